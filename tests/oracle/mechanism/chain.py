"""A motion as a chain of phases: in each, one set of elements is held, the others slip one way each.

At every change all combinations that the velocities allow are tried, held elements first, and the one whose event
functions all start upwards is the motion: the first non-zero derivative decides. Friction is a monotone law, so there
is one. What ends a phase is the first of its event functions that falls through zero.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from ..polynomials import first_crossing
from .equations import Problem, System
from .flow import BITS, LEADING, Flow, Point, Series, advance, at, expand, fixed, loose
from .guards import Guard, Mode, Polynomial, blocked, guards, polynomial
from .leap import Level, leap, levels
from .numbers import (
    TINY,
    Matrix,
    Real,
    Vector,
    apply,
    dot,
    free_rows,
    independent,
    inverse,
    magnitude,
    mp,
    null_space,
    times,
    total,
    transpose,
)

SHORT_STEPS = 3  # windows of a phase before a long step is tried
MOST_WINDOWS = 200_000
TIE = max(fixed(TINY), 1)
FlowKey = tuple[tuple[int, ...], bool]  # what is held, and whether a law acts unsaturated


@dataclass(frozen=True)
class Event:
    """A change of an element's motion."""

    time: Real
    kind: str


@dataclass(frozen=True)
class Phase:
    """A stretch of one mode and one input; `before` is how many events lie before it."""

    start: Real
    point: Point
    mode: Mode
    u: Real
    before: int


@dataclass(frozen=True)
class Mark:
    """A state that was passed: the start of a window or of a long step."""

    time: Real
    phase: int
    point: Point


@dataclass(frozen=True)
class Hit:
    """The end of a phase by events: time, state there before it changes, what is due."""

    time: Real
    point: Point
    due: tuple[Guard, ...]


@dataclass
class Run:
    """A motion in the making."""

    problem: Problem
    system: System
    grazing: Real = mp.zero  # how far below zero, relative to their terms, forces and distances still only graze it
    flows: dict[FlowKey, Flow | None] = field(default_factory=dict[FlowKey, Flow | None])
    spectra: dict[int, list[Level]] = field(default_factory=dict[int, list[Level]])
    phases: list[Phase] = field(default_factory=list[Phase])
    marks: list[Mark] = field(default_factory=list[Mark])
    events: list[Event] = field(default_factory=list[Event])
    losses: list[tuple[Real, Real]] = field(
        default_factory=list[tuple[Real, Real]]
    )  # (time, kinetic energy) taken by the limits
    margin: Real = mp.inf
    windows: int = 0

    def flow(self, mode: Mode) -> Flow | None:
        """The motion of a mode; none where held directions depend on each other."""
        key = mode.held, self.system.law is not None and not mode.saturation
        if key not in self.flows:
            try:
                self.flows[key] = Flow(self.system, *key)
            except ZeroDivisionError:
                self.flows[key] = None
        return self.flows[key]

    def known_flow(self, mode: Mode) -> Flow:
        flow = self.flow(mode)
        assert flow is not None
        return flow

    def near(self, value: Real, scale: Real) -> None:
        if scale:
            self.margin = min(self.margin, abs(value) / scale)

    def mark(self, t: Real) -> int:
        """The last stored state up to t."""
        return bisect_right(self.marks, t, key=lambda mark: mark.time) - 1


# ---- forces of a mode ----


def inputs(system: System, q: Vector, mode: Mode, u: Real) -> list[Vector]:
    """What a mode adds to the forces r: friction of slipping elements, the input."""
    parts = list[Vector]()
    for element, sign in zip(system.elements, mode.signs, strict=True):
        if sign:
            parts.append(tuple(p * element.friction(sign) for p in element.direction))
    law = system.law
    if law is None:
        force = u
    elif mode.saturation:
        force = mode.saturation * law.limit
    else:
        force = mp.fsum([dot(law.row.q, q), law.row.constant, law.target * u])
    return [*parts, tuple(p * force for p in system.input)]


