"""The rooms of the derivation: a walk from the model to a rendered line never climbs back."""

import ast
import sys
from collections.abc import Iterator
from importlib.util import resolve_name
from pathlib import Path

import pytest

from derive.emit.program import MODULES, program
from derive.ir import Definition, Step, function, scalar

DERIVE = Path(__file__).resolve().parents[2] / "derive"

# Each module may import those of the lines above it.
LAYERS = (
    ("ir",),
    ("model.quantities", "model.precisions", "model.kinds", "model.units", "model.names"),
    ("model.equations", "model.structs", "model.selftest", "model.answers"),
    ("model.declare",),
    ("model.mechanism",),
    ("model",),
    ("model_file",),
    ("shipped",),
    ("maths.laplace", "maths.kernels"),
    ("maths.partial_fractions", "maths.stability", "maths.modes", "maths.elements"),
    ("maths.time_domain",),
    ("maths.energy", "maths.flight", "maths.law"),
    ("maths.control",),
    ("maths.sensitivity",),
    ("maths.contact",),
    ("maths.linear", "maths.formulas"),
    ("paper.register",),
    ("emit.program", "emit.expressions", "emit.instantiate", "emit.facts", "emit.toml", "emit.markdown"),
    ("emit.numpy", "emit.c", "emit.forms"),
    ("emit.render",),
    ("emit.folder",),
    ("derivation",),
    ("page",),
    ("solver",),
    ("__main__",),
)
LEVEL = {f"derive.{name}": level for level, names in enumerate(LAYERS) for name in names}
ROOMS = {"derive", *(f"derive.{name}" for name in ("maths", "paper", "emit"))}
"""Packages that import nothing themselves."""


def name_of(path: Path) -> str:
    parts = path.relative_to(DERIVE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {name_of(path): path for path in sorted(DERIVE.rglob("*.py")) if path.parent.name != "models"}
"""Model files are run, not imported: they take their elements as everybody's do."""


def imported(name: str) -> Iterator[tuple[str, bool]]:
    """What a module imports, with whether it is named from where the module stands; of a package, the module meant."""
    path = SOURCES[name]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, False) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = resolve_name("." * node.level + (node.module or ""), package) if node.level else str(node.module)
            for alias in node.names:
                inner = f"{source}.{alias.name}"
                yield (inner if inner in SOURCES else source), node.level > 0


EACH = pytest.mark.parametrize("name", SOURCES)


def test_every_module_has_its_place_in_the_order():
    assert SOURCES.keys() == LEVEL.keys() | ROOMS


@EACH
def test_a_module_imports_only_what_comes_before(name):
    above = [other for other, near in imported(name) if near and LEVEL.get(other, -1) >= LEVEL.get(name, -1)]
    assert not above, f"{name} does not stand above {above}"


@EACH
def test_the_derivation_names_itself_relatively_so_that_it_may_be_installed_under_another_name(name):
    far = {other.split(".")[0] for other, near in imported(name) if not near} - sys.stdlib_module_names
    assert far <= {"sympy", "jinja2"}


def test_every_function_of_the_program_is_defined_in_the_module_of_its_steps():
    defined = {
        value.name: module for module in MODULES for value in vars(module).values() if isinstance(value, Definition)
    }
    assert [each.name for each in program().functions] == list(defined)
    for name, module in defined.items():
        assert getattr(module, name).make.__module__ == module.__name__, (
            f"{name} stands in another module than its steps"
        )


def test_a_function_without_a_meaning_is_refused():
    with pytest.raises(ValueError, match="no docstring"):

        @function(takes=(), returns=scalar("one", "1", "one"))
        def one() -> tuple[Step, ...]:
            return ()
