"""What the commands that solve print: tables for people, records for JSON, which `output` writes."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import RenderableType
from rich.table import Column, Table
from rich.text import Text

from hopform import (
    ROBOTS,
    Claim,
    Command,
    Equation,
    FixedPoint,
    Motion,
    Phase,
    PrintedCommand,
    Reachability,
    Robot,
    Stance,
)
from hopform._cli.bands import Bands, Draws
from hopform._cli.output import Record, number, record, spaced, table, to_json
from hopform._errors import printable
from hopform._files import csv_of
from hopform._motion import energies_of, force_units, layout_of, masses_of, unit_of_time, units_of_energies
from hopform._solver.package import records
from hopform._words import change_of_limit, limit_in, modes_of, start_of

READABLE = 90
"""Columns of a paragraph, however wide the line may be."""

OURS = "Values of shipped robots are this project's own: the paper gives none."


Printed = list[tuple[str, PrintedCommand]]
"""Forms of the printed controller with what they would have done."""
STATUSES = {
    "reached": "reaches the desired apex",
    "nearest": "cannot reach the desired apex; this comes nearest",
    "no_takeoff": "has no admissible current: no take-off, or the stroke is too short",
}
PRINTED: dict[str, dict[str, Any]] = {
    "as printed": {},
    "(26) without the 1/2": {"half": False},
    "the same with the step's sign": {"half": False, "signed": True},
    "as printed, with the spring coordinate": {"spring_coordinate": True},
    "all three": {"half": False, "signed": True, "spring_coordinate": True},
}
"""Forms of the printed controller, with the options of `choose_current_as_printed` that make them."""


# ---- tables ----


def robots(shown: Sequence[Robot], *, with_meaning: bool) -> Iterator[RenderableType]:
    """Robots side by side, a row per parameter."""
    meaning = ("meaning",) if with_meaning else ()

    def row(field: records.Field) -> tuple[str, ...]:
        values = (robot[field.name] for robot in shown)
        words = ("none" if math.isinf(value) else f"{value:.6g}" for value in values)
        return field.name, *words, "" if field.unit == "1" else field.unit, *(getattr(field, each) for each in meaning)

    head = ("parameter", *(robot.label for robot in shown), "unit", *meaning)
    about = ((robot.label, printable(" ".join(robot.description.split()))) for robot in shown if robot.description)
    notes = [*map(": ".join, about), *([OURS] if any(robot.name in ROBOTS for robot in shown) else [])]
    return spaced(table("", head, map(row, shown[0].all_fields()), ("parameter", "unit", "meaning")), "\n".join(notes))


def unclaimed(shown: Sequence[Equation]) -> tuple[str, ...]:
    """Why nothing is claimed to follow in the place of the paper's equations; empty where the hopper is the paper's."""
    return tuple(dict.fromkeys(each.reason for each in shown if not each.derived))


def equations(shown: Sequence[Equation]) -> Iterator[RenderableType]:
    """The register, a row per equation."""
    rows = ((f"({each.number})", each.title, each.verdict) for each in shown)
    how = "`hopform equations N` shows how equation N is printed, how it is derived, and what differs."
    return spaced(*unclaimed(shown), table("", ("no.", "title", "verdict"), rows, ("title", "verdict")), how)


def equation(shown: Equation) -> Iterator[RenderableType]:
    """All that the register holds on one equation."""
    made = Table.grid(Column(style="bold", no_wrap=True), Column(max_width=READABLE), padding=(0, 2, 0, 0))
    made.add_row("as printed", shown.printed)
    if shown.derived:
        made.add_row("as derived", shown.derived)
        made.add_row("reason", shown.reason)
        made.add_row("computed by", "\n".join(shown.computed_by))
    title = Text(f"({shown.number}) {shown.title}: {shown.verdict}", style="bold")
    return spaced(*unclaimed([shown]), title, made)


def unproven(shown: Sequence[Claim]) -> tuple[str, ...]:
    """Why nothing is said of the paper's claims; empty where the hopper is the paper's."""
    return tuple(dict.fromkeys(each.reason for each in shown if not each.numbers))


def claims(shown: Sequence[Claim]) -> Iterator[RenderableType]:
    """The claims, a row each."""
    rows = ((each.name, each.where, each.says, each.verdict) for each in shown)
    how = "`hopform equations CLAIM --claims` shows the numbers of a claim, and why its verdict is what it is."
    heads = ("claim", "section", "title", "verdict")
    return spaced(*unproven(shown), table("", heads, rows, heads), how)


def claim(shown: Claim) -> Iterator[RenderableType]:
    """All that the register holds on one claim."""
    made = Table.grid(Column(style="bold", no_wrap=True), Column(max_width=READABLE), padding=(0, 2, 0, 0))
    made.add_row("claim", f"{shown.says} ({shown.where})")
    if shown.printed:
        made.add_row("as printed", shown.printed)
    if shown.numbers:
        for what, value, unit in shown.numbers:
            made.add_row(f"{value}{'' if unit == '1' else f' {unit}'}", what)
        made.add_row("reason", shown.reason)
    title = Text(f"{shown.name}: {shown.verdict}", style="bold")
    return spaced(*unproven([shown]), title, made)


def motion(solved: Motion, with_sensitivities: bool = False, explained: bool = False) -> Iterator[RenderableType]:
    """A motion, of which a stance is one: its ending, phases with the events that begin them, states, forces and
    energies, the ledger; where asked for, derivatives and how it was solved.
    """
    about = ", ".join(each for each in (f"from {start_of(solved)}", solved.input_in_words) if each)
    title = Text(f"{solved.robot.label}: {about}; {solved.outcome}", style="bold")
    parts = [phases(solved), states(solved), ledger(solved), *([sensitivities(solved)] if with_sensitivities else [])]
    by = "; ".join([*solved.figures_in_words, f"solved in {solved.dtype}"])
    return spaced(title, *parts, *loss_at_start(solved), by, *([solved.explain()] if explained else []))


def phases(solved: Motion) -> Table:
    """The chain of phases; what begins each one is its event."""
    scale, unit = unit_of_time(solved.duration)
    masses, inputs = masses_of(solved.robot.solver), solved.inputs
    currents = solved.robot.solver.facts.currents
    words = ["begins with", *(mass.name for mass in masses), *(each["name"] for each in currents)]
    numbers = [f"{each['name']} [{each['unit']}]" for each in inputs]
    numbers += [f"{mass.position} [{mass.unit}]" for mass in masses]
    rows = list[tuple[str, ...]]()
    for phase, event in zip(solved.phases, beginnings(solved), strict=True):
        times = (f"{t * scale:.6g}" for t in (phase.start, phase.end))
        state = [getattr(phase.state, mass.position) for mass in masses]
        values = (f"{value:.4g}" for value in (*([phase.u] if inputs else []), *state))
        limits = (limit_in(phase) for _ in currents)
        rows.append((*times, event, *modes_of(phase, solved.robot), *limits, *values))
    return table("Phases and events", (f"from [{unit}]", f"to [{unit}]", *words, *numbers), rows, words)


def beginnings(solved: Motion) -> list[str]:
    """The beginning of each phase: the start, an event, a step of the input, or a limit that a current reaches or leaves."""
    events: dict[float, list[str]] = {}
    words = solved.robot.solver.facts.events
    for event in solved.events:
        events.setdefault(event.time, []).append(words[event.kind])
    steps, what = {t for t, _ in solved.u[1:]}, ", ".join(each["name"] for each in solved.inputs)
    found, currents = [solved.beginning], solved.robot.solver.facts.currents
    for before, phase in pairwise(solved.phases):
        waiting = events.get(phase.start, [])
        if waiting:
            found.append(waiting.pop(0))
        elif phase.start in steps:
            found.append(f"step of {what}")
        else:
            limits = currents if before.mode_2 != phase.mode_2 else ()
            found.append(", ".join(change_of_limit(each["name"], phase.mode_2 != 0) for each in limits))
    return found


def states(solved: Motion) -> Table:
    """First and last state, the forces there and the energies."""
    of, rows = layout_of(solved.robot.solver), list[tuple[str, ...]]()
    for name, t in ((solved.beginning, 0.0), (solved.status.replace("_", " "), solved.duration)):
        state = (getattr(solved.at(t), each) for each in of.names)
        numbers = (*state, *currents_at(solved, t), *solved.forces(t).values(), *energies_of(solved, t).values())
        rows.append((name, *(f"{round(float(each), 9) + 0.0:.5g}" for each in numbers)))
    units = of.unit_of | units_of_law(solved) | force_units(solved) | units_of_energies(solved)
    return table("State and forces", ("", *(f"{name} [{unit}]" for name, unit in units.items())), rows, ("",))


def units_of_law(solved: Motion) -> dict[str, str]:
    """The unit of the current that a law sets, by its name, of a model that has one."""
    return {each["name"]: each["unit"] for each in solved.robot.solver.facts.currents}


def currents_at(solved: Motion, t: float) -> list[float]:
    """The current that a law sets, of a model that has one."""
    return [float(solved.current(t)) for _ in solved.robot.solver.facts.currents]


def ledger(solved: Motion) -> Table:
    """The ledger at the ending with its sums, a column per energy of the model."""
    of, known = solved.ledger(solved.duration)._asdict(), solved.robot.solver.package.records
    parts = {"H": known.LEDGER_OF_ROBOT} | ({"E": known.LEDGER_OF_BODY} if "E" in units_of_energies(solved) else {})
    before, after = energies_of(solved, 0.0), energies_of(solved, solved.duration)
    before["H"] = given_energy(solved)
    rows = [
        (words, *(f"{float(of[key]) + 0.0:+.6f}" if key in parts[each] else "" for each in before))
        for key, words in solved.robot.solver.facts.ledger.items()
        if any(key in parts[each] for each in before)
    ]
    heads = (f"{name} [{unit}]" for name, unit in units_of_energies(solved).items())
    made = table("Energy ledger", ("", *heads), rows, ("",))
    made.add_section()
    sums = [math.fsum(of[key] for key in parts[each]) for each in before]
    changes = [float(after[each] - before[each]) for each in before]
    made.add_row("sum", *(f"{each:+.6f}" for each in sums))
    made.add_row("change", *(f"{each:+.6f}" for each in changes))
    made.add_row("difference", *(f"{a - b:.1e}" for a, b in zip(sums, changes, strict=True)))
    return made


def given_energy(solved: Motion) -> float:
    """Energy H [J] of the start as it is given, from which the ledger counts: before what a stop takes at t = 0."""
    return float(solved.total_energy(0.0)) + lost_at_start(solved)


def lost_at_start(solved: Motion) -> float:
    """What a start that runs into a stop loses there [J]: the ledger at t = 0, of a model that has stops."""
    return -float(solved.ledger(0.0).stop_loss) if "stop_loss" in solved.robot.solver.facts.ledger else 0.0


def loss_at_start(solved: Motion) -> list[str]:
    """What is said of that."""
    loss = lost_at_start(solved)
    said = f"The start meets a stop and loses {loss:.6g} J there; state and forces at the start are those after this impact."
    return [said] if loss > 0.0 else []


def sensitivities(solved: Motion) -> Table:
    """Derivatives of the ending: a row per input, a column per result, "-" where there is no derivative."""
    by = solved.sensitivities
    heads = ("", *(f"{row} [{by.units[row]}]" for row in by.rows))
    rows = ((f"{name} [{by.units[name]}]", *(number(by[row, name] + 0.0) for row in by.rows)) for name in by.columns)
    what = "take-off" if solved.status == "takeoff" else "ending"
    return table(f"Sensitivities: derivatives of the {what} by", heads, rows, ("",))


def command(
    robot: Robot, h_des: float, found: Command, printed: Printed, drawn: Draws | None, band: Bands | None
) -> Iterator[RenderableType]:
    """The controller's answer, and what the printed forms would have done."""
    shown: list[tuple[str, Command | PrintedCommand]] = [("exact", found), *printed]
    rows = (
        (words, f"{each.u:.9g}", number(each.apex, ".6g", 100.0), number(each.apex - h_des, "+.2g", 100.0))
        for words, each in shown
    )
    currents = table("Currents", ("controller", "u [A]", "apex [cm]", "error [cm]"), rows, ("controller",))
    note = f"{found.solved} stances were solved. Heights are hop heights."
    if drawn and band:
        note = f"Under the exact current 95 % of the apexes are {band.text()} cm. {drawn.said()}\n{note}"
    return spaced(Text(f"{robot.label}: {STATUSES[found.status]}", style="bold"), currents, note)


