"""How a stance was solved: of each phase its poles, its event functions, and by which rule of the certificate each of
them has no zero in which interval.

A library beside that which solves, from the same C, solves the stance again, to the same bits, and notes what it
decides (runtime/engine/c/notes). docs/explanation/certificate.md has the rules by number.
"""

import ctypes
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from hopform._motion import Motion, Phase, force_unit, masses_of
from hopform._solver.c import FIRST_CAPACITY, PHASES_NOT_KEPT, Library, Solved, Types, plan_of
from hopform._solver.package import LegState, Precision, Steps
from hopform._words import change_of_limit, limit_in, modes_of

MONOTONE = "monotone: its end decides"
SIGNS, QUIET = "rule 2, signs", "rule 5, quiet time"
RULES = {
    "has_no_root_by_bernstein": "rule 1, Bernstein coefficients",
    "falls_too_little": "rule 2, fall",
    "cut_at_minimum": "rule 4, the minimum",
}
"""What certifies a function in an interval in place of signs, by the engine's word for it. Rule 3 has closed forms in
place of intervals."""
CLOSED, PIECES = "rule 3, closed form", "rule 3, two monotone pieces"
KINDS = ("contact", "limit", "stop", "threshold", "velocity")
"""The engine's words for what an event function is."""
FIRST_ROOM = 1024
"""Notes that are kept at first; hardly any stance has more."""

NOTE = (
    "Proven by the theorems of rules 1 to 5: no zero is missed, for the poles and rates as rounded.",
    "Measured, not proven: the rounding-error bound above which a value is positive (docs/explanation/certificate.md).",
)


class Interval(NamedTuple):
    """Where an event function has no zero, and by which rule."""

    start: float
    """[s] since the phase began"""
    end: float
    rule: str


class EventFunction(NamedTuple):
    """An event function of a phase, at its start and its end."""

    name: str
    unit: str
    start: float
    end: float
    intervals: tuple[Interval, ...]
    zero: float
    """[s] since the phase began, where a closed form says it: infinite if there is none; else NaN"""
    ends: bool
    """Whether its zero is the first one"""


class Search(NamedTuple):
    """What the engine has done in a phase."""

    length: float
    """[s]"""
    poles: tuple[complex, ...]
    """[1/s]"""
    half_period: float
    """[s] of the pair; infinite if it does not ring"""
    functions: tuple[EventFunction, ...]
    cuts: int
    """Intervals that had no certificate, and were cut"""


# ---- notes ----


class Note(NamedTuple):
    """What the engine decided or found."""

    what: str
    function: int
    """of the phase, by its number; of a phase its row"""
    start: float
    end: float
    """[s] since the phase began; or two numbers"""


@lru_cache(maxsize=8)
def note_of(types: Types) -> Any:
    """The struct of a note, in a precision of a library."""
    members = [("what", ctypes.c_char_p), ("function", ctypes.c_int32), ("start", types.real), ("end", types.real)]
    return type("Note", (ctypes.Structure,), {"_fields_": members})


def noted(
    library: Library, parameters: Any, start: LegState, steps: Steps, horizon: float, max_phases: int, dtype: Precision
) -> tuple[Solved, Iterator[Note]]:
    """A stance by the library that has notes, and its notes."""
    types = library.types(dtype)
    plan, packed = plan_of(types, parameters), types.pack(*(number for step in steps for number in step))
    asked = plan, types.pack_state(*start), packed, len(steps), types.real(horizon), max_phases
    capacity, room, count = FIRST_CAPACITY, FIRST_ROOM, ctypes.c_int32()
    while True:
        stance, phases = types.memory(capacity)
        notes = (note_of(types) * room)()
        given = *asked, phases, capacity, stance, notes, room, ctypes.byref(count)
        status = library.call("note_stance", types, *given)
        if status != PHASES_NOT_KEPT and count.value <= room:
            break
        capacity, room = max(capacity, types.stance.unpack(stance)[-3]), max(room, count.value)
    taken = (Note(each.what.decode(), each.function, each.start, each.end) for each in notes[: count.value])
    return Solved(types, plan, packed, phases, stance[:]), taken


