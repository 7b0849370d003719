"""The rooms of runtime/hopform: what rests on what, what is public, and what is loaded and entered when."""

import ast
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from unittest.mock import patch

import pytest

import hopform
import hopform_solver
from hopform._show import drawing

ROOT = Path(__file__).resolve().parents[2]
RUNTIME = ROOT / "runtime" / "hopform"

# Each module may import those of the lines above it, inside of functions too. A folder's own name is its __init__.
LAYERS = (
    ("hopform", "_errors", "_progress", "_warnings"),
    ("_solver", "_solver.build"), ("_solver.library", "_solver.package"), ("_solver.folder",),
    ("_checks",), ("_files",),
    ("_solver.c",), ("_solver.choice",), ("_solver.loading",),
    ("_show",), ("_robots", "_sensitivities", "model", "terrain"),
    ("_motion",), ("_stance",), ("_flight", "_batch"),
    ("_control",), ("controllers",),
    ("_hopping", "_hopping.run", "_hopping.touchdown"),
    ("_identify.motion",), ("_identify.recordings",), ("_identify.segments",),
    ("_identify.rigs",), ("_identify.estimation",), ("_identify.search",), ("_identify.alternatives", "_identify.nuisances", "_identify.kinds", "_identify.repeats"), ("_identify.causes",),
    ("_identify.fits",), ("_identify.drop", "_identify.step", "_identify.synthetic"),
    ("_identify.joint", "_identify.models"), ("_identify.simulators",), ("_identify",),
    ("_studies",), ("_solvers",), ("_all",),
    ("_export",),
    ("_words",), ("_explain",), ("_cli.use",), ("_cli.options", "_cli.output"),
    ("_figures",), ("_figures.plots",), ("_figures.animation", "_figures.results"),
    ("_cli.bands",), ("_cli.tables", "_cli.report"),
    ("_cli.model",), ("_cli.solve", "_cli.identify", "_cli.folders"), ("_cli.fit",), ("_cli",), ("__main__",),
)  # fmt: skip
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}

PUBLIC = {"controllers", "model", "terrain"}
EXTRAS = {"scipy", "matplotlib", "xarray"}

# What is handed on is no import of one's own: it waits until it is asked.
HANDS_ON = {("hopform", "_all"), ("_stance", "_flight"), ("_motion", "_explain")}


def name_of(path: Path) -> str:
    """The module of a file, without `hopform.`; that of the package itself is `hopform`."""
    parts = path.relative_to(RUNTIME).with_suffix("").parts
    return ".".join(parts if parts[-1] != "__init__" else parts[:-1]) or "hopform"


MODULES = {name_of(path): path for path in sorted(RUNTIME.rglob("*.py"))}
each = pytest.mark.parametrize("name", MODULES)


def imported(node: ast.AST) -> Iterator[str]:
    """What some code imports, in functions and for type checkers too; a name taken from a package may be its module."""
    for inner in ast.walk(node):
        if isinstance(inner, ast.Import):
            yield from (alias.name for alias in inner.names)
        elif isinstance(inner, ast.ImportFrom):
            assert inner.level == 0, f"line {inner.lineno}: a relative import"
            for alias in inner.names:
                module = f"{inner.module}.{alias.name}"
                yield module if module.removeprefix("hopform.") in MODULES else str(inner.module)
        elif isinstance(inner, ast.Call) and ast.unparse(inner.func).endswith("import_module"):
            yield from (arg.value for arg in inner.args[:1] if isinstance(arg, ast.Constant))


def tree(name: str) -> ast.Module:
    return ast.parse(MODULES[name].read_text("utf-8"))


def of_hopform(names: Iterator[str]) -> set[str]:
    """Those of this room; the derivation, which a wheel has inside, is a room of its own apart."""
    ours = {name.removeprefix("hopform.") for name in names if name.split(".")[0] == "hopform"}
    return {name for name in ours if not name.startswith("_derive")}


def test_every_module_has_its_place():
    assert set(MODULES) == LEVEL.keys()


@each
def test_a_module_imports_only_what_lies_below(name):
    above = [
        other
        for other in of_hopform(imported(tree(name))) - {name}
        if LEVEL[other] >= LEVEL[name] and (name, other) not in HANDS_ON
    ]
    assert not above, f"{name} is not above {above}"


def test_no_module_is_public_that_nobody_promised():
    top = {name.split(".")[0] for name in MODULES} - {"hopform", "__main__"}
    assert {name for name in top if not name.startswith("_")} == PUBLIC
    folders = {path.name for path in RUNTIME.iterdir() if path.is_dir()}
    assert all(name.startswith("_") for name in folders), folders


@each
def test_only_the_solvers_room_knows_the_generated_package(name):
    known = {module for module in imported(tree(name)) if module.split(".")[0] == "hopform_solver"}
    assert not known or name == "_solver.package", known


@each
def test_hopform_takes_no_answer_of_the_readable_solver(name):
    """It is a second opinion, and no back end: `solve` and its module are asked by nobody, by whatever name."""
    module = tree(name)
    assert not {"hopform_solver.solve", "hopform_solver.solver"} & set(imported(module))
    package = {"package", "OURS", "hopform_solver"}
    for node in ast.walk(module):
        if isinstance(node, ast.Attribute) and node.attr in {"solve", "solver"}:
            of = node.value
            assert (of.attr if isinstance(of, ast.Attribute) else getattr(of, "id", "")) not in package, ast.unparse(
                node
            )