def rebased(system: System, z: Point, old: tuple[Mode, Real] | None, new: tuple[Mode, Real]) -> Point:
    """The same state with the forces of another mode and input."""
    away = [] if old is None else inputs(system, z.q, *old)
    come = inputs(system, z.q, *new)
    r = list[Real]()
    for i, p in enumerate(z.r):
        gone, added = sorted(part[i] for part in away), sorted(part[i] for part in come)
        r.append(p if gone == added else total(p, *(-q for q in gone), *added))
    return replace(z, r=tuple(r))


def loaded(system: System, q: Vector, v: Vector) -> Point:
    """A state with springs and constant forces only."""
    r = [
        total(f, *(-p * x for p, x in zip(row, q, strict=True)))
        for f, row in zip(system.force, system.stiffness, strict=True)
    ]
    return Point(q, v, tuple(r))


# ---- what moves at a change ----


def choices(system: System, z: Point, u: Real, armed: bool) -> Iterator[Mode]:
    """The modes that the velocities and the law allow, those with more held elements first."""
    signs: list[list[int]] = []
    for e, element in enumerate(system.elements):
        rate = dot(element.direction, z.v)
        shut = blocked(system, e, z.q)
        signs.append([int(mp.sign(rate))] if rate else [0, *(s for s in (1, -1) if s not in shut)])
    sides, aim = [0], mp.zero if system.law is None else u
    if system.law is not None and mp.isfinite(system.law.limit):
        terms = [*system.law.row.terms(z.q, z.v), system.law.target * u]
        over = {side: total(*(side * q for q in terms), -system.law.limit) for side in (1, -1)}
        sides = [side for side, q in over.items() if q > 0] or [0, *(side for side, q in over.items() if q == 0)]
    combinations = sorted(product(*signs), key=lambda pair: sum(map(abs, pair)))
    for pair in combinations:
        for side in sides:
            yield Mode(pair, side, armed, aim)


def choose(run: Run, z: Point, old: tuple[Mode, Real] | None, u: Real, armed: bool) -> tuple[Mode, Point]:
    """The mode that the state takes, by velocities and at rest by the hold rule, and the state with its forces."""
    system = run.system
    for mode in choices(system, z, u, armed):
        flow = run.flow(mode)
        if flow is None:
            continue
        trial = rebased(system, z, old, (mode, u))
        series = expand(flow, trial, LEADING) if flow.order else Series(flow, mp.one, [], [], [])
        if all(starts_well(polynomial(guard, series)) for guard in undecided(system, flow, trial, mode)):
            note_holds(run, trial, mode, u)
            return mode, trial
    raise ArithmeticError(f"{run.problem.name}: no mode fits the state q = {z.q}, v = {z.v}")


def undecided(system: System, flow: Flow, z: Point, mode: Mode) -> Iterator[Guard]:
    """The event functions that the choice of a mode must start upwards."""
    for guard in guards(system, flow, z, mode):
        resting = guard.kind == "velocity" and not guard.value
        if resting or guard.kind in ("hold", "law"):
            yield guard


def starts_well(function: Polynomial) -> bool:
    """A held element may sit on its level for good, a slipping one must move."""
    _, sign = function.leading()
    return sign > 0 or (sign == 0 and function.guard.kind != "velocity")


def hold_slacks(run: Run, z: Point, mode: Mode, u: Real) -> Iterator[tuple[tuple[int, int], Real, Real]]:
    """(element, side), slack of the hold rule and its scale for each element at rest, the others as they are."""
    system = run.system
    for e, sign in enumerate(mode.signs):
        if dot(system.elements[e].direction, z.v):
            continue
        held = replace(mode, signs=tuple(0 if i == e else s for i, s in enumerate(mode.signs)))
        flow = run.flow(held)
        if flow is None:
            continue
        trial = rebased(system, z, (mode, u), (held, u))
        for guard in guards(system, flow, trial, held):
            if guard.kind == "hold" and guard.element == e and (not sign or guard.side == sign):
                yield (e, guard.side), guard.value, guard.scale


