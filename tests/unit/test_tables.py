"""What is printed has an oracle: every cell of every table is parsed, in the unit of its head, and compared with the
object's own value; so is every number of the lines beside the tables.
"""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hopform
import hopform.hopping
import hopform.identify
from hopform import _front as cli
from hopform._cli import output, tables
from hopform.hopping.controllers import FeedForward
from hopform.hopping.terrain import uniform
from hopform.identify import _report as report

HOPPER = hopform.load_robot("hopper_c")
FACTORS = {"cm": 100.0, "mm": 1000.0, "ms": 1000.0, "%": 100.0}
"""Numbers of a table to one of SI, where they are not the same."""
CELL = re.compile(r"\S+(?: \S+)*")


def tables_of(text):
    """Tables as rows by their heads, under the line before them; two spaces or more separate columns."""
    lines, found = ["", *text.splitlines(), ""], {}
    rules = [n for n, each in enumerate(lines) if each.startswith("───")]
    for n, following in zip(rules, [*(rule - 2 for rule in rules[1:]), len(lines)], strict=True):
        heads = list(CELL.finditer(lines[n - 1]))
        # A head that stands there twice is followed by that before it.
        names = [
            h[0] if h[0] not in [e[0] for e in heads[:k]] else f"{h[0]}, {heads[k - 1][0]}" for k, h in enumerate(heads)
        ]
        rows = found.setdefault(lines[n - 2].strip(), [])
        for place in range(n + 1, following):
            row = dict.fromkeys(names, "")
            cells = list(CELL.finditer(lines[place]))
            above = [[name for name, head in zip(names, heads, strict=True) if meet(each, head)] for each in cells]
            if any(len(each) > 1 for each in above) or not (cells or lines[place + 1].startswith("sum")):
                break  # a line of words, or the end
            if cells:
                rows.append(row | {"".join(name): cell[0] for name, cell in zip(above, cells, strict=True)})
    return found


def meet(one, other):
    """Whether two cells stand above each other."""
    return one.start() < other.end() and other.start() < one.end()


def near(cell, value, unit):
    """A cell has at least four digits of a value, those behind the fourth decimal left out; "-" is none."""
    factor = FACTORS.get(unit, 1.0)
    if math.isnan(value):
        assert cell == "-"
    else:
        assert float(cell) == pytest.approx(factor * value, rel=5.1e-4, abs=6e-5)


def check(rows, columns, objects):
    """Each row against its object: a number for a head with a unit, in SI, else the words."""
    assert len(rows) == len(objects) > 0
    for row, each in zip(rows, objects, strict=True):
        assert row.keys() == columns.keys()
        for head, value in columns.items():
            unit = re.search(r"\[(.*)\]", head)
            if isinstance(expected := value(each), str):
                assert row[head] == expected, head
            else:
                near(row[head], expected, unit[1] if unit else "")


def numbers(text, *values):
    """The numbers with a unit of a line, against values in SI in their order."""
    found = re.findall(r"([-+]?\d[\d.e+-]*) (cm|mm|ms|m/s\^2|m/s|m|s|A|J|N)\b", text)
    assert len(found) == len(values), text
    for (number, unit), value in zip(found, values, strict=True):
        near(number, value, unit)


@pytest.fixture
def printed(capsys):
    """What a command prints: its tables, and its lines."""

    def call(*arguments):
        assert cli.main([str(argument) for argument in arguments]) == 0
        text, errors = capsys.readouterr()
        assert errors == ""
        return tables_of(text), text.splitlines()

    return call


def line(lines, begin):
    (found,) = [each for each in lines if each.startswith(begin)]
    return found


# ---- a stance ----

