"""The rules of the house: what is generated is fresh, imports point one way, templates only loop, the C is C.

They hold for files that nobody has written yet: each test walks the folder that it is about.
"""

import ast
import dataclasses
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import jinja2
import pytest
from jinja2 import meta, nodes

import hopform
import hopform_solver
from derive.emit.folder import GENERATED, check
from derive.emit.library import NO_LAYOUT
from derive.emit.program import program
from derive.emit.programs import OF_SOME, program_of
from derive.emit.render import PARTS, render
from derive.emit.sources import Solver, instance, templates
from derive.emit.texts import PLACES
from derive.ir import Function
from derive.model import quantities
from derive.model.precisions import PRECISIONS
from derive.shipped import HOPPER, shipped
from hopform_solver import records
from tests.derived import model_of
from tests.needs import the_first
from tests.objects import compiled, run_compiler

ROOT = Path(__file__).resolve().parents[2]
DERIVE, TEMPLATES, RUNTIME = ROOT / "derive", ROOT / "templates", ROOT / "runtime" / "hopform"
ENGINE = ROOT / "runtime" / "engine"
SOLVER, C = GENERATED / "python" / "hopform_solver", GENERATED / "c"
PROGRAM = program()


def modules(folder: Path) -> list[Path]:
    found = sorted(folder.glob("*.py"))
    assert found, folder
    return found