def reach(found: Reachability, drawn: Draws | None, bands: Mapping[str, Bands] | None) -> Iterator[RenderableType]:
    """A map: bounds and holds by height, then the fixed points."""
    held = np.isfinite(found.hold)
    title = Text(f"{found.robot.label}: {int(held.sum())} of {held.size} heights can be held", style="bold")
    columns = (
        "height [cm]", "lowest [cm]", "at [A]", "highest [cm]", "at [A] ", "held by [A]", "gaps [A]", "limited by "
        "stroke", *(BANDS.values() if bands else ()),
    )  # fmt: skip
    rows = (_height_row(found, row, bands) for row in range(found.heights.size))
    made = [table("Next apex", columns, rows, ("gaps [A]",))]
    if found.fixed_points:
        points = map(_point_row, found.fixed_points)
        made.append(table("Fixed points", ("u [A]", "height [cm]", "multiplier", "stability"), points, ("stability",)))
    heights = "Heights are hop heights. Gaps and the share limited by the stroke are those of the currents of the map."
    return spaced(title, *made, f"{heights}\n{drawn.said()}" if drawn else heights)


BOUNDS = {"lowest": 100.0, "u_lowest": 1.0, "highest": 100.0, "u_highest": 1.0, "hold": 1.0}
"""What is known of each height, and its factor in a table."""
BANDS = {"lowest": "lowest, 95 % [cm]", "highest": "highest, 95 % [cm]", "hold": "held by, 95 % [A]"}
"""What has a band at each height, and its heading."""