STARTS = {
    "takes off": (("--height", 0.2, "--u", 3), {"v2": hopform.touchdown_velocity(HOPPER, 0.2), "u": 3.0}),
    "steps": (
        ("--height", 0.02, "--u-steps", "0:0,0.05:2,0.1:-3"),
        {"v2": hopform.touchdown_velocity(HOPPER, 0.02), "u": [(0.0, 0.0), (0.05, 2.0), (0.1, -3.0)]},
    ),
    "meets its stop": (
        ("--v2", -1.9, "--x1", 0.07, "--v1", 0.3, "--u", 2),
        {"v2": -1.9, "x1": 0.07, "v1": 0.3, "u": 2.0},
    ),
    "is cut short": (
        ("--v2", -1.2, "--x1", 0.02, "--v1", -0.3, "--x2", 0.38, "--u-steps", "0:1,0.05:3", "--horizon", 0.08),
        {"v2": -1.2, "x1": 0.02, "v1": -0.3, "x2": 0.38, "u": [(0.0, 1.0), (0.05, 3.0)], "horizon": 0.08},
    ),
    "rests": (("--v2", -0.3, "--u", 1), {"v2": -0.3, "u": 1.0}),
    "takes seconds": (
        ("--robot", "soft.toml", "--v2", -0.05, "--u", 0, "--horizon", 1.5), {"v2": -0.05, "u": 0.0, "horizon": 1.5},
    ),
}  # fmt: skip
SOFT = hopform.Robot(m_eff=25.0, m_s=9.0, k=60.0, L0=5.0, b1=30.0, b2=4.0, name="soft")
ACTUATOR = {1: "extends", -1: "retracts", 0: "held"}
BODY = {1: "slips up", -1: "slips down", 0: "held"}


@pytest.fixture(params=STARTS)
def stance(request, printed, tmp_path, monkeypatch):
    """A stance, and what `hopform stance` prints of it."""
    options, start = STARTS[request.param]
    monkeypatch.chdir(tmp_path)
    Path("soft.toml").write_text(SOFT.to_toml())
    robot = SOFT if "--robot" in options else HOPPER
    return hopform.solve_stance(robot, **start), *printed("stance", *options, "--sensitivities")


def test_the_phases_of_a_stance_are_printed(stance):
    solved, shown, _ = stance
    times = f"[{'ms' if solved.duration < 1.0 else 's'}]"
    words = {event.time: event.kind for event in solved.events}
    for row, phase in zip(shown["Phases and events"], solved.phases, strict=True):
        near(row[f"from {times}"], phase.start, times[1:-1])
        near(row[f"to {times}"], phase.end, times[1:-1])
        near(row["u [A]"], phase.u, "A")
        near(row["x1 [m]"], phase.state.x1, "m")
        near(row["x2 [m]"], phase.state.x2, "m")
        assert row["body"] == BODY[phase.mode_2]
        assert row["actuator"] == ACTUATOR[phase.mode_1] or (phase.mode_1 == 0 and row["actuator"] == "at stop")
        kind = words.get(phase.start, "")
        steps = "step of u" if phase.start in [t for t, _ in solved.u] else ""
        begin = {"x1": "actuator", "x2": "body"}[kind[:2]] if kind else steps if phase.start else "touchdown"
        assert row["begins with"].split(" ")[0] == begin.split(" ")[0]


def test_the_states_of_a_stance_are_printed(stance):
    solved, shown, _ = stance
    robot = solved.robot
    columns = {
        "": lambda t: "touchdown" if t == 0.0 else solved.status,
        **{f"{name} [{unit}]": lambda t, name=name: float(getattr(solved.at(t), name))
           for name, unit in {"x1": "m", "v1": "m/s", "x2": "m", "v2": "m/s"}.items()},
        **{f"{name} [N]": lambda t, name=name: float(solved.forces(t)[name])
           for name in ("friction_x1", "stop_x1", "friction_x2") if name in solved.forces(0.0)},
        "input [N]": lambda t: -robot.gamma2 * solved.current(t),
        "contact [N]": lambda t: robot.k * float(solved.at(t).x1 - solved.at(t).x2 + robot.L0 + robot.c),
        "E [J]": lambda t: float(solved.energy(t).body),
        "H [J]": lambda t: float(solved.energy(t).total),
    }  # fmt: skip
    check(shown["State and forces"], columns, [0.0, solved.duration])