def each(paths: list[Path]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("path", paths, ids=lambda path: path.name)


@pytest.fixture(scope="module")
def rendered() -> dict[Path, str]:
    return render()


# ---- what is generated is fresh ----


def test_what_is_generated_is_what_the_derivation_and_the_templates_say(rendered, capsys):
    stale = check(rendered, GENERATED)
    assert stale == 0, capsys.readouterr().err


# ---- imports point one way ----


def imported(tree: ast.AST) -> Iterator[str]:
    """The modules that some code imports from elsewhere, a name taken from a package counted as a module of it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def packages(path: Path) -> set[str]:
    """The packages that a file imports anywhere, other than the standard library's."""
    return {name.split(".")[0] for name in imported(ast.parse(path.read_text("utf-8")))} - sys.stdlib_module_names


@each(modules(SOLVER))
def test_the_generated_package_needs_numpy_alone_and_does_not_know_its_name(path):
    """Two of them stand side by side under any names. What type checkers alone read is no need of theirs."""
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = [ast.Pass()]
    assert {name.split(".")[0] for name in imported(tree)} - sys.stdlib_module_names <= {"numpy"}


def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


def declared(*extras: str) -> set[str]:
    """The packages that the project needs, or those that its extras add."""
    own = project()["project"]
    lists = [own["optional-dependencies"][extra] for extra in extras] or [own["dependencies"]]
    return set(map(package_of, chain.from_iterable(lists)))


def package_of(requirement: str) -> str:
    return re.split(r"[^\w-]", requirement)[0]


def of_a_checkout() -> set[str]:
    """The packages of all extras and dependency groups."""
    of = project()
    lists = [*of["project"]["optional-dependencies"].values(), *of["dependency-groups"].values()]
    return {package_of(each) for each in chain.from_iterable(lists) if isinstance(each, str)} - {"hopform"}


def installed_by_make_run() -> set[str]:
    """The packages of the extras that `make run` installs, and what the project needs anyway."""
    makefile, script = ((ROOT / name).read_text("utf-8") for name in ("Makefile", "tools/venv.sh"))
    assert re.search(r"^run: .*\bvenv\b", makefile, re.MULTILINE)
    assert re.search(r"^venv:\n\t@sh tools/venv.sh run$", makefile, re.MULTILINE)
    extras = re.search(r"^extras=([\w,]+)$", script, re.MULTILINE)
    assert extras
    return declared() | declared(*extras[1].split(","))


def test_extras_are_for_users_and_groups_for_a_checkout():
    """What a user installs names no tool of tests or pages; each group that is named is there."""
    of = project()
    assert set(of["project"]["optional-dependencies"]) == {
        "identify", "plot", "xarray", "jax", "all", "derive", "compiler",
    }  # fmt: skip
    groups = of["dependency-groups"]
    included = {each["include-group"] for group in groups.values() for each in group if isinstance(each, dict)}
    makefile = (ROOT / "Makefile").read_text("utf-8")
    asked = set(re.findall(r"tools/venv.sh (\w+)$", makefile, re.MULTILINE)) - {"run"}
    assert asked | included == set(groups)
    assert [each for each in groups["docs"] if isinstance(each, dict)] == [
        {"include-group": "pages"},
        {"include-group": "zig"},
    ]


@pytest.mark.sliced
def test_what_make_run_installs_is_enough_for_the_page_on_commands(tmp_path):
    """They run where no other package of any extra can be imported."""
    present = installed_by_make_run()
    absent = of_a_checkout() - present - {"mpmath"}  # sympy brings it
    page = (ROOT / "docs" / "reference" / "commands.md").read_text("utf-8").splitlines()
    commands = [line.split("#")[0].split()[1:] for line in page if line.startswith("hopform ")]
    assert len(commands) >= 8
    assert {"sympy", "jinja2"} <= present  # python -m derive, which takes too long to be run here
    program = f"""
import importlib.abc, sys

class Absent(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in {absent!r}:
            raise ModuleNotFoundError(name=name)

sys.meta_path.insert(0, Absent())
from hopform._front import main
sys.exit([command for command in {commands!r} if main(command) != 0] or 0)
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@each(sorted(RUNTIME.rglob("*.py")))
def test_the_runtime_imports_what_the_project_declares(path):
    extras = declared("identify", "plot", "xarray")
    assert not (declared() | extras) & {"sympy", "jinja2"}
    types = {"typing_extensions"}  # for type checkers, which bring it
    assert packages(path) <= {"hopform", "hopform_solver"} | declared() | extras | types


# ---- templates have shape, not thoughts ----

SHAPE = {"Template", "Output", "TemplateData", "For", "Name", "Getattr", "Call", "Const"}
FILTERS = {"int", "join", "length", "upper", *PLACES}


def inside(node: nodes.Node) -> Iterator[nodes.Node]:
    yield node
    for child in node.iter_child_nodes():
        yield from inside(child)


@pytest.mark.parametrize("path", sorted(TEMPLATES.rglob("*.j2")), ids=lambda path: path.name)
def test_a_template_substitutes_and_loops_and_nothing_else(path):
    for node in inside(jinja2.Environment().parse(path.read_text("utf-8"))):
        where = f"{path.name}, line {node.lineno}"
        if isinstance(node, nodes.For):
            assert not node.test and not node.else_ and not node.recursive, where
        elif isinstance(node, nodes.Filter):
            assert node.name in FILTERS, where
        elif isinstance(node, nodes.Tuple):  # the names of a loop over rows
            assert node.ctx == "store", where
        else:
            assert type(node).__name__ in SHAPE, where


def test_every_source_makes_its_files_and_every_file_has_a_source(rendered):
    sources = {path: path.relative_to(TEMPLATES).as_posix().removesuffix(".j2") for path in files(TEMPLATES)}
    sources |= {path: instance(path.relative_to(ENGINE).as_posix()) for path in files(ENGINE)}
    expected = set()
    for target in filter(of_the_hopper().has, sources.values()):
        precisions = ("_f32", "_f64") if target.startswith("c/") and "_real" in target else ("_real",)
        expected |= {Path(target.replace("_real", precision)) for precision in precisions}
    assert rendered.keys() == expected


def test_every_program_for_a_board_is_of_some_model():
    free = model_of(
        "m = parameter('m', 'kg', 'mass', 'positive', 1)\nx = coordinate('x', 'm', m, 'slider')\nviscous(x, 1)"
    )
    models = [shipped(name) for name in ("hopper", "joint", "servo")]
    assert {folder for model in (*models, free) for folder in program_of(model).folders} == {*OF_SOME}
    there = {path.relative_to(root / "packages" / "program").parts[0] for root in (TEMPLATES, ENGINE)
             for path in files(root / "packages" / "program")}  # fmt: skip
    assert {*OF_SOME} <= there


def of_the_hopper() -> Solver:
    return Solver(HOPPER, PRECISIONS, PROGRAM, NO_LAYOUT)


def files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("[!.]*")) if path.is_file() and "__pycache__" not in path.parts]


def test_an_instance_of_the_engine_has_the_lines_of_its_source(rendered):
    """So that a message of a compiler or a debugger about generated code names the line to change."""
    hopper = of_the_hopper()
    for source in files(ENGINE):
        lines = source.read_text("utf-8").count("\n")
        target = instance(source.relative_to(ENGINE).as_posix())
        if not hopper.has(target):
            continue
        for precision in ("_f32", "_f64") if "_real" in target else ("",):
            assert rendered[Path(target.replace("_real", precision))].count("\n") == lines, source.name


def test_each_template_is_of_one_part_which_gives_it_the_names_that_it_asks_for_and_no_others():
    """And one that asks for nothing but a header or a version is source, and stands in the engine."""
    solver = of_the_hopper()
    given = [(name, set(values(solver))) for part in PARTS for name, values in part.items()]
    environment = jinja2.Environment()
    environment.filters |= PLACES
    asked = [
        (name, meta.find_undeclared_variables(environment.parse((TEMPLATES / f"{name}.j2").read_text("utf-8"))))
        for name in templates()
    ]
    assert sorted(given) == [(name, names - {"header", "precision"}) for name, names in asked]
    assert all(names - {"header", "version"} for _, names in asked)


# ---- one name per thing ----


def test_every_word_for_a_parameter_is_the_one_of_the_model():
    names = [quantity.name for quantity in HOPPER.parameters]
    assert [field.name for field in dataclasses.fields(hopform.Robot)] == [
        *names,
        "travel",
        "name",
        "description",
        "fit",
    ]
    assert list(records.Robot._fields) == [field.name for field in records.ROBOT_FIELDS] == names
    for precision in ("f32", "f64"):
        assert members(f"hopform_robot_{precision}") == names
    shipped = sorted((RUNTIME / "_robots").glob("*.toml"))
    assert shipped
    for path in shipped:
        assert tomllib.loads(path.read_text("utf-8")).keys() <= {*names, "travel", "name", "description"}, path.name


def test_every_parameter_is_what_the_model_declares():
    for field, quantity in zip(records.ROBOT_FIELDS, HOPPER.parameters, strict=True):
        assert field._asdict() | {"shipped_with": "hopper"} == dataclasses.asdict(quantity)
    assert records.TRAVEL._asdict() == dataclasses.asdict(quantities.TRAVEL)


def header(name: str) -> str:
    return (C / "include" / "hopform" / name).read_text("utf-8")


def members(struct: str) -> list[str]:
    """The names of the members of a struct of the public headers."""
    text = re.sub(r"/\*.*?\*/", "", header(f"hopform_{struct[-3:]}.h"), flags=re.DOTALL)
    (body,) = re.findall(rf"typedef struct {{([^}}]*)}} {struct};", text)
    return re.findall(r"(\w+);", body)


@pytest.mark.parametrize("record", PROGRAM.records, ids=lambda record: record.name)
def test_a_record_has_its_fields_in_the_same_order_in_python_and_c(record):
    names = [quantity.name for quantity in record.quantities]
    assert list(getattr(records, record.in_python)._fields) == names
    struct = re.sub(r"(?<!^)(?=[A-Z])", "_", record.name).lower()
    sources = header("hopform_f64.h") + (C / "src" / "formulas_f64.h").read_text("utf-8")
    if not re.search(rf"\b{struct}_f64\b", sources):
        return  # C has those of the formulas that the engine calls
    (body,) = re.findall(rf"typedef struct {{([^}}]*)}} (?:hopform_)?{struct}_f64;", sources)
    assert re.findall(r"double (\w+);", body) == names


def test_a_class_that_hopform_and_its_solver_both_have_is_one():
    """But for the robot: the solver's is the numbers alone, that of hopform checks them and has a name; and for the
    motion: the solver's has the numerators of a phase, and is none of its public names.
    """
    assert not hasattr(hopform_solver, "Motion")
    own = {"Robot", "Motion"}
    both = {name for name in hopform.__all__ if isinstance(getattr(records, name, None), type)} - own
    assert both == {"Energy", "FlightLedger", "Gains", "Ledger"}
    assert [name for name in both if getattr(hopform, name) is not getattr(records, name)] == []


def test_the_words_for_endings_and_events_are_the_same_in_python_and_c():
    for kind, words in (("ENDING", records.ENDINGS), ("EVENT", records.EVENTS | records.BEGINNINGS)):
        macros = dict(re.findall(rf"#define HOPFORM_{kind}_(\w+) (\d+)", header("hopform.h")))
        assert {word.upper(): str(number) for number, word in words.items()} == macros


def test_both_precisions_have_the_same_functions():
    single = re.findall(r"(hopform_\w+)_f32\(", header("hopform_f32.h"))
    double = re.findall(r"(hopform_\w+)_f64\(", header("hopform_f64.h"))
    assert single == double != []


def definitions(path: Path, opening: str) -> dict[str, str]:
    """The text of each function of a file of formulas, up to the next one."""
    parts = re.split(opening, path.read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("function", PROGRAM.functions, ids=lambda function: function.name)
def test_a_formula_is_the_same_lines_in_python_and_c(function: Function):
    """Step by step the same name, the same expression, the same source; only the punctuation differs. C has those that
    the engine calls.
    """
    python = definitions(SOLVER / "formulas.py", r"^def (\w+)\(")[function.name]
    c = definitions(C / "src" / "formulas_f64.h", r"^(?:static inline|ALWAYS_f64) \w+ (\w+)_f64\(").get(function.name)
    if c is None:
        sources = [path.read_text("utf-8") for path in (C / "src").glob("*_f64.[ch]")]
        assert not any(re.search(rf"\b{function.name}_f64\(", text) for text in sources)
        return
    in_python = re.findall(r"^    (\w+) = (.*?) +# (.*)$", python, flags=re.MULTILINE)
    in_c = re.findall(r"^    const double (\w+) = (.*?); +/\* (.*) \*/$", c, flags=re.MULTILINE)
    derived = [(str(step.symbol), step.source) for step in function.steps]
    assert [(name, source) for name, _, source in in_python] == derived
    in_c = [(name, re.sub(r"\b(sqrt|fabs)_f64\(", r"\1(", text), source) for name, text, source in in_c]
    in_c = [(name, text.replace("(double)INFINITY", 'float("inf")'), source) for name, text, source in in_c]
    assert in_python == in_c


# ---- the C is C ----

WARNINGS = [
    "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wfloat-equal",
    "-Wshadow", "-Wundef", "-Werror",
]  # fmt: skip


def installed(*names: str) -> list[str]:
    return [name for name in names if shutil.which(name)]


def with_every_warning(compiler: str, *language: str) -> tuple[str, ...]:
    return compiler, *language, *WARNINGS


@pytest.fixture
def objects(store) -> Callable[..., list[Path]]:
    """Every source of the library, or of its notes, compiled with every warning an error, once for all tests."""

    def by(compiler: str, part: str = "src") -> list[Path]:
        command = with_every_warning(compiler, "-std=c99", "-O2", "-fno-pie", "-ffp-contract=off", "-I", str(C / "src"))
        found = [compiled(store, command, source) for source in sorted((C / part).glob("*.c"))]
        assert found
        return found

    return by


def symbols(path: Path) -> list[tuple[str, str]]:
    """Kind and name of each symbol of an object file."""
    listing = subprocess.run(["nm", path], capture_output=True, text=True, check=True).stdout
    return [(line.split()[-2], line.split()[-1]) for line in listing.splitlines()]


each_compiler = pytest.mark.parametrize("compiler", the_first(installed("gcc", "clang") or ["cc"]))


@pytest.mark.sliced
@each_compiler
def test_the_library_compiles_as_c99_without_a_warning(objects, compiler):
    assert installed(compiler) or not os.environ.get("HOPFORM_CI"), "there is no C compiler"
    if installed(compiler):
        objects(compiler)
        objects(compiler, "notes")


@pytest.mark.sliced
@each_compiler
def test_the_library_keeps_no_data(objects, compiler):
    for path in (*objects(compiler), *objects(compiler, "notes")):
        assert not [name for kind, name in symbols(path) if kind in "dDbBC"], path.name


@pytest.mark.sliced
@each_compiler
def test_the_library_defines_no_name_that_is_not_its_own(objects, compiler):
    for path in (*objects(compiler), *objects(compiler, "notes")):
        assert not [name for kind, name in symbols(path) if kind in "TRVWi" and not name.startswith("hopform_")]


# What compilers make of __builtin_cpu_supports; what <fenv.h> has.
ASKS_THE_PROCESSOR = {"__cpu_model", "__cpu_indicator_init", "_GLOBAL_OFFSET_TABLE_"}
KEEPS_FLAGS = {"fegetenv", "fesetenv"}


@pytest.mark.sliced
@each_compiler
def test_single_precision_calls_single_precision_alone(objects, compiler):
    """It needs its own, memory functions, and of libm what ends in f: no warning of a compiler sees calls."""
    single = [path for path in (*objects(compiler), *objects(compiler, "notes")) if "_f32_" in path.stem]
    assert single
    for path in single:
        needed = {name for kind, name in symbols(path) if kind == "U"}
        other = {name for name in needed if not name.endswith("f") and not name.startswith("hopform_")}
        assert other <= {"memcpy", "memset", "memmove", *ASKS_THE_PROCESSOR, *KEEPS_FLAGS}, path.name
        assert not {name for name in needed if name.startswith("hopform_") and not name.endswith("_f32")}


@pytest.mark.parametrize("name", [path.name for path in sorted((C / "include" / "hopform").glob("*.h"))])
def test_a_public_header_stands_alone_in_c_and_in_cpp(tmp_path, name):
    for compiler, suffix, language in (
        *((compiler, ".c", "-std=c99") for compiler in installed("gcc", "clang")),
        *((compiler, ".cpp", "-std=c++11") for compiler in installed("g++", "clang++")),
    ):
        source, target = tmp_path / f"user{suffix}", tmp_path / "user.o"
        source.write_text(f'#include "hopform/{name}"\n#include "hopform/{name}"\nconst char *what(void);\n')
        include = ("-I", C / "include", "-I", C / "src")
        run_compiler(*with_every_warning(compiler, language), *include, "-c", source, "-o", target)


@pytest.mark.sliced
def test_cpp_finds_the_names_of_the_library(tmp_path, objects):
    source = tmp_path / "user.cpp"
    source.write_text(
        '#include "hopform/hopform.h"\n'
        "int main() { hopform_plan_f64 plan; return hopform_layout() && !hopform_plan_init_f64(&plan, 0); }\n"
    )
    for cpp, compiler in zip(installed("g++"), installed("gcc"), strict=False):
        made = objects(compiler)
        run_compiler(cpp, "-no-pie", "-I", C / "include", source, *made, "-lm", "-o", tmp_path / "user")
