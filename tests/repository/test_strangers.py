"""A mechanism of a user has no word of the hopper, in no text that its user can meet.

Three model files: a door with a closer, a relay, and a tendon, of which one coordinate is called "leg" and whose input
is a current. Read are the files of their solvers and packages, what each command prints and writes for them, messages,
and the representations of objects in Python, each with the words that the hopper has for itself. A word that the file of
a model has is its own, and may come out.
"""

import json
import re
import sys
from collections.abc import Callable, Iterable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
import pytest

import hopform
from hopform import _front as cli
from hopform._export import SYSTEMS
from hopform.identify import fit, read_recording
from tests.derived import MODELS, built
from tests.objects import key, once

WORDS = {
    "leg": r"legs?",
    "body": r"bod(?:y|ies)",
    "hopper": r"hoppers?",
    "touchdown": r"touch-?downs?",
    "take-off": r"take-?offs?",
    "actuator": r"actuators?",
    "compression": r"compressions?",
    "/A": r"(?:(?<=[\w)}])/A|\[A\])",
    "number of the paper": r"(?<![\w\])}])\((?:[1-9]|1[0-9]|2[0-7])\)(?: ?(?:-|,|and) ?\(\d+\))*",
    "x_1": r"x\}?_\{?[12]\}?",
    "AED": r"AED",
}
"""The words of the hopper, each with its pattern. A part of a name is a word: `leg_loss`, `HOPFORM_TOUCHDOWN`."""

PATTERNS = {
    name: re.compile(
        rf"(?<![A-Za-z0-9]){word}(?![A-Za-z0-9])" if word[0].isalpha() else rf"{word}(?![A-Za-z0-9])",
        re.IGNORECASE if name != "/A" else re.NOFLAG,
    )
    for name, word in WORDS.items()
}

EXEMPT = {
    "fit: mjcf": (r"</?(?:body|actuator)\b[^>]*>", "elements of MuJoCo's format"),
    "fit: urdf": (r"</?actuator\b[^>]*>", "an element of URDF"),
    "fit: isaac": (r"isaaclab\.actuators", "a module of Isaac Lab"),
}
"""By text: what is left out of it, with the reason."""


class Stranger(NamedTuple):
    """How the texts of a model are had: a start, steps of its input, what a fit takes as known, how it is recorded."""

    start: tuple[str, ...]
    steps: str
    known: tuple[str, ...]
    recorded: tuple[str, ...] = ()

    @property
    def motion(self) -> list[str]:
        return [*repeated("--start", self.start), "--u-steps", self.steps]


def repeated(option: str, values: Iterable[str]) -> list[str]:
    return [text for value in values for text in (option, value)]


STRANGERS = {
    "door": Stranger(("phi=1.2", "phi_dot=0.5"), "0:3,0.4:30,0.8:-10,1.2:5", ("I_d=2.5", "F_h0=1.4")),
    "relay": Stranger(
        ("z=0.001",), "0:5,0.01:0,0.02:3,0.05:-2", ("m_a=0.012", "gap=0.003"),
        ("--rate", "4000", "--noise", "1e-6", "--duration", "0.1"),
    ),
    "tendon": Stranger(("drum=0.5", "leg=0.1"), "0:3,0.3:-3,0.6:6", ("k_t=0.3",), ("--duration", "1")),
}  # fmt: skip
"""The models of the strangers, files of tests/models."""

FORMS = ("text", "latex", "sympy", "json", "numpy", "c", "notebook")
HELP = ("", "motion", "fit", "record", "robots", "export", "selftest")
"""The commands that a model without a contact can use, of which "" is the whole."""
OF_FILES = ("model check", "model build", "model prove", "model show", "model list")
"""The commands about files of models."""

REFUSED = (
    "motion --start nothing=1",
    "motion --start y=0.02",
    "motion --start {first}=nan",
    "motion --start {first}=1e6",
    "motion --start {first}",
    "motion --set nothing=1",
    "motion --set {parameter}=-1",
    "motion --set {parameter}=x",
    "motion --u x",
    "motion --u-steps 0:1,0:2",
    "motion --u-steps 0:1,-1:2",
    "motion --horizon -1",
    "motion --max-phases 0",
    "motion --robot nobody",
    "motion --robot nowhere.toml",
    "motion --height 0.2",
    "stance --height 0.2",
    "hop --height 0.2",
    "control --height 0.2 --h-des 0.2",
    "reach",
    "identify log.csv",
    "equations",
    "record drop",
    "record motion --height 0.2",
    "record motion --start {first}=1e6",
    "fit nowhere.csv",
    "fit columns.csv",
    "fit units.csv",
    "fit still.csv",
    "fit log.csv",
    "fit log.csv --fitted nothing",
    "fit log.csv --known nothing=1",
    "fit log.csv --known {parameter}=-1",
    "fit log.csv --near nothing=1",
    "fit log.csv --known {parameter}=1 --loss nothing",
    "export made --for nothing",
    "export made --robot nobody",
    "export made --prefix 9",
    "robots nobody",
    "model show {file} nothing",
    "model show {file} 3",
    "model check nowhere.py",
)
"""Command lines that are refused, for the model's first coordinate, first parameter and file."""


