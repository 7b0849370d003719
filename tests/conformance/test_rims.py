"""Models at the rims of what a file may say: the least of everything, each name that a macro has, and hostile texts.

The motion of each is known in closed form, a constant force on one mass: x = x_0 + F t^2/(2 m).
"""

import ast
import csv
import io
import itertools
import string
import subprocess
import tomllib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from markdown_it import MarkdownIt

from derive.emit.render import Options, render
from derive.model.equations import ModelError
from derive.model.names import why_no_column, why_not
from derive.solver import model_of, solver
from hopform._cli import tables
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
    numbers = {each["name"]: each["default"] for each in facts.parameters}
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
    text = render(Options(made))[Path("solver.toml")]
    known = tomllib.loads(text)
    limits = [each["limit"] for each in (*known["inputs"], *known.get("currents", ())) if "limit" in each]
    assert all(limit in {each["name"] for each in known["parameters"]} for limit in limits), limits


HOSTILE = """A title with */, \\"\\"\\", <script>alert(1)</script>, & | -->, {{ header }}, @header@, $x ${y} %s, \\\\, 0000000000000000"""
WORDS = "<script>alert(2)</script> | & 0000000000000000 @header@ --> {{ layout }} $x %s ??/ '"
"""What a meaning may be: a printable line without quotes, comments of C and backslashes."""
MODEL = f'''__doc__ = "{HOSTILE}"
from hopform.model import *
m = parameter("m", "kg", "mass {WORDS}", "positive", 1)
x = coordinate("x", "m", m, "block {WORDS}", directions=("right {WORDS}", "left"), meaning="way {WORDS}")
i = current("i", "A", thing="motor {WORDS}", meaning="current {WORDS}")
spring(x, 5, "spring")
force(x, 2*i, "pull")
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
    assert known["parameters"][0]["meaning"] == f"mass {WORDS}"
    assert tomllib.loads(texts[Path("robot.toml")])["m"] == 1.0
    for path, text in texts.items():
        place = tmp_path / "made" / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, "utf-8")
        if path.suffix == ".py":
            ast.parse(text)
        elif path.suffix == ".md":
            assert not markup(text), path
        elif path.suffix in (".pdsc", ".xml"):
            ElementTree.fromstring(text)
        assert text.count("Generated by") == (path not in map(Path, ("model.py", "robot.toml"))) * text.count(
            "Generated by"
        )
    units = sorted(str(path) for path in (tmp_path / "made" / "c").rglob("*.c"))
    flags = [f"-I{tmp_path / 'made' / 'c' / each}" for each in ("include", "src")]
    for unit in units:
        subprocess.run(["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", *flags, unit], check=True)


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