def test_what_is_solved_loads_no_readable_solver():
    loaded = loaded_by(
        "import hopform\n"
        "robot = hopform.load_robot('hopper_c')\n"
        "hopform.solve_stance(robot, v2=-1.93, u=2.0).ledger(0.05)\n"
        "hopform.choose_current(robot, v2=-1.93, h_des=0.1)\n"
        "hopform.solve_flight(robot, v2=1.9)"
    )
    assert "hopform_solver.formulas" in loaded and "hopform_solver.solver" not in loaded


def at_import(name: str) -> set[str]:
    """What a module imports when it is imported: all but the bodies of functions and what only type checkers read."""
    module = tree(name)
    for_types = [node for node in module.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    module.body = [node for node in module.body if node not in for_types and not isinstance(node, ast.FunctionDef)]
    return set(imported(module))


def test_what_needs_an_extra_is_imported_within_functions():
    """Pictures import matplotlib, by a door that raises MissingExtra; nothing else imports them before that."""
    needs = {name for name in MODULES if {module.split(".")[0] for module in at_import(name)} & EXTRAS}
    assert needs and all(name.startswith("_figures.") for name in needs)
    refused = pytest.raises(hopform.MissingExtra, match="needs the extra `plot`")
    with refused, patch.dict(sys.modules, {"matplotlib": None}):
        drawing("plots")
    for name in MODULES:
        if not name.startswith("_figures."):
            assert not of_hopform(iter(at_import(name))) & needs, name


def own() -> dict[str, str]:
    """The environment of a process of its own: this hopform and its solver."""
    roots = [str(Path(package.__file__ or "").parent.parent) for package in (hopform, hopform_solver)]
    return os.environ | {"PYTHONPATH": os.pathsep.join(roots)}


def loaded_by(code: str) -> set[str]:
    """The modules that some code loads in a process of its own, with what it prints left out."""
    program = f"import sys\nbefore = set(sys.modules)\n{code}\nprint('', *set(sys.modules) - before, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", program], env=own(), capture_output=True, text=True, check=True, encoding="utf-8"
    )
    return set(done.stderr.split())


FORKED = """
import importlib, os, sys
loaded, *names = sys.argv[1:]
for name in loaded.split():
    importlib.import_module(name)
for name in names:
    sys.stdout.flush()
    if not (child := os.fork()):
        __import__(name)
        os._exit(0)
    if os.waitpid(child, 0)[1]:
        print(name)
"""
"""Import each module in a process in which nothing of hopform is loaded; print those that raise. What they need of
others is loaded once."""


def alone(names: Iterable[str], loaded: str = "numpy") -> tuple[list[str], str]:
    """The modules of hopform that cannot be the first to be imported, and what they raise."""
    done = subprocess.run(
        [sys.executable, "-c", FORKED, loaded, *names],
        env=own(),
        capture_output=True,
        text=True,
        check=True,
        encoding="utf-8",
    )
    return done.stdout.split(), done.stderr


def test_each_public_module_may_be_the_first_that_a_program_imports():
    assert alone(["hopform", *(f"hopform.{name}" for name in sorted(PUBLIC))]) == ([], "")


@pytest.mark.sliced
def test_each_module_may_be_the_first_that_a_program_imports():
    names = ["hopform" if name == "hopform" else f"hopform.{name}" for name in MODULES]
    assert alone(names, "numpy scipy.optimize matplotlib.figure rich.console sympy") == ([], "")


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], []])
def test_the_front_of_the_command_line_loads_no_command(arguments):
    loaded = loaded_by(f"from hopform._cli import main\nassert main({arguments!r}) == 0")
    ours = {name for name in loaded if name.split(".")[0] == "hopform"}
    solver = {
        "hopform._solver",
        "hopform._solver.library",
        "hopform._solver.build",
    }  # the last where no library is there
    assert ours <= {"hopform", "hopform._cli", "hopform._errors"} | solver
    assert not {name.split(".")[0] for name in loaded} & {"numpy", "hopform_solver", *EXTRAS}


def test_importing_hopform_loads_nothing_else_and_its_names_load_numpy():
    for code, packages in (
        ("import hopform", {"hopform"}),
        ("import hopform\nhopform.solve_stance", {"hopform", "hopform_solver", "numpy"}),
    ):
        assert {name.split(".")[0] for name in loaded_by(code)} - sys.stdlib_module_names == packages


def test_every_name_of_hopform_is_there_and_no_other():
    assert set(hopform.__all__) <= set(dir(hopform))
    assert all(getattr(hopform, name) is not None for name in hopform.__all__)
    with pytest.raises(AttributeError, match="module 'hopform' has no attribute 'solve_stanze'"):
        _ = hopform.solve_stanze


def test_a_warm_stance_enters_at_most_four_modules(hopper_c):
    """What a call costs beside the library's work is mostly frames."""
    hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)
    entered: list[str] = []

    def seen(frame, event, _):
        if event == "call" and Path(frame.f_code.co_filename).is_relative_to(RUNTIME):
            entered.append(frame.f_code.co_filename)

    sys.setprofile(seen)
    try:
        hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)
    finally:
        sys.setprofile(None)
    assert 0 < len(set(entered)) <= 4, set(entered)
