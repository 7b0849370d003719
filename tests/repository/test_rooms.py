"""The rooms of hopform and derive: what import-linter cannot say of imports, what is public, what is loaded when.

Which module may import which stands in pyproject.toml, [tool.importlinter].
"""

import ast
import importlib
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from unittest.mock import patch

import grimp
import pytest

import hopform
import hopform_solver
from hopform import _front, extend, hopping

ROOT = Path(__file__).resolve().parents[2]
RUNTIME = ROOT / "runtime" / "hopform"

PUBLIC = {"extend", "hopping", "identify", "jax", "model", "reference"}
APPLICATIONS = {"hopping", "identify"}
EXTRAS = {"scipy", "matplotlib", "xarray", "jax"}

WALL = {
    "_checks": {
        "MEMORY",
        "Role",
        "flag",
        "function",
        "instance",
        "mapping",
        "nonnegative",
        "number_of",
        "real",
        "word",
    },
    "_cli.output": {"deliver", "ends", "number", "picture", "record", "show", "to_json"},
    "_cli.use": {"core", "robot_in_use", "start_in_use"},
    "_errors": {"printable"},
    "_figures": {"figure_of", "plots"},
    "_figures.plots": {"render"},
    "_files": {"Named", "name_of", "path_of", "read_text", "rows_of"},
    "_motion": {"DOUBLE", "Start"},
    "_robots": {"Provenance", "attribute_of", "checked_robot", "checked_value", "robot_class"},
    "_sensitivities": {"COLUMNS", "STARTS", "columns_beneath", "in_coordinates", "in_height"},
    "_show": {"Array", "Arrays", "Curve", "Picture", "Shown", "span"},
    "_solver.c": {"Solved"},
    "_solver.choice": {"DEFAULT", "Solver"},
    "_solver.package": {"ENDINGS", "LegState", "ROWS", "Steps", "records"},
    "_stance": {"Current"},
    "_texts": {"comment_of_xml", "in_html", "line", "markdown"},
}
"""What hopform.identify still takes of the core beside its public names. Those of `_solver`, `_sensitivities` and
`_motion` are a motion's states and derivatives at all samples of a fit, without the objects of a `Motion`; hopping takes
none.
"""

OF_A_TUPLE = {"_asdict", "_fields", "_make", "_replace"}
"""What every NamedTuple offers."""


def name_of(path: Path, root: Path) -> str:
    """The module of a file."""
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts if parts[-1] != "__init__" else parts[:-1])


MODULES = {
    name_of(path, root): path
    for root, package in ((ROOT / "runtime", "hopform"), (ROOT, "derive"))
    for path in sorted((root / package).rglob("*.py"))
    if path.parent.name != "models"  # files that are run
}
OF_HOPFORM = [name for name in MODULES if name.split(".")[0] == "hopform"]


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(MODULES[name].read_text("utf-8"))


def room_of(name: str) -> str:
    """The folder or the module right below the package; the package's own file is a room of its own."""
    return ".".join([*name.split("."), "__init__"][:2])


@cache
def defined_in(room: str) -> set[str]:
    """The functions, classes and variables of a room, and the attributes that it sets."""
    found = set[str]()
    for node in (node for name in MODULES if room_of(name) == room for node in ast.walk(tree(name))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            found.add(node.id if isinstance(node, ast.Name) else node.attr)
    return found


def test_a_room_uses_no_underscore_of_another():
    """What `self` has may be of a base class. A name that is imported is a module, or has no underscore."""
    for name in MODULES:
        taken = set[str]()
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.Attribute) and getattr(node.value, "id", "") != "self":
                taken.add(node.attr)
            elif isinstance(node, ast.ImportFrom) and room_of(str(node.module)) != room_of(name):
                taken |= {alias.name for alias in node.names if f"{node.module}.{alias.name}" not in MODULES}
        private = {each for each in taken if each.startswith("_") and not each.endswith("_")}
        assert not private - defined_in(room_of(name)) - OF_A_TUPLE, name


def layers() -> list[set[str]]:
    """The rooms of hopform from the highest to the lowest, as import-linter has them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    of = next(each for each in contracts if each["name"] == "The rooms of hopform")
    assert "ignore_imports" not in of
    return [set(layer.split(" | ")) for layer in of["layers"]]


def height_of(name: str) -> int:
    """How far below the highest a module's room stands."""
    own = name.removeprefix("hopform.")
    found = [n for n, rooms in enumerate(layers()) if any(own == room or own.startswith(f"{room}.") for room in rooms)]
    assert len(found) == 1, name
    return found[0]


