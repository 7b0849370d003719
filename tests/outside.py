"""Generators of what comes from outside: objects for arguments, texts of CSV, TOML and model files, command lines.

Each test draws `examples(n)`: n of them, the same each time, in `make test`; HOPFORM_EXAMPLES times as many, drawn
afresh, in `make fuzz-outside`.
"""

import os
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from hopform._cli import options
from hopform.hopping import _commands
from hopform.identify import _commands as identify
from tests.calls import DECAY, HOPPER, OBJECTS, STEP, TOUCHDOWN, arrays

TIMES = int(os.environ.get("HOPFORM_EXAMPLES", "1"))


def examples(count: int) -> settings:
    """The settings of a test that draws so many examples."""
    return settings(
        max_examples=count * TIMES, derandomize=TIMES == 1, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip


# ---- objects ----


class Broken(RuntimeError):
    """What a hostile object raises: nothing else may hide it, nor let it through."""


def hostile(*methods: str, base: type = object) -> Any:
    """An object whose methods raise."""

    def breaks(*_: Any, **__: Any) -> Any:
        raise Broken("this object is hostile")

    return type(f"Hostile{''.join(methods)}", (base,), dict.fromkeys(methods, breaks))()


def generator() -> Iterator[float]:
    yield 0.0
    raise Broken("in the middle")


HOSTILE: tuple[Callable[[], Any], ...] = (
    *(lambda name=name: hostile(name) for name in ("__float__", "__repr__", "__len__", "__iter__", "__array__")),
    *(lambda name=name: hostile(name) for name in ("__bool__", "__eq__", "__getitem__", "__fspath__", "__index__")),
    lambda: hostile("__float__", "__repr__"),
    lambda: hostile("__iter__", "__len__", "__getitem__", base=list),
    lambda: hostile("__float__", base=float),
    lambda: hostile("__str__", "__repr__", base=str),
    lambda: hostile("__getattr__"),
    lambda: hostile("__hash__"),
    lambda: hostile("items", "__iter__", base=dict),
    generator,
    lambda: iter([0.0, 1.0]),
)
"""Objects that raise, made anew each time."""

PLAIN: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 3, 2**31 - 1, 2**31, 10**14, 10**400, -(10**5000), 0.0, -0.0, 1e-320, 5e-324,
    1e300, -1e300, 1.7e308, float("nan"), float("inf"), -float("inf"), 0.1, -1.9, 1j, complex("nan"), "", "c",
    "python", "drop", "1.0", "hopper_c", "\0", "\udc80", "x" * 5000, "\N{ARABIC-INDIC DIGIT ONE}", b"1",
    bytearray(b"1"), (), [], {}, set(), (0.0, 1.0), [0.0, 1.0], [[0.0, 1.0]], [(0.0, 1.0), (0.1, 2.0)], [(0.0, "x")],
    [[1.0], [1.0, 2.0]], [None], ["x"], {"k": 1.0}, {"k": "x"}, {1: 2}, {"q": float("nan")}, range(3), slice(None),
    Ellipsis, NotImplemented, float, np.float32, np.int64, object, object(), print, len, lambda *_: 0.0,
    lambda *_: None, Decimal("0.1"), Decimal("NaN"), Decimal("sNaN"), Decimal("1e400"), Fraction(1, 3),
    Fraction(10**400, 3), np.float64(0.1), np.float32(0.1), np.int64(2), np.bool_(True), np.str_("1.0"),
    np.bytes_(b"1"), np.complex128(1j), np.datetime64("2020-01-01"), np.timedelta64(1, "s"), np.longdouble("1e4000"),
    np.void(b"1"), np.dtype("f4"), np.random.default_rng(1), memoryview(b"1"), os, Path("x"), Path("/"),
    Path("/dev/null"), HOPPER, DECAY, STEP, TOUCHDOWN, [DECAY], [STEP, 3], *OBJECTS.values(), *arrays(),
)  # fmt: skip
"""Objects of every sort that people hand in by mistake, numbers at every edge among them. What a callback raises is
its caller's own, so none of those that can be called raises anything but TypeError."""


def objects() -> st.SearchStrategy[Any]:
    """Any object."""
    simple = st.one_of(
        st.sampled_from(PLAIN),
        st.sampled_from(HOSTILE).map(lambda made: made()),
        st.floats(),
        st.integers(),
        st.text(max_size=20),
        st.integers(-5, 50),
        st.floats(-10.0, 10.0),
    )
    return st.one_of(
        simple,
        st.lists(simple, max_size=4),
        st.lists(st.tuples(simple, simple), max_size=3),
        st.tuples(simple, simple),
        st.dictionaries(st.sampled_from(["k", "m_s", "g", "x", "q"]), simple, max_size=2),
    )