def note_holds(run: Run, z: Point, mode: Mode, u: Real) -> None:
    """How close the force was to the friction level; an exact tie, settled by a derivative, is no close call."""
    for _, slack, scale in hold_slacks(run, z, mode, u):
        if slack:
            run.near(slack, scale)


# ---- impacts ----


def impact(system: System, q: Vector, v: Vector, resting: Sequence[int] = ()) -> Vector:
    """The velocity after the limits took what moves into them: projected along M^-1 c onto all that are violated.

    Elements at rest that the impact sets in motion are released: friction gives no impulse.
    """
    struck: list[int] = []
    while True:
        into = [
            e
            for e in range(len(system.elements))
            if e not in struck and int(mp.sign(dot(system.elements[e].direction, v))) in blocked(system, e, q)
        ]
        if not into:
            return v
        struck += into
        C: Matrix = tuple(system.elements[e].direction for e in struck)
        CM = times(C, system.mobility)
        impulse = apply(inverse(times(CM, transpose(C))), apply(C, v))
        after = tuple(total(p, -dot(column, impulse)) for p, column in zip(v, zip(*CM, strict=True), strict=True))
        still = [e for e in resting if unmoved(system.elements[e].direction, v, after)]
        v = arrested(system, after, [*struck, *still])


def unmoved(direction: Vector, before: Vector, after: Vector) -> bool:
    """Whether an impact left an element at rest, to within rounding."""
    return bool(abs(dot(direction, after)) <= TINY * (magnitude(direction, before) + magnitude(direction, after)))


def arrested(system: System, v: Vector, resting: Sequence[int]) -> Vector:
    """The velocity with that of elements at rest exactly zero: free coordinates keep theirs, the others follow."""
    held: Matrix = ()
    for e in resting:
        more = (*held, system.elements[e].direction)
        held = more if independent(more, system.size) else held
    Z = null_space(held, system.size)
    return apply(Z, tuple(v[i] for i in free_rows(Z)))


def placed(q: Vector, direction: Vector, limit: Real) -> Vector:
    """The position moved the shortest way so that direction . q is exactly the limit."""
    excess, square = mp.fdot(direction, q) - limit, mp.fdot(direction, direction)
    return tuple(p - d * excess / square if d else p for p, d in zip(q, direction, strict=True))


def at_limits(system: System, q: Vector) -> Vector:
    """The position with what is at a limit to within rounding exactly there."""
    for e, element in enumerate(system.elements):
        for side in blocked(system, e, q):
            q = placed(q, element.direction, element.limit(side))
    return q


def settle(run: Run, hit: Hit, mode: Mode) -> Point:
    """The state after events: what is zero is exactly zero, a limit takes the velocity of what hits it."""
    system, q = run.system, hit.point.q
    resting = {*mode.held, *(guard.element for guard in hit.due if guard.kind == "velocity")}
    v = arrested(system, hit.point.v, sorted(resting))
    for guard in hit.due:
        if guard.kind == "limit":
            q = placed(q, system.elements[guard.element].direction, system.elements[guard.element].limit(guard.side))
    q = at_limits(system, q)
    after = impact(system, q, v, sorted(resting))
    lose(run, hit.time, v, after)
    return replace(hit.point, q=q, v=after)


def lose(run: Run, t: Real, before: Vector, after: Vector) -> None:
    """Book the kinetic energy that an impact takes."""
    mass = run.system.mass
    loss = [mp.fdot(v, [mp.fdot(row, v) for row in mass]) / 2 for v in (before, after)]
    if before != after and loss[0] != loss[1]:
        run.losses.append((t, loss[1] - loss[0]))


# ---- one phase ----


