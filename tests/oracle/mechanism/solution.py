"""The solved motion: events, states, works and extremes, to 60 digits.

T(t) - T(0) = sum of the works of all forces,       T = v M v/2
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..polynomials import horner, refine
from .chain import Event, Mark, Phase, Run, begin, between, run_chain
from .equations import Problem, Row, System, read
from .flow import BITS, TERMS, Flow, Point, expand, exponential, fixed, loose, recurrence
from .guards import Guard, along, polynomial
from .numbers import TINY, Matrix, Number, Real, Vector, dot, exact, mp, plus, times, transpose


@dataclass(frozen=True)
class Solution:
    """A solved motion. Times in s, states in the units of the equations; all numbers are mpf.

    `margin` says how close the motion came to another list of events: the smallest of extrema that nearly crossed zero
    or only just did, of slacks of the hold rule and of times between neighbouring events, each relative to the terms it
    is made of. Extrema count where they are within 1e-6.
    """

    problem: Problem
    run: Run
    status: str
    duration: Real
    end: Point

    @property
    def system(self) -> System:
        return self.problem.system

    @property
    def events(self) -> tuple[Event, ...]:
        return tuple(self.run.events)

    @property
    def phases(self) -> tuple[Phase, ...]:
        return tuple(self.run.phases)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Event kinds, and the ending last."""
        return (*(event.kind for event in self.run.events), self.status)

    @cached_property
    def margin(self) -> Real:
        times = [mp.zero, *(event.time for event in self.events)]
        if self.status != "rest":
            times.append(self.duration)
        gaps = [(b - a) / max(b, self.duration) for a, b in zip(times, times[1:], strict=False) if b]
        return min([self.run.margin, *gaps])

    def point(self, t: Number) -> Point:
        """The carried state at t; at an event: after it, at the ending: before it changes anything."""
        t = exact(t)
        if not 0 <= t <= self.duration and not (t > 0 and self.status == "rest"):
            raise ValueError(f"t must be in [0, {mp.nstr(self.duration, 17)}] s, got {mp.nstr(t, 17)}")
        return self.end if t >= self.duration else between(self.run, self.run.marks[self.run.mark(t)], t)

    def at(self, t: Number) -> dict[str, Real]:
        """The declared outputs at t."""
        z = self.point(t)
        return {name: row.at(z.q, z.v) for name, row in self.system.outputs.items()}

    @property
    def final(self) -> dict[str, Real]:
        return self.at(self.duration)

    def energies(self, t: Number) -> dict[str, Real]:
        """`whole`, the energy of everything, and the declared ones."""
        z = self.point(t)
        forms = {"whole": self.system.energy, **self.system.energies}
        return {name: form.at(z.q, z.v) for name, form in forms.items()}

    @property
    def gains(self) -> dict[str, Real]:
        """What each energy gained from the start, as it was given, to the end."""
        forms = {"whole": self.system.energy, **self.system.energies}
        s, z = self.system, self.end
        return {name: form.at(z.q, z.v) - form.at(s.position, s.velocity) for name, form in forms.items()}

    def kinetic(self, t: Number) -> Real:
        v = self.point(t).v
        return mp.fdot(v, [mp.fdot(row, v) for row in self.system.mass]) / 2

    @property
    def given_kinetic(self) -> Real:
        """The kinetic energy of the start as it was given, before a limit took any."""
        v = self.system.velocity
        return mp.fdot(v, [mp.fdot(row, v) for row in self.system.mass]) / 2

    def ledger(self, t: Number) -> dict[str, Real]:
        """The work of each force up to t, signed as it enters the kinetic energy, and what the limits took."""
        z, t = self.point(t), min(exact(t), self.duration)
        s, start = self.system, self.system.position
        works = {f"spring {name}": -(square(K, z.q) - square(K, start)) / 2 for name, K in s.springs.items()}
        works |= {f"force {name}": dot(f, minus(z.q, start)) for name, f in s.forces.items()}
        works |= {f"damper {name}": mp.zero for name in s.dampers}
        works |= {f"friction {element.name}": mp.zero for element in s.elements}
        works["input"] = mp.zero
        for mark, stop in strides(self, t):
            for name, work in path_works(self, mark, stop).items():
                works[name] += work
        works["stop_loss"] = mp.fsum(loss for time, loss in self.run.losses if time <= t)
        return works

    def turning_points(self, row: Row) -> list[tuple[Real, Real]]:
        """(time, value) of a linear function where phases begin, at the end, and where its derivative vanishes."""
        ends = {mp.zero, self.duration, *(phase.start for phase in self.phases)}
        found = [(t, row.at(z.q, z.v)) for t in sorted(ends) for z in [self.point(t)]]
        for mark, end in stretches(self):
            found += turns(self, mark, end, row)
        found.sort()
        gaps = [b[0] - a[0] for a, b in zip(found, found[1:], strict=False)]
        return [found[0], *(point for point, gap in zip(found[1:], gaps, strict=True) if gap > TINY * self.duration)]

    @property
    def compression_max(self) -> Real:
        """The largest compression of the leg."""
        assert self.system.contact is not None
        return max(value for _, value in self.turning_points(self.system.contact.compression))

    @property
    def force_minima(self) -> list[tuple[Real, Real]]:
        """(time, N) of the contact force's minima inside."""
        assert self.system.contact is not None
        points = self.turning_points(self.system.contact.force)
        return [b for a, b, c in zip(points, points[1:], points[2:], strict=False) if a[1] > b[1] < c[1]]


