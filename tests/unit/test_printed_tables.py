"""The tables of the command line are the results of Python: each number under a heading with a unit, times that unit,
is the attribute that the heading names.
"""

import re

import numpy as np
import pytest
from rich.table import Table

import hopform
from hopform import _cli as cli
from hopform import terrain
from hopform.controllers import FeedForward

HOPPER = hopform.load_robot("hopper_c")
UNITS = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "s": 1.0, "ms": 1e-3, "m/s": 1.0, "A": 1.0, "N": 1.0, "J": 1.0, "kg": 1.0,
    "N/m": 1.0, "N s/m": 1.0, "N/A": 1.0, "m/s^2": 1.0, "1": 1.0,
}  # fmt: skip
"""What a unit of a heading is in SI units."""
ROUNDED = 6e-4
"""A table has four digits at least."""
LEDGER = {
    "work of the motor": "motor_work", "work of the offset force k c": "offset_work",
    "actuator, viscous friction": "viscous_1", "actuator, Coulomb friction": "coulomb_1",
    "body, viscous friction": "viscous_2", "body, Coulomb friction": "coulomb_2",
    "actuator, lost at stops": "stop_loss", "the actuator's work on the body": "spring_work",
}  # fmt: skip


@pytest.fixture
def printed(monkeypatch):
    """The tables of a command by their titles, and the lines around them."""

    def call(*arguments):
        parts = []
        monkeypatch.setattr("hopform._cli.output.show", parts.extend)
        assert cli.main([str(each) for each in arguments]) == 0
        tables = {str(part.title): columns_of(part) for part in parts if isinstance(part, Table)}
        return tables, "\n".join(str(part) for part in parts if not isinstance(part, Table))

    return call


def columns_of(table):
    return {str(column.header): list(map(str, column.cells)) for column in table.columns}


def refuse_difference(columns, expected):
    """AssertionError where a column with a unit is not there, is not expected, or has other numbers.

    expected: by heading without its unit, numbers in SI units; NaN where there is none.
    """
    shown = {}
    for heading, cells in columns.items():
        found = re.fullmatch(r"(.*?),? ?\[(.+)\] ?", heading)
        if found:
            name = found[1] + " " * heading.endswith(" ")
            shown[name] = [np.nan if cell in ("-", "") else float(cell) * UNITS[found[2]] for cell in cells]
    assert shown.keys() == expected.keys()
    for name, numbers in expected.items():
        np.testing.assert_allclose(shown[name], np.array(numbers, float), rtol=ROUNDED, atol=1e-9, err_msg=name)


def numbers_in(text, pattern):
    """The numbers of a line, by a pattern with a group for each."""
    found = re.search(pattern, text)
    assert found, (pattern, text)
    return [float(each) for each in found.groups()]


@pytest.mark.parametrize(
    ("start", "options"),
    [
        ({"v2": -1.9, "u": 2.0}, ()),
        ({"v2": -1.2, "x1": 0.02, "v1": -0.3, "x2": 0.38, "u": [(0.0, 1.0), (0.05, 3.0)], "horizon": 0.08}, ()),
        ({"v2": -0.3, "u": 1.0}, ()),
        ({"v2": -0.05, "u": 0.0, "horizon": 1.5}, ("--robot", "heavy.toml")),
    ],
    ids=["hop", "horizon", "rest", "seconds"],
)
def test_a_stance(printed, tmp_path, monkeypatch, start, options):
    monkeypatch.chdir(tmp_path)
    robot = HOPPER
    if options:
        robot = hopform.Robot(m_eff=25.0, m_s=90.0, k=600.0, L0=2.0, b1=300.0, b2=40.0, name="heavy", gamma2=-100.0)
        (tmp_path / "heavy.toml").write_text(robot.to_toml())
    u = start["u"]
    arguments = [part for name, value in start.items() if name != "u" for part in (f"--{name}", value)]
    arguments += ["--u", u] if isinstance(u, float) else ["--u-steps", ",".join(f"{t}:{value}" for t, value in u)]
    tables, text = printed("stance", *arguments, "--sensitivities", *options)
    stance = hopform.solve_stance(robot, **start)
    phases, ends = stance.phases, (stance.phases[0].state, stance.end)
    of_phases = {"from": [phase.start for phase in phases], "to": [phase.end for phase in phases]}
    of_phases |= {"u": [phase.u for phase in phases], "x1": [phase.state.x1 for phase in phases]}
    refuse_difference(tables["Phases and events"], of_phases)
    force = [robot.k * (each.x1 - each.x2 + robot.L0 + robot.c) for each in ends]
    energies = [stance.energy(t) for t in (0.0, stance.duration)]
    states = {name: [getattr(each, name) for each in ends] for name in hopform.State._fields}
    states |= {"N": np.round(force, 9), "E": [each.body for each in energies], "H": [each.total for each in energies]}
    refuse_difference(tables["State"], states)
    entries = stance.ledger(stance.duration)._asdict()
    ledger = dict(
        zip(tables["Energy ledger"][""], zip(*list(tables["Energy ledger"].values())[1:], strict=True), strict=True)
    )
    assert list(tables["Energy ledger"])[1:] == ["whole robot [J]", "body [J]"]
    for words, name in LEDGER.items():
        written = [float(cell) for cell in ledger[words] if cell]
        assert written == pytest.approx([entries[name]] * len(written), abs=6e-7), words
        assert written, words
    change = [after - before for before, after in zip(*([each.total, each.body] for each in energies), strict=True)]
    assert [float(cell) for cell in ledger["change of energy H, E"]] == pytest.approx(change, abs=6e-7)
    by, shown = (
        stance.sensitivities,
        tables[f"Sensitivities: change of the {'take-off' if stance.takeoff else 'ending'} per unit of"],
    )
    refuse_difference({name: cells for name, cells in shown.items() if name}, {
        row: [by[row, column] for column in by.columns] for row in by.rows
    })  # fmt: skip
    assert [cell.split(" [")[0] for cell in shown[""]] == list(by.columns)
    aed, most = numbers_in(text, r"AED (\S+) J; largest compression (\S+) cm")
    assert (aed, most / 100.0) == pytest.approx((stance.aed, stance.compression_max), rel=ROUNDED)
    motion = stance.grid(4001)[1]
    assert np.max(motion.x1 - motion.x2) + robot.L0 + robot.c == pytest.approx(most / 100.0, rel=ROUNDED)
    assert numbers_in(text, r"touchdown at (\S+) m/s") == [pytest.approx(start["v2"], rel=ROUNDED)]
    value, unit = re.search(r"(\d\S*) (m?s)\b(?!\S)", text.replace(",", "").split(";")[1]).groups()
    assert float(value) * UNITS[unit] == pytest.approx(stance.duration, rel=ROUNDED)
    if stance.takeoff is not None:
        assert numbers_in(text, r"apex (\S+) cm") == [pytest.approx(100.0 * stance.apex, rel=ROUNDED)]


