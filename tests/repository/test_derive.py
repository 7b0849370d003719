"""The derivation: it does not know its name, and each function stands with its steps."""

import ast
import sys
from pathlib import Path

import pytest

from derive.emit.program import MODULES, program
from derive.ir import Definition, Step, function, scalar

DERIVE = Path(__file__).resolve().parents[2] / "derive"


def test_the_derivation_names_itself_relatively_so_that_it_may_be_installed_under_another_name():
    """Model files are run, not imported: they take their elements as everybody's do; what is pasted is printed."""
    sources = [path for path in DERIVE.rglob("*.py") if path.parent.name != "models" and path.name != "pasted.py"]
    assert sources
    for path in sources:
        nodes = [*ast.walk(ast.parse(path.read_text("utf-8")))]
        far = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        far |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
        assert {name.split(".")[0] for name in far} - sys.stdlib_module_names <= {"sympy", "jinja2", "mpmath"}, path


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