def solve(source: Problem | Mapping[str, Any] | str | Path, grazing: Number = 0) -> Solution:
    """The motion from its start to its ending. Raises ValueError for a start outside the model.

    With `grazing`, contact forces and distances to limits may fall below zero by that much of the terms they are made
    of: what is left of a motion that has died away ends nothing.
    """
    problem = source if isinstance(source, Problem) else read(source)
    run, z, armed = begin(problem, exact(grazing))
    return Solution(problem, run, *run_chain(run, z, armed))


# ---- works ----


def square(a: Any, x: Vector) -> Real:
    return mp.fdot(x, [mp.fdot(row, x) for row in a])


def minus(a: Vector, b: Vector) -> Vector:
    return tuple(p - q for p, q in zip(a, b, strict=True))


def strides(solution: Solution, until: Real) -> Iterator[tuple[Mark, Real]]:
    """(start, end) of each window and long step up to a time."""
    marks = solution.run.marks
    for mark, following in zip(marks, (*marks[1:], None), strict=True):
        end = min(until, solution.duration if following is None else following.time)
        if mark.time < end and flow_of(solution, mark).order:
            yield mark, end


def stretches(solution: Solution) -> Iterator[tuple[Mark, Real]]:
    """The same over all the motion, a long step cut into windows."""
    for mark, end in strides(solution, solution.duration):
        here, window = mark, flow_of(solution, mark).window
        while here.time < end:
            stop = min(here.time + window, end)
            yield here, stop
            here = Mark(stop, mark.phase, between(solution.run, here, stop))


def flow_of(solution: Solution, mark: Mark) -> Flow:
    return solution.run.known_flow(solution.run.phases[mark.phase].mode)


def path_works(solution: Solution, mark: Mark, stop: Real) -> dict[str, Real]:
    """Works that depend on the path: friction and input by displacement, dampers by the integral of v_i v_j."""
    system, phase, flow = solution.system, solution.run.phases[mark.phase], flow_of(solution, mark)
    step = minus(between(solution.run, mark, stop).q, mark.point.q)
    work = {
        f"friction {e.name}": e.friction(sign) * dot(e.direction, step)
        for e, sign in zip(system.elements, phase.mode.signs, strict=True)
    }
    squares = velocity_squares(flow, mark.point, stop - mark.time)
    whole = spread(flow.Z, squares)
    for name, B in system.dampers.items():
        work[f"damper {name}"] = -mp.fsum(B[i][j] * value for (i, j), value in whole.items() if B[i][j])
    return {**work, "input": input_work(system, phase, mark.point, flow, stop - mark.time, step, squares)}


def velocity_squares(flow: Flow, z: Point, h: Real) -> dict[tuple[int, int], Real]:
    """int w_i w_j dt over h: by the series within a window, else as a quadratic form of the start."""
    pairs = [(i, j) for i in range(flow.order) for j in range(flow.order)]
    if h > flow.window:
        w, a, _ = flow.start(z)
        return {pair: square(gramian(flow, pair, h), (*w, *a)) for pair in pairs}
    s, place = expand(flow, z), fixed(h / flow.window)
    unit = s.nu**2 * flow.window
    return {(i, j): loose(product_integral(s.w[i], s.w[j], place)) * unit for i, j in pairs}