def test_a_string_imports_from_a_room_below():
    """What begins with a variable names a package: a generated one, or one of an extra. The package's own file offers
    what `_all` has; the front and the door for extensions name whole rooms, all of which stand below them.
    """
    for name in MODULES:
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in ("import_module", "__import__"):
                text = node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
                if isinstance(text, ast.Constant) and text.value.split(".")[0] in ("hopform", "derive"):
                    if text.value == "hopform.":
                        assert name in ("hopform._front", "hopform.extend"), name
                    elif name != "hopform":
                        assert text.value.startswith(f"{room_of(name)}.") or height_of(text.value) > height_of(name)
    assert all(height_of(f"hopform.{module}") > height_of("hopform._front") for module in _front.COMMANDS.values())
    assert all(height_of(f"hopform.{room}") > height_of("hopform.extend") for room in extend.ROOMS)


def test_applications_stand_on_public_names():
    """Of the core they import `hopform`, `hopform.extend` and nothing else; what identification still takes beside that
    is named above.
    """
    taken = {room: dict[str, set[str]]() for room in APPLICATIONS}
    for name in OF_HOPFORM:
        room = name.split(".")[1] if "." in name else ""
        for node in ast.walk(tree(name)) if room in APPLICATIONS else ():
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("hopform"):
                module = str(node.module).removeprefix("hopform").removeprefix(".")
                if module.startswith("_"):
                    taken[room].setdefault(module, set()).update(alias.name for alias in node.names)
                elif not module:
                    assert all(not alias.name.startswith("_") for alias in node.names if alias.name != "__version__"), (
                        name
                    )
                else:
                    assert module.split(".")[0] in (room, "extend"), (name, module)
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("hopform.") for alias in node.names), name
    assert taken == {"hopping": {}, "identify": WALL}