# ---- texts of numbers and files ----

NUMBERS = (
    "0", "0.2", "-1.9", "3", "1e-3", " 0.2 ", "+0.2", ".2", "2.", "0x10", "1_0", "1,5", "", " ", "nan", "inf",
    "-inf", "1e400", "-1e400", "1e300", "-1e300", "1e-320", "5e-324", "1e5", "\N{ARABIC-INDIC DIGIT THREE}", "3 A",
    "three", "9" * 400, "9" * 5000, "0." + "3" * 5000, "1e" + "9" * 5000, "--", "-", "0\0", "1\n", "\udc80", "True",
    "None",
)  # fmt: skip
"""Texts for a number."""
COUNTS = (
    "1", "2", "3", "7", "-1", "0", "2.0", "1e14", "2e1", "100000000000000", "1000000000000", "2147483647",
    "2147483648", "10000000", "1" + "0" * 400, "9" * 5000, "1_0", "+3", " 3", "", "x",
    "\N{ARABIC-INDIC DIGIT THREE}",
)  # fmt: skip
"""Texts for a count: few, or far too many."""
KEYS = ("name", "description", "m_eff", "m_s", "k", "L0", "c", "g", "u_max", "x1_min", "x1_max", "kk", "a.b", '"k"')
VALUES = (
    "25.0", "3", "1200", "0.4", "inf", "-inf", "nan", "-1", "true", '"text"', "'''a\nb'''", "[]", "[[1]]", "{}",
    "{ a = 1 }", "2020-01-01", "12:00:00", "1_000", "0x10", "1e400", "9" * 400, "9" * 5000, "[" * 3000 + "]" * 3000,
    "{a=" * 500 + "1" + "}" * 500, '"\\u0000"', '"\\ud800"', '"\x1b[31m"', "",
)  # fmt: skip


def robot_files() -> st.SearchStrategy[bytes]:
    """TOML files of a robot, right and wrong ones."""
    right = HOPPER.to_toml()
    lines = st.lists(st.tuples(st.sampled_from(KEYS), st.sampled_from(VALUES)), max_size=5)
    added = lines.map(lambda pairs: right + "".join(f"{key} = {value}\n" for key, value in pairs))
    alone = lines.map(lambda pairs: "".join(f"{key} = {value}\n" for key, value in pairs))
    other = lines.map(lambda pairs: "".join(with_value(right, *pair) for pair in pairs))
    return encoded(st.one_of(st.just(right), added, alone, other))


def with_value(text: str, key: str, value: str) -> str:
    """The text of a robot with another value for one key."""
    return "".join(f"{key} = {value}\n" if line.split(" ")[0] == key else line + "\n" for line in text.splitlines())


CELLS = (
    *NUMBERS[:30],
    '"0.1"',
    '"a,b"',
    "'1'",
    '"',
    '"0\n1"',
    "x" * 200_000,
    "#",
    ";",
    "\t",
    "0.1;0.2",
    "\x0b",
    "\u2028",
)
TITLES = (
    "time_s",
    "time_ms",
    "t_s",
    "x1_m",
    "x2_mm",
    "x_m",
    "current_A",
    "u_V",
    "force_N",
    "height",
    "x2",
    "_m",
    "",
    "1",
)


def tables() -> st.SearchStrategy[bytes]:
    """CSV files, of recordings and of heights: right ones with something wrong in them, and wrong ones."""
    right = st.sampled_from([_of_recording(DECAY), _of_recording(STEP), "0\n0.01\n", "hop,height\n0,0.02\n1,0.0\n"])
    cell = st.one_of(st.sampled_from(CELLS), st.text(max_size=4), st.floats().map(repr))
    row = st.lists(cell, max_size=4).map(",".join)
    head = st.lists(st.sampled_from(TITLES), max_size=4).map(",".join)
    made = st.tuples(head, st.lists(row, max_size=30)).map(lambda parts: "\n".join([parts[0], *parts[1]]))
    spoilt = st.tuples(right, st.integers(0, 10**4), row).map(lambda parts: _with_row(*parts))
    return encoded(st.one_of(right, spoilt, made))


def _of_recording(recording: Any) -> str:
    from hopform.identify._synthetic import to_csv

    return to_csv(recording)


def _with_row(text: str, at: int, row: str) -> str:
    lines = text.split("\n")
    lines[at % len(lines)] = row
    return "\n".join(lines)