def _height_row(found: Reachability, row: int, bands: Mapping[str, Bands] | None) -> tuple[str, ...]:
    share = float(np.count_nonzero(found.limited[row])) / found.currents.size
    bounds = (number(float(getattr(found, name)[row]), scale=scale) for name, scale in BOUNDS.items())
    gaps = ", ".join(f"{low:.3g}..{high:.3g}" for low, high in found.gaps(row)) or "-"
    shown = (each.at(row).text(BOUNDS[name]) for name, each in (bands or {}).items() if name in BANDS)
    return f"{100.0 * float(found.heights[row]):.5g}", *bounds, gaps, f"{100.0 * share:.0f} %", *shown


def _point_row(point: FixedPoint) -> tuple[str, ...]:
    words = ("stable" if point.stable else "unstable") + ("" if point.admissible else ", beyond the stroke")
    return f"{point.u:.5g}", f"{100.0 * point.height:.5g}", f"{point.multiplier:.4f}", words


# ---- JSON ----


def robots_json(shown: Sequence[Robot]) -> str:
    """Robots, and what their parameters are."""
    fields = [record("field", each, required=each.default is None) for each in shown[0].all_fields()]
    return to_json("robots", robots=shown, fields=fields)


def stance_json(solved: Stance, height: float | None) -> str:
    """A stance with the robot it was solved for; `height` is the drop, None if a velocity was given."""
    start, end = 0.0, solved.duration
    energies = solved.energy(start)._replace(total=given_energy(solved)), solved.energy(end)
    return to_json("stance", solved, height=height, start=solved.at(start), energy=energies, ledger=solved.ledger(end),
                   sensitivities=solved.sensitivities.matrix)  # fmt: skip