def search(run: Run, t: Real, z: Point, mode: Mode, end: Real) -> tuple[Hit | None, Point]:
    """The first event of a phase, or none and the state at `end`."""
    flow = run.known_flow(mode)
    if not flow.order:
        run.marks.append(Mark(t, len(run.phases) - 1, z))
        return (Hit(t, z, lifted), z) if (lifted := lifts(run, z)) else (None, z)
    windows, short_steps, allowed = 0, SHORT_STEPS, bands(run, flow, z, mode)
    while t < end:
        run.marks.append(Mark(t, len(run.phases) - 1, z))
        watched = [leniently(guard, allowed) for guard in guards(run.system, flow, z, mode)]
        if windows >= short_steps and not (flow.lawful and run.system.law):
            step = leap(flow, z, watched, (end - t) / flow.window, spectrum(run, flow))
            if step:
                z = advance(flow, z, step * flow.window)
                t += step * flow.window
                continue
            short_steps = 2 * windows
        h = min(flow.window, end - t)
        series = expand(flow, z)
        place, due = first_due(run, [polynomial(guard, series) for guard in watched], fixed(h / flow.window))
        if due:
            return Hit(t + loose(place) * flow.window, at(series, z, place), due), z
        z = at(series, z, fixed(h / flow.window))
        t, windows = t + h, windows + 1
        run.windows += 1
        if run.windows > MOST_WINDOWS:
            raise ArithmeticError(f"{run.problem.name}: more than {MOST_WINDOWS} windows")
    return None, z


def bands(run: Run, flow: Flow, z: Point, mode: Mode) -> dict[tuple[str, int, int], Real]:
    """How far below zero contact forces and distances still only graze it, by their terms where the phase begins."""
    kinds = ("contact", "limit", "clearance") if run.grazing else ()
    found = [guard for guard in guards(run.system, flow, z, mode) if guard.kind in kinds]
    return {guard.label: run.grazing * guard.scale for guard in found}


def leniently(guard: Guard, allowed: Mapping[tuple[str, int, int], Real]) -> Guard:
    return replace(guard, value=guard.value + allowed[guard.label]) if guard.label in allowed else guard


def spectrum(run: Run, flow: Flow) -> list[Level]:
    if id(flow) not in run.spectra:
        run.spectra[id(flow)] = levels(flow)
    return run.spectra[id(flow)]


def first_due(run: Run, functions: Sequence[Polynomial], limit: int) -> tuple[int, tuple[Guard, ...]]:
    """Place of the first violated event function in the window, and all that are due there."""
    found = list[tuple[int, Polynomial]]()
    for function in functions:
        root = violated(run, function)
        if root is not None and root <= limit + TIE:
            found.append((root, function))
    if not found:
        return limit, ()
    first = min(place for place, _ in found)
    due = tuple(function for place, function in found if place <= first + TIE)
    for function in due:
        note_flat(run, function, first)
    return min(first, limit), tuple(function.guard for function in due)


def violated(run: Run, function: Polynomial) -> int | None:
    """Where an event function first fails in a window.

    A velocity that touches zero goes on: what bends it upwards is the force that would move the element, were it held.
    """
    order, sign = function.leading()
    if sign <= 0:
        return 0 if sign else None
    c = function.c[order:]

    def note(place: int, height: int) -> None:
        run.near(loose(height) * function.unit * loose(place) ** order, scale_of(function))

    return first_crossing(c, BITS, int(max(map(abs, c)) * TINY), note)


def scale_of(function: Polynomial) -> Real:
    """What a value of an event function is small or large against."""
    return max(function.guard.scale, function.unit)


def note_flat(run: Run, function: Polynomial, place: int) -> None:
    """A flat crossing has an extremum near by, at a distance g'^2/(2 g'') from zero."""
    x = loose(place)
    slope = mp.fsum(n * loose(c) * x ** (n - 1) for n, c in enumerate(function.c[:60]) if n)
    bend = mp.fsum(n * (n - 1) * loose(c) * x ** (n - 2) for n, c in enumerate(function.c[:60]) if n > 1)
    if bend and slope and place:
        run.near(slope**2 / (2 * bend) * function.unit, scale_of(function))


# ---- the whole ----


def name_events(system: System, t: Real, due: Sequence[Guard], old: Mode, new: Mode) -> list[Event]:
    """The events of one instant in the order of the elements; a limit that is hit comes before what follows from it."""
    names = list[str]()
    for e, element in enumerate(system.elements):
        before, after = old.signs[e], new.signs[e]
        if any(guard.kind == "limit" and guard.element == e for guard in due):
            names.append(f"{element.name}_hits_stop")
        elif before != after:
            names.append(f"{element.name}_{'slips' if not before else 'reverses' if after else 'sticks'}")
    return [Event(t, name) for name in names]