@dataclass
class Noted:
    """What has been noted of the phase that is being solved."""

    intervals: list[tuple[float, dict[int, str]]] = field(default_factory=list[tuple[float, dict[int, str]]])
    """when each begins, and in it by event function the rule that certified it; -1 for all; else signs did"""
    quiet: bool = False
    """whether the next interval ends where rule 5 says"""
    cuts: int = 0
    facts: dict[tuple[str, int], tuple[float, float]] = field(
        default_factory=dict[tuple[str, int], tuple[float, float]]
    )
    """what the phase is described by: two numbers by what they are and of which function; -1 for the phase"""

    def take(self, note: Note) -> None:
        what, n, start, end = note
        if what == "node":
            self.intervals.append((start, {-1: QUIET} if self.quiet else {}))
            self.quiet = False
        elif what == "quiet_time_at_node":
            self.quiet = True
        elif what in RULES:
            self.intervals[-1][1][n] = RULES[what]
        elif what == "cut":
            self.cuts += 1
            self.intervals[-1][1].clear()
        else:
            self.facts[what, n] = start, end

    def search(self, length: float) -> Search:
        """The phase, at its end."""
        if ("pair", -1) not in self.facts:  # nothing moves
            return Search(length, (), 0.0, (), self.cuts)
        poles, half_period = poles_of(*self.facts["pair", -1], self.facts.get(("pole", -1)))
        functions = ((n, what) for what, n in self.facts if what in KINDS)
        return Search(length, poles, half_period, tuple(self._function(*each, length) for each in functions), self.cuts)

    def _function(self, n: int, kind: str, length: float) -> EventFunction:
        name, unit = self._named(n, kind)
        zero = self.facts["zero", n][1] if ("zero", n) in self.facts else math.nan
        closed = ("no_zero", n) in self.facts or ("zero", n) in self.facts
        zero = math.inf if ("no_zero", n) in self.facts else zero
        intervals = () if closed else self._intervals(n, length)
        return EventFunction(name, unit, *self.facts["values", n], intervals, zero, ("ends", n) in self.facts)

    def _intervals(self, n: int, length: float) -> tuple[Interval, ...]:
        """Of a function; those that follow each other by the same rule are one."""
        for what, rule in (("monotone", MONOTONE), ("pieces", PIECES)):
            if (what, n) in self.facts:
                return (Interval(*self.facts[what, n], rule),)
        kept: list[Interval] = []
        for start, by in self.intervals:
            rule = by.get(n, by.get(-1, SIGNS))
            if kept and kept[-1].rule == rule:
                continue
            kept = [*kept[:-1], *(each._replace(end=start) for each in kept[-1:]), Interval(start, length, rule)]
        return tuple(each for each in kept if each.start < length)

    def _named(self, n: int, kind: str) -> tuple[str, str]:
        """Name and unit of an event function."""
        element, towards = map(int, self.facts[kind, n])
        sides = tuple(map(int, self.facts["sides", -1]))
        if kind == "contact":
            return "N/k", "m"
        if kind == "limit":
            at_limit = int(self.facts["at_limit", -1][0])
            where = "beyond" if at_limit else "below" if towards > 0 else "above"
            return f"{where} its {'upper' if (at_limit or towards) > 0 else 'lower'} limit", "N"
        number, side = element + 1, sides[element]
        if kind == "stop":
            return ("x1_max - x1" if side > 0 else "x1 - x1_min"), "m"
        if kind == "threshold":
            excess = self.facts["excess", n][0] > 0.0
            at_rest = f"f{number} + f{number}_excess" if excess else f"f{number}"
            return f"{at_rest} {'-' if towards > 0 else '+'} a{number}", "m/s^2"
        return f"{'' if side > 0 else '-'}v{number}", "m/s"


def poles_of(p: float, q: float, pole: tuple[float, float] | None) -> tuple[tuple[complex, ...], float]:
    """The poles of a mode, s^2 + p s + q and a real one if all masses slip, and half the period of the pair."""
    mean = 0.5 * p
    square = q - mean * mean
    real = () if pole is None else (complex(-pole[0]),)
    if square > 0.0:
        omega = math.sqrt(square)
        return (*real, complex(-mean, omega), complex(-mean, -omega)), math.pi / omega
    fast = mean + math.sqrt(-square)
    slow = q / fast if fast > 0.0 else 0.0
    return (*real, complex(-fast), complex(-slow)), math.inf


def searches_in(notes: Iterable[Note]) -> dict[int, Search]:
    """How each phase was solved, by its row."""
    found, of_phase = dict[int, Search](), Noted()
    for note in notes:
        if note.what == "phase":
            found[note.function], of_phase = of_phase.search(note.end), Noted()
        else:
            of_phase.take(note)
    return found


def searches_of(stance: Motion, asked: tuple[LegState, float, int]) -> tuple[Solved, dict[int, Search]]:
    """The motion solved again from what was asked, start, horizon and bound on phases, and how."""
    robot, (start, horizon, most) = stance.robot, asked
    library = robot.solver.compiled().library.notes
    solved, notes = noted(library, robot.parameters, start, stance.u, horizon, most, stance.dtype)
    return solved, searches_in(notes)


# ---- in words ----


def text_of(stance: Motion, asked: tuple[LegState, float, int]) -> str:
    """How the motion was solved, phase by phase."""
    solved, searches = searches_of(stance, asked)
    rows = solved.phase_rows()
    about = ", ".join(each for each in (stance.robot.label, stance.input_in_words) if each)
    lines = [f"{about}; {stance.outcome}"]
    for n, phase in enumerate(stance.phases):
        kind = kind_of(rows[n + 1][3], stance) if n + 1 < len(rows) else stance.status
        lines += ["", *of_phase(n + 1, stance, phase, kind, searches.get(n))]
    return "\n".join([*lines, "", *NOTE])


def kind_of(event: int, motion: Motion) -> str:
    """What ends a phase, by what begins the next one."""
    records, facts = motion.robot.solver.package.records, motion.robot.solver.facts
    if event in records.EVENTS:
        return str(records.EVENTS[event])
    beginning = records.BEGINNINGS[event]
    if beginning == "step":
        return f"a step of {facts.inputs[0]['name']}"
    if beginning == "none":
        return "a grazing contact, which is no event"
    return change_of_limit(facts.currents[0]["name"], beginning == "u_saturates")