def test_the_ledger_of_a_stance_is_printed(stance):
    solved, shown, _ = stance
    ledger, rows = solved.ledger(solved.duration), {row[""]: row for row in shown["Energy ledger"]}
    of_body = ("spring_work", "viscous_2", "coulomb_2")
    for name, words in solved.robot.solver.facts.ledger.items():
        whole, body = rows[words]["H [J]"], rows[words]["E [J]"]
        value = float(getattr(ledger, name))
        assert (body != "") == (name in of_body) and (whole != "") == (name != "spring_work")
        for cell in filter(None, (whole, body)):
            near(cell, value, "J")
    before, after = solved.energy(0.0), solved.energy(solved.duration)
    for head, change in {"H [J]": after.total - before.total, "E [J]": after.body - before.body}.items():
        for words in ("sum", "change"):
            near(rows[words][head], float(change), "J")
        assert abs(float(rows["difference"][head])) < 1e-12


def test_the_derivatives_of_a_stance_are_printed(stance):
    solved, shown, _ = stance
    (rows,) = [each for words, each in shown.items() if words.startswith("Sensitivities")]
    by = solved.sensitivities
    for row, name in zip(rows, by.columns, strict=True):
        assert row.pop("").split(" [")[0] == name
        for (head, cell), of in zip(row.items(), by.rows, strict=True):
            value = by[of, name]
            assert head.split(" [")[0] == of
            assert cell == "-" if math.isnan(value) else float(cell) == pytest.approx(value, rel=5.1e-5)


def test_the_lines_of_a_stance_have_its_numbers(stance):
    """The largest compression is that of a fine grid of times."""
    solved, _, lines = stance
    most = float(np.max(solved.compression(np.linspace(0.0, solved.duration, 20_001))))
    assert most > 0.01
    apex = [solved.apex] if solved.takeoff else []
    numbers(next(each for each in lines if "AED" in each), *apex, solved.aed, most)
    first = solved.phases[0].state
    start = [each for each in (first.x1, first.v1, first.x2, first.v2) if each]
    numbers(lines[0], *start, max(u for _, u in solved.u), solved.duration, *apex)


def test_a_stance_is_the_motion_from_its_drop(printed):
    """`hopform stance` and `hopform motion` print the same of one start."""
    drop = hopform.touchdown_velocity(HOPPER, 0.2)
    stance = printed("stance", "--height", 0.2, "--u", 3, "--sensitivities")
    assert printed("motion", "--start", f"v2={drop!r}", "--u", 3, "--sensitivities") == stance


# ---- a run, the controller, a map ----


def test_the_hops_of_a_run_are_printed(printed):
    options = ("--terrain", "uniform", "--seed", 3, "--controller", "exact", "--h-des", 0.2, "--hops", 5)
    shown, lines = printed("hop", "--height", 0.15, *options)
    run = hopform.hopping.simulate(HOPPER, uniform(5, 0.02, seed=3), FeedForward(0.2), height=0.15)
    columns = {
        "hop": lambda hop: str(hop.index + 1),
        "ground [cm]": lambda hop: hop.ground,
        "from [cm]": lambda hop: hop.height,
        "at [s]": lambda hop: hop.touchdown_time,
        "u [A]": lambda hop: hop.u,
        "stance [ms]": lambda hop: hop.stance.duration,
        "ending": lambda hop: hop.stance.status,
        "apex [cm]": lambda hop: float(hop.takeoff_time and run.at(hop.takeoff_time).x2)
        + float(run.at(hop.takeoff_time).v2) ** 2 / (2.0 * HOPPER.g) - HOPPER.L0 - HOPPER.c,
        "AED [J]": lambda hop: float(np.diff(hop.stance.energy([0.0, hop.stance.duration]).body)[0]),
        "impact [J]": lambda hop: -0.05 / 0.95 * HOPPER.m_s * float(hop.touchdown.v2) ** 2 / 2.0,
        "stops": lambda hop: "hits a stop" if hop.hits_stop else "",
    }  # fmt: skip
    check(shown["Hops"], columns, run.hops)
    gains = [each.gains for each in (*(hop.flight for hop in run.hops[1:]), run.last)]
    found = re.findall(r"(K[pd]) = (\S+) to (\S+) N", line(lines, "Return in flight"))
    for name, low, high in found:
        near(low, min(getattr(each, name) for each in gains), "")
        near(high, max(getattr(each, name) for each in gains), "")
    assert [name for name, _, _ in found] == ["Kp", "Kd"]


