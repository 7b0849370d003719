"""The motion of a mass whose current a controller sets at its ticks, and its derivatives.

At tick k, at t_k = k T, the controller reads target, place and velocity; the current that it computes,

    i_k = sat(law(target(t_k - delay), x_k, v_k)),

acts from t_k + dead time on, up to where the next one does. Before the first one that one acts. A controller without a
sensor of velocity has (x_k - x_(k-1))/T in place of v_k. Between two changes of
the current the motion is that of the mechanism under a constant current. That is the model's own motion at a limit of
its law, where the current is that limit, so each section of a tick is solved by the model's library.

A section without an event is an affine map of where it begins and of its current. Velocity is then a motion of the
pair, whose zeros are at least half a period apart, so a section that is shorter has no event if its velocity has the
same sign at both ends and its end is within the stops. The map has its coefficients from the library, once for each
length and direction.

Derivatives are handed on from tick to tick. With s_k those of the state (x, v) and i_k' those of the current,

    s_(k+1) = P_k s_k + R_k i'_(k-m-1) + Q_k i'_(k-m) + h_k,    i_k' = (di/dx, di/dv) s_k + e_k

(of a difference of places s_(k-1) is in i_k', too), m the ticks in the dead time: one banded system for all columns. A dead time that is longer by d moves the change of
current in a tick by d, which changes the state there by the difference of both accelerations.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from hopform import HopformError, Robot, solve_motion
from hopform._motion import DOUBLE
from hopform._robots import attribute_of
from hopform._sensitivities import STARTS, columns_beneath, in_coordinates
from hopform._solver.choice import Solver
from hopform.identify._motion import MAX_PHASES, Array, of_scipy

MOST_LATE = 64
"""Ticks that a dead time has at most."""
_FAR = 1e6
"""Times the largest size that a law's force has, how far off a target is that keeps the current at its limit."""


class Law(NamedTuple):
    """What sets the current of a model: names of the current, of its limit and of the target, the parameters of its
    gains, and those of the force per current.
    """

    current: str
    limit: str
    target: str
    gains: tuple[str, ...]
    motor: tuple[str, ...]


def law_of(core: Solver) -> Law | None:
    """The law of a model, None of a model without one; HopformError for one that no fit can have."""
    facts = core.facts
    if not facts.currents:
        return None
    (current,), names = facts.currents, core.package.records.Robot._fields
    if current.get("limit") not in names:
        raise HopformError(
            f"the model {facts.name} has a law whose current has no limit of its own: declare it, as in "
            f'current("{current["name"]}", "{current["unit"]}", limit=i_max)'
        )
    if "gains" not in current:
        raise HopformError(
            f"the solver of {facts.name} is older than fits under a law: build it again, hopform model build {facts.name}"
        )
    motor = tuple(name for name in re.findall(r"\w+", current["per_unit"]) if name in names)
    return Law(current["name"], current["limit"], facts.inputs[0]["name"], tuple(current["gains"]), motor)


class Ticks(NamedTuple):
    """A controller's ticks: their period [s], the target that it reads at each, and whether the velocity of its law is the
    difference of the place at a tick and at the one before, over the period.
    """

    period: float
    target: Array
    differs: bool = False

    def velocities(self, states: Array) -> Array:
        """What the law takes for the velocity at each tick, of the states there; at the first one it is the velocity."""
        x, v = states[: self.target.size].T
        return np.append(v[:1], np.diff(x) / self.period) if self.differs else v


class _Map(NamedTuple):
    """A section without an event, over a length: its end (place, velocity) from a state 0 under a current 0, and what x,
    v and the current add to it; the same of the derivatives of the end, (4, 2, columns of the library).
    """

    ends: tuple[tuple[float, float], ...]
    columns: Array