# ---- the texts ----


def said(*arguments: str) -> str:
    """What a command prints, on both streams; a report says how it was called."""
    stream = StringIO()
    with redirect_stdout(stream), redirect_stderr(stream), patch.object(sys, "argv", ["hopform", *arguments]):
        cli.main([*arguments])
    return stream.getvalue()


def files_in(folder: Path, kind: str) -> dict[str, str]:
    """The texts of a folder, each with its path for a first line."""
    return {
        f"{kind}: {path.relative_to(folder)}": f"{path.relative_to(folder)}\n{path.read_text('utf-8')}"
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix not in {".so", ".pyc"}
    }


def of_solver(folder: Path) -> dict[str, str]:
    """The files of a solver, but for those that packages are made of: an export says what becomes of them."""
    texts = {
        f"{kind}: {name}": (folder / name).read_text("utf-8")
        for kind, name in (("equations", "EQUATIONS.md"), ("facts", "solver.toml"), ("robot", "robot.toml"))
    }
    texts |= files_in(folder / "python", "Python")
    texts |= files_in(folder / "c" / "include", "C header") | files_in(folder / "c" / "src", "C source")
    return (
        texts | files_in(folder / "c" / "notes", "C source") | {"C readme": (folder / "c/README.md").read_text("utf-8")}
    )


def of_packages(folder: Path, name: str) -> dict[str, str]:
    """The files of the package for each build system that the others do not have, with the program for a board."""
    texts: dict[str, str] = {}
    known: set[str] = set()
    for system in SYSTEMS:
        printed = said("--solver", str(folder), "export", system, "--for", system, "--robot", name)
        texts[f"export: {system}"] = printed
        for key_, text in files_in(Path(system), f"package for {system}").items():
            if text not in known:
                texts[key_] = text
                known.add(text)
    return texts


def of_commands(solver: list[str], file: str, model: Stranger) -> dict[str, str]:
    """What the commands say about a model, in every form that they have."""
    texts = {f"help: {name or 'hopform'}": said(*solver, *name.split(), "--help") for name in HELP}
    texts |= {f"help of files: {name}": said(*solver, *name.split(), "--help") for name in OF_FILES}
    texts["model check"] = said("model", "check", file)
    texts |= {f"model show: {form}": said("model", "show", file, "--as", form) for form in FORMS}
    texts["robots"] = said(*solver, "robots") + said(*solver, "robots", "--toml") + said(*solver, "robots", "--json")
    texts |= {f"robots: {precision}": said(*solver, "robots", "--c", precision) for precision in ("float32", "float64")}
    texts["selftest"] = said(*solver, "selftest") + said(*solver, "selftest", "--json")
    texts["motion"] = said(*solver, "motion", *model.motion, "--explain", "--sensitivities")
    texts["motion: json"] = said(*solver, "motion", *model.motion, "--json")
    texts["motion: csv"] = said(*solver, "motion", *model.motion, "--csv", "-")
    texts["motion: plot"] = said(*solver, "motion", *model.motion, "--plot", "motion.svg") + words_of("motion.svg")
    texts["record: plan"] = said(*solver, "record", "motion", *model.motion, *model.recorded, "--plan")
    return texts


def of_fits(solver: list[str], model: Stranger) -> dict[str, str]:
    """What is said of a fit of a recording, which is written to log.csv."""
    recorded = said(*solver, "record", "motion", *model.motion, *model.recorded, "--seed", "1", "--csv", "log.csv")
    texts = {"record": recorded + Path("log.csv").read_text("utf-8")[:1000]}
    known = repeated("--known", model.known)
    texts["fit"] = said(*solver, "fit", "log.csv", *known, "--report", "fit.md", "--out", "fitted.toml")
    texts["fit: report"] = Path("fit.md").read_text("utf-8") + words_of("fit.svg")
    texts["fit: robot"] = Path("fitted.toml").read_text("utf-8")
    texts["fit: json"] = said(*solver, "fit", "log.csv", *known, "--json")
    texts |= {f"fit: {s}": said(*solver, "fit", "log.csv", *known, "--export", s) for s in ("mjcf", "urdf", "isaac")}
    return texts


def of_refusals(solver: list[str], name: str, file: str, model: Stranger) -> dict[str, str]:
    """Messages of what is refused, log.csv a recording among it."""
    header, *rows = Path("log.csv").read_text("utf-8").splitlines()
    wrong = {
        "columns": "time_s,position_m",
        "units": header.replace("_rad", "_kg").replace("_m", "_kg"),
        "still": header,
    }
    for title, columns in wrong.items():
        still = [f"{row.split(',')[0]}{',0' * columns.count(',')}" for row in rows]
        Path(f"{title}.csv").write_text("\n".join([columns, *(still if title == "still" else rows)]), "utf-8")
    words = {
        "first": model.start[0].partition("=")[0],
        "parameter": model.known[0].partition("=")[0],
        "file": file,
    }
    texts: dict[str, str] = {}
    for line in REFUSED:
        arguments = line.format(**words).split()
        texts[f"refused: {line}"] = said(*(() if arguments[0] == "model" else solver), *arguments)
    return texts