def ending(due: Sequence[Guard]) -> str | None:
    """Contact and touchdown end the motion."""
    words = {"contact": "takeoff", "clearance": "touchdown"}
    return next((words[guard.kind] for guard in due if guard.kind in words), None)


def run_chain(run: Run, z: Point, armed: bool) -> tuple[str, Real, Point]:
    """Status, duration and state at the end."""
    problem, t, piece = run.problem, mp.zero, 0
    steps = [step for step in problem.steps if step[0] == 0 or step[0] < problem.horizon]
    u, rest = steps[0][1], None
    mode, z = choose(run, z, None, u, armed)
    while True:
        if len(run.phases) >= problem.max_phases:
            return "too_many_phases", t, z
        run.phases.append(Phase(t, z, mode, u, len(run.events)))
        last = piece + 1 == len(steps)
        if at_rest(run, z, mode):
            rest = t if rest is None else rest
            if last:
                run.marks.append(Mark(t, len(run.phases) - 1, z))
                return "rest", rest, z
        else:
            rest = None
        hit, z = search(run, t, z, mode, problem.horizon if last else steps[piece + 1][0])
        old, due = (mode, u), () if hit is None else hit.due
        if hit is None:
            if last:
                return "horizon" if mode.armed else "tripped", problem.horizon, z
            piece += 1
            t, u = steps[piece]
        else:
            t, word = hit.time, ending(due)
            if word:
                return word, t, hit.point
            z = settle(run, hit, mode)
        armed = mode.armed or any(guard.kind == "arming" for guard in due)
        mode, z = choose(run, z, old, u, armed)
        run.events += name_events(run.system, t, due, old[0], mode)


def at_rest(run: Run, z: Point, mode: Mode) -> bool:
    """Nothing moves and nothing can start to: every element is held, and no free coordinate is accelerated."""
    flow = run.known_flow(mode)
    still = not any(mode.signs) and not any(z.v) and not (flow.order and any(flow.start(z)[1]))
    return still and not lifts(run, z)


def lifts(run: Run, z: Point) -> tuple[Guard, ...]:
    """The contact, if it would have to pull where nothing moves."""
    contact = run.system.contact
    if contact is None or contact.force.at(z.q, z.v) >= 0:
        return ()
    return (Guard("contact", -1, 0, contact.force.at(z.q, z.v), mp.zero, (), ()),)


def begin(problem: Problem, grazing: Real = mp.zero) -> tuple[Run, Point, bool]:
    """The state at t = 0, before anything has moved. Raises ValueError for a start outside the model."""
    system = problem.system
    run, q = Run(problem, system, grazing), at_limits(system, system.position)
    for e, element in enumerate(system.elements):
        place = dot(element.direction, q)
        if not element.low <= place <= element.high and not blocked(system, e, q):
            raise ValueError(f"{element.name} must be in [{element.low}, {element.high}], got {place}")
    if system.contact is not None:
        y, tolerance = system.contact.compression.at(q, system.velocity), system.contact.tolerance
        if y < -tolerance:
            raise ValueError(f"the leg must not be stretched at the start, got y = {mp.nstr(y, 17)} m")
    v = impact(system, q, system.velocity)
    lose(run, mp.zero, system.velocity, v)
    return run, loaded(system, q, v), starts_above(run, q, v)


def starts_above(run: Run, q: Vector, v: Vector) -> bool:
    """Whether the foot is over the ground or about to be."""
    row = run.system.clearance
    if row is None:
        return True
    height, rate = row.at(q, v), dot(row.q, v)
    return bool(height > 0 or (height == 0 and rate > 0))


def between(run: Run, mark: Mark, t: Real) -> Point:
    """The state at t from the last mark before it."""
    return advance(run.known_flow(run.phases[mark.phase].mode), mark.point, t - mark.time)