def motion_json(solved: Motion) -> str:
    """A motion with the robot it was solved for."""
    first, *_ = solved.phases
    by = solved.sensitivities
    found = {row: {column: by[row, column] for column in by.columns} for row in by.rows}
    parts = [
        record(
            "part", phase, state=phase.state._asdict(), driven=solved.driven(min(phase.start, solved.duration)), forces=solved.forces(min(phase.start, solved.duration)),
            modes=dict(zip((mass.name for mass in masses_of(solved.robot.solver)), sides_of(solved, phase), strict=True)),
        )
        for phase in solved.phases
    ]  # fmt: skip
    return to_json(
        "motion", solved, start=first.state._asdict(), end=solved.end._asdict(), phases=parts,
        driven=solved.driven(solved.duration), units=solved.units | units_of_law(solved) | force_units(solved),
        forces=solved.forces(solved.duration),
        total_energy=[given_energy(solved), solved.total_energy(solved.duration)],
        ledger=solved.ledger_by_element(solved.duration),
        sensitivities=None if np.isnan(by.matrix[0]).any() else found,
    )  # fmt: skip


def sides_of(solved: Motion, phase: Phase) -> list[int]:
    """The mode of each mass that may move, as a number."""
    return [(phase.mode_1, phase.mode_2)[mass.number - 1] for mass in masses_of(solved.robot.solver)]


