"""How a stance was solved: of each phase its poles, its event functions, and by which rule of the certificate each of
them has no zero in which interval.

The search is C, and Python is printed from it to the same bits. A private copy of the printed engine solves the stance
again, and notes which functions it calls. docs/explanation/certificate.md has the rules by number.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from importlib.util import find_spec, module_from_spec
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

from hopform._motion import force_unit, masses_of
from hopform._show import name_of
from hopform._solver.package import LegState, Package, Precision
from hopform._solver.printed import Engine, Python, Solved
from hopform._words import ending, input_of, limit_in, modes_of

if TYPE_CHECKING:
    from hopform import Motion, Phase

RULES = {
    "stays_positive_by_bernstein": "rule 1, Bernstein coefficients",
    "has_no_root": "rule 2, signs",
    "stays_positive_by_slope": "rule 2, slope",
    "has_faded": "rule 2, amplitude",
    "minimum_between": "rule 4, the minimum",
    "quiet_time": "rule 5, quiet time",
}
"""The rules by the functions of the engine that apply them. Rule 3 has closed forms in place of intervals."""
SIGNS, QUIET = RULES["has_no_root"], RULES["quiet_time"]
CLOSED = "rule 3, closed form"
MONOTONE = "monotone, so its end says all"
TOO_SHORT = "too short to be cut"

NOTE = (
    "Proven by the theorems of rules 1 to 5: no zero is stepped over, for poles and numerators as they are rounded.",
    "Measured, not proven: what counts as above zero. docs/explanation/certificate.md has the bound and its figures.",
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


@dataclass
class Notes:
    """What has been noted of the phase that is being solved, and of the phases before, by their rows."""

    searches: dict[int, Search] = field(default_factory=dict[int, Search])
    intervals: dict[int, list[Interval]] = field(default_factory=dict[int, list[Interval]])
    cuts: int = 0
    last: str | None = None
    """the rule that was asked last"""
    found: dict[int, str] = field(default_factory=dict[int, str])
    """by event function: the rule that certified it, in the interval that is being looked at"""

    def add(self, n: int, start: Any, end: Any, rule: str) -> None:
        """An interval of function n; what is certified anew from the same time on is so further, or less far."""
        kept = [each for each in self.intervals.get(n, []) if each.start < float(start)]
        self.intervals[n] = [*kept, Interval(float(start), float(end), rule)]


class Watched:
    """A private copy of the printed engine of a package, which notes what it does."""

    def __init__(self, package: Package, dtype: Precision) -> None:
        spec = find_spec(Engine(package, dtype).module.__name__)
        assert spec is not None
        assert spec.loader is not None
        self.engine = module_from_spec(spec)
        spec.loader.exec_module(self.engine)
        own = Package(package.name)
        setattr(own, spec.name.rpartition(".")[2], self.engine)
        self.back_end, self.lock, self.notes = Python(own), Lock(), Notes()
        for name, rule in RULES.items():
            self._note(name, partial(self._rule, rule))
        self._note("is_certified", self._is_certified)
        self._note("is_certified_inside", self._is_certified_inside)
        self._note("are_certified", self._are_certified)
        self._note("next_end", self._next_end)
        self._note("stance_find_end", self._find_end)

    def solve(self, *asked: Any) -> tuple[Solved, dict[int, Search]]:
        """The stance, and by its row how each of its phases was solved."""
        with self.lock:
            self.notes = Notes()
            return self.back_end.solve_stance(*asked), self.notes.searches

    def _note(self, name: str, note: Callable[..., None]) -> None:
        """Have a function of the engine noted, with its answer behind its arguments."""
        function = getattr(self.engine, name)

        def noted(*arguments: Any) -> Any:
            answer = function(*arguments)
            note(*arguments, answer)
            return answer

        setattr(self.engine, name, noted)

    def _rule(self, rule: str, *_: Any) -> None:
        self.notes.last = rule

    def _is_certified(self, set_: Any, in_: Any, n: int, d: Any, answer: bool) -> None:
        """The rules are asked until one says yes."""
        if answer and self.notes.last:
            self.notes.found[n] = self.notes.last
        self.notes.last = None

    def _is_certified_inside(self, set_: Any, in_: Any, n: int, d: Any, answer: bool) -> None:
        if answer:
            self.notes.found[n] = self.notes.last or TOO_SHORT
        self.notes.last = None

    def _are_certified(self, set_: Any, in_: Any, answer: bool) -> None:
        """An interval is certified for all functions, or it has been cut."""
        for n in range(set_.count) if answer else ():
            if set_.function[n].needs_certificate:  # the cheap half of rule 2 is no function
                self.notes.add(n, in_.low.t, in_.high.t, self.notes.found.get(n, SIGNS))
        self.notes.cuts += not answer
        self.notes.found = {}

    def _next_end(self, set_: Any, in_: Any, limit: Any, end: Any, quiet: bool) -> None:
        for n in range(set_.count) if quiet else ():
            if set_.function[n].needs_certificate:
                self.notes.add(n, in_.low.t, end[0], QUIET)

    def _find_end(self, chain: Any, search: Any, _: None) -> None:
        """The end of a phase is found."""
        moves = not self.engine.all_rest(chain.side)
        found = tuple(self._functions(chain, search)) if moves else ()
        poles, half_period = poles_of(search.events.set, self.engine.both_slip(chain.side)) if moves else ((), 0.0)
        length = float(search.in_.high.t)
        self.notes.searches[chain.count - 1] = Search(length, poles, half_period, found, self.notes.cuts)
        self.notes.intervals, self.notes.cuts = {}, 0

    def _functions(self, chain: Any, search: Any) -> Iterator[EventFunction]:
        """The event functions that the engine searches, and the one whose first zero has a closed form."""
        engine, end, events = self.engine, search.in_.high, search.events
        for n in range(events.set.count):
            g = events.set.function[n]
            within = [each for each in self.notes.intervals.get(n, []) if each.start < end.t]
            certified = tuple(each._replace(end=min(each.end, float(end.t))) for each in within)
            monotone = (Interval(0.0, float(end.t), MONOTONE),)
            shown = certified if g.needs_certificate else monotone
            ends = (g.owner, n) == (search.owner, search.in_.found)
            # in the modal form `start` is the final value, and at the start exp(-a t) = cos = 1
            start = float(g.start + g.H3 + g.H2 if self.engine.is_modal(end) else g.start)
            yield EventFunction(*self._named(g, chain), start, self._value(g, end), shown, math.nan, ends)
        if events.rests >= engine.CONTACT:
            element, contact = events.rests - engine.ELEMENT, events.rests == engine.CONTACT
            h = chain.motion.compression if contact else chain.motion.velocity[element]
            sign = 1.0 if contact else float(chain.side[element])
            start = sign * (chain.at.y if contact else chain.at[element + 1])
            g = engine.EventFunction(sign * h.H3, sign * h.H2, sign * h.H1, 0.0, start)
            g.owner = events.rests
            zero = float(events.rest_time) if events.rest_time < engine.NEVER else math.inf
            ends = search.owner == events.rests and not zero > float(end.t)
            yield EventFunction(*self._named(g, chain), float(start), self._value(g, end), (), zero, ends)

    def _value(self, g: Any, at: Any) -> float:
        """The value of an event function, or 0 if that is within its rounding bound."""
        value = self.engine.value_at(g, at)
        return float(value) if abs(value) > self.engine.rounding_of(g, at, 0.0 * value) else 0.0

    def _named(self, g: Any, chain: Any) -> tuple[str, str]:
        """Name and unit of an event function."""
        if g.owner == self.engine.CONTACT:
            return "N/k", "m"
        if g.owner == self.engine.LIMIT:
            under_law = self.engine.limit_of_chain(chain) == 0
            return ("room of the law" if under_law else "law beyond its limit"), "N"
        element = g.owner - self.engine.ELEMENT
        number, side = element + 1, chain.side[element]
        if g.touch_is_no_event:
            return ("x1_max - x1" if side > 0 else "x1 - x1_min"), "m"
        if side == 0:
            excess = self.engine.excess_to_side(chain.plan.robot, element, g.side)
            at_rest = f"f{number} + f{number}_excess" if excess > 0.0 else f"f{number}"
            return f"{at_rest} {'-' if g.side > 0 else '+'} a{number}", "m/s^2"
        return f"{'' if side > 0 else '-'}v{number}", "m/s"


def poles_of(set_: Any, several: bool) -> tuple[tuple[complex, ...], float]:
    """The poles of a mode, and half the period of its pair; where one mass is held there are two."""
    pair = set_.poles
    mean = 0.5 * float(pair.p)
    square = float(pair.q) - mean * mean
    real = (complex(-float(pair.a)),) if several else ()
    if square > 0.0:
        omega = math.sqrt(square)
        return (*real, complex(-mean, omega), complex(-mean, -omega)), math.pi / omega
    fast = mean + math.sqrt(-square)
    slow = float(pair.q) / fast if fast > 0.0 else 0.0
    return (*real, complex(-fast), complex(-slow)), math.inf


@lru_cache(maxsize=8)
def watched(package: Package, dtype: Precision) -> Watched:
    """The copy for a package and a precision, made once."""
    return Watched(package, dtype)


def searches_of(stance: "Motion", asked: tuple[LegState, float, int]) -> tuple[Solved, dict[int, Search]]:
    """The motion solved again from what was asked, start, horizon and bound on phases, and how."""
    robot, (start, horizon, most) = stance.robot, asked
    watch = watched(robot.solver.package, stance.dtype)
    return watch.solve(robot.parameters, start, stance.u, horizon, most, stance.dtype)


# ---- in words ----


def text_of(stance: "Motion", asked: tuple[LegState, float, int]) -> str:
    """How the motion was solved, phase by phase."""
    solved, searches = searches_of(stance, asked)
    rows, words = solved.phase_rows(), stance.robot.solver.package.records.EVENTS
    about = ", ".join(each for each in (name_of(stance.robot), input_of(stance)) if each)
    lines = [f"{about}; {ending(stance)}"]
    for n, phase in enumerate(stance.phases):
        kind = kind_of(rows[n], rows[n + 1], words, stance) if n + 1 < len(rows) else stance.status
        lines += ["", *of_phase(n + 1, stance, phase, kind, searches.get(n))]
    return "\n".join([*lines, "", *NOTE])


def kind_of(row: tuple[Any, ...], following: tuple[Any, ...], words: Mapping[int, str], motion: "Motion") -> str:
    """What ends a phase, by its row and the next one."""
    *_, mode, event, step = following
    if motion.robot.solver.facts.currents:
        reached = row[2] % 3 != mode % 3
        return words.get(event, "a step of the target" if step != row[-1] else "a limit of the current" if reached
                         else "a touch, which is no event")  # fmt: skip
    return words.get(event, "a step of the current" if step != row[-1] else "a touch, which is no event")


def of_phase(number: int, stance: "Motion", phase: "Phase", kind: str, search: Search | None) -> Iterator[str]:
    """A phase: its poles, then a row for each event function."""
    solver = stance.robot.solver
    named = zip(masses_of(solver), modes_of(phase, stance.robot), strict=True)
    modes = ", ".join(f"{mass.name} {mode}" for mass, mode in named)
    modes += "".join(f", {each['name']} {limit_in(phase)}" for each in solver.facts.currents)
    yield f"Phase {number}, {phase.start:.5g} to {phase.end:.5g} s: {modes}; then {kind}"
    if search is None or not search.functions:
        moves = any((phase.mode_1, phase.mode_2)[mass.number - 1] for mass in masses_of(solver))
        yield "  two events at the same time" if moves else "  nothing moves, so that nothing is searched"
        return
    half = f"half a period is {search.half_period:.4g} s" if search.half_period < math.inf else "all real"
    cuts = f"; {search.cuts} interval{'s' * (search.cuts > 1)} cut" if search.cuts else ""
    yield f"  poles [1/s]: {', '.join(poles_in_words(search.poles))}; {half}{cuts}"
    rows = [("event function", "start", "end", "no earlier zero, by")]
    functions = (in_names(function, stance) for function in search.functions)
    rows += [row for function in functions for row in rows_of(function, phase.start)]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    for name, start, end, why in rows:
        yield f"  {name:{widths[0]}}  {start:>{widths[1]}}  {end:>{widths[2]}}  {why}"


def in_names(function: EventFunction, motion: "Motion") -> EventFunction:
    """An event function under the names and in the units of the model."""
    names, units = dict[str, str](), {"N/k": "m"}
    for mass in masses_of(motion.robot.solver):
        n = mass.number
        names |= {f"x{n}": mass.position, f"v{n}": mass.velocity}
        names |= dict(zip((f"x{n}_min", f"x{n}_max"), mass.stops, strict=False))
        units |= {each: mass.unit for each in (f"x{n}", f"v{n}", f"a{n}")}
    length_of_first = masses_of(motion.robot.solver)[0].unit
    tokens = re.findall(r"[a-z]+[12](?:_max|_min)?|N/k", function.name)
    length = next((units[each] for each in tokens if each in units), "m")
    name = re.sub(r"[xv][12](?:_max|_min)?", lambda found: names.get(found[0], found[0]), function.name)
    unit = force_unit(length_of_first) if function.unit == "N" else function.unit.replace("m", length, 1)
    return function._replace(name=name, unit=unit)


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