@pytest.mark.parametrize(("height", "h_des"), [(0.2, 0.21), (0.2, 0.4), (0.05, 0.02)])
def test_the_currents_of_the_controllers_are_printed(printed, height, h_des):
    shown, lines = printed("control", "--height", height, "--h-des", h_des, "--printed")
    start = {"v2": hopform.touchdown_velocity(HOPPER, height), "h_des": h_des}
    found = {"exact": hopform.choose_current(HOPPER, **start)}
    found |= {
        words: hopform.choose_current_as_printed(HOPPER, **start, **options)
        for words, options in tables.PRINTED.items()
    }
    apexes = {name: hopform.solve_stance(HOPPER, v2=start["v2"], u=each.u).apex for name, each in found.items()}
    columns = {
        "controller": str,
        "u [A]": lambda name: found[name].u,
        "apex [cm]": lambda name: apexes[name],
        "error [cm]": lambda name: float(f"{100.0 * (apexes[name] - h_des):.2g}") / 100.0,
    }
    check(shown["Currents"], columns, list(found))
    assert line(lines, f"{found['exact'].solved} stances were solved")


def test_a_map_is_printed(printed):
    shown, lines = printed("reach", "--heights", 7, "--currents", 13)
    found = hopform.reachability(HOPPER, np.linspace(0.02, 0.4, 7), np.linspace(-3.0, 3.0, 13))
    gaps = [", ".join(f"{low:.3g}..{high:.3g}" for low, high in found.gaps(row)) or "-" for row in range(7)]
    assert len(found.fixed_points) > 1 and set(gaps) != {"-"}
    of_heights = {
        "height [cm]": lambda row: found.heights[row],
        "lowest [cm]": lambda row: found.lowest[row],
        "at [A]": lambda row: found.u_lowest[row],
        "highest [cm]": lambda row: found.highest[row],
        "at [A], highest [cm]": lambda row: found.u_highest[row],
        "held by [A]": lambda row: found.hold[row],
        "gaps [A]": lambda row: gaps[row],
        "limited by stroke": lambda row: f"{100.0 * np.mean(found.limited[row]):.0f} %",
    }
    check(shown["Next apex"], of_heights, range(7))
    columns = {
        "u [A]": lambda point: point.u,
        "height [cm]": lambda point: point.height,
        "multiplier": lambda point: point.multiplier,
        "stability": lambda point: "stable" if abs(point.multiplier) < 1.0 else "unstable",
    }
    check(shown["Fixed points"], columns, found.fixed_points)
    assert line(lines, f"hopper_c: {np.isfinite(found.hold).sum()} of 7 heights can be held")


def test_robots_are_printed(printed):
    shown, _ = printed("robots")
    (rows,) = shown.values()
    robots = {name: hopform.load_robot(name) for name in hopform.ROBOTS}
    for row, field in zip(rows, hopform.Robot.all_fields(), strict=True):
        assert (row["parameter"], row["unit"]) == (field.name, "" if field.unit == "1" else field.unit)
        for name, robot in robots.items():
            value = getattr(robot, field.name)
            assert row[name] == "none" if math.isinf(value) else float(row[name]) == pytest.approx(value, rel=1e-6)


# ---- what identification prints ----


def shown_of(answer, capsys):
    output.show(report.tables_of(answer))
    text = capsys.readouterr().out
    return tables_of(text), text.splitlines()


@pytest.fixture(scope="module")
def fit():
    recordings = [hopform.identify.record(HOPPER, "decay", height=0.04, duration=1.0, seed=seed) for seed in (3, 4)]
    return hopform.identify.fit_robot(decays=recordings, known={"m_s": 3.0}, holdout=True)


