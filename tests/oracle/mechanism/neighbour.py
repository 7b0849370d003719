"""The neighbour rule: whose events a list is that differs from the exact one.

    p -> p - sign(G) sign(dG/dp) 32 ulp(p)        for all inputs p, G the first quantity that was decided otherwise

Quantities near the first difference are the slacks of the hold rule, the least values of event functions, their values
where a phase begins, and the times between zeros of two of them. Which was decided otherwise is not known from a list:
they are tried in the order of |G| over what 32 ulp of all inputs move it. A list without a neighbour is wrong. An
extremum within 16 ulp of zero counts as grazing, so the motion that grazes is tried last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ..polynomials import horner, refine
from .chain import Run, between, hold_slacks, violated
from .equations import Problem
from .flow import BITS, Point, expand, fixed, loose
from .guards import Polynomial, guards, polynomial
from .numbers import TINY, Real, mp, ulp
from .solution import Solution, solve

STEP = mp.mpf("1e-25")  # relative, of the differences for gradients
ULPS = 32
GRAZES = 16  # ulp of its terms within which an extremum only grazes zero
SOLVES = 4
TIE = mp.mpf("1e-50")  # what is smaller against what the moves change is an exact tie: the written rule decides it
REACH = 2  # a quantity larger than this many times what the moves change is not tried
MOST = 300  # windows of a phase that are looked at, the last ones
GRID = 32  # places of a window between which an event function's slope changes sign at most once

Label = tuple[Any, ...]


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


def neighbour(problem: Problem, kinds: Sequence[str], digits: int = 53) -> Neighbour:
    """The neighbour with these event kinds, the ending last, inputs moved by 32 ulp of so many binary digits at a time.

    >>> from tests.oracle.mechanism import builders, read
    >>> drop = read(builders.stance(builders.HOPPER_C, v2="-1.930751"))
    >>> neighbour(drop, ["x2_reverses", "x2_sticks", "rest"]).found
    False
    """
    wanted, here, attempts = tuple(kinds), solve(problem), list[Attempt]()
    while here.kinds != wanted and len(attempts) < SOLVES:
        place = difference(here.kinds, wanted)
        advanced = False
        for label, value, slopes in decisions(here, place, digits):
            moved = solved(shifted(here.problem, value, slopes, digits))
            if moved is None:
                continue
            attempts.append(Attempt(label, value, reach_of(here.problem, slopes, digits), moved.kinds))
            advanced = moved.kinds == wanted or difference(moved.kinds, wanted) > place
            if advanced or len(attempts) == SOLVES:
                here = moved
                break
        if not advanced:
            break
    if here.kinds != wanted:
        band = GRAZES * mp.ldexp(1, 1 - digits)
        here = solve(problem, band)
        attempts.append(Attempt(("grazing",), band, band, here.kinds))
    return Neighbour(here if here.kinds == wanted else None, tuple(attempts))


def solved(problem: Problem) -> Solution | None:
    """The motion, or none where a move carries the start out of the model."""
    try:
        return solve(problem)
    except ValueError:
        return None


def difference(a: Sequence[str], b: Sequence[str]) -> int:
    """The first place where two lists differ."""
    return next((n for n, (p, q) in enumerate(zip(a, b, strict=False)) if p != q), min(len(a), len(b)))


Slopes = dict[tuple[str, ...], Real]


def decisions(solution: Solution, place: int, digits: int) -> list[tuple[Label, Real, Slopes]]:
    """Quantities that 32 ulp may carry through zero, with their relative slopes by inputs; the nearest first."""
    problem, base = solution.problem, quantities(solution, place)
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


def shifted(problem: Problem, value: Real, slopes: Slopes, digits: int) -> Problem:
    """Every input moved by 32 ulp so that the quantity goes towards zero and through it."""
    inputs, moves = problem.inputs(), dict[str, Real]()
    for group, slope in slopes.items():
        for name in group:
            way = -mp.sign(value) * mp.sign(slope) * mp.sign(inputs[name])
            moves[name] = inputs[name] + way * ULPS * ulp(inputs[name], digits)
    return problem.moved(moves)


# ---- quantities ----


def quantities(solution: Solution, place: int) -> dict[Label, Real]:
    """What decides the event at a place of the list, by label."""
    run, found = solution.run, dict[Label, Real]()
    before = max((phase.before for phase in run.phases if phase.before <= place), default=0)
    near = [n for n, phase in enumerate(run.phases) if phase.before == before]
    for n in [*near, *(m for m in near[-1:] if m + 1 < len(run.phases) for m in [m + 1])]:
        phase = run.phases[n]
        for (e, side), slack, _ in hold_slacks(run, phase.point, phase.mode, phase.u):
            found["hold", n, e, side] = slack
    for n in near:
        found |= phase_quantities(solution, n)
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