def of_python(folder: Path, name: str, model: Stranger) -> dict[str, str]:
    """How the objects of a model represent and explain themselves in Python."""
    solver = hopform.load_solver(folder)
    robot = solver.load_robot(name)
    start = {key_: float(value) for key_, value in (each.split("=") for each in model.start)}
    motion, first = solver.solve_motion(robot, start=start, u=1.0), next(iter(start))
    many = solver.solve_motions(robot, start=start | {first: np.array([0.5, 1.0]) * start[first]}, u=1.0)
    objects = (
        solver, robot, *solver.Robot.fields(), solver.Robot.__doc__, motion, motion.end, motion.events, motion.phases,
        motion.ledger(motion.duration), motion.ledger_by_element(motion.duration), motion.forces(0.0), motion.units,
        motion.outcome, motion.explain(), motion.warnings, motion.sensitivities, motion.to_xarray(), many,
        many.to_xarray(), many.words, many.labels, fit(solver, read_recording("log.csv")),
    )  # fmt: skip
    return {f"Python: {type(each).__name__}": f"{each!r}\n{each}" for each in objects}


def words_of(picture: str) -> str:
    """The texts of a drawing, which are paths, each behind a comment that has it."""
    return "\n".join(re.findall(r"<!-- *(.*?) *-->", Path(picture).read_text("utf-8"), re.DOTALL))


def texts_of(folder: Path, name: str) -> dict[str, str]:
    """All texts of a model, by kind and name, in a folder for what is written."""
    model, solver, file = STRANGERS[name], ["--solver", str(folder)], str(MODELS / f"{name}.py")
    return {
        **of_solver(folder),
        **of_packages(folder, name),
        **of_commands(solver, file, model),
        **of_fits(solver, model),
        **of_refusals(solver, name, file, model),
        **of_python(folder, name, model),
    }


# ---- what is found in them ----


class Found(NamedTuple):
    """A line of a text with a word of the hopper."""

    text: str
    number: int
    word: str
    line: str


def found_in(texts: dict[str, str], declared: str) -> list[Found]:
    """The lines that have a word of the hopper which the text of the model's file has not."""
    patterns = {word: pattern for word, pattern in PATTERNS.items() if not pattern.search(declared)}
    return [
        Found(name, number, word, line.strip()[:120])
        for name, text in texts.items()
        for number, line in enumerate(re.sub(EXEMPT.get(name, ("$^", ""))[0], "", text).splitlines(), 1)
        for word, pattern in patterns.items()
        if pattern.search(line)
    ]


@pytest.fixture
def found(store, tmp_path, monkeypatch) -> Callable[[str], list[Found]]:
    """What is found of a stranger by its name; its texts are made once for all processes of the run."""
    monkeypatch.chdir(tmp_path)

    def of(name: str) -> list[Found]:
        source = (MODELS / f"{name}.py").read_text("utf-8")
        folder = built(store, name)
        made = once(
            store / f"texts_of_{name}_{key(source)}.json",
            lambda aside: aside.write_text(json.dumps(texts_of(folder, name)), "utf-8"),
        )
        return found_in(json.loads(made.read_text("utf-8")), source)

    return of


@pytest.mark.sliced
@pytest.mark.parametrize("name", list(STRANGERS))
def test_no_text_of_a_stranger_has_a_word_of_the_hopper(found, name):
    assert found(name) == []


def test_a_word_of_the_hopper_is_found():
    lines = {
        "leg": ("a leg stands", "leg_loss", "LEGS"),
        "body": ("of the body", "BODY_HEIGHT_f32"),
        "hopper": ("Hopper.ino", "hopper_c", "the hopper's stance"),
        "touchdown": ("HOPFORM_TOUCHDOWN", "a touch-down"),
        "take-off": ("takeoff", "take-off", "HOPFORM_TAKEOFF"),
        "actuator": ("motion_of_actuator",),
        "compression": ("compression_max", "its compressions"),
        "/A": ("rad/s^2/A", "(N m)/A", "current [A]"),
        "number of the paper": ("(3), (4)", "as in (25)-(27)", "/* (11) denominator */"),
        "x_1": ("x_1", "x_{2}(0)", "\\dot{x}_1"),
        "AED": ("aed", "aed_of_ledger"),
    }
    for word, known in lines.items():
        for line in known:
            assert word in {each.word for each in found_in({"a text": f"nothing\n{line}"}, "")}, (word, line)
            assert found_in({"a text": line}, line) == []
    harmless = (
        "elegant legend",
        "anybody",
        "hopform",
        "f(3)",
        "a[2](1)",
        "(0)",
        "x1 + x_10",
        "a^2/q, x/a",
        "takes off",
    )
    assert found_in({"a text": "\n".join(harmless)}, "") == []
    assert found_in({"fit: mjcf": '<body name="door">leg</body>'}, "") == [Found("fit: mjcf", 1, "leg", "leg")]
