"""Models at the rims of what a file may say: the least of everything, each name that a macro has, and hostile texts.

The motion of each is known in closed form, a constant force on one mass: x = x_0 + F t^2/(2 m).
"""

import ast
import csv
import dataclasses
import io
import itertools
import json
import string
import subprocess
import tomllib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from markdown_it import MarkdownIt

from derive.derivation import Derivation
from derive.emit.render import render
from derive.emit.texts import BROKEN
from derive.model.equations import ModelError
from derive.model.names import in_python, why_no_column, why_not
from derive.solver import model_of, solver
from hopform._cli import tables
from hopform._export import struct_of
from hopform._robots import Provenance, robot_from_toml
from hopform._texts import comment_of_xml
from tests import needs
from tests.derived import SHIPPED, solver_of
from tests.derived import model_of as model_of_text
from tests.macros import arguments_of_macros

pytestmark = needs.library
MASS = 'x = coordinate("x", "m", {}, "block")\n'


def block(*names: str, more: str = "") -> str:
    """A mass of the first parameter under the sum of the others, or under 1 N."""
    mass, *forces = names
    lines = [f'{name} = parameter("{name}", "{"N" if n else "kg"}", "number {n}", "positive", {n + 1})'
             for n, name in enumerate(names)]  # fmt: skip
    return "\n".join(['"""A block under constant forces."""', "from hopform.model import *", *lines, MASS.format(mass),
                      f'force(x, {" + ".join(forces) or "1"}, "push")', more])  # fmt: skip


def allowed(*names: str) -> list[str]:
    return [name for name in names if why_not(name) is None and name not in ("x", "v")]


RIMS = {
    "one parameter": block("m"),
    "single capitals": block(*allowed(*string.ascii_uppercase)),
    "arguments of macros": block(*allowed(*sorted(arguments_of_macros()))),
    "a current without a limit": block("m", more='i = current("i")\nforce(x, 2*i, "motor")'),
    "a coordinate of one letter": block("m").replace('"x"', '"F"').replace('x = c', 'F = c').replace("(x,", "(F,"),
}  # fmt: skip


@pytest.mark.parametrize("name", needs.the_first([*RIMS], 0))
def test_a_model_at_a_rim_is_built_and_solved(name, store, tmp_path):
    file = tmp_path / f"{name.replace(' ', '_')}.py"
    file.write_text(RIMS[name], "utf-8")
    built = solver_of(store, file)
    facts = built._core.facts
    numbers = {in_python(each["name"]): each["default"] for each in facts.parameters}
    force = sum(value for value in numbers.values()) - 1.0 or 1.0
    robot = built.Robot(**numbers)
    motion = built.solve_motion(robot, start={}, horizon=0.5)
    assert motion.at(0.5)[0] == pytest.approx(force * 0.5**2 / 2.0, rel=1e-12)
    many = built.solve_motions(robot, start={}, u=[0.0, 0.0, 0.0], horizon=0.5) if facts.inputs else None
    assert many is None or many.end[0].tolist() == [motion.at(0.5)[0]] * 3


LIMITS = ("a current without a limit", *RIMS, *(path.stem for path in sorted(SHIPPED.glob("[a-z]*.py"))))


@pytest.mark.parametrize("name", needs.the_first([*dict.fromkeys(LIMITS)]))
def test_a_limit_that_is_none_is_left_out_of_the_facts(name):
    made = model_of_text(RIMS[name]) if name in RIMS else model_of(name)
    text = render(made)[Path("solver.toml")]
    known = tomllib.loads(text)
    limits = [each["limit"] for each in (*known["inputs"], *known.get("currents", ())) if "limit" in each]
    assert all(limit in {each["name"] for each in known["parameters"]} for limit in limits), limits