def of_phase(number: int, stance: Motion, phase: Phase, kind: str, search: Search | None) -> Iterator[str]:
    """A phase: its poles, then a row for each event function."""
    solver = stance.robot.solver
    named = zip(masses_of(solver), modes_of(phase, stance.robot), strict=True)
    modes = ", ".join(f"{mass.name} {mode}" for mass, mode in named)
    modes += "".join(f", {each['name']} {limit_in(phase)}" for each in solver.facts.currents)
    yield f"Phase {number}, {phase.start:.5g} to {phase.end:.5g} s: {modes}; then {kind}"
    if search is None or not search.functions:
        moves = any((phase.mode_1, phase.mode_2)[mass.number - 1] for mass in masses_of(solver))
        yield "  two events at the same time" if moves else "  nothing moves: no event to search for"
        return
    half = f"half a period is {search.half_period:.4g} s" if search.half_period < math.inf else "all real"
    cuts = f"; {search.cuts} interval{'s' * (search.cuts > 1)} cut" if search.cuts else ""
    yield f"  poles [1/s]: {', '.join(poles_in_words(search.poles))}; {half}{cuts}"
    rows = [("event function", "start", "end", "no earlier zero, shown by")]
    functions = (in_names(function, stance) for function in search.functions)
    rows += [row for function in functions for row in rows_of(function, phase.start)]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    for name, start, end, why in rows:
        yield f"  {name:{widths[0]}}  {start:>{widths[1]}}  {end:>{widths[2]}}  {why}"


def in_names(function: EventFunction, motion: Motion) -> EventFunction:
    """An event function under the names and in the units of the model."""
    masses = {str(mass.number): mass for mass in masses_of(motion.robot.solver)}
    if (found := re.fullmatch(r"f([12]).* ([+-]) a[12]", function.name)) is not None:
        mass = masses[found[1]]
        name = f"stick margin, {mass.name} {mass.directions[found[2] == '+']}"
    elif (found := re.fullmatch(r"x([12])_max - x[12]|x[12] - x([12])_min", function.name)) is not None:
        mass = masses[found[1] or found[2]]
        name = to_stop(mass.position, mass.stops["upper" if found[1] else "lower"], upper=bool(found[1]))
    elif (found := re.fullmatch(r"(-?)v([12])", function.name)) is not None:
        mass = masses[found[2]]
        name = f"{found[1]}{mass.velocity}"
    elif function.unit == "N":  # the force that a law asks for, and its limit
        (current,) = motion.robot.solver.facts.currents
        unit = force_unit(next(iter(masses.values())).unit)
        return function._replace(name=f"{current['name']} {function.name}", unit=unit)
    else:
        return function
    return function._replace(name=name, unit=function.unit.replace("m", mass.unit, 1))


def to_stop(position: str, stop: str, *, upper: bool) -> str:
    """The distance of a coordinate to a stop, which the file gives by a name, an expression or a number.

    >>> to_stop("phi", "19/10", upper=True), to_stop("phi", "0", upper=False), to_stop("x", "x_min", upper=False)
    ('1.9 - phi', 'phi', 'x - x_min')
    """
    if re.fullmatch(r"-?[0-9]+(/[0-9]+)?", stop):
        value = float(Fraction(stop))
        if upper:
            return f"{value:.6g} - {position}" if value else f"-{position}"
        return f"{position} {'-' if value > 0.0 else '+'} {abs(value):.6g}" if value else position
    if upper:
        return f"{stop} - {position}"
    return f"{position} - {stop if stop.isidentifier() else f'({stop})'}"


def poles_in_words(poles: Sequence[complex]) -> Iterator[str]:
    """Real poles, then a pair as one."""
    yield from (f"{pole.real + 0.0:.4g}" for pole in poles if not pole.imag)
    yield from (f"{pole.real:.4g} +- {pole.imag:.4g}i" for pole in poles if pole.imag > 0.0)


def rows_of(function: EventFunction, begin: float) -> Iterator[tuple[str, str, str, str]]:
    """An event function, and in further rows what it is certified by in further intervals."""
    name, start, end = f"{function.name} [{function.unit}]", f"{function.start + 0.0:.4g}", f"{function.end + 0.0:.4g}"
    ends = "; this zero ends the phase" if function.ends else ""
    if not math.isnan(function.zero):
        zero = f"first zero at {begin + function.zero:.5g} s" if function.zero < math.inf else "no zero"
        yield name, start, end, f"{CLOSED}: {zero}{ends}"
        return
    several = len(function.intervals) > 1
    for each in function.intervals:
        where = f", {begin + each.start:.5g} to {begin + each.end:.5g} s" if several else ""
        yield name, start, end, f"{each.rule}{where}{ends}"
        name = start = end = ""


# What `Motion.explain` calls, from below.
Motion._explained = staticmethod(text_of)  # pyright: ignore[reportPrivateUsage]