@pytest.mark.parametrize(("height", "h_des"), [(0.2, 0.2), (0.2, 0.4), (0.05, 0.02)])
def test_a_command(printed, height, h_des):
    tables, text = printed("control", "--height", height, "--h-des", h_des, "--printed")
    v2 = hopform.touchdown_velocity(HOPPER, height)
    command = hopform.choose_current(HOPPER, v2=v2, h_des=h_des)
    forms = [{}, {"half": False}, {"half": False, "signed": True}, {"spring_coordinate": True}]
    forms.append({"half": False, "signed": True, "spring_coordinate": True})
    found = [command, *(hopform.choose_current_as_printed(HOPPER, v2=v2, h_des=h_des, **form) for form in forms)]
    off = [each.apex - h_des for each in found]
    shown = tables["Currents"]
    refuse_difference(
        {name: cells for name, cells in shown.items() if not name.startswith("off")},
        {"u": [each.u for each in found], "apex": [each.apex for each in found]},
    )
    assert [float(cell) / 100.0 for cell in shown["off by [cm]"]] == pytest.approx(off, rel=0.06, abs=1e-12)
    assert numbers_in(text, r"(\d+) stances were solved") == [command.solved]


def test_a_map(printed):
    tables, text = printed("reach", "--heights", 7, "--currents", 13)
    heights, currents = np.linspace(0.02, 0.4, 7), np.linspace(-HOPPER.u_max, HOPPER.u_max, 13)
    found = hopform.reachability(HOPPER, heights, currents)
    shown = dict(tables["Next apex"])
    gaps, share = shown.pop("gaps [A]"), shown.pop("limited by stroke")
    refuse_difference(shown, {
        "height": heights, "lowest": found.lowest, "at": found.u_lowest, "highest": found.highest,
        "at ": found.u_highest, "held by": found.hold,
    })  # fmt: skip
    for row, (written, part) in enumerate(zip(gaps, share, strict=True)):
        between = [] if written == "-" else [float(u) for gap in written.split(", ") for u in gap.split("..")]
        assert between == pytest.approx([u for gap in found.gaps(row) for u in gap], rel=6e-3)
        assert float(part.removesuffix(" %")) == pytest.approx(100.0 * found.limited[row].mean(), abs=0.5)
    points = found.fixed_points
    shown = dict(tables["Fixed points"])
    multipliers = [float(each) for each in shown.pop("multiplier")]
    assert multipliers == pytest.approx([point.multiplier for point in points], abs=6e-5)
    refuse_difference(shown, {"u": [point.u for point in points], "height": [point.height for point in points]})
    assert f"{np.isfinite(found.hold).sum()} of 7 heights can be held" in text
    assert len(points) > 1 and any(gap != "-" for gap in gaps)


def test_a_run(printed):
    ground = ("--terrain", "uniform", "--size", 0.02, "--hops", 6, "--seed", 3)
    tables, text = printed("hop", "--height", 0.2, *ground, "--controller", "exact", "--h-des", 0.2)
    run = hopform.simulate(HOPPER, terrain.uniform(6, 0.02, seed=3), FeedForward(0.2), height=0.2)
    of = run.hops
    refuse_difference(tables["Hops"], {
        "ground": [hop.ground for hop in of], "from": [hop.height for hop in of],
        "at": [hop.touchdown_time for hop in of],
        "u": [hop.u for hop in of], "stance": [hop.stance.duration for hop in of], "apex": [hop.apex for hop in of],
        "AED": [hop.stance.aed for hop in of], "impact": [-hop.energy_lost_at_impact for hop in of],
    })  # fmt: skip
    assert tables["Hops"]["hop"] == [str(n + 1) for n in range(6)]
    flights = [*(hop.flight for hop in of[1:]), run.last]
    gains = [(min(each), max(each)) for each in zip(*(flight.gains for flight in flights), strict=True)]
    assert numbers_in(text, r"Kp = (\S+) to (\S+) N/m, Kd = (\S+) to (\S+) N s/m") == pytest.approx(
        [end for each in gains for end in each], rel=ROUNDED
    )