def gramian(flow: Flow, pair: tuple[int, int], h: Real) -> Matrix:
    """int phi_i^T phi_j dt over h, phi the rows of the solution from (w, a): W(2 h) = W + phi(h)^T W phi(h)."""
    if (pair, h) in flow.gramians:
        return flow.gramians[pair, h]
    if h <= flow.window:
        i, j = pair
        columns = [basis(flow, n) for n in range(2 * flow.order)]
        place = fixed(h / flow.window)
        found = tuple(tuple(loose(product_integral(p[i], q[j], place)) * flow.window for q in columns) for p in columns)
    else:
        half, phi = gramian(flow, pair, h / 2), exponential(flow, h / 2)[: 2 * flow.order]
        found = plus(half, times(transpose(phi), times(half, phi)))
    flow.gramians[pair, h] = found
    return found


def basis(flow: Flow, n: int) -> list[list[int]]:
    """The series of w over a window from a unit of w or a."""
    d, s, theta = flow.integers
    unit = [fixed(mp.one if i == n else mp.zero) for i in range(flow.order)]
    other = [fixed(1 / flow.rho if flow.order + i == n else mp.zero) for i in range(flow.order)]
    return recurrence(unit, other, d, s, theta, TERMS)[0]


def product_integral(p: list[int], q: list[int], place: int) -> int:
    """The integral of a product of two series, in units of the window."""
    c = [0] * (len(p) + len(q))
    for n, a in enumerate(p):
        if a:
            for m, b in enumerate(q):
                c[n + m] += a * b
    return horner([0, *((a >> BITS) // (n + 1) for n, a in enumerate(c))], place, BITS)


def spread(Z: Any, squares: Mapping[tuple[int, int], Real]) -> dict[tuple[int, int], Real]:
    """int v_i v_j dt from int w_i w_j dt."""
    size = range(len(Z))
    return {(i, j): mp.fsum(Z[i][a] * value * Z[j][b] for (a, b), value in squares.items()) for i in size for j in size}


def input_work(
    system: System,
    phase: Phase,
    z: Point,
    flow: Flow,
    h: Real,
    step: Vector,
    squares: Mapping[tuple[int, int], Real],
) -> Real:
    """int u g . v dt."""
    law, way = system.law, dot(system.input, step)
    if law is None:
        return phase.u * way
    if phase.mode.saturation:
        return phase.mode.saturation * law.limit * way
    s, place = expand(flow, z), fixed(h / flow.window)  # a law that acts has no long steps
    g, lq, lv = (along(row, flow) for row in (system.input, law.row.q, law.row.v))
    level = dot(law.row.q, z.q) + law.row.constant + law.target * phase.u
    both = range(flow.order)
    moved = [
        g[i] * lq[j] * loose(product_integral(s.w[i], s.x[j], place)) * (s.nu * flow.window) ** 2
        for i in both
        for j in both
        if g[i] and lq[j]
    ]
    return level * way + mp.fsum(moved) + mp.fsum(g[i] * lv[j] * squares[i, j] for i in both for j in both)


# ---- extremes ----


def turns(solution: Solution, mark: Mark, end: Real, row: Row) -> list[tuple[Real, Real]]:
    """Where a linear function has a flat place inside a window."""
    run = solution.run
    flow = run.known_flow(run.phases[mark.phase].mode)
    if not flow.order:
        return []
    none = mp.zero
    guard = Guard("row", -1, 0, row.at(mark.point.q, mark.point.v), none, along(row.q, flow), along(row.v, flow))
    c = polynomial(guard, expand(flow, mark.point)).c
    slope = [n * q for n, q in enumerate(c)][1:]
    last = fixed((end - mark.time) / flow.window)
    places = [last * n // 64 for n in range(65)]
    values = [horner(slope, place, BITS) for place in places]
    found = list[tuple[Real, Real]]()
    for a, b, p, q in zip(places, places[1:], values, values[1:], strict=False):
        if (p > 0) != (q > 0):
            t = mark.time + loose(refine(slope, a, b, BITS)) * flow.window
            z = between(run, mark, t)
            found.append((t, row.at(z.q, z.v)))
    return found