class Loop:
    """A robot of a model under its law, whose sections of ticks its library solves; columns: by which derivatives are
    wanted, beside the start and the current; all if left out.
    """

    def __init__(self, core: Solver, law: Law, robot: Any, columns: Sequence[int] | None = None) -> None:
        self.core, self.law, self.robot = core, law, robot
        records, formulas = core.package.records, core.package.formulas
        self.state, self.formulas, self.compiled = records.LegState, formulas, core.compiled()
        axes = core.facts.axes
        at = {axis: 0.0 for axis in STARTS if axis in axes}
        self._y0, self._y1 = (
            float(formulas.state_of_start(robot, records.Start(*{**at, "x1": x}.values())).y) for x in (0.0, 1.0)
        )
        self.zero = float(self.asked(robot, 0.0, 0.0, 0.0))
        units = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        self.by_x, self.by_v, self.by_target = (float(self.asked(robot, *each)) - self.zero for each in units)
        if not self.by_target * self.by_target > 0.0:
            raise HopformError("the proportional gain of the law must be > 0: without it the target has no effect")
        letters = formulas.letters_of(robot)
        self.limit, self.stops = float(letters.u_max), (float(letters.x1_min), float(letters.x1_max))
        self.of_limit = len(STARTS) + robot._fields.index(law.limit)
        every = range(len(STARTS) + len(robot._fields))
        self.columns = list(dict.fromkeys((0, 1, self.of_limit, *(every if columns is None else columns))))
        self._beneath = columns_beneath(self.columns, core.package)
        self._maps = dict[tuple[float, float], _Map]()
        rates = formulas.rates_of(robot)
        self._turns = math.sqrt(max(float(rates.q_1 - 0.25 * rates.p_1**2), 0.0))

    def asked(self, robot: Any, x: Any, v: Any, target: Any) -> Any:
        """The current that the law asks for."""
        return self.formulas.current_of_law(robot, self.state(x, v, 0.0 * x, x), target)

    def limited(self, current: float) -> float:
        """A current within the limit."""
        return min(max(current, -self.limit), self.limit)

    def section(self, x: float, v: float, i: float, length: float) -> Any:
        """The motion from a state under a constant current: at the limit of the law, where that is the limit."""
        robot = self.robot._replace(**{self.law.limit: abs(i)})
        target = self._beyond(x, v, i)
        begin = self.state(x, v, 0.0, self._y0 + (self._y1 - self._y0) * x)
        return self.compiled.solve_stance(robot, begin, ((0.0, target),), length, MAX_PHASES, DOUBLE)

    def end(self, robot: Robot, state: Mapping[str, float], i: float, length: float) -> dict[str, float]:
        """The state after a section, by the names of the model: what `solve_motion` has."""
        limit: dict[str, Any] = {attribute_of(type(robot), self.law.limit): abs(i)}
        at_limit = replace(robot, **limit)
        x, v = (state[str(self.core.facts.axes[axis]["name"])] for axis in ("x1", "v1"))
        motion = solve_motion(at_limit, start=state, u=self._beyond(x, v, i), horizon=length)
        return {name: float(each) for name, each in motion.end._asdict().items()}

    def _beyond(self, x: float, v: float, i: float) -> float:
        """A target so far off that the law stays at the limit to the side of a current."""
        size = 1.0 + abs(i) + abs(self.by_x * x) + abs(self.by_v * v) + abs(self.zero)
        return math.copysign(_FAR * size / self.by_target, i * self.by_target)

    def derived(self, x: float, v: float, i: float, length: float) -> tuple[Array, Array]:
        """The end of a section, and its derivatives (2, columns) by the start and the parameters, 0 by what is not wanted;
        in the column of the limit those by the current.
        """
        motion = self.section(x, v, i, length)
        state, rows = motion.tangents(np.array([length]), self._beneath)
        by = np.zeros((2, len(STARTS) + len(self.robot._fields)))
        by[:, self.columns] = in_coordinates(state, rows, x, self.core.package, self.robot, self.columns)[0, :2]
        by[:, self.of_limit] *= math.copysign(1.0, i)
        return np.array([state.x1[0], state.v1[0]]), by

    def slip(self, length: float, side: float) -> _Map:
        """The map of sections in which the mass slips to a side all along."""
        key = length, side
        if key not in self._maps:
            if self._turns * length >= math.pi:
                raise HopformError(f"a tick of {length:.4g} s is longer than half a period of the mechanism")
            self._maps[key] = self._map(length, side)
        return self._maps[key]

    def _map(self, length: float, side: float) -> _Map:
        low, high = self.stops
        middle = 0.5 * (low + high) if math.isfinite(high - low) else max(min(0.0, high - 1.0), low + 1.0)
        speed = side * min(1.0, 0.2 * (high - low) / length)
        unit = 1.0
        for _ in range(60):  # fast enough to go on under each current, or a smaller one
            one = [(middle, speed, 0.0), (middle, speed, unit), (middle, speed, -unit)]
            if all(len(self.section(*each, length).phase_rows()) == 1 for each in one):
                break
            unit, speed = 0.5 * unit, speed if math.isfinite(high - low) else 2.0 * speed
        else:
            raise HopformError("the mass does not slip on over a tick under any current")
        step = 0.1 * (high - low) if math.isfinite(high - low) else 1.0
        step = step if middle + 2.0 * step < high else -step
        zero, further = self.derived(middle, speed, 0.0, length), self.derived(middle + step, speed, 0.0, length)
        faster, pushed = self.derived(middle, 1.5 * speed, 0.0, length), self.derived(middle, speed, unit, length)
        by_x, by_v, by_i = (
            (zero[1][:, 0], (further[1] - zero[1]) / step),
            (zero[1][:, 1], (faster[1] - zero[1]) / (0.5 * speed)),
            (pushed[1][:, self.of_limit], (pushed[1] - zero[1]) / unit),
        )
        end = zero[0] - middle * by_x[0] - speed * by_v[0]
        columns = zero[1] - middle * by_x[1] - speed * by_v[1]
        ends = tuple((float(e[0]), float(e[1])) for e in (end, by_x[0], by_v[0], by_i[0]))
        return _Map(ends, np.stack([columns, by_x[1], by_v[1], by_i[1]]))

    def slips(self, x: Array, v: Array, i: Array) -> Array:
        """Accelerations of the mass under a current; from rest to the side to which it starts."""
        rates = self.formulas.rates_of(self.robot)
        state = self.state(x, v, 0.0 * v, self._y0 + (self._y1 - self._y0) * x)

        def to(side: float) -> Array:
            sides = np.full_like(v, side)
            drive = self.formulas.drive_of(self.robot, rates, i, sides, 0.0 * sides)
            return np.asarray(self.formulas.speeds_of(rates, drive, sides, 0.0 * sides, state).v1_rate)

        up, down = to(1.0), to(-1.0)
        return np.where((v > 0.0) | ((v == 0.0) & (up > 0.0)), up, down)

    def run(self, ticks: Ticks, start: tuple[float, float], dead_time: float, further: Array | None = None) -> "Run":
        """The motion over all ticks from a state on. further: a current of each tick that the law knows nothing of."""
        late = int(dead_time / ticks.period + _SAME)
        rest = dead_time - late * ticks.period
        rest = rest if rest > _SAME * ticks.period else 0.0
        lengths = [rest, ticks.period - rest] if rest else [ticks.period]
        parts = [
            (length, self.slip(length, 1.0).ends, self.slip(length, -1.0).ends, behind)
            for length, behind in zip(lengths, (late + 1, late) if rest else (late,), strict=True)
        ]
        (low, high), (x, v) = self.stops, start
        pushes = [0.0] * ticks.target.size if further is None else further.tolist()
        states, asked, currents = list[tuple[float, float]](), list[float](), list[float]()
        begins, kinds, solved = list[tuple[float, float, float]](), list[int](), dict[int, Array]()
        held = math.nan, math.inf, -math.inf  # place, and currents between which friction holds the mass there
        for k, (target, push) in enumerate(zip(ticks.target.tolist(), pushes, strict=True)):
            seen = (x - states[-1][0]) / ticks.period if ticks.differs and states else v
            states.append((x, v))
            asked.append(self.zero + self.by_x * x + self.by_v * seen + self.by_target * target)
            currents.append(self.limited(asked[-1]))
            for length, forwards, backwards, behind in parts:
                i = currents[max(k - behind, 0)] + push
                begins.append((x, v, i))
                if v != 0.0:
                    end, by_x, by_v, by_i = forwards if v > 0.0 else backwards
                    place = end[0] + by_x[0] * x + by_v[0] * v + by_i[0] * i
                    speed = end[1] + by_x[1] * x + by_v[1] * v + by_i[1] * i
                    if speed * v > 0.0 and low < place < high:
                        kinds.append(_FORWARDS if v > 0.0 else _BACKWARDS)
                        x, v = place, speed
                        continue
                elif x == held[0] and held[1] <= i <= held[2]:
                    kinds.append(_HELD)
                    continue
                (place, speed), by = self.derived(x, v, i, length)
                if v == 0.0 and speed == 0.0 and place == x:
                    held = x, min(i, held[1] if x == held[0] else i), max(i, held[2] if x == held[0] else i)
                    kinds.append(_HELD)
                    continue
                solved[len(kinds)] = by
                kinds.append(_SOLVED)
                x, v = float(place), float(speed)
        states.append((x, v))
        if not math.isfinite(x + v):
            raise HopformError("the motion under the law diverges")
        every = zip(np.array(begins).reshape(-1, len(parts), 3).transpose(1, 0, 2), lengths, strict=True)
        kinds_of_parts = np.array(kinds).reshape(-1, len(parts)).T
        sections = tuple(
            _Section(length, begin, kind, {k // len(parts): by for k, by in solved.items() if k % len(parts) == n})
            for n, ((begin, length), kind) in enumerate(zip(every, kinds_of_parts, strict=True))
        )
        beyond = np.abs(np.array(asked)) > self.limit
        return Run(np.array(states), np.array(currents), beyond, late, sections)

    def by(self, run: "Run", ticks: Ticks, slope: Array, columns: Mapping[str, int]) -> dict[str, Array]:
        """Derivatives of the states at ticks (ticks + 1, 2) by letters: of the start x and v, of parameters by their
        columns, of the delay of the target, whose slope at each tick is given, and of the dead time.
        """
        letters = [letter for letter in columns if letter not in ("x", "v")]
        taken = [columns[letter] for letter in letters]
        rows = [each.rows(self, [0, 1, self.of_limit, *taken]) for each in run.sections]
        for section_rows in rows:
            section_rows[:, :, 3:][:, :, [n for n, column in enumerate(taken) if column == self.of_limit]] = 0.0
        count, size = ticks.target.size, len(letters) + 2
        inside, x, seen = ~run.beyond, run.states[:-1, 0], ticks.velocities(run.states)
        asks = np.zeros((count, size))
        for n, letter in enumerate(letters):
            asks[:, n] = inside * self._asked_by(letter, x, seen, ticks.target)
            if taken[n] == self.of_limit:
                asks[:, n] = np.where(inside, 0.0, np.sign(run.currents))
        asks[:, -2] = np.where(inside, -self.by_target * slope, 0.0)
        by_state = inside[:, np.newaxis] * np.array([self.by_x, self.by_v])
        by_before = np.zeros_like(by_state)
        if ticks.differs:
            by_before[1:, 0] = inside[1:] * (-self.by_v / ticks.period)
            by_state[1:] = inside[1:, np.newaxis] * np.array([self.by_x + self.by_v / ticks.period, 0.0])
        # By sections: s' = phi s + push i' + more.
        first, last = rows[0], rows[-1]
        places = np.arange(count)
        newest = np.maximum(places - run.late, 0)
        older = np.maximum(places - run.late - 1, 0)
        x, v = run.sections[-1].begin[:, :2].T
        before = np.where(v == 0.0, 0.0, self.slips(x, v, run.currents[older]))
        after = np.where(run.sections[-1].kinds == _HELD, 0.0, self.slips(x, v, run.currents[newest]))
        jump = before - after
        late = last[:, :, 1] * jump[:, np.newaxis]  # a velocity more by the jump, where the last section begins
        phi, push, more = last[:, :, :2], last[:, :, 2], last[:, :, 3:]
        pushes = [(newest, push)]
        if len(rows) > 1:
            more = more + np.einsum("kij,kjn->kin", phi, first[:, :, 3:])
            pushes.append((older, np.einsum("kij,kj->ki", phi, first[:, :, 2])))
            phi = np.einsum("kij,kjn->kin", phi, first[:, :, :2])
        driven = np.zeros((count, 2, size))
        driven[:, :, :-2], driven[:, :, -1] = more, late
        lower = 2 * (run.late + 3) + 1
        band = np.zeros((lower + 1, 2 * (count + 1)))  # row i - j, column j
        band[0] = 1.0

        def put(matrix: Array, ticks_of: Any) -> None:
            for i in range(2):
                for j in range(2):
                    band[2 * (places + 1 - ticks_of) + i - j, 2 * ticks_of + j] -= matrix[:, i, j]

        put(phi, places)
        for computed, by_current in pushes:
            put(by_current[:, :, np.newaxis] * by_state[computed][:, np.newaxis, :], computed)
            put(by_current[:, :, np.newaxis] * by_before[computed][:, np.newaxis, :], np.maximum(computed - 1, 0))
            driven += by_current[:, :, np.newaxis] * asks[computed][:, np.newaxis, :]
        right = np.zeros((2 * (count + 1), size + 2))
        right[2:, :size] = driven.reshape(2 * count, size)
        right[0, size] = right[1, size + 1] = 1.0
        whole = of_scipy("linalg").solve_banded((lower, 0), band, right, check_finite=False)
        whole = whole.reshape(count + 1, 2, size + 2)
        return {letter: whole[:, :, n] for n, letter in enumerate((*letters, "delay", "dead_time", "x", "v"))}

    def _asked_by(self, name: str, x: Array, v: Array, target: Array) -> Any:
        """The derivative of what the law asks for by a parameter, by a step along the imaginary axis."""
        robot = self.robot._replace(**{name: complex(getattr(self.robot, name), _IMAGINARY)})
        return np.imag(self.asked(robot, x, v, target)) / _IMAGINARY


_SAME = 1e-9
"""Share of a tick that is none."""
_IMAGINARY = 1e-30
_HELD, _FORWARDS, _BACKWARDS, _SOLVED = range(4)
"""What a section is: held by friction, without an event either way, or with one."""


class _Section(NamedTuple):
    """The sections of all ticks of one length: state and current where each begins, (ticks, 3), its kind, and the
    derivatives of those with events by their ticks.
    """

    length: float
    begin: Array
    kinds: Any
    solved: Mapping[int, Array]

    def rows(self, loop: Loop, columns: Sequence[int]) -> Array:
        """Derivatives of the ends, (ticks, 2, columns)."""
        rows = np.zeros((self.kinds.size, 2, len(columns)))
        rows[self.kinds == _HELD, 0, 0] = 1.0
        for kind, side in ((_FORWARDS, 1.0), (_BACKWARDS, -1.0)):
            alike = self.kinds == kind
            factors = np.column_stack([np.ones(int(alike.sum())), self.begin[alike]])
            rows[alike] = np.einsum("km,mij->kij", factors, loop.slip(self.length, side).columns[:, :, list(columns)])
        for k, by in self.solved.items():
            rows[k] = by[:, list(columns)]
        return rows


@dataclass(frozen=True)
class Run:
    """A motion over ticks: states (ticks + 1, 2) at each and after the last, the current that each computes, whether the
    law asks for more than the limit, ticks in the dead time, sections.
    """

    states: Array
    currents: Array
    beyond: Any
    late: int
    sections: tuple[_Section, ...]


def between(values: Array, period: float, time: Array) -> Array:
    """Places and velocities (times, 2, ...) at times between ticks, from those at ticks: the cubic through both ends."""
    at = time / period
    n = np.clip(np.floor(at + 1e-6).astype(int), 0, values.shape[0] - 2)
    share = (at - n).reshape(-1, *[1] * (values.ndim - 2))
    share = np.where(np.abs(share - np.round(share)) < 1e-6, np.round(share), share)
    (x0, v0), (x1, v1) = ((values[each, 0], period * values[each, 1]) for each in (n, n + 1))
    rise, rest = x1 - x0, 1.0 - share
    place = x0 + rise * share**2 * (3.0 - 2.0 * share) + share * rest * (v0 * rest - v1 * share)
    speed = 6.0 * share * rest * rise + v0 * rest * (1.0 - 3.0 * share) + v1 * share * (3.0 * share - 2.0)
    return np.stack([place, speed / period], axis=1)
