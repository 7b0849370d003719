"""The neighbour rule: whose events a list is that differs from the exact one.

    p -> p - sign(G) sign(dG/dp) 32 ulp(p)        for all inputs p, G the first quantity that was decided otherwise

Quantities near the first difference are the least values of event functions, their values where a phase begins, and the
times between zeros of two of them; and the slacks of the hold rule up to there, because what an element does at the
start, or at a step of the input, need not be an event. Which was decided otherwise is not known from a list:
they are tried in the order of |G| over what 32 ulp of all inputs move it. A list without a neighbour is wrong. An
extremum within 16 ulp of zero counts as grazing, so the motion that grazes is tried last.

On a threshold of the hold rule a motion may be unlike those on both sides of it: what no friction holds rests where the
force on it is exactly 0, and what starts there starts with the acceleration 0. So all inputs are moved by one share of
32 ulp, too, at which G = 0; where two elements rest, at which both are on their thresholds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from typing import Any

from ..polynomials import horner, refine
from .chain import Run, between, hold_slacks, violated
from .equations import Problem
from .flow import BITS, Point, expand, fixed, loose
from .guards import Polynomial, guards, polynomial
from .numbers import TINY, Real, apply, inverse, mp, ulp
from .solution import Solution, solve

STEP = mp.mpf("1e-25")  # relative, of the differences for gradients
ULPS = 32
GRAZES = 16  # ulp of its terms within which an extremum only grazes zero
SOLVES = 4
TIE = mp.mpf("1e-50")  # what is smaller against what the moves change is an exact tie: the written rule decides it
REACH = 2  # a quantity larger than this many times what the moves change is not tried
MOST = 300  # windows of a phase that are looked at, the last ones
NEWTON = 12  # steps to a threshold at most
GRID = 32  # places of a window between which an event function's slope changes sign at most once

Label = tuple[Any, ...]
Slopes = dict[tuple[str, ...], Real]  # relative, by group of inputs
Decision = tuple[Label, Real, Slopes]  # a quantity, its value
Differs = Callable[[Solution], int | None]


@dataclass(frozen=True)
class Attempt:
    """A quantity that was moved through zero, and the events that came of it."""

    label: Label
    value: Real
    reach: Real
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class Neighbour:
    """What the search came to: the solution with the wanted events, or none."""

    solution: Solution | None
    attempts: tuple[Attempt, ...]

    @property
    def found(self) -> bool:
        return self.solution is not None


def neighbour(problem: Problem, kinds: Sequence[str], digits: int = 53, differs: Differs | None = None) -> Neighbour:
    """The neighbour with these event kinds, the ending last, inputs moved by 32 ulp of so many binary digits at a time.

    differs: the first place at which a motion is not what is wanted, None for one that is; else by the kinds alone.

    >>> from tests.oracle.mechanism import builders, read
    >>> drop = read(builders.stance(builders.HOPPER_C, v2="-1.930751"))
    >>> neighbour(drop, ["x2_reverses", "x2_sticks", "rest"]).found
    False
    """
    differs = differs or by_kinds(tuple(kinds))
    start, attempts = solve(problem), list[Attempt]()
    place = differs(start)
    if place is None:
        return Neighbour(start, ())
    near = decisions(start, place, digits)
    for attempt, moved in chain(
        through_zero(start, near, differs, digits), on_thresholds(start, near, place, digits), grazing(problem, digits)
    ):
        attempts.append(attempt)
        if differs(moved) is None:
            return Neighbour(moved, tuple(attempts))
    return Neighbour(None, tuple(attempts))


Tries = Iterator[tuple[Attempt, Solution]]


def through_zero(start: Solution, near: Sequence[Decision], differs: Differs, digits: int) -> Tries:
    """Motions with all inputs moved by 32 ulp; from one that is as wanted further than the one before, again."""
    here, place, solves = start, differs(start), 0
    while place is not None:
        further = None
        for label, value, slopes in near:
            moved = solved(shifted(here.problem, [(value, slopes, mp.one)], digits))
            if moved is None:
                continue
            yield Attempt(label, value, reach_of(here.problem, slopes, digits), moved.kinds), moved
            solves += 1
            further = differs(moved)
            if solves == SOLVES:
                return
            if further is None or further > place:
                here = moved
                break
        else:
            return
        place = further
        near = [] if place is None else decisions(here, place, digits)


def grazing(problem: Problem, digits: int) -> Tries:
    band = GRAZES * mp.ldexp(1, 1 - digits)
    moved = solve(problem, band)
    yield Attempt(("grazing",), band, band, moved.kinds), moved


def by_kinds(wanted: tuple[str, ...]) -> Differs:
    return lambda solution: None if solution.kinds == wanted else difference(solution.kinds, wanted)


def on_thresholds(start: Solution, near: Sequence[Decision], place: int, digits: int) -> Tries:
    """Neighbours that are exactly on thresholds of the hold rule where a phase begins; on as many as can be, first."""
    holds = [each for each in near if each[0][0] == "hold"]
    for n in sorted({label[1] for label, _, _ in holds}):
        of_phase = [each for each in holds if each[0][1] == n]
        for count in range(min(2, len(of_phase)), 0, -1):
            for chosen in combinations(of_phase, count):
                moved = balanced(start, place, chosen, digits)
                if moved is not None:
                    label, value, slopes = chosen[0]
                    yield Attempt(("on", *label), value, reach_of(start.problem, slopes, digits), moved.kinds), moved


def balanced(here: Solution, place: int, chosen: Sequence[Decision], digits: int) -> Solution | None:
    """The motion in which quantities are exactly 0, by Newton's steps; none where that takes more than 32 ulp."""
    problem, values = up_to(here, place), tuple(value for _, value, _ in chosen)
    shares = tuple(mp.zero for _ in chosen)
    ways = [moves_of(problem, value, slopes, digits) for _, value, slopes in chosen]
    try:
        back = inverse(tuple(tuple(change_by(problem, slopes, way) for way in ways) for _, _, slopes in chosen))
    except ZeroDivisionError:  # one threshold twice
        return None
    for _ in range(NEWTON):
        shares = tuple(share - step for share, step in zip(shares, apply(back, values), strict=True))
        if mp.fsum(shares, absolute=True) > 1:
            return None
        there = shifted(problem, [(v, p, s) for (_, v, p), s in zip(chosen, shares, strict=True)], digits)
        moved = solved(there)
        found = {} if moved is None else hold_quantities(moved, place)
        if any(label not in found for label, _, _ in chosen):
            return None
        values = tuple(found[label] for label, _, _ in chosen)
        if not any(values):
            return solved(replace(there, max_phases=here.problem.max_phases))
    return None