def encoded(texts: st.SearchStrategy[str]) -> st.SearchStrategy[bytes]:
    """Texts in UTF-8, with a byte order mark, with other ends of lines, in other encodings, cut, with bytes added."""
    ways: tuple[Callable[[str], bytes], ...] = (
        lambda text: text.encode("utf-8", "replace"),
        lambda text: text.encode("utf-8", "replace"),
        lambda text: b"\xef\xbb\xbf" + text.encode("utf-8", "replace"),
        lambda text: text.replace("\n", "\r\n").encode("utf-8", "replace"),
        lambda text: text.replace("\n", "\r").encode("utf-8", "replace"),
        lambda text: text.encode("utf-16", "replace"),
        lambda text: text.encode("latin-1", "replace") + b"\xff",
        lambda text: text.encode("utf-8", "replace")[: len(text) // 2],
        lambda text: b"\0" + text.encode("utf-8", "replace"),
    )
    return st.tuples(texts, st.sampled_from(ways)).map(lambda parts: parts[1](parts[0]))


SYMBOLS = ("k_emf", "x", "m", "q", "i", "J", "2", "0", "0.5", "1e400", "1e-40", "9" * 500, "None", "'x'")
FIELDS = (
    '"k_emf"', '"k"', '"while"', '"x\\ny"', '"*/"', '"2"', "3", "None", '"unit"', '"N s/m"', '"nonnegative"', "-1.0",
)  # fmt: skip
MODEL = """from hopform.model import *
J = parameter("J", "kg m^2", "inertia", "positive")
k_emf = parameter({0}, {1}, {2}, {3})
q = coordinate({4}, "rad", {5}, "wheel")
i = current("i", limit={6})
viscous({7}, {8}, {9})
spring(q, 2)
torque(q, {10}, "motor")
{11}
"""
WRONG = (
    "", "", "", "raise SystemExit(3)", "1/0", "import nowhere", "spring = 3", "del J", "def", "\0", "exit()",
    "raise KeyError", "viscous(q, k_emf)", "stop(q, 1, 0)", "contact(q)", "friction(q, J)", "raise RecursionError",
    "\x1b[31m",
)  # fmt: skip


def model_files() -> st.SearchStrategy[bytes]:
    """Model files: a wheel with a motor, any of it replaced."""
    value = st.recursive(
        st.sampled_from(SYMBOLS),
        lambda part: st.tuples(part, st.sampled_from([" * ", " + ", " / ", "**2 * ", " - "]), part).map("".join),
        max_leaves=4,
    )
    right = ('"k_emf"', '"N m s/rad"', '"damping by the back-EMF"', '"nonnegative"', '"q"')
    return st.tuples(
        *(with_default(st.sampled_from(FIELDS), each) for each in right),
        with_default(value, "J"),
        with_default(value, "None"),
        with_default(value, "q"),
        with_default(value, "k_emf"),
        with_default(st.sampled_from(FIELDS), '"back-EMF"'),
        with_default(value, "3.5*i"),
        st.sampled_from(WRONG),
    ).map(lambda parts: MODEL.format(*parts).encode())


def with_default(strategy: st.SearchStrategy[str], default: str) -> st.SearchStrategy[str]:
    """Mostly what is right."""
    return st.one_of(st.just(default), st.just(default), st.just(default), strategy)


# ---- a folder of files, and command lines about them ----

LATIN_1 = os.fsdecode(b"R\xfcck.csv")
OUTPUTS = (
    "new.csv", "new.svg", "new.md", "new.html", "new.toml", "new.npz", "old.csv", "old.svg", "old.md", "folder",
    "folder/new.csv", "nowhere/new.csv", "robot.toml", "drop.csv", "heights.csv", "./robot.toml",
    "folder/../drop.csv", "link.csv", "link.toml", "dangling.csv", "loop.csv", "protected.csv", "protected/new.csv",
    "old.csv/new.csv", "", ".", "..", "/dev/null", "/dev/null/x", "/dev/full", "pipe", "a" * 252 + ".csv",
    "a" * 256, "a" * 5000, "-", "new.pdf", "new.xyz", LATIN_1, "a$b|c<d>.csv", "\x1b[31m.csv", "new\n.csv",
    "new\0.csv", "~/new.csv", "made", "made/deeper",
)  # fmt: skip
INPUTS = (
    "hopper_c", "hopper_b", "ideal", "robot.toml", "drop.csv", "decay.csv", "step.csv", "heights.csv", "link.csv",
    "link.toml", "bom.toml", "deep.toml", "digits.toml", "field.csv", "dangling.csv", "loop.csv", "folder",
    "nowhere.csv", "nowhere.toml", "pipe", "/dev/null", "/dev/zero", "/", "", "a" * 5000, "flat", "steps", "uniform",
    "drop:drop.csv", "decay:decay.csv", "x:y", LATIN_1, "hoper_c", "robot.toml\0", "..", "large.toml",
)  # fmt: skip


def furnish(folder: Path) -> None:
    """Files of every sort in a folder."""
    (folder / "robot.toml").write_text(HOPPER.to_toml())
    (folder / "bom.toml").write_text(HOPPER.to_toml(), "utf-8-sig")
    (folder / "deep.toml").write_text("k = " + "[" * 3000 + "]" * 3000)
    (folder / "digits.toml").write_text("k = " + "9" * 5000)
    (folder / "large.toml").write_text("#" * (2**20 + 1))
    (folder / "field.csv").write_text("x" * 131073)
    for name, recording in (("drop", DECAY), ("decay", DECAY), ("step", STEP)):
        (folder / f"{name}.csv").write_text(_of_recording(recording))
    (folder / "heights.csv").write_text("0\n0.01\n")
    for name in ("old.csv", "old.svg", "old.md", "protected.csv", LATIN_1):
        (folder / name).write_text("old")
    (folder / "folder").mkdir()
    (folder / "folder" / "inside").write_text("old")
    (folder / "protected").mkdir()
    (folder / "link.csv").symlink_to("drop.csv")
    (folder / "link.toml").symlink_to("robot.toml")
    (folder / "dangling.csv").symlink_to("nowhere/at_all.csv")
    (folder / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(folder / "pipe")
    (folder / "protected.csv").chmod(0o400)
    (folder / "protected").chmod(0o500)


WORDS = {
    "controller": _commands.ControllerName, "dtype": options.Precision,
    "kind": identify.Identification, "test": identify.Recordable,
}  # fmt: skip
"""The words that an option takes, by its name."""


def options_of(command: Any) -> Iterator[tuple[str, st.SearchStrategy[str] | None]]:
    """The options and arguments of a command, each with texts for it; None for a switch, "" for an argument's name."""
    for parameter in command.params:
        name = parameter.opts[0] if parameter.opts[0].startswith("-") else ""
        shown = (parameter.metavar or "").upper()
        words = WORDS.get(parameter.name, ())
        if getattr(parameter, "is_flag", False):
            yield name, None
        elif words:
            yield name, st.sampled_from([*map(str, words), "other", ""])
        elif name in ("--csv", "--hops-csv", "--npz", "--plot", "--report", "--out") or shown == "DIR":
            yield name, st.sampled_from(OUTPUTS)
        elif "FILE" in shown:
            yield name, st.sampled_from(INPUTS)
        elif shown == "N":
            yield name, st.sampled_from(COUNTS)
        else:
            extra = (
                "0:0,0.05:2",
                "0:0,0:0",
                "2000,300",
                "m_s=3",
                "k=1_0",
                "m_s",
                "k,b2",
                "b2=k",
                "x2=0.38",
                "q=1",
                "12",
                "12,13",
                "animation",
                "plain",
                "a" * 300,
            )
            yield name, st.sampled_from((*NUMBERS, *extra, "cmake", "huber", "0,1"))


@st.composite
def command_lines(draw: Any, commands: dict[str, Any]) -> list[str]:
    """A command with its arguments and up to four options, now and then something that is none."""
    name = draw(st.sampled_from(sorted(commands)))
    known = list(options_of(commands[name]))
    line = name.split()
    for _, texts in (each for each in known if not each[0]):
        line += [draw(texts) for _ in range(draw(st.integers(0, 2)) or 1)] if texts is not None else []
    needed = [each for each in known if each[0] in NEEDED.get(name, ())]
    some = draw(st.lists(st.sampled_from(known), max_size=4))
    for option, texts in (*needed, *(each for each in some if each[0])):
        right = NEEDED.get(name, {}).get(option)
        line.append(option)
        if texts is not None:
            line.append(right if right is not None and draw(st.integers(0, 9)) else draw(texts))
    if not draw(st.integers(0, 19)):
        line.insert(
            draw(st.integers(0, len(line))),
            draw(st.sampled_from(["--no-such-option", "-h", "--", "", "x", "--version"])),
        )
    return line


NEEDED = {
    "stance": {"--height": "0.2"}, "hop": {"--height": "0.2"}, "control": {"--height": "0.2", "--h-des": "0.2"},
    "reach": {"--heights": "3", "--currents": "3"}, "record": {"--duration": "0.5"},
}  # fmt: skip
"""Options without which a command has nothing to do, with what is right for them."""
