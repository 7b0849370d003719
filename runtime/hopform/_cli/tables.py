"""Answers as text: tables for people, records for JSON, CSV for spreadsheets; docs/json.md explains the last two.

JSON and CSV are in SI units and A; tables are in the units in which a hopper is talked about, which their heads name.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

import hopform
from hopform import Energy, Equation, Hop, Ledger, Phase, Robot, Run, Sensitivities, Stance, State
from hopform._solver.package import LEDGER_OF_BODY, LEDGER_OF_ROBOT
from hopform._stance import aed_of

Record = dict[str, Any]

MOST_ROWS = 40
"""A table that would be longer shows its first and its last rows."""

READABLE = 90
"""Columns of a paragraph, however wide the line may be."""

PROSE = ("title", "meaning")
"""Columns of a table that may be broken into lines where a terminal is narrow."""

ENDINGS = {
    "takeoff": "takes off after",
    "rest": "comes to rest after",
    "horizon": "is still on the ground after",
    "too_many_phases": "has had the allowed number of phases after",
}
EVENTS = {
    "x1_reverses": "actuator reverses",
    "x1_sticks": "actuator sticks",
    "x1_slips": "actuator slips",
    "x1_hits_stop": "actuator hits stop",
    "x2_reverses": "body reverses",
    "x2_sticks": "body sticks",
    "x2_slips": "body slips",
}
LEDGER = {
    "motor_work": "work of the motor",
    "offset_work": "work of the offset force k c",
    "viscous_1": "actuator, viscous friction",
    "coulomb_1": "actuator, Coulomb friction",
    "viscous_2": "body, viscous friction",
    "coulomb_2": "body, Coulomb friction",
    "stop_loss": "actuator, lost at stops",
    "spring_work": "the actuator's work on the body",
}
OF_ROBOT = (*LEDGER_OF_ROBOT, "stop_loss")
OUTCOMES = {
    "completed": "hops on",
    "stopped": "stays on the ground",
    "tripped": "trips over the ground ahead",
}
OURS = "Values of shipped robots are this project's own: the paper gives none."


# ---- words ----


def name_of(robot: Robot) -> str:
    """What a robot is called; one made in Python may have no name."""
    return robot.name or "robot"


def mode_of_actuator(phase: Phase, robot: Robot) -> str:
    """What the actuator does in a phase."""
    if phase.mode_1 == 0 and robot.x1_min == robot.x1_max:
        return "locked"
    if phase.mode_1 == 0 and phase.state.x1 in (robot.x1_min, robot.x1_max):
        return "at stop"
    return mode(phase.mode_1)


def mode(side: int) -> str:
    """What a mass with this sign of its velocity does."""
    return {1: "slips up", 0: "held", -1: "slips down"}[side]


def current(steps: Sequence[tuple[float, float]]) -> str:
    """The current of a stance in words."""
    if len(steps) == 1:
        return f"u = {steps[0][1]:g} A"
    return f"u in {len(steps)} steps, {min(u for _, u in steps):g} to {max(u for _, u in steps):g} A"


def ending(stance: Stance) -> str:
    """How a stance ends, in one sentence."""
    scale, unit = unit_of_time(stance.duration)
    words = f"{ENDINGS[stance.status]} {stance.duration * scale:.5g} {unit}"
    return words if math.isnan(stance.apex) else f"{words}, apex {100.0 * stance.apex:.4g} cm"


def unit_of_time(longest: float) -> tuple[float, str]:
    """Milliseconds for what is over within a second."""
    return (1000.0, "ms") if longest < 1.0 else (1.0, "s")


def value_of(value: float, unit: str) -> str:
    """A parameter as a table shows it."""
    return "none" if math.isinf(value) else f"{value:.6g}" + (f" {unit}" if unit and unit != "1" else "")


# ---- tables ----


def table(title: str, *columns: str, words: Iterable[str] = ()) -> Table:
    """A table without rows; columns hold numbers, at the right, but for those in `words`."""
    made = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    made.show_edge, made.padding = False, (0, 1, 0, 0)
    for column in columns:
        made.add_column(column, justify="left" if column in words else "right", no_wrap=column not in PROSE)
    return made


def add_rows(made: Table, rows: Sequence[Sequence[str]]) -> None:
    """Fill a table; in the middle of a long one, say how many rows are left out."""
    left_out = len(rows) - MOST_ROWS
    if left_out <= 0:
        shown = list(rows)
    else:
        half = MOST_ROWS // 2
        shown = [*rows[:half], ["..."] * len(rows[0]), *rows[-half:]]
        made.caption = f"{left_out} rows left out; --json has them all"
    for row in shown:
        made.add_row(*row)


def robots(shown: Sequence[Robot], *, with_meaning: bool) -> Iterator[RenderableType]:
    """Robots side by side, a row per parameter."""
    meaning = ("meaning",) if with_meaning else ()
    names = [name_of(robot) for robot in shown]
    made = table("", "parameter", *names, "unit", *meaning, words=("parameter", "unit", "meaning"))
    for field in Robot.fields():
        values = [value_of(getattr(robot, field.name), "") for robot in shown]
        made.add_row(
            field.name, *values, "" if field.unit == "1" else field.unit, *([field.meaning] if meaning else [])
        )
    yield made
    yield ""
    for robot in shown:
        if robot.description:
            yield f"{robot.name}: {robot.description}"
    if any(robot.name in hopform.ROBOTS for robot in shown):
        yield OURS


def equations(shown: Sequence[Equation]) -> Iterator[RenderableType]:
    """The register, a row per equation."""
    made = table("", "no.", "title", "verdict", words=("title", "verdict"))
    for each in shown:
        made.add_row(f"({each.number})", each.title, each.verdict)
    yield made
    yield ""
    yield "`hopform equations N` shows how equation N is printed, how it is derived, and what differs."


def equation(shown: Equation) -> Iterator[RenderableType]:
    """All that the register holds on one equation."""
    yield Text(f"({shown.number}) {shown.title}: {shown.verdict}", style="bold")
    made = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    made.add_column(style="bold", no_wrap=True)
    made.add_column(max_width=READABLE)
    rows = {
        "as printed": shown.printed,
        "as derived": shown.derived,
        "reason": shown.reason,
        "computed by": "\n".join(shown.computed_by),
    }
    for name, text in rows.items():
        made.add_row(name, text)
    yield ""
    yield made


def stance(solved: Stance, with_sensitivities: bool = False) -> Iterator[RenderableType]:
    """A stance: its ending, phases with the events that begin them, states and energies; derivatives where asked for."""
    first = solved.phases[0].state
    head = (
        f"{name_of(solved.robot)}: touchdown at {float(first.v2) + 0.0:.4g} m/s, {current(solved.u)}; {ending(solved)}"
    )
    yield Text(head, style="bold")
    parts = [phases(solved), states(solved), ledger(solved)]
    for part in [*parts, sensitivities(solved)] if with_sensitivities else parts:
        yield ""
        yield part
    yield ""
    yield f"AED {solved.aed:+.6g} J; solved by the {solved.backend} back end in {solved.dtype}"


def phases(solved: Stance) -> Table:
    """The chain of phases; what begins each one is its event."""
    scale, unit = unit_of_time(solved.duration)
    columns = (f"from [{unit}]", f"to [{unit}]", "begins with", "actuator", "body", "u [A]", "x1 [cm]")
    made = table("Phases and events", *columns, words=columns[2:5])
    begins = beginnings(solved)
    rows = [
        (
            f"{phase.start * scale:.6g}",
            f"{phase.end * scale:.6g}",
            event,
            mode_of_actuator(phase, solved.robot),
            mode(phase.mode_2),
            f"{phase.u:.4g}",
            f"{100.0 * float(phase.state.x1):.4g}",
        )
        for phase, event in zip(solved.phases, begins, strict=True)
    ]
    add_rows(made, rows)
    return made


def beginnings(solved: Stance) -> list[str]:
    """What begins each phase: touchdown, events, or a step of the current."""
    events: dict[float, list[str]] = {}
    for event in solved.events:
        events.setdefault(event.time, []).append(EVENTS[event.kind])
    steps = {t for t, _ in solved.u[1:]}
    found = ["touchdown"]
    for phase in solved.phases[1:]:
        waiting = events.get(phase.start, [])
        found.append(waiting.pop(0) if waiting else "current steps" if phase.start in steps else "")
    return found


def states(solved: Stance) -> Table:
    """Where the stance begins and ends."""
    columns = ("", "x1 [cm]", "v1 [m/s]", "x2 [cm]", "v2 [m/s]", "F [N]", "E [J]", "H [J]")
    made = table("State", *columns, words=("",))
    for name, t in (("touchdown", 0.0), (solved.status.replace("_", " "), solved.duration)):
        at, energy = solved.at(t), solved.energy(t)
        force = solved.robot.k * float(solved.compression(t))
        numbers = (100.0 * at.x1, at.v1, 100.0 * at.x2, at.v2, force, energy.body, energy.total)
        made.add_row(name, *(f"{round(float(number), 9) + 0.0:.5g}" for number in numbers))
    return made


def ledger(solved: Stance) -> Table:
    """Where the energy went, and whether it adds up."""
    made = table("Energy ledger", "", "whole robot [J]", "body [J]", words=("",))
    entries = {name: float(value) for name, value in solved.ledger(solved.duration)._asdict().items()}
    parts = (OF_ROBOT, LEDGER_OF_BODY)
    for name, words in (LEDGER | {name: name.replace("_", " ") for name in entries if name not in LEDGER}).items():
        made.add_row(words, *(f"{entries[name] + 0.0:+.6f}" if name in part else "" for part in parts))
    made.add_section()
    sums = [math.fsum(entries[name] for name in part) for part in parts]
    before, after = solved.energy(0.0), solved.energy(solved.duration)
    changes = [float(after.total) - float(before.total), float(after.body) - float(before.body)]
    made.add_row("sum", *(f"{each:+.6f}" for each in sums))
    made.add_row("change of energy H, E", *(f"{each:+.6f}" for each in changes))
    made.add_row("difference", *(f"{a - b:.1e}" for a, b in zip(sums, changes, strict=True)))
    return made


def sensitivities(solved: Stance) -> Table:
    """What the take-off depends on: a row per input, a column per result, "-" where there is no derivative."""
    derivatives = solved.sensitivities
    units = {"x1": "m", "v1": "m/s", "x2": "m", "v2": "m/s", "u": "A"}
    units |= {field.name: field.unit for field in Robot.fields()}
    of = {"T": "s", "apex": "m", "aed": "J"}
    heads = [f"{row} [{of.get(row) or units[row]}]" for row in derivatives.rows]
    made = table("Sensitivities: change of the take-off per unit of", "", *heads, words=("",))
    for column in derivatives.columns:
        values = [derivatives[row, column] for row in derivatives.rows]
        made.add_row(
            f"{column} [{units[column]}]", *("-" if math.isnan(value) else f"{value + 0.0:.5g}" for value in values)
        )
    return made


def run(solved: Run, designed: bool) -> Iterator[RenderableType]:
    """A run: a row per hop; whether the gains of the return in flight were designed for each."""
    count = len(solved.hops)
    head = f"{name_of(solved.robot)}: {OUTCOMES[solved.status]} after {count} touchdowns"
    yield Text(head.replace(" 1 touchdowns", " 1 touchdown"), style="bold")
    yield ""
    numbers = ("hop", "ground [cm]", "from [cm]", "at [s]", "u [A]", "stance [ms]")
    columns = (*numbers, "ending", "apex [cm]", "AED [J]", "impact [J]", "stops")
    made = table("Hops", *columns, words=("ending", "stops"))
    add_rows(made, [hop_row(each) for each in solved.hops])
    yield made
    yield ""
    yield "Heights are hop heights over the terrain's zero: 0 where the unloaded leg touches ground of height 0."
    yield from gains_of(solved, designed)


def gains_of(solved: Run, designed: bool) -> Iterator[str]:
    """The law of the actuator in the flights between the hops, in words."""
    flights = [each for each in (*(hop.flight for hop in solved.hops[1:]), solved.last) if each is not None]
    if not flights:
        return
    ranges = [sorted({getattr(flight.gains, name) for flight in flights}) for name in ("Kp", "Kd")]
    kp, kd = (f"{each[0]:.4g}" if each[0] == each[-1] else f"{each[0]:.4g} to {each[-1]:.4g}" for each in ranges)
    yield f"Return in flight, gains {'designed for each' if designed else 'as given'}: Kp = {kp} N/m, Kd = {kd} N s/m."


def hop_row(hop: Hop) -> tuple[str, ...]:
    numbers = (100.0 * hop.height, hop.touchdown_time, 1000.0 * hop.stance.duration, 100.0 * hop.apex)
    height, time, duration, apex = (f"{number:.5g}" for number in numbers)
    return (
        str(hop.index + 1),
        f"{100.0 * hop.ground + 0.0:.4g}",
        height,
        time,
        f"{hop.u + 0.0:.4g}",
        duration,
        hop.stance.status.replace("_", " "),
        "-" if math.isnan(hop.apex) else apex,
        f"{hop.stance.aed:+.4f}",
        f"{-hop.energy_lost_at_impact + 0.0:+.4f}",
        "bottoms out" if hop.bottoms_out else "hits a stop" if hop.hits_stop else "",
    )


# ---- records for JSON ----


def to_json(record: Record) -> str:
    """Strict JSON: what is not a number, or has no limit, is null."""
    return json.dumps(strict(record), indent=2, allow_nan=False)


def strict(value: Any) -> Any:
    """The same with plain Python numbers, and null for NaN and infinities."""
    if isinstance(value, Mapping):
        return {str(key): strict(each) for key, each in value.items()}  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
    if isinstance(value, (list, tuple)):
        return [strict(each) for each in value]  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, (float, np.floating, np.ndarray)):
        number = float(value)  # pyright: ignore[reportUnknownArgumentType]
        return number if math.isfinite(number) else None
    return value


def robot_record(robot: Robot) -> Record:
    names = ("name", "description", *(field.name for field in Robot.fields()))
    return {name: getattr(robot, name) for name in names}


def robots_record(shown: Sequence[Robot]) -> Record:
    fields = [
        {name: getattr(field, name) for name in ("name", "unit", "domain", "meaning", "default")}
        | {"required": field.default is None}
        for field in Robot.fields()
    ]
    return {"hopform": hopform.__version__, "robots": [robot_record(robot) for robot in shown], "fields": fields}


def equations_record(shown: Sequence[Equation]) -> Record:
    names = ("number", "title", "printed", "derived", "verdict", "reason", "computed_by")
    register = [{name: getattr(each, name) for name in names} for each in shown]
    return {"hopform": hopform.__version__, "equations": register}


def stance_record(solved: Stance, height: float | None) -> Record:
    """A stance with the robot it was solved for; `height` is the drop, None if a velocity was given."""
    return {
        "hopform": hopform.__version__,
        "robot": robot_record(solved.robot),
        "height": height,
        "u": steps_record(solved.u),
        "backend": solved.backend,
        "dtype": str(solved.dtype),
        **ending_record(solved),
        "start": state_record(solved.at(0.0)),
        "end": state_record(solved.end),
        "takeoff": None if solved.takeoff is None else state_record(solved.takeoff),
        "events": [{"time": event.time, "kind": event.kind} for event in solved.events],
        "phases": [phase_record(phase) for phase in solved.phases],
        "energy": {"start": energy_record(solved.energy(0.0)), "end": energy_record(solved.energy(solved.duration))},
        "ledger": ledger_record(solved.ledger(solved.duration)),
        "sensitivities": sensitivities_record(solved.sensitivities),
        "warnings": list(solved.warnings),
    }


def ending_record(solved: Stance) -> Record:
    return {"status": solved.status, "duration": solved.duration, "apex": solved.apex, "aed": solved.aed}


def steps_record(steps: Sequence[tuple[float, float]]) -> list[Record]:
    return [{"time": t, "current": u} for t, u in steps]


def state_record(state: State) -> Record:
    return dict(state._asdict())


def energy_record(energy: Energy) -> Record:
    return dict(energy._asdict())


def ledger_record(entries: Ledger) -> Record:
    return dict(entries._asdict())


def sensitivities_record(derivatives: Sensitivities) -> Record:
    return {row: {column: derivatives[row, column] for column in derivatives.columns} for row in derivatives.rows}


def phase_record(phase: Phase) -> Record:
    return {**phase._asdict(), "state": state_record(phase.state)}


def run_record(solved: Run, settings: Record) -> Record:
    """A run with the settings that it was asked with; each hop with the ending of its stance."""
    return {
        "hopform": hopform.__version__,
        "robot": robot_record(solved.robot),
        **settings,
        "terrain": list(solved.terrain),
        "backend": solved.backend,
        "status": solved.status,
        "duration": solved.duration,
        "hops": [hop_record(hop) for hop in solved.hops],
        "warnings": list(solved.warnings),
    }


def hop_record(hop: Hop) -> Record:
    return {
        "index": hop.index,
        "ground": hop.ground,
        "height": hop.height,
        "touchdown_time": hop.touchdown_time,
        "gains": hop.flight.gains._asdict(),
        "touchdown": state_record(hop.touchdown),
        "u": steps_record(hop.stance.u),
        "takeoff_time": None if hop.stance.takeoff is None else hop.takeoff_time,
        "takeoff": None if hop.stance.takeoff is None else state_record(hop.stance.takeoff),
        "apex": hop.apex,
        "energy_lost_at_impact": hop.energy_lost_at_impact,
        "hits_stop": hop.hits_stop,
        "bottoms_out": hop.bottoms_out,
        "stance": ending_record(hop.stance),
    }


# ---- CSV ----


def stance_csv(solved: Stance, samples: int) -> str:
    """A stance over time: uniform times, and those of the events."""
    t = times(solved.duration, samples, (phase.start for phase in solved.phases))
    columns = {
        "t": t,
        **solved.at(t)._asdict(),
        "F": solved.robot.k * np.asarray(solved.compression(t)),
        "E": solved.energy(t).body,
        "AED": aed_of(solved.ledger(t)),
    }
    return to_csv(columns)


def run_csv(solved: Run, samples: int) -> str:
    """A run over time: uniform times, and those of touchdowns and take-offs."""
    t = solved.times(samples)
    energy, foretold = solved.energy(t), np.asarray(solved.aed(t))
    columns = {
        "t": t,
        **solved.at(t)._asdict(),
        "ground": solved.ground(t),
        "foot": solved.foot(t),
        "u": solved.current(t),
        "E": energy.body,
        "H": energy.total,
        "AED": foretold - foretold[0],
    }
    return to_csv(columns)


def times(duration: float, samples: int, events: Iterable[float]) -> NDArray[np.float64]:
    """`samples` uniform times over [0, duration] and the given ones, in order, each once."""
    return np.union1d(np.linspace(0.0, duration, samples), np.fromiter(events, float))


def to_csv(columns: Mapping[str, ArrayLike]) -> str:
    """Columns as text; every number reads back to the same bits."""
    arrays = [np.asarray(column, dtype=float).tolist() for column in columns.values()]
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in zip(*arrays, strict=True))]
    return "\n".join(lines) + "\n"