def test_what_is_there_for_extensions_is_small_said_and_used():
    assert len(extend.__all__) <= 25 and {*extend.__all__} == {
        name for names in extend.ROOMS.values() for name in names
    }
    users = {name: set[str]() for name in extend.__all__}
    for name in OF_HOPFORM:
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.ImportFrom) and node.module == "hopform.extend":
                for alias in node.names:
                    users[alias.name].add(name.split(".")[1])
    assert all(rooms & APPLICATIONS for rooms in users.values()), users
    assert all(getattr(extend, name).__doc__ for name in extend.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'plenty'"):
        _ = extend.plenty


def test_a_name_that_moved_says_where_it_is():
    for room, names in hopform.MOVED.items():
        for name in names:
            assert hasattr(importlib.import_module(f"hopform.{room}"), name), name
            with pytest.raises(AttributeError, match=f"from hopform.{room} import {name}"):
                getattr(hopform, name)


def test_no_module_imports_the_room_that_it_stands_in():
    graph = grimp.build_graph("hopform", "derive", cache_dir=None)
    pairs = [(name, other) for name in graph.modules for other in graph.find_modules_directly_imported_by(name)]
    assert len(pairs) > len(MODULES)
    assert not [pair for pair in pairs if "." in pair[1] and pair[0].startswith(f"{pair[1]}.")]


def test_no_module_is_public_that_nobody_promised():
    top = {name.split(".")[1] for name in OF_HOPFORM if "." in name} - {"__main__"}
    assert {name for name in top if not name.startswith("_")} == PUBLIC
    folders = {path.name for path in RUNTIME.iterdir() if path.is_dir()}
    assert {name for name in folders if not name.startswith("_")} == APPLICATIONS, folders


def test_hopform_takes_no_answer_of_the_readable_solver():
    """It is a second opinion, and no back end: `solve` and its module are asked by nobody, by whatever name."""
    for name in OF_HOPFORM:
        for node in ast.walk(tree(name)):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("hopform_solver"):
                assert not {"solve", "solver"} & {*str(node.module).split("."), *(each.name for each in node.names)}, (
                    name
                )
            if isinstance(node, ast.Attribute) and node.attr in {"solve", "solver"}:
                of = node.value
                package = of.attr if isinstance(of, ast.Attribute) else getattr(of, "id", "")
                assert package not in {"package", "OURS", "hopform_solver"}, (name, ast.unparse(node))


def outside_functions(node: ast.AST) -> Iterator[ast.AST]:
    """What runs when a module is imported: all but the bodies of functions and what only type checkers read."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef) and not (
            isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"
        ):
            yield child
            yield from outside_functions(child)


def at_import(name: str) -> Iterator[str]:
    """What a module imports when it is imported."""
    for node in outside_functions(tree(name)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_what_needs_an_extra_is_imported_within_functions():
    """Pictures import matplotlib, by a door that raises MissingExtra; nothing else imports them before that."""
    needs = {name for name in OF_HOPFORM if {module.split(".")[0] for module in at_import(name)} & EXTRAS}
    assert needs == {
        "hopform._figures.plots", "hopform.hopping._pictures", "hopform.hopping._scene", "hopform.identify._pictures",
    }  # fmt: skip
    for name in set(OF_HOPFORM) - needs:
        assert not {*at_import(name)} & needs, name


def test_pictures_say_which_extra_they_need(hopper_c):
    run = hopping.simulate(hopper_c, [0.0], 3.0, height=0.2)
    for draw in (run.plot, run.hops[0].stance.plot, lambda: hopping.animate(run)):
        refused = pytest.raises(hopform.MissingExtra, match="needs the extra `plot`")
        with refused, patch.dict(sys.modules, {"matplotlib": None}):
            draw()


def own() -> dict[str, str]:
    """The environment of a process of its own: this hopform and its solver."""
    roots = [str(Path(package.__file__ or "").parent.parent) for package in (hopform, hopform_solver)]
    return os.environ | {"PYTHONPATH": os.pathsep.join(roots)}


TABLE = """
import json, os, sys
for name, program in json.loads(sys.argv[1]).items():
    sys.stdout.flush()
    if not (child := os.fork()):
        before = set(sys.modules)
        exec(program, {})
        print(json.dumps([name, sorted(set(sys.modules) - before)]), file=sys.stderr, flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""
"""Run each program in a process of its own; print the modules that it loads."""

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
    assert alone(OF_HOPFORM, "numpy scipy.optimize matplotlib.figure rich.console sympy") == ([], "")


FRONT = "from hopform._front import main\nassert main({!r}) == 0"
PROGRAMS = {
    "hopform --version": FRONT.format(["--version"]),
    "hopform --help": FRONT.format(["--help"]),
    "hopform": FRONT.format([]),
    "hopform reference --help": FRONT.format(["reference", "--help"]),
    "the package": "import hopform",
    "a function": "import hopform; hopform.solve_stance",
    "a command": "import hopform._cli.solve, hopform._cli.use",
    "what is solved": (
        "import hopform\n"
        "robot = hopform.load_robot('hopper_c')\n"
        "hopform.solve_stance(robot, v2=-1.93, u=2.0).ledger(0.05)\n"
        "hopform.choose_current(robot, v2=-1.93, h_des=0.1)\n"
        "hopform.solve_flight(robot, v2=1.9)"
    ),
}


@pytest.fixture(scope="module")
def loaded() -> dict[str, set[str]]:
    """The modules that each program loads, in a child of a process in which nothing of hopform is."""
    done = subprocess.run(
        [sys.executable, "-c", TABLE, json.dumps(PROGRAMS)], env=own(), capture_output=True, text=True, check=True
    )
    return {program: set(names) for program, names in map(json.loads, done.stderr.splitlines())}


def packages(names: Iterable[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


@pytest.mark.parametrize("program", ["hopform --version", "hopform --help", "hopform", "hopform reference --help"])
def test_the_front_of_the_command_line_loads_no_command(loaded, program):
    ours = {name for name in loaded[program] if name.split(".")[0] == "hopform"}
    library = {"hopform._solver", "hopform._solver.library", "hopform._solver.build"}  # where no library is there
    assert ours <= {"hopform", "hopform._front", "hopform._errors"} | library
    assert not packages(loaded[program]) & {"numpy", "hopform_solver", *EXTRAS}


def test_importing_hopform_loads_nothing_else_and_its_names_load_numpy(loaded):
    assert packages(loaded["the package"]) - sys.stdlib_module_names == {"hopform"}
    assert packages(loaded["a function"]) - sys.stdlib_module_names == {"hopform", "hopform_solver", "numpy"}
    assert not any(name.startswith(("hopform.reference", "hopform._reference")) for name in loaded["what is solved"])


def test_a_command_loads_no_extra_before_it_needs_it(loaded):
    assert "numpy" in packages(loaded["a command"])
    assert not packages(loaded["a command"]) & {*EXTRAS, "sympy"}


def test_what_is_solved_loads_no_readable_solver(loaded):
    assert "hopform_solver.formulas" in loaded["what is solved"]
    assert "hopform_solver.solver" not in loaded["what is solved"]


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