HOSTILE = """A title with */, \\"\\"\\", <script>alert(1)</script>, & | -->, {{ header }}, @header@, $x ${y} %s, \\\\, 0000000000000000"""
WORDS = "<script>alert(2)</script> | & 0000000000000000 @header@ --> {{ layout }} {% raw %} $x %s ??/ ' */ /* "
WORDS += """k_real \"\"\" \\n ]]> -- ü \\"""
"""What a meaning may be: any printable line, with what ends a comment, a docstring or a string, and ends in a backslash."""
NAMES = ("I", "A0", "B1", "E", "X", "J_L", "t", "name", "status", "total_energy", "stop_q", "fit", "time", "N", "H")
MODEL = f'''__doc__ = "{HOSTILE}"
from hopform.model import *
WORDS = {WORDS!r}
m = parameter("m", "kg", "mass " + WORDS, "positive", 1)
others = [parameter(name, WORDS, WORDS, "real", 0.5, glyph="A_{{|" + WORDS + "}}") for name in {NAMES}]
x = coordinate("x_1", "m", m, "block " + WORDS, directions=("right " + WORDS, "left"), meaning="way " + WORDS)
i = current("i", "A", thing="motor " + WORDS, meaning="current " + WORDS)
spring(x, 5, "spring")
force(x, 2*i + sum(others), "pull")
friction(x, 0.125)
stop(x, -9, 9)
'''


def products(folder: Path) -> dict[Path, str]:
    """The texts of the solver of a hostile model."""
    file = folder / "hostile.py"
    file.write_text(MODEL, "utf-8")
    return solver(file)


def markup(text: str) -> set[str]:
    """The tags of HTML in a page of Markdown."""
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    return {each.content for token in tokens for each in (token, *(token.children or ()))
            if each.type in ("html_inline", "html_block") and not each.content.startswith(("<!--", "<a id"))}  # fmt: skip


def test_every_product_of_a_hostile_model_is_read_by_what_reads_its_kind(tmp_path):
    texts = products(tmp_path)
    unhurt = {path for path, text in solver("joint").items()}
    assert texts.keys() == unhurt
    known = tomllib.loads(texts[Path("solver.toml")])
    assert known["title"] == ast.literal_eval(f'"{HOSTILE}"')
    assert [each["meaning"] for each in known["parameters"]] == [f"mass {WORDS}", *[WORDS] * len(NAMES)]
    numbers = tomllib.loads(texts[Path("robot.toml")])
    assert numbers["m"] == 1.0 and numbers["A0"] == numbers["parameters"]["name"] == 0.5
    found_in = set[str]()
    for path, text in texts.items():
        place = tmp_path / "made" / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, "utf-8")
        assert BROKEN not in text, path
        if path.suffix == ".py":
            compile(text, str(path), "exec")
            said = [node.value for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant)]
            found_in |= {path.name} if any(WORDS in str(each) for each in said) else set()
        elif path.suffix == ".json":
            json.loads(text)
        elif path.suffix == ".md":
            assert not markup(text), path
        elif path.suffix in (".pdsc", ".xml"):
            ElementTree.fromstring(text)
        assert text.count("Generated by") == (path not in map(Path, ("model.py", "robot.toml"))) * text.count(
            "Generated by"
        )
    assert {"records.py", "robot.py", "elements.py"} <= found_in
    header = texts[Path("c/include/hopform/hopform_f64.h")]
    assert "J_L_;" in header and "J_L: <script>" in header and "k_real" in header
    units = sorted(str(path) for path in (tmp_path / "made" / "c").rglob("*.c"))
    flags = [f"-I{tmp_path / 'made' / 'c' / each}" for each in ("include", "src")]
    for unit in units:
        subprocess.run(["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", *flags, unit], check=True)


def test_every_form_of_a_hostile_model_is_read_by_what_reads_its_kind(tmp_path):
    (tmp_path / "hostile.py").write_text(MODEL, "utf-8")
    made = Derivation(model_of(tmp_path / "hostile.py"))
    for form in ("numpy", "sympy"):
        compile(made.show(form=form), form, "exec")
    (tmp_path / "form.c").write_text(made.show(form="c"), "utf-8")
    unused = "-Wno-unused-function"
    subprocess.run(["gcc", "-std=c99", "-Wall", "-Werror", unused, "-fsyntax-only", tmp_path / "form.c"], check=True)
    assert all(WORDS not in each["meaning"] or each["unit"] for each in json.loads(made.show(form="json")))
    cells = json.loads(made.show(form="notebook"))["cells"]
    assert not set().union(*(markup("".join(each["source"])) for each in cells if each["cell_type"] == "markdown"))