def command_json(
    robot: Robot, asked: Record, found: Command, printed: Printed, drawn: Draws | None, band: Bands | None
) -> str:
    """The controller's answer and the question."""
    forms = [record("form", each, form=words) for words, each in printed]
    return to_json("control", found, robot=robot, **asked, printed=forms, band=band, draws=drawn and drawn.record())


def reach_json(found: Reachability, drawn: Draws | None, bands: Mapping[str, Bands] | None) -> str:
    """A map by heights, with bands where there are some."""

    def row_of(row: int) -> Record:
        of: Record = {name: getattr(found, name)[row] for name in BOUNDS}
        of |= {f"{name}_band": bands and bands[name].at(row) for name in BANDS}
        of_bands = [bands and bands["apex"].at(row, n) for n in range(found.currents.size)]
        cells = zip(found.currents, found.apex[row], found.admissible[row], of_bands, strict=True)
        return of | {"height": found.heights[row], "gaps": found.gaps(row), "cells": cells}

    rows = map(row_of, range(found.heights.size))
    return to_json("reach", found, rows=rows, draws=drawn and drawn.record())


# ---- CSV ----


def stance_csv(solved: Stance, samples: int) -> str:
    """A stance over time: uniform times, and those of the events."""
    t = times_of(solved, samples)
    state = {name: values for name, values in solved.at(t)._asdict().items() if name in solved.robot.solver.facts.axes}
    return csv_of({"t": t, **state, "N": solved.contact_force(t), "E": solved.energy(t).body, "AED": solved.aed_at(t)})


def motion_csv(solved: Motion, samples: int) -> str:
    """A motion over time: uniform times, and those of the events."""
    t = times_of(solved, samples)
    columns = {"t": t, **solved.at(t)._asdict(), **solved.driven(t), **solved.forces(t)}
    return csv_of(columns | {"H": solved.total_energy(t)})


def times_of(solved: Motion, samples: int) -> NDArray[np.float64]:
    """Uniform times from the start to the ending, and those at which phases begin."""
    t = np.union1d(np.linspace(0.0, solved.duration, samples), [phase.start for phase in solved.phases])
    return t[t <= solved.duration]