def solved(problem: Problem) -> Solution | None:
    """The motion, or none where a move carries the start out of the model."""
    try:
        return solve(problem)
    except ValueError:
        return None


def difference(a: Sequence[str], b: Sequence[str]) -> int:
    """The first place where two lists differ."""
    return next((n for n, (p, q) in enumerate(zip(a, b, strict=False)) if p != q), min(len(a), len(b)))


def decisions(solution: Solution, place: int, digits: int) -> list[Decision]:
    """Quantities that 32 ulp may carry through zero, with their relative slopes by inputs; the nearest first."""
    problem = up_to(solution, place)
    solution = solve(problem)
    base = quantities(solution, place)
    gradients: dict[Label, Slopes] = {label: {} for label in base}
    for group in problem.groups():
        for step in (STEP, -STEP):
            moved = solved(scaled(problem, group, 1 + step))
            other = {} if moved is None else quantities(moved, place)
            for label, value in base.items():
                if label in other and group not in gradients[label]:
                    gradients[label][group] = (other[label] - value) / step
            if moved is not None and moved.kinds == solution.kinds:
                break
    found = list[tuple[Real, Label, Real, Slopes]]()
    for label, value in base.items():
        reach = reach_of(problem, gradients[label], digits)
        if TIE * reach < abs(value) <= REACH * reach:
            found.append((abs(value) / reach, label, value, gradients[label]))
    return [(label, value, slopes) for _, label, value, slopes in sorted(found, key=nearness)]


def up_to(solution: Solution, place: int) -> Problem:
    """The problem of the phases by which the event at a place of the list is decided."""
    problem, last = solution.problem, max(phases_near(solution, place), default=0)
    return replace(problem, max_phases=min(problem.max_phases, last + 3))


def nearness(entry: tuple[Real, Label, Real, Slopes]) -> Real:
    return entry[0]


def scaled(problem: Problem, group: Sequence[str], factor: Real) -> Problem:
    inputs = problem.inputs()
    return problem.moved({name: inputs[name] * factor for name in group})


def reach_of(problem: Problem, slopes: Slopes, digits: int) -> Real:
    """How much 32 ulp of every input may change a quantity."""
    inputs = problem.inputs()
    return ULPS * mp.fsum(
        abs(slope / inputs[group[0]]) * ulp(inputs[group[0]], digits) for group, slope in slopes.items()
    )


def moves_of(problem: Problem, value: Real, slopes: Slopes, digits: int) -> dict[str, Real]:
    """32 ulp of every input, to the side on which the quantity goes towards zero and through it."""
    inputs, moves = problem.inputs(), dict[str, Real]()
    for group, slope in slopes.items():
        for name in group:
            way = -mp.sign(value) * mp.sign(slope) * mp.sign(inputs[name])
            moves[name] = way * ULPS * ulp(inputs[name], digits)
    return moves


def change_by(problem: Problem, slopes: Slopes, moves: dict[str, Real]) -> Real:
    """What moves of the inputs change a quantity by, as far as it is linear."""
    inputs = problem.inputs()
    return mp.fsum(slope * moves.get(group[0], 0) / inputs[group[0]] for group, slope in slopes.items())