@pytest.mark.sliced
def test_what_a_hostile_solver_writes_is_read_by_what_reads_its_kind(store, tmp_path):
    """A robot whose texts and whose fit are hostile, too, in TOML, C, XML, HTML and CSV."""
    (tmp_path / "hostile.py").write_text(MODEL, "utf-8")
    built = solver_of(store, tmp_path / "hostile.py")
    said = ast.literal_eval(f'"{HOSTILE}"') + "\n[fit]\nname = 3"
    fit = Provenance(
        ("m", "name"), (1.0, 0.5), (0.0, 0.0), (2.0, 1.0), ((1.0, 0.0), (0.0, 1.0)), (), said, True, (said,)
    )
    robot: Any = dataclasses.replace(built.load_robot("hostile"), name=said, description=said, fit=fit)
    assert robot_from_toml(robot.to_toml(), kind=type(robot)) == robot
    assert tomllib.loads(robot.to_toml())["parameters"]["name"] == 0.5
    (tmp_path / "robot.c").write_text('#include "hopform/hopform.h"\n' + struct_of(robot, "f64"), "utf-8")
    include = f"-I{built._core.folder.path('solver.toml').parent / 'c' / 'include'}"
    flags = ["-std=c99", "-Wall", "-Werror", "-Wno-unused-const-variable", "-fsyntax-only"]
    subprocess.run(["gcc", *flags, include, tmp_path / "robot.c"], check=True)
    assert ElementTree.fromstring(f"<a><!-- {comment_of_xml(said)} --></a>").tag == "a"
    motion: Any = built.solve_motion(robot, start={"x_1": 0.1}, horizon=0.1)
    page = motion._repr_html_()
    assert "<script" not in page and ElementTree.fromstring(page) is not None
    text = tables.motion_csv(motion, 5)
    head, *rows = csv.reader(io.StringIO(text))
    assert len(set(head)) == len(head) and {len(row) for row in rows} == {len(head)}


@pytest.mark.parametrize("docstring", ["5", "None", "b'x'", "[]"])
def test_a_docstring_that_is_no_text_gives_no_title(docstring, tmp_path):
    file = tmp_path / "odd.py"
    file.write_text(f"__doc__ = {docstring}\n" + RIMS["one parameter"].partition("\n")[2], "utf-8")
    assert model_of(file).title == "The model odd."


@pytest.mark.parametrize("name", needs.the_first(["joint", "servo", "sea"], 0))
def test_no_column_of_a_result_has_a_name_that_a_coordinate_may_have(name, store):
    """So none overwrites another: the columns of the table over time are those of the model, or refused as names."""
    built = solver_of(store, SHIPPED / f"{name}.py")
    facts = built._core.facts
    robot = built.Robot(**{each["name"]: each["default"] for each in facts.parameters})
    motion: Any = built.solve_motion(robot, start={}, horizon=0.1)
    head = next(csv.reader(io.StringIO(tables.motion_csv(motion, 9))))
    own = [each["name"] for each in (*facts.coordinates, *facts.inputs, *facts.currents)]
    others = {*motion.to_xarray().variables, *head} - {*own}
    assert len(head) == len(set(head))
    assert not [each for each in others if why_no_column(each) is None], others
    for each, text in itertools.product(sorted(others), ("coordinate", "velocity")):
        with pytest.raises(ModelError, match="a column of results has this name|attribute of a robot"):
            if text == "coordinate":
                model_of_text(RIMS["one parameter"].replace('"x"', f'"{each}"'))
            else:
                model_of_text(RIMS["one parameter"].replace('"block")', f'"block", velocity="{each}")'))