def test_a_fit_is_printed(capsys, fit):
    shown, _ = shown_of(fit, capsys)
    values = {each.name: (each.value, each.low, each.high, each.unit, each.method) for each in fit.estimates}
    values |= {name: (value, None, None, "", "known") for name, value in fit.known.items()}
    for row, (name, (value, low, high, unit, by)) in zip(shown["Parameters"], values.items(), strict=True):
        assert (row["parameter"], row["unit"], row["by"]) == (name, unit, by)
        half, ends = (0.0, []) if low is None else (0.5 * (high - low), [low, high])
        two_digits = {"abs": 0.051 * half + 1e-12, "rel": 0.0 if half else 5.1e-6}
        assert float(row["value"]) == pytest.approx(value, **two_digits)
        assert [float(each) for each in row["95 % interval"].split(" .. ") if each] == pytest.approx(ends, **two_digits)
    columns = {
        "recording": lambda trace: trace.label,
        "samples": lambda trace: str(trace.time.size),
        "rms": lambda trace: 1000.0 * float(np.sqrt(np.mean((trace.predicted - trace.measured) ** 2))),
        "rms, viscous alone": lambda trace: 1000.0 * float(np.sqrt(np.mean((trace.old - trace.measured) ** 2))),
        "hold-out": lambda trace: 1000.0 * trace.holdout,
        "quantum": lambda trace: 1000.0 * trace.quantum,
        "unit": lambda _: "mm",
        "autocorrelation": lambda trace: round(trace.tests.autocorrelation, 2),
        "white": lambda trace: "yes" if trace.tests.white else "no",
    }
    check(shown["Recordings"], columns, fit.traces)


# ---- on a terminal ----

ANSI = re.compile(r"\x1b\[[0-9;]*m")
PRINTED = (
    "model list", "hop --height 0.2 --u 3", "stance --height 0.2 --u 3 --explain --sensitivities", "equations", "robots",
    "robots hopper_c", "motion --start y=0.02", "control --height 0.2 --h-des 0.2 --printed", "reach --heights 5",
    "model check hopper", "record drop --plan --seed 1",
)  # fmt: skip
"""Commands whose tables a terminal of 60 or 80 columns used to cut."""


@pytest.mark.parametrize(
    "command", [PRINTED[0], PRINTED[1], *(pytest.param(each, marks=pytest.mark.sliced) for each in PRINTED[2:])]
)
def test_a_narrow_terminal_shows_every_word(capsys, monkeypatch, command, tmp_path):
    """Tables that are too wide stand below each other, and what a pipe gets is there, within the terminal's columns."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    assert cli.main(command.split()) == 0
    piped = capsys.readouterr().out
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich then takes the output for a terminal
    for columns in (60, 80, 120):
        monkeypatch.setenv("COLUMNS", str(columns))
        assert cli.main(command.split()) == 0
        shown = ANSI.sub("", capsys.readouterr().out)
        assert set(re.sub("─+", "", piped).split()) <= set(shown.split())
        assert "…" not in shown and max(map(len, shown.splitlines())) <= columns


def test_a_pipe_and_a_column_wider_than_the_terminal_get_whole_lines(capsys, monkeypatch):
    head, rows = ("name", "where", "title"), [("one", "/long" * 60, "some words " * 30), ("two", "here", "there")]
    output.show([output.table("", head, rows, head)])
    lines = capsys.readouterr().out.splitlines()
    assert [CELL.findall(line) for line in (lines[0], *lines[2:])] == [
        [*head],
        *([word.strip() for word in row] for row in rows),
    ]
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "80")
    output.show([output.table("", head, rows, head)])
    shown = ANSI.sub("", capsys.readouterr().out)
    assert f"one   {rows[0][1]}" in shown and "some words some words" in shown and "…" not in shown


def test_a_value_without_an_interval_has_no_infinity(capsys, fit):
    first, second, *others = fit.estimates
    bare = first._replace(low=-math.inf, high=math.inf, method="not explained")
    half_open = second._replace(high=math.inf)
    shown, lines = shown_of(replace(fit, estimates=(bare, half_open, *others)), capsys)
    rows = {row["parameter"]: row["95 % interval"] for row in shown["Parameters"]}
    assert rows[bare.name] == "-" and rows[half_open.name].endswith(" .. inf")
    assert not any("-inf" in line for line in lines)
    assert f"{bare.name} = {bare.value:.4g} (no interval)" in str(replace(fit, estimates=(bare,)))