def shifted(problem: Problem, towards: Sequence[tuple[Real, Slopes, Real]], digits: int) -> Problem:
    """Every input moved by a share of 32 ulp so that a quantity goes towards zero; of several, by a share for each."""
    moved = problem.inputs()
    for value, slopes, share in towards:
        for name, move in moves_of(problem, value, slopes, digits).items():
            moved[name] += share * move
    return problem.moved(moved)


# ---- quantities ----


def quantities(solution: Solution, place: int) -> dict[Label, Real]:
    """What decides the event at a place of the list, by label."""
    found = hold_quantities(solution, place)
    for n in phases_near(solution, place):
        found |= phase_quantities(solution, n)
    return found


def phases_near(solution: Solution, place: int) -> list[int]:
    """The phases that end with the event at a place of the list, or with a step before it."""
    phases = solution.run.phases
    before = max((phase.before for phase in phases if phase.before <= place), default=0)
    return [n for n, phase in enumerate(phases) if phase.before == before]


def hold_quantities(solution: Solution, place: int) -> dict[Label, Real]:
    """Slacks of the hold rule where phases begin, up to the one that follows; both of what no friction holds."""
    run, found = solution.run, dict[Label, Real]()
    for n, phase in enumerate(run.phases[: max(phases_near(solution, place), default=0) + 2]):
        for (e, side), slack, _ in hold_slacks(run, phase.point, phase.mode, phase.u):
            found["hold", n, e, side] = slack
            if not solution.system.elements[e].level(1) and not solution.system.elements[e].level(-1):
                found["hold", n, e, -side] = -slack
    return found


def phase_quantities(solution: Solution, n: int) -> dict[Label, Real]:
    """Values at the start, least values, and times between zeros, of the event functions of a phase."""
    phase, end = solution.run.phases[n], phase_end(solution, n)
    flow = solution.run.known_flow(phase.mode)
    found: dict[Label, Real] = {}
    zeros: dict[Label, Real] = {("end",): scheduled(solution, n)}
    if not flow.order:
        return found
    for guard in guards(solution.system, flow, phase.point, phase.mode):
        if guard.kind in ("contact", "limit", "clearance"):
            found["start", n, *guard.label] = guard.value
    for t, z in windows(solution, n, end):
        series = expand(flow, z)
        for guard in guards(solution.system, flow, z, phase.mode):
            function = polynomial(guard, series)
            for value in least_values(function):
                label = ("least", n, *guard.label)
                if label not in found or abs(value) < abs(found[label]):
                    found[label] = value
            root = first_zero(solution.run, function)
            if root is not None and guard.label not in zeros:
                zeros[guard.label] = t + loose(root) * flow.window
    labels = sorted(zeros, key=lambda label: zeros[label])
    for a in labels:
        for b in labels:
            if zeros[a] < zeros[b]:
                found["order", n, *sorted((a, b), key=str)] = (zeros[b] - zeros[a]) * (1 if str(a) < str(b) else -1)
    return found


def phase_end(solution: Solution, n: int) -> Real:
    phases = solution.run.phases
    return phases[n + 1].start if n + 1 < len(phases) else solution.duration


def scheduled(solution: Solution, n: int) -> Real:
    """When a phase ends without an event: the next step of the input, or the horizon."""
    later = [t for t, _ in solution.problem.steps if t > solution.run.phases[n].start]
    return min([*later, solution.problem.horizon])


def windows(solution: Solution, n: int, end: Real) -> Iterator[tuple[Real, Point]]:
    """Window starts of a phase, and one more behind its end."""
    run, phase = solution.run, solution.run.phases[n]
    flow = run.known_flow(phase.mode)
    marks = [mark for mark in run.marks if mark.phase == n]
    count = int(mp.ceil((end - phase.start) / flow.window))
    t = phase.start + max(0, count - MOST) * flow.window
    while marks and t < end + flow.window:
        yield t, between(run, max((m for m in marks if m.time <= t), key=lambda m: m.time), t)
        t += flow.window


def first_zero(run: Run, function: Polynomial) -> int | None:
    """Where an event function falls through zero in a window; not where a window begins just behind it."""
    _, sign = function.leading()
    margin = run.margin
    root = violated(run, function) if sign > 0 else None
    run.margin = margin  # looking is no decision
    return root


def least_values(function: Polynomial) -> Iterator[Real]:
    """Local minima in a window."""
    slope = [n * c for n, c in enumerate(function.c)][1:]
    places = [fixed(mp.mpf(n) / GRID) for n in range(GRID + 1)]
    rates = [horner(slope, place, BITS) for place in places]
    for a, b, p, q in zip(places, places[1:], rates, rates[1:], strict=False):
        if p < 0 <= q:
            bottom = refine(slope, a, b, BITS)
            value = horner(function.c, bottom, BITS)
            if bottom > fixed(TINY):
                yield loose(value) * function.unit
