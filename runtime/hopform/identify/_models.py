"""Fits over any solver, by its facts: which coordinate was recorded, under which input, and which parameters are asked for.

A model's motion, its derivatives and its accelerations are those of its package, so nothing here knows an equation of
motion. Starts come from the accelerations: those of the filtered recording against those of the model, a least squares
without any motion. The rest is the recipe of every fit.

Gravity's sine, where the model has the spring of a small angle: its torque is K sin(z) for K z, z the angle from where
the joint rests. The difference, K (z - sin z), is a further drive of the angle that the fit itself makes, and the
motion under it is solved again until that angle stays. The drive is constant over steps: its mean f by Simpson's rule,
less a twelfth of the second difference of f, which is what mean and hold together add.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Self, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError, Solver, load_solver
from hopform._checks import flag, mapping, real
from hopform._motion import DOUBLE
from hopform._robots import attribute_of, checked_value, robot_class
from hopform._sensitivities import STARTS, columns_beneath, in_coordinates
from hopform._solver.choice import Solver as Core
from hopform._solver.package import Steps
from hopform.extend import items, positive, shown
from hopform.identify._closed_loop import MOST_LATE, Law, Loop, Run, Ticks, between, law_of
from hopform.identify._estimation import Parameter, Solution
from hopform.identify._fits import Asked, Fit, Options, checked, solved
from hopform.identify._kinds import MOST_KNOWN, Cut, Recordings, cuts_of, files_of, read_some
from hopform.identify._motion import MAX_PHASES, Array, Values, held_at, of_scipy
from hopform.identify._recordings import (
    DRIVES,
    SI,
    Column,
    Recording,
    Units,
    current_steps,
    half_period,
    known_spans,
    mended,
    noise_of,
    outliers,
    quantum_of,
    used_after_all,
    whole_spans,
)
from hopform.identify._rigs import (
    SINGULAR,
    Along,
    Experiment,
    Force,
    Moved,
    Rates,
    friction_of,
    in_recorded_time,
    named_by_masses,
    power_of,
)
from hopform.identify._search import Problem
from hopform.identify._segments import CUTOFFS, Filtered, decays, filtered_part

Given = Mapping[str, float | str] | None
"""Known values; a name in place of one says that a parameter is as one that is fitted."""


@dataclass(frozen=True)
class Mass:
    """A mass of a model: the names of its coordinate and velocity, its number, and the SI unit of the former."""

    coordinate: str
    velocity: str
    number: int
    unit: str


class Model:
    """What the facts of a solver say of its motion: masses that move, input, parameters."""

    def __init__(self, core: Core) -> None:
        self.core, facts = core, core.facts
        self.law = law_of(core)
        numbers = [n for n in (1, 2) if f"x{n}" in facts.axes]
        self.masses = [Mass(facts.axes[f"x{n}"]["name"], facts.axes[f"v{n}"]["name"], n, facts.axes[f"x{n}"]["unit"])
                       for n in numbers]  # fmt: skip
        self.input = facts.inputs[0] if facts.inputs else None
        self.parameters = {each["name"]: each for each in facts.parameters}
        self.coulomb = [name for name, kind in self.friction.items() if kind == "coulomb"]
        self.records, self.formulas = core.package.records, core.package.formulas
        self.columns = {name: n for n, name in enumerate((*STARTS, *self.records.Robot._fields))}

    def __reduce__(self) -> Any:
        """A model is pickled as its solver."""
        return _model_again, (Solver(self.core),)

    def robot(self, at: Values) -> Any:
        """The parameters as the solver takes them."""
        return self.records.Robot(**{name: at[name] for name in self.records.Robot._fields})

    def accelerations(self, robot: Any, number: int, x: Any, v: Any, u: Any, side: Any) -> Any:
        """Those of a mass that slips to a side, at places x and velocities v of the masses."""
        places, speeds = dict(zip(self._numbers, x, strict=True)), dict(zip(self._numbers, v, strict=True))
        zero, sides = np.zeros_like(np.asarray(u, dtype=float)), dict(zip(self._numbers, side, strict=True))
        x1, v1, v2 = places.get(1, zero), speeds.get(1, zero), speeds.get(2, zero)
        y = self.compression(robot, x1, places.get(2, zero))
        state, rates = self.records.LegState(x1, v1, v2, y), self.formulas.rates_of(robot)
        forces = sides.get(1, zero), sides.get(2, zero)
        drive = self.formulas.drive_of(robot, rates, u, *forces)
        speeds_of = self.formulas.speeds_of(rates, drive, *forces, state)
        return speeds_of.v1_rate if number == 1 else speeds_of.v2_rate

    def linear(self, robot: Any, number: int) -> "Linear":
        """What the accelerations of a mass that is alone are made of."""

        def a(x: float = 0.0, v: float = 0.0, u: float = 0.0, side: float = 1.0) -> float:
            return float(self.accelerations(robot, number, [np.asarray(x)], [np.asarray(v)], u, [side]))

        up, down = a(), a(side=-1.0)
        stiffness, damping, gain = up - a(x=1.0), up - a(v=1.0), a(u=1.0) - up
        friction, middle = 0.5 * (down - up), 0.5 * (up + down)
        robot = robot._replace(**dict.fromkeys(self.coulomb, 0.0))
        rest = a() / stiffness if stiffness > 0.0 else 0.0
        return Linear(stiffness, damping, gain, rest, friction, middle)

    def words(self, robot: Any) -> dict[str, float]:
        """What a simulator calls the numbers of the only mass: the inertia from the kinetic energy, all else times it."""
        inertia, linear = self.moving(robot), self.linear(robot, self.masses[0].number)
        values = {"inertia": inertia, "damping": linear.damping * inertia, "frictionloss": linear.friction * inertia}
        if linear.stiffness > 0.0:
            values |= {"stiffness": linear.stiffness * inertia, "springref": linear.middle / linear.stiffness}
        if self.input is not None and linear.gain != 0.0:
            values |= {"gear": linear.gain * inertia}
            values |= {} if linear.stiffness > 0.0 else {"bias": linear.middle / linear.gain}
        return values

    def driving(self, robot: Any, x: Array, v: Array, u: Array) -> Array:
        """What drives a mass at places and velocities under the input: this, or the current that a law makes of it."""
        if self.law is None:
            return u
        loop = Loop(self.core, self.law, robot)
        return np.asarray(np.clip(loop.asked(robot, x, v, u), -loop.limit, loop.limit))

    def compression(self, robot: Any, x1: Any, x2: Any) -> Any:
        """That of the spring at places of the masses, 0 of one that there is not."""
        places = {"x1": x1, "v1": 0.0, "x2": x2, "v2": 0.0}
        start = self.records.Start(*(places[axis] for axis in STARTS if axis in self.core.facts.axes))
        return self.formulas.state_of_start(robot, start).y

    @property
    def _numbers(self) -> list[int]:
        return [each.number for each in self.masses]

    @property
    def stops(self) -> set[str]:
        """The parameters of stops and limits, which are known or absent."""
        bounds = {name for name, each in self.parameters.items() if each["domain"] in ("lower", "upper", "bound")}
        return bounds | self._named("stops")

    @property
    def excess(self) -> set[str]:
        """The parameters of friction that is higher at rest, which are fitted where they are asked for."""
        return {name for name in self._named("excess") if self.parameters[name]["domain"] != "positive"} - {
            *self.coulomb
        }

    def _named(self, key: str) -> set[str]:
        return named_by_masses(self.core, key)

    @property
    def friction(self) -> dict[str, str]:
        """The parameters of friction, by kind."""
        return friction_of(self.core)

    @property
    def powers(self) -> dict[str, int]:
        """The powers of 1/s in which parameters count."""
        return {name: power_of(each["unit"]) for name, each in self.parameters.items()}

    @property
    def places(self) -> set[str]:
        """The parameters that are places of the only coordinate: each encoder has its own zero."""
        mass, *more = self.masses
        return set() if more else {
            name for name, each in self.parameters.items()
            if (each["unit"], each["domain"]) == (mass.unit, "real") and name not in self.stops
        }  # fmt: skip

    @property
    def per_drive(self) -> str | None:
        """The parameter that is the force of a unit of the input, if there is one."""
        drive = self.input["unit"] if self.input else ""
        names = [name for name, each in self.parameters.items() if each["unit"] in (f"N/{drive}", f"N m/{drive}")]
        return names[0] if len(names) == 1 else None

    def inertia(self, at: Values) -> str:
        """The parameter that is the inertia of the only mass, to which a weighed mass adds; HopformError for a model
        without.
        """
        unit = "kg" if self.masses[0].unit == "m" else "kg m^2"
        values = {n: float(each.get("default", 1.0)) for n, each in self.parameters.items()} | dict(at)
        for name in [n for n, each in self.parameters.items() if each["unit"] == unit and len(self.masses) == 1]:
            less, more = (self.moving(self.robot({**values, name: value})) for value in (1.0, 2.0))
            if abs(more - less - 1.0) < 1e-9:
                return str(name)
        raise HopformError(
            f"added masses need a parameter that is the inertia of all that moves; {self.core.name} has none"
        )

    def moving(self, robot: Any) -> float:
        """The inertia [kg, kg m^2] of the first mass, from its kinetic energy."""
        length = float(self.formulas.second_position(robot, 0.0, 0.0))
        still, moving = (self.records.LegState(0.0, v, 0.0, length) for v in (0.0, 1.0))
        return 2.0 * float(self.formulas.energies(robot, moving).total - self.formulas.energies(robot, still).total)


def _model_again(solver: Solver) -> Model:
    """The model of a pickle."""
    return Model(solver.Robot.solver)


@dataclass(frozen=True)
class Modelled(Experiment):
    """A recording of a coordinate of a model. grid: times of all samples, between which gravity's sine is constant, if it
    is asked for; seen: the angle that settled last, and the one that was measured; heavier: the parameter to which a
    mass was added.
    """

    model: Model = cast(Model, None)  # noqa: RUF009
    mass: int = 1
    heavier: str = ""
    grid: Array | None = None
    seen: "list[Seen]" = field(default_factory=list["Seen"])

    @property
    def driven(self) -> bool:
        return self.model.input is not None and self.steps != ((0.0, 0.0),)

    @property
    def swings(self) -> bool:
        return self.grid is not None

    @property
    def powers(self) -> Mapping[str, int]:
        return self.model.powers

    @property
    def own_letters(self) -> tuple[str, ...]:
        starts = (letter for each in self.model.masses for letter in _start_letters(each.number))
        return (*self.model.parameters, *starts)

    def robot(self, at: Values) -> Any:
        """The parameters as the solver takes them, with the mass that was added."""
        return self.model.robot(self.loaded(at))

    def loaded(self, at: Values) -> Values:
        """The parameters with the mass that was added."""
        return _heavier(dict(at), self.heavier, self.added_mass) if self.added_mass else at

    def moved(self, at: Values, steps: Steps, time: Array) -> tuple[Moved, Rates]:
        model, robot = self.model, self.robot(at)
        under, fed = self._with_sine(at, robot, steps) if self.grid is not None else (steps, None)
        motion = self._solved(at, robot, under, float(time[-1]))
        state, by = self._derived(motion, at, robot, np.ascontiguousarray(time))
        if self.mass == 1:
            states, rows = np.stack([state.x1, state.v1], axis=1), by[:, 0:2]
        else:
            x2 = model.formulas.second_position(robot, state.x1, state.y)
            states, rows = np.stack([x2, state.v2], axis=1), by[:, 2:4]
        columns = {letter: rows[:, :, n] for n, letter in enumerate(self._columns(at))}
        if fed is not None:
            more = fed.at(time)
            columns = {letter: rows + more[:, :, n] for n, (letter, rows) in enumerate(columns.items())}
        return (states, columns), self._rates(at, robot, under[0][1])

    def _derived(self, motion: Any, at: Values, robot: Any, times: Array) -> tuple[Any, Array]:
        """States at times, and the derivatives (times, rows, columns) of x1, v1, x2, v2 by the letters of `_columns`."""
        package, by = self.model.core.package, [*self._columns(at).values()]
        state, rows = motion.tangents(times, columns_beneath(by, package))
        return state, in_coordinates(state, rows, at.get("x", 0.0), package, robot, by)

    def _columns(self, at: Values) -> dict[str, int]:
        """Columns of derivatives by letters: those of the start, and of what is fitted; under another clock all."""
        names = {**{name: name for name in self.model.parameters}, **_STARTS}
        every = "clock" in self.names or at["clock"] != 1.0
        return {letter: self.model.columns[name] for letter, name in names.items()
                if letter in at and (every or letter in self.names or letter in _STARTS)}  # fmt: skip

    def only(self, chosen: NDArray[np.bool_] | slice) -> Self:
        """As of every rig; the drive is the angle's up to the last sample, and of a thinned recording over twice as long
        steps.
        """
        thinned = super().only(chosen)
        if self.grid is None:
            return thinned
        every = 2 if isinstance(chosen, slice) and (chosen.step or 1) > 1 else 1
        before = self.grid[self.grid < thinned.time[-1]][::every]
        return replace(thinned, grid=np.append(before, thinned.time[-1]), seen=[self.seen[-1], self.seen[-1]])

    def _solved(self, at: Values, robot: Any, steps: Steps, horizon: float) -> Any:
        """The motion as its library has it; HopformError if it ends before the last sample."""
        x1, v1, x2, v2 = (at.get(letter, 0.0) for letter in _STARTS)
        state = self.model.records.LegState(x1, v1, v2, self.model.compression(robot, x1, x2))
        longest = horizon * (1.0 + 1e-12)
        motion = self.model.core.compiled().solve_stance(robot, state, steps, longest, MAX_PHASES, DOUBLE)
        ending, duration, *_ = motion.outcome()
        word = self.model.records.ENDINGS[ending]
        if word not in ("rest", "horizon"):
            raise HopformError(f"the motion ends by {word} after {duration:.6g} s, before the last sample")
        return motion

    def _rates(self, at: Values, robot: Any, u: float) -> Rates:
        """The rates of the letters of the start."""
        rates = Rates()
        for mass in self.model.masses:
            x, v = _start_letters(mass.number)
            free = (
                self._acceleration(at, robot, u, mass.number, 1.0),
                self._acceleration(at, robot, u, mass.number, -1.0),
            )
            side = 0.0 if at[v] == 0.0 and free[0] <= 0.0 <= free[1] else at[v] or free[0] + free[1]
            rates |= {x: at[v], v: 0.0 if side == 0.0 else free[0 if side > 0.0 else 1]}
        return rates

    def _acceleration(self, at: Values, robot: Any, u: float, number: int, side: float) -> float:
        """Of a mass at the start, if it slips to a side."""
        pairs = [_start_letters(each.number) for each in self.model.masses]
        x, v = ([np.asarray(at[pair[n]]) for pair in pairs] for n in (0, 1))
        sides = [side if each.number == number else float(np.sign(at[pair[1]]))
                 for each, pair in zip(self.model.masses, pairs, strict=True)]  # fmt: skip
        return float(self.model.accelerations(robot, number, x, v, u, sides))

    # ---- gravity's sine, and forces along a motion ----

    def _slopes(self, at: Values, linear: "Linear", letters: Sequence[str]) -> tuple[Array, Array]:
        """By each letter the derivatives of what gravity's sine is less than its spring, s (z - sin z), s the stiffness
        over the gain of the drive, at a place of the mass: gain ds/dp, of z - sin z, and stiffness drest/dp, of 1 - cos z.
        """
        stiffening, shift = np.zeros(len(letters)), np.zeros(len(letters))
        for n, letter in enumerate(letters):
            if letter in self.model.parameters:
                positive = self.model.parameters[letter]["domain"] == "positive"
                step = _STEP * (at[letter] if positive else max(abs(at[letter]), 1.0))
                ends = (at[letter] + 0.5 * step, at[letter] - 0.5 * step)
                above, below = (self.model.linear(self.robot({**at, letter: end}), self.mass) for end in ends)
                stiffness, gain = (above.stiffness - below.stiffness) / step, (above.gain - below.gain) / step
                pull = (above.stiffness * above.rest - below.stiffness * below.rest) / step
                stiffening[n], shift[n] = (
                    stiffness - linear.stiffness * gain / linear.gain,
                    pull - linear.rest * stiffness,
                )
        return stiffening, shift

    def _with_sine(self, at: Values, robot: Any, steps: Steps) -> "tuple[Steps, FedBack]":
        """The drive with what gravity's sine is less than its spring, of the angle that it leads to, and by how much more
        this changes the derivatives. First by Newton's steps, then, where these lead nowhere, by those of Picard.
        """
        linear, grid = self.model.linear(robot, self.mass), cast(Array, self.grid)
        if linear.gain == 0.0:
            raise HopformError("gravity's sine is a further drive, and the model's has no force here")
        begins = np.array(steps, dtype=float)[:, 0]
        times = np.unique(np.concatenate([grid, begins[(begins >= 0.0) & (begins < grid[-1])]]))
        base = held_at(steps, times)
        reach = max(float(np.ptp(self.seen[-1].x)), 1e-12)
        by_column = self._columns(at)
        starts = [[*by_column].index(letter) for letter in ("x", "v")]
        letters = np.array([at[letter] for letter in by_column])
        tries = [(self.seen[0].near(letters), True), (self.seen[-1], True), (self.seen[-1], False)]
        for seen, newton in tries:
            z, v = np.interp(times, seen.time, seen.x) - linear.rest, np.interp(times, seen.time, seen.v)
            last = math.inf
            for _ in range(_MOST_SINES):
                sines = _under_sine(linear, times, base, z, v)
                state, by = self._derived(self._solved(at, robot, sines, float(times[-1])), at, robot, times)
                off = np.stack([np.asarray(state.x1) - linear.rest - z, np.asarray(state.v1) - v], axis=1)
                moved = float(np.abs(off[:, 0]).max())
                if not math.isfinite(moved) or moved > 100.0 * reach:
                    break
                by = by[:, 0:2]
                softer, change = linear.stiffness * (1.0 - np.cos(z)), off
                if newton and moved <= 0.3 * last:  # else beside a kink, where a joint comes to stick
                    change, last = _fed_back(times, by[:, :, starts], softer, off[:, :, np.newaxis])[:, :, 0], moved
                else:
                    last = math.inf
                z, v = z + change[:, 0], v + change[:, 1]
                if (
                    moved <= _SAME_ANGLE * reach
                ):  # what the last step leaves is smaller by orders, and is not solved again
                    stiffening, shift = self._slopes(at, linear, [*by_column])
                    direct = np.outer(z - np.sin(z), stiffening) - np.outer(1.0 - np.cos(z), shift)
                    whole = _fed_back(times, by[:, :, starts], softer, by, direct)
                    self.seen[0] = Seen(times, z + linear.rest, v, letters, whole)
                    return _under_sine(linear, times, base, z, v), FedBack(times, whole - by)
        raise HopformError("the angle under gravity's sine does not settle: these parameters are far from the motion's")

    def respond(self, at: Values, steps: Steps, fine: Array, force: Force, size: float) -> Array:
        """As of every rig; 0 of a model of several masses, or without a drive."""
        robot, none = self.robot(at), np.zeros(fine.size)
        linear = self.model.linear(robot, self.mass) if len(self.model.masses) == 1 else None
        if linear is None or linear.gain == 0.0:
            return none
        try:
            steps = self._with_sine(at, robot, steps)[0] if self.grid is not None else steps
        except HopformError:
            return none
        drive = held_at(steps, fine)

        def moved(u: Array) -> tuple[Array, Array]:
            motion = self._solved(at, robot, current_steps(fine, u), float(fine[-1]))
            state = motion.state_at(np.minimum(fine, motion.outcome()[1]))
            return np.asarray(state.x1), np.asarray(state.v1)

        x, v = moved(drive)
        if not v.any():
            return none
        shifted, _ = moved(drive - size * force(linear.along(fine, x, v, drive)) / linear.gain)
        return (shifted - x) / size


@dataclass(frozen=True)
class Controlled(Modelled):
    """A recording of a coordinate under a law that a controller computes at its ticks. period: of these [s]; target: what
    was logged of it, over times from the first tick on; differs: whether the law's velocity is a difference of places.
    """

    period: float = 0.0
    target: tuple[Array, Array] = (np.empty(0), np.empty(0))
    differs: bool = False

    @property
    def own_letters(self) -> tuple[str, ...]:
        return (*super().own_letters, "dead_time")

    def _ticks(self, delay: float, last: float) -> tuple[Ticks, Array]:
        """The ticks up to a time, with the target that the controller reads then and its slope: between samples a cubic
        that keeps their order (Fritsch and Carlson 1980), a line where the target goes by steps.
        """
        at = self.period * np.arange(math.ceil(last / self.period - 1e-6), dtype=np.float64) - delay
        times, values = self.target
        inside: Array = np.clip(at, times[0], times[-1])
        stands: NDArray[np.bool_] = np.diff(values) == 0.0
        if np.count_nonzero(stands) > _STANDS * stands.size:
            n = np.clip(np.searchsorted(times, at + 1e-6 * self.period, side="right") - 1, 0, times.size - 2)
            read, slope = np.interp(inside, times, values), (np.diff(values) / np.diff(times))[n]
        else:
            cubic = of_scipy("interpolate").PchipInterpolator(times, values)
            read, slope = cubic(inside), cubic(inside, 1)
        return Ticks(self.period, read, self.differs), np.where((at < times[0]) | (at > times[-1]), 0.0, slope)

    def _loop(self, at: Values) -> Loop:
        return Loop(self.model.core, cast(Law, self.model.law), self.model.robot(at), [*self._columns(at).values()])

    def moved(self, at: Values, steps: Steps, time: Array) -> tuple[Moved, Rates]:
        loop = self._loop(at)
        ticks, slope = self._ticks(at["delay"], float(time[-1]))
        run = loop.run(ticks, (at["x"], at["v"]), at["dead_time"])
        by = loop.by(run, ticks, slope, self._columns(at))
        columns = {letter: between(rows, self.period, time) for letter, rows in by.items()}
        return (between(run.states, self.period, time), columns), self._rates(at, loop.robot, float(run.currents[0]))

    def response_to(self, values: Values, force: Force, size: float) -> Array:
        """As of every rig, in closed loop: the force is held from tick to tick."""
        letters = self.letters(values)
        at = in_recorded_time(letters, letters["clock"], self.powers)
        loop, linear = self._loop(at), self.model.linear(self.model.robot(at), self.mass)
        ticks, _ = self._ticks(at["delay"], float(self.time[-1]))

        def moved(further: Array | None = None) -> Run:
            return loop.run(ticks, (at["x"], at["v"]), at["dead_time"], further)

        run = moved()
        (x, v), drive = run.states[:-1].T, run.currents
        fastest = float(np.abs(v).max())
        if fastest == 0.0 or linear.gain == 0.0:
            return np.zeros(self.time.size)
        along = linear.along(self.period * np.arange(x.size, dtype=np.float64), x, v, drive)
        shifted = moved(-size * force(along) / linear.gain)
        changed = between(shifted.states - run.states, self.period, self.time)[:, 0]
        return np.asarray(letters["gain"] * changed / size)


_STANDS = 0.3
"""Share of samples at which a target stands still, from where it goes by steps."""
_STARTS = {"x": "x1", "v": "v1", "x'": "x2", "v'": "v2"}
"""Letters of where the masses begin, with the columns of their derivatives."""
_MOST_SINES, _SAME_ANGLE = 40, 1e-6
"""Rounds in which the angle under gravity's sine settles, and the share of its reach by which the last step moves it."""
_STEP = 1e-5
"""Share of a parameter for differences of what is linear or hyperbolic in it: they are right to ten digits."""


def _start_letters(number: int) -> tuple[str, str]:
    return ("x", "v") if number == 1 else ("x'", "v'")


class Seen(NamedTuple):
    """A motion of an angle: times [s], places [rad], velocities [rad/s]; of a solved one the letters, and the derivatives
    of both by them.
    """

    time: Array
    x: Array
    v: Array
    letters: Array = np.empty(0)
    by: Array = np.empty((0, 2, 0))

    def near(self, letters: Array) -> "Seen":
        """About what it is under other letters, to first order; as it is where it has no derivatives by them."""
        if letters.size != self.letters.size:
            return self
        change = self.by @ (letters - self.letters)
        return Seen(self.time, self.x + change[:, 0], self.v + change[:, 1])


class FedBack(NamedTuple):
    """What a drive that follows the angle adds to derivatives (times, 2, columns)."""

    times: Array
    more: Array

    def at(self, time: Array) -> Array:
        """At other times, by lines."""
        n = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, self.times.size - 2)
        share = (time - self.times[n]) / (self.times[n + 1] - self.times[n])
        low, high = self.more[n], self.more[n + 1]
        return np.asarray(low + share[:, np.newaxis, np.newaxis] * (high - low))


def _under_sine(linear: "Linear", times: Array, base: Array, z: Array, v: Array) -> Steps:
    """The drive with what gravity's sine is less than its spring, at angles z and velocities v [rad, rad/s] at the times."""
    middle = 0.5 * (z[1:] + z[:-1]) + np.diff(times) * (v[:-1] - v[1:]) / 8.0
    more = [each - np.sin(each) for each in (z[:-1], middle, z[1:])]
    extra = linear.stiffness / linear.gain * (more[0] + 4.0 * more[1] + more[2]) / 6.0
    extra[1:-1] -= np.diff(extra, 2) / 12.0
    return tuple(zip(times.tolist(), (base + np.append(extra, extra[-1:])).tolist(), strict=True))


def _fed_back(time: Array, transition: Array, softer: Array, plain: Array, direct: Array | None = None) -> Array:
    """Changes (times, 2, ...) of places and velocities which change the drive, from what they are under a drive that stays
    as it is: d = plain + P(t) w, w = int P(s)^-1 (0, softer d + direct) ds, P the derivatives by the start, up to where
    it sticks; direct: changes of the drive at a place that stays.

    By trapezia w is the solution of a system of two rows a time, which know no w but their own and the one before.
    """
    determinant = transition[:, 0, 0] * transition[:, 1, 1] - transition[:, 0, 1] * transition[:, 1, 0]
    moves = int(np.argmax(np.append(np.abs(determinant) < SINGULAR, True)))
    if moves < 2:
        return plain
    p, first = transition[:moves], plain[:moves]
    inverse = np.stack([-p[:, 0, 1], p[:, 0, 0]], axis=1) / determinant[:moves, np.newaxis]
    half = 0.5 * np.diff(time[:moves])[:, np.newaxis]
    weights = inverse * softer[:moves, np.newaxis]
    inside, of_itself = weights[:, :, np.newaxis] * first[:, 0:1], weights[:, :, np.newaxis] * p[:, 0:1]
    if direct is not None:
        inside = inside + inverse[:, :, np.newaxis] * direct[:moves, np.newaxis]
    now, before = (
        np.eye(2) - half[:, :, np.newaxis] * of_itself[1:],
        -np.eye(2) - half[:, :, np.newaxis] * of_itself[:-1],
    )
    band = np.zeros((5, 2 * (moves - 1)))  # row 1 + i - j, column j
    band[0, 1::2], band[1, ::2], band[1, 1::2], band[2, ::2] = now[:, 0, 1], now[:, 0, 0], now[:, 1, 1], now[:, 1, 0]
    band[2, 1:-2:2], band[3, :-2:2], band[3, 1:-2:2], band[4, :-2:2] = (
        before[1:, 0, 1], before[1:, 0, 0], before[1:, 1, 1], before[1:, 1, 0]
    )  # fmt: skip
    driven = (half[:, :, np.newaxis] * (inside[1:] + inside[:-1])).reshape(2 * (moves - 1), -1)
    whole = np.zeros_like(inside)
    whole[1:] = of_scipy("linalg").solve_banded((3, 1), band, driven, check_finite=False).reshape(moves - 1, 2, -1)
    return np.concatenate([first + p @ whole, plain[moves:]])


class Linear(NamedTuple):
    """Of a mass alone, per its inertia: stiffness [1/s^2], damping [1/s], acceleration per drive, where it rests without a
    drive and friction, the mean level of its friction, and the mean acceleration at 0 of slip to either side.
    """

    stiffness: float
    damping: float
    gain: float
    rest: float
    friction: float
    middle: float

    def along(self, t: Array, x: Array, v: Array, drive: Array) -> Along:
        """A motion under a drive, for a force along it."""
        pull = self.middle + self.gain * drive - self.stiffness * x
        by_drive, by_spring = np.abs(self.gain * drive), self.stiffness * np.abs(x - self.rest)
        largest, load = max(float(by_drive.max()), float(by_spring.max())), by_drive + by_spring
        way, level = np.where(v != 0.0, v, pull), np.full(x.size, self.friction)
        fastest = float(np.abs(v).max())
        return Along(t, x - self.rest, v, way, fastest, level, largest, self.stiffness, self.damping, load)


# ---- from recordings to a problem ----


class Setup(NamedTuple):
    """What is to be fitted of which recordings: as they are, and with the columns of the model alone; the unit of what
    drives; values of what is not fitted, names of what is, and which are as one of these; the parameter to which masses
    were added; of each recording which parameter of the fit each letter is.
    """

    model: Model
    files: Sequence[Recording]
    recordings: Sequence[Recording]
    drive: str
    values: Values
    names: Sequence[str]
    tied: Mapping[str, str]
    heavier: str
    letters: Mapping[int, Mapping[str, str]]

    @property
    def units(self) -> Units:
        """Those of the first mass and of its drive."""
        return Units(self.model.masses[0].unit, self.drive)

    @property
    def parameters(self) -> dict[str, str]:
        """The parameters of the fit, each with its letter."""
        of_each = (each.items() for each in self.letters.values())
        return {name: letter for pairs in of_each for letter, name in pairs if letter in self.names}

    def begin(self, start: Values | None) -> dict[str, float]:
        """Where the search for a start begins."""
        return {name: begin_of_search(self.model, letter, start) for name, letter in self.parameters.items()}

    def at(self, values: Values, number: int) -> dict[str, float]:
        """The letters of a recording under values of the parameters, with the mass that was added."""
        at = {**self.values, **{letter: values[name] for letter, name in self.letters[number].items()}}
        return _heavier(at, self.heavier, self.recordings[number].added_mass)

    def robot(self, values: Values) -> Any:
        """The robot of a fit; of a place of each recording it has the mean."""
        ours = {name: float(np.mean([values[p] for p, letter in self.parameters.items() if letter == name]))
                for name in self.names}  # fmt: skip
        every = {**self.values, **ours, **{name: ours[other] for name, other in self.tied.items()}}
        kind, core = robot_class(self.model.core), self.model.core
        values_of_robot: dict[str, Any] = {attribute_of(kind, name): value for name, value in every.items()}
        return kind(**values_of_robot, name=core.name)

    def known(self, given: Given) -> dict[str, float]:
        """What was given as known, without what is as another one."""
        return {name: self.values[name] for name in given or {} if name in self.values}


def _heavier(at: dict[str, float], heavier: str, added: float) -> dict[str, float]:
    return {**at, heavier: at[heavier] + added} if heavier else at


def setup_of(model: Model, recordings: Recordings, fitted: Sequence[str] | None, known: Given) -> Setup:
    """What of a model is to be fitted; HopformError for recordings that are not of it, and for names that it has not."""
    several = read_some(recordings)
    view = [_view(model, each) for each in several]
    drive = _drive(model, view)
    values, names, tied = _chosen(model, fitted, _with_force(model, drive, fitted, known))
    heavier = model.inertia(values) if any(each.added_mass for each in view) else ""
    return Setup(model, several, view, drive, values, names, tied, heavier, _letters(model, view, names, tied))


def fit_model(
    core: Core,
    recordings: Recordings,
    fitted: Sequence[str] | None,
    known: Given,
    start: Values | None,
    sine: bool,
    rate: float | None,
    options: Options,
) -> Fit:
    """What `hopform.identify.fit` says, of a solver."""
    model, asked = Model(core), checked(options)
    several = read_some(recordings)
    _refuse(model, sine)
    ticks = _rate(model, rate, several)
    setup = setup_of(model, several, fitted, known)
    motions = [cut for n, each in enumerate(setup.recordings) for cut in _motions(model, each, n)]
    free, given = setup.begin(start), _given(model, setup.names, start)
    given = {name: given[letter] for name, letter in setup.parameters.items() if letter in given}
    search = Search(model, motions, setup.letters, setup.heavier, sine)
    tries, left = search.starts(setup.values, free)
    if given and left > 0.0:
        tries.insert(0, search.near(setup.values, free, given) | given)
    experiments, parameters = list[Experiment](), {name: parameter_of(setup, name, tries[0][name]) for name in free}
    for n, cut in enumerate(motions):
        posed, begins = _posed(model, cut, n, setup.values, setup.letters[cut.number], sine, ticks)
        experiments += [replace(each, added_mass=cut.recording.added_mass, heavier=setup.heavier) for each in posed]
        parameters |= {p.name: p for p in begins}
    first = {name: p.start for name, p in parameters.items()}
    of_ticks = [_said_of_ticks(each, ticks) for each in setup.recordings] if ticks else []
    law = {*model.law.gains, *model.law.motor} if model.law else set[str]()
    aside = {*(known or {}), *setup.names, *model.excess, *model.stops, *law}
    defaults = tuple(parameter_of(setup, name, value) for name, value in setup.values.items() if name not in aside)
    problem = Problem(
        "model", "x1", tuple(experiments), tuple(parameters.values()),
        tuple(first | each | late for late in _delays(motions, ticks) for each in tries), setup.known(known),
        (*filter(None, of_ticks), *(note for cut in motions for note in cut.rests())),
        tuple(f"{each.source}: {note}" for each in setup.recordings for note in each.notes), parts=(0.35, 1.0),
        units=setup.units, loss=asked.loss, given=given, defaults=defaults, friction=model.friction,
        tied={name: other for name, other in setup.tied.items() if other in free}, files=files_of(several),
    )  # fmt: skip
    result = solved(problem, asked)
    if model.law is not None and not _explained(result):
        result = _by_differences(problem, asked, result)
    said, driven = list[str](), any(len(each.steps) > 1 for each in experiments)
    if model.law is None and driven and left > _UNDRIVEN and not _explained(result):
        said.append(_undriven(model, left))
    said += _scale(model, result, setup.values)
    return replace(result, statements=(*result.statements, *said), base=setup.robot(result.values), tied=setup.tied)


def _letters(
    model: Model, recordings: Sequence[Recording], names: Sequence[str], tied: Mapping[str, str]
) -> dict[int, dict[str, str]]:
    """Of each recording which parameter of the fit each letter is. Over several recordings a place is that of each,
    because an encoder has a zero of its own; under different added masses so is friction, which grows with the load.
    """
    apart = model.places if len(recordings) > 1 else set[str]()
    if len({each.added_mass for each in recordings}) > 1:
        apart = apart | model.friction.keys()
    every = {name: name for name in names} | dict(tied)
    return {n: {letter: f"{name}@{n}" if name in apart else name for letter, name in every.items()}
            for n in range(len(recordings))}  # fmt: skip


def _drive(model: Model, recordings: Sequence[Recording]) -> str:
    """The unit of what drives, that of the model where nothing does; HopformError where recordings differ."""
    several = {_unit_of_drive(model, each.columns["current"]): each for each in recordings if "current" in each.columns}
    if len(several) > 1:
        (unit, recording), (other, _) = [*several.items()][:2]
        raise recording.error(
            f"is in {unit}, another in {other}: one fit takes one of them", recording.head, recording.columns["current"]
        )
    return next(iter(several), model.input["unit"] if model.input else "A")


def _unit_of_drive(model: Model, column: Column) -> str:
    """That of a column, of the model's input where this has a unit of its own."""
    return DRIVES.get(column.quantity) or cast("dict[str, Any]", model.input)["unit"]


def _with_force(model: Model, drive: str, fitted: Sequence[str] | None, known: Given) -> Given:
    """What is known, and that a recorded force is the force, where nothing else is said of it."""
    per = model.per_drive
    is_force = drive == Units(model.masses[0].unit).force and model.input is not None and model.input["unit"] != drive
    if not is_force or per is None or per in (fitted or ()) or per in (known or ()):
        return known
    return {**(known or {}), per: 1.0}


def _scale(model: Model, fit: Fit, values: Values) -> list[str]:
    """What is said where motion and drive leave the scale of all forces open."""
    open_names = {name for some in fit.combinations for name in some}
    try:
        inertia = model.inertia(values)
    except HopformError:
        return []
    if inertia not in open_names:
        return []
    unit = fit[inertia].unit
    return [
        f"motion fixes forces only up to a common factor: weigh it, or give {inertia}=1 as known; the others are then per {unit} of {inertia}"
    ]


_UNDRIVEN = 0.2
"""Share of the accelerations that drive and model leave, from where it is said."""


def _undriven(model: Model, left: float) -> str:
    """What is said of a drive that is not the one which moved the mass."""
    name = cast("dict[str, Any]", model.input)["name"]
    return (
        f"{name} and the model do not explain {100.0 * left:.0f} % of the accelerations: is {name} the command and not the "
        "measured value, is it late, or is a term missing? inertia and stiffness are no more accurate; a free decay needs no {name}"
    )


def _explained(fit: Fit) -> bool:
    """Whether the residuals of a fit are noise in all recordings."""
    return all(cast(Solution, fit.solution).explained)


_DIFFERS = (
    "the controller takes its velocity from the difference of two positions, half a tick late; fitted so the residuals "
    "are noise, with the velocity at the tick they are not"
)


def _by_differences(problem: Problem, asked: Asked, plain: Fit) -> Fit:
    """The fit under a law whose velocity is the difference of two places, where that explains what the plain one leaves:
    a controller without a sensor of velocity has no other.
    """
    differing = tuple(replace(cast(Controlled, each), differs=True) for each in problem.experiments)
    result = solved(replace(problem, experiments=differing), asked._replace(diagnose=False))
    return replace(result, statements=(_DIFFERS, *result.statements)) if _explained(result) else plain


def _refuse(model: Model, sine: bool) -> None:
    """HopformError for a sine of what is no angle, is not alone, or is under a law."""
    if flag("sine", sine) and model.law is not None:
        raise HopformError(f"sine: gravity's sine is no term of a fit under a law; the model {model.core.name} has one")
    if sine and (len(model.masses) > 1 or model.masses[0].unit != "rad" or model.input is None):
        raise HopformError(
            f"sine: gravity's sine is a torque on one angle with a drive; the model {model.core.name} moves "
            f"{', '.join(f'{each.coordinate} [{each.unit}]' for each in model.masses)}"
        )


def _rate(model: Model, rate: float | None, several: Sequence[Recording]) -> float:
    """The rate [Hz] of a law's controller, 0 without a law; HopformError where it is missing, or lower than a log's."""
    if model.law is None:
        if rate is not None:
            raise HopformError(f"rate: the model {model.core.name} has no law; its input is held as it was recorded")
        return 0.0
    first = several[0]
    logged = _logged(first)
    if rate is None:
        raise HopformError(
            f"rate: give the sampling rate of the controller, at whose ticks the law of {model.core.name} sets "
            f"{model.law.current}; {first.source} was logged at {logged:.5g} Hz"
        )
    ticks = positive("rate", rate, "Hz")
    for recording in several:
        if ticks < (logged := _logged(recording)) * (1.0 - _SAME_RATE):
            raise HopformError(
                f"rate must be at least that of the log, {logged:.5g} Hz in {recording.source}, got {ticks:.6g} Hz: a "
                "controller that is slower than its log holds each current over several samples; leave samples out"
            )
    return ticks


def _logged(recording: Recording) -> float:
    """The rate of a log [Hz], by the mean of its steps but for gaps, whatever digits its times have."""
    steps = np.diff(recording.time)
    return 1.0 / float(np.mean(steps[steps <= 2.5 * float(np.median(steps))]))


_SAME_RATE = 0.02
"""Share by which rates differ that are the same."""


class Grid(NamedTuple):
    """A controller's ticks under the samples of a log: their period [s], the times of samples by the ticks, whether each
    sample is one, and every how many ticks there is one.
    """

    period: float
    time: Array
    exact: bool
    every: int


def _grid_of(time: Array, rate: float, logged: float) -> Grid:
    """The ticks of a controller from the first sample on. Samples are ticks where a log is of the controller's clock:
    whatever digits its times have, they are at most half a tick off.
    """
    every = max(round(rate / logged), 1)
    if abs(rate / logged / every - 1.0) <= _SAME_RATE:
        period = float(time[-1]) / (every * (time.size - 1))
        regular: Array = every * period * np.arange(time.size, dtype=np.float64)
        if float(np.abs(time - regular).max()) <= 0.5 * period:
            return Grid(period, regular, True, every)
    return Grid(1.0 / rate, time, False, every)


def _said_of_ticks(recording: Recording, rate: float) -> str:
    """What is to be said of a log that has not each tick."""
    logged = _logged(recording)
    grid, rates = _grid_of(recording.time, rate, logged), f"{logged:.5g} of {rate:.5g} Hz"
    if not grid.exact:
        return f"{recording.source}: samples are between ticks of the controller, {rates}; the first is taken as one"
    if grid.every == 1:
        return ""
    ordinal = {2: "second", 3: "third"}.get(grid.every, f"{grid.every}th")
    return (
        f"{recording.source}: the log has every {ordinal} tick of the controller, {rates}; at the others the target is "
        "interpolated"
    )


def _chosen(
    model: Model, fitted: Sequence[str] | None, known: Given
) -> tuple[dict[str, float], list[str], dict[str, str]]:
    """The values of the parameters that are not fitted, the names of those that are, and which are as one of them."""
    given, tied = dict[str, float](), dict[str, str]()
    fields = {each.name: each for each in model.records.ROBOT_FIELDS}
    for name, value in mapping("known", known, MOST_KNOWN).items():
        if name not in fields:
            raise HopformError(f"known: {model.core.name} has no parameter {shown(name)}; it has {', '.join(fields)}")
        if isinstance(value, str):
            tied[cast(str, name)] = value
        else:
            given[cast(str, name)] = checked_value(fields[cast(str, name)], value)
    law = model.law
    left = {*law.gains, *law.motor} if law else set[str]()
    if fitted is None:
        names = [n for n in fields if not {n} & (given.keys() | tied.keys() | model.excess | model.stops | left)]
    else:
        names = [cast(str, each) for each in items("fitted", fitted, "names of parameters", len(fields))]
        for name in names:
            if name not in fields or name in given or name in tied:
                may = ", ".join(n for n in fields if n not in given and n not in tied)
                what = f"{shown(name)} is known" if name in fields else f"unknown parameter {shown(name)}"
                raise HopformError(f"fitted: {what}; free ones are {may}")
    for name, other in tied.items():
        if other not in names:
            raise HopformError(
                f"known: {name} = {shown(other)} names no fitted parameter; fitted are {', '.join(names)}"
            )
    unknown = [n for n in (law.gains if law else ()) if n not in given and n not in names]
    if law and (unknown or not given.keys() & {*law.gains}):
        gains = " and ".join(law.gains)
        what = f"{' and '.join(unknown)} must be given" if unknown else "one of them must be given"
        raise HopformError(
            f"known: the law has the gains {gains}, of which {what}: without them a fit from a {law.target} does "
            f"not know the size of the forces; as in {law.gains[0]}={model.parameters[law.gains[0]].get('default') or 1.0:g}"
        )
    values = given | {n: each.default for n, each in fields.items()
                      if n not in given and n not in tied and n not in names and each.default is not None}  # fmt: skip
    missing = [n for n in fields if n not in names and n not in tied and n not in values]
    if missing:
        raise HopformError(f"fitted: {', '.join(missing)} must be fitted or known; they have no default")
    return values, names, tied


def _view(model: Model, recording: Recording) -> Recording:
    """The columns of a recording that the model has: positions, and what drives it."""
    columns = dict[str, Column]()
    alone = len(model.masses) == 1
    for mass in model.masses:
        column = recording.named(mass.coordinate)
        if column is None and alone:
            column = recording.found("x1") or recording.found("x2")
        if column is None:
            continue
        if SI[column.quantity] != mass.unit:
            raise recording.error(
                f"must be in {mass.unit} or a multiple of it, as {mass.coordinate} of the model", recording.head, column
            )
        columns["position" if alone else f"x{mass.number}"] = column
    if not columns:
        names = " or ".join(f"{each.coordinate} (as in {each.coordinate}_{each.unit})" for each in model.masses)
        raise recording.error(
            f"no column is a coordinate of the model {model.core.name}: name it {names}; there are {recording.titled()}",
            recording.head,
        )
    if model.law is not None:
        columns["target"] = _target(model, recording)
    elif model.input is not None:
        name, unit = model.input["name"], model.input["unit"]
        in_its_unit = recording.in_unit(name, unit)
        drive = in_its_unit or recording.named(name) or recording.found("u")
        if drive is None:  # one in another unit must not pass for a recording without a drive
            titles = (each for each in recording.others if each.startswith(f"{name}_".lower()))
            drive = next((recording.others[each] for each in titles), None)
        if drive is not None:
            other = DRIVES.get(drive.quantity)
            if in_its_unit is None and other != unit and not (other and unit in DRIVES.values() and model.per_drive):
                raise recording.error(f"must be in {unit}, as {name} of the model", recording.head, drive)
            columns["current"] = drive
            notes = used_after_all(recording.notes, drive.title)
            if in_its_unit is None and other != unit:
                notes += (
                    f"{drive.title} drives, in {other}: {name} and {model.per_drive} are in this unit, not in {unit}",
                )
            recording = replace(recording, notes=notes)
    return replace(recording, columns=columns, unfit={}).of_columns([*columns.values()])


def _target(model: Model, recording: Recording) -> Column:
    """The column of a law's target: by the name that the model has for it, or that loggers have."""
    name, unit = cast(Law, model.law).target, cast("dict[str, Any]", model.input)["unit"]
    column = recording.named(name) or recording.found("target")
    if column is None:
        raise recording.error(
            f"no column is the {name} of the law: name it {name}, goal, command or setpoint, with its unit, as in "
            f"goal_{unit}; there are {recording.titled()}. Without it fit the mechanism without the law, under the measured "
            f"{cast(Law, model.law).current}",
            recording.head,
        )
    if SI[column.quantity] != unit:
        raise recording.error(f"must be in {unit}, as {name} of the model", recording.head, column)
    if float(np.ptp(column.values)) == 0.0:
        raise recording.error(
            f"is constant at {column.values[0]:.6g} {unit}: it commands no motion", recording.line, column
        )
    return column


def seen_by(core: Core, recording: Recording) -> Recording:
    """A recording with the columns that the model of a solver has, as every fit names them."""
    return _view(Model(core), recording)


def _motions(model: Model, recording: Recording, number: int) -> list[Cut]:
    """The motions of a recording: what its drive shows, or its free decays."""
    titles = [title for title in ("position", "x1", "x2") if title in recording.columns]
    axis = "x2" if titles[0] == "x2" else "x1"
    decay = len(model.masses) == 1 and not recording.has_current()
    x = recording.oscillation(axis) if decay else recording.position(axis)
    other = recording.columns[titles[1]].values if len(titles) > 1 else None
    if model.law is not None:
        spans = whole_spans(recording)
    elif recording.has_current():
        spans = known_spans(recording)
    else:
        spans = decays(recording, mended(x)) if decay else [(0, x.size)]
    return cuts_of(recording, number, spans, x, other)


def _posed(
    model: Model, cut: Cut, n: int, values: Values, names: Mapping[str, str], sine: bool, rate: float
) -> tuple[list[Modelled], list[Parameter]]:
    """The experiments of a motion, one of each coordinate that was measured, and where it begins as parameters."""
    measured = [each for each in model.masses if len(model.masses) == 1 or f"x{each.number}" in cut.recording.columns]
    kept, clean = cut.independent(), cut.mended()
    parameters, letters, constants = list[Parameter](), dict(names), dict(values)
    for mass in model.masses:
        x, v = _start_letters(mass.number)
        seen = {1: clean.x, 2: clean.x1}[measured.index(mass) + 1] if mass in measured else None
        place = speed = 0.0
        if seen is not None:
            place, speed = float(np.median(seen[:5])), float(np.polyfit(cut.time[:5], seen[:5], 1)[0])
        reach = float(np.ptp(cut.x))
        letters[x] = f"{mass.coordinate}@{n}"
        start = Parameter(letters[x], mass.unit, place, 0.1 * reach, own=True)
        if "v" in cut.still and seen is not None:
            constants[v] = 0.0
            wide = 8.0 * max(noise_of(seen), quantum_of(seen), 1e-9)
            start = start._replace(low=place - wide, high=place + wide)
        else:
            letters[v] = f"{mass.velocity}@{n}"
            parameters.append(Parameter(letters[v], f"{mass.unit}/s", speed, reach, own=True))
        parameters.append(start)
    if rate:
        return [_controlled(model, cut, kept, letters, constants, parameters, rate)], parameters
    angle = Seen(cut.time, clean.x, np.gradient(clean.x, cut.time))
    experiments = list[Modelled]()
    for mass, place_of in zip(measured, (cut.x, cut.x1), strict=False):
        experiments.append(
            Modelled(
                cut.label if len(measured) == 1 else f"{cut.label}, {mass.coordinate}", "model", cut.time[kept], cast(Array, place_of)[kept], letters, constants, cut.steps,
                begin=cut.begin, of="x1" if mass.number == 1 else "x2", model=model, mass=mass.number,
                grid=_grid(cut.time, clean.x) if sine else None, seen=[angle, angle],
            )
        )  # fmt: skip
    return experiments, parameters


_LATEST = 0.05
"""[s] of a delay or a dead time at most."""


def _target_of(cut: Cut) -> Array:
    """A law's target at the samples of a motion."""
    begin = int(np.searchsorted(cut.recording.time, cut.begin - 1e-12))
    return cut.recording.columns["target"].values[begin : begin + cut.time.size]


def _controlled(
    model: Model, cut: Cut, kept: NDArray[np.bool_], letters: dict[str, str], constants: Values,
    parameters: list[Parameter], rate: float,
) -> Controlled:  # fmt: skip
    """A motion under a law, with its delays among the parameters: of the target one in each recording, of the current one
    in all.
    """
    grid, target = _grid_of(cut.time, rate, _logged(cut.recording)), _target_of(cut)
    period, time = grid.period, grid.time
    letters |= {"delay": f"delay{letters['x'][letters['x'].index('@') :]}", "dead_time": "dead_time"}
    latest = min(_LATEST, MOST_LATE * period)
    parameters += [
        Parameter(letters["delay"], "s", 0.0, 1e-3, own=True, low=-_LATEST, high=_LATEST),
        Parameter("dead_time", "s", 0.5 * period, 1e-3, low=0.0, high=latest),
    ]
    return Controlled(
        cut.label, "model", time[kept], cut.x[kept], letters, constants, current_steps(time, target), begin=cut.begin,
        of="x1", model=model, mass=1, period=period, target=(time, target),
    )  # fmt: skip


def _delays(motions: Sequence[Cut], rate: float) -> list[dict[str, float]]:
    """Where delay and dead time may begin: both short first; a dead time acts as a delay and takes from the damping."""
    if not rate:
        return [{}]
    pairs = ((0.0, 0.5 / rate), (0.0, _LATE), (_LATE, 0.5 / rate))
    return [
        {**{f"delay@{n}": delay for n in range(len(motions))}, "dead_time": min(dead, MOST_LATE / rate)}
        for delay, dead in pairs
    ]  # fmt: skip


_LATE = 5e-3
"""[s] of a delay or a dead time that is usual."""
_ANGLE = 0.06
"""[rad] of an oscillation in a step of gravity's sine at most: what is left of its hold, corrected to second order, is
its fourth power.
"""


def _grid(time: Array, x: Array) -> Array:
    """Times between which gravity's sine is constant."""
    half = half_period(time, x)
    step = _ANGLE / math.pi * half if half > 0.0 else 0.0
    every = max(int(step / float(np.median(np.diff(time)))), 1)
    return np.append(time[:-1:every], time[-1])


def begin_of_search(model: Model, name: str, start: Values | None) -> float:
    """Where the search for a start begins: what is given, the default, or 1."""
    parameter = model.parameters[name]
    given = mapping("start", start, MOST_KNOWN).get(name, parameter.get("default", 1.0))
    value = real(f"start: {name}", given, parameter["unit"])
    return value if value or parameter["domain"] == "real" else 0.1


def _given(model: Model, names: Sequence[str], start: Values | None) -> dict[str, float]:
    """The values near which the search is asked to begin, of what is fitted."""
    given = mapping("start", start, MOST_KNOWN)
    for name in given:
        if name not in names:
            what = "it is not fitted" if name in model.parameters else "unknown parameter"
            raise HopformError(f"near: {shown(name)}: {what}; fitted are {', '.join(names)}")
    return {n: real(f"start: {n}", given[n], model.parameters[n]["unit"]) for n in names if n in given}


def parameter_of(setup: Setup, name: str, start: float) -> Parameter:
    """A parameter of a fit; that of a place of each recording is that recording's own."""
    letter = setup.parameters.get(name, name)
    declared = setup.model.parameters[letter]
    domain = declared["domain"] if declared["domain"] in ("positive", "nonnegative", "fraction") else "real"
    scale = abs(start) if domain == "positive" else max(abs(start), 1e-3)
    is_own = name != letter and letter in setup.model.places
    unit = setup.units.of("N/A") if letter == setup.model.per_drive else declared["unit"]
    return Parameter(name, unit, start, scale, domain, profiled=not is_own, own=is_own)


_SPREAD = (1.0, 0.05, 20.0)
"""Times what is given of positive parameters, where the search for a start begins."""
_MOST_LEFT = 0.05
"""Share of the accelerations that a start leaves which is good enough: the search for it ends."""


class Rows(NamedTuple):
    """Places, velocities and accelerations of each mass, and the drive, filtered alike; scale: of the accelerations."""

    x: list[Array]
    v: list[Array]
    a: list[Array]
    u: Array


_LONG = 1.0
"""[s] of a motion from which the cutoffs are those that they are."""


def _filtered(model: Model, motion: Cut, cutoff: float) -> Rows:
    """A motion through a filter, without outliers, whose cutoff [Hz] is that of a long one: of a short motion so few rows
    would be left that anything explains them. Its drive holds from sample to sample, so it is the smooth one of half a
    sample later.
    """
    time, step = motion.time, float(np.median(np.diff(motion.time)))
    cutoff *= max(_LONG / float(time[-1] - time[0]), 1.0)
    drive = held_at(motion.steps, time) if model.law is None else _target_of(motion)
    u = np.interp(time - 0.5 * step, time, drive)
    places, parts = [each for each in (motion.x, motion.x1) if each is not None], list[Filtered]()
    for x in places:
        kept = ~outliers(x)
        kept[[0, -1]] = True  # the filtered parts are as long as each other
        parts.append(filtered_part(time[kept], mended(x)[kept], u[kept], step, min(cutoff, 0.2 / step)))
    return Rows([p.x for p in parts], [p.v for p in parts], [p.acceleration for p in parts], parts[0].u)


class Search(NamedTuple):
    """The search for where a fit begins: a model, its motions, of each recording which parameter of the fit a letter is,
    the parameter to which masses were added, and whether the spring is gravity's sine.
    """

    model: Model
    motions: Sequence[Cut]
    letters: Mapping[int, Mapping[str, str]]
    heavier: str
    sine: bool

    def starts(self, values: Values, free: Values) -> tuple[list[dict[str, float]], float]:
        """Where the fit begins: the least squares of the accelerations through each filter; of several coordinates that
        were not all recorded what is given. And the least share of the accelerations that is left.
        """
        if len(self.model.masses) > 1 and any(each.x1 is None for each in self.motions):
            return [dict(free)], 0.0
        rows = [[_filtered(self.model, each, cutoff) for each in self.motions] for cutoff in CUTOFFS]
        tries = sorted((self._regressed(some, values, free) for some in rows), key=lambda each: each[0])
        return [start for _, start in tries], tries[0][0]

    def near(self, values: Values, free: Values, given: Values) -> dict[str, float]:
        """Where the fit begins of what no start was given for."""
        rest = {name: each for name, each in free.items() if name not in given}
        held = {letter: given[name] for each in self.letters.values() for letter, name in each.items() if name in given}
        letters = {n: {letter: name for letter, name in each.items() if name not in given}
                   for n, each in self.letters.items()}  # fmt: skip
        return self._replace(letters=letters).starts({**values, **held}, rest)[0][0] if rest else {}

    def _regressed(self, rows: Sequence[Rows], values: Values, free: Values) -> tuple[float, dict[str, float]]:
        """The least squares of accelerations where something moves, from several sizes of positive parameters: its cost, and
        the parameters.
        """
        optimize, names, model = of_scipy("optimize"), list(free), self.model
        domains = {name: model.parameters[name.partition("@")[0]]["domain"] for name in names}
        log = np.array([domains[name] == "positive" for name in names])
        scale = np.array([abs(free[name]) or 1.0 for name in names])
        low = np.where([domains[n] == "nonnegative" for n in names], 0.0, -np.inf)
        size = max(float(np.sqrt(np.mean(np.concatenate([a for each in rows for a in each.a]) ** 2))), 1e-12)

        def out(z: Array) -> dict[str, float]:
            values_of_z = np.where(log, scale * np.exp(np.clip(np.where(log, z, 0.0), -30.0, 30.0)), scale * z)
            return dict(zip(names, values_of_z.tolist(), strict=True))

        def off(z: Array) -> Array:
            free_values, parts = out(z), list[Array]()
            for row, motion in zip(rows, self.motions, strict=True):
                at = {**values, **{n: free_values[name] for n, name in self.letters[motion.number].items()}}
                robot = model.robot(_heavier(at, self.heavier, motion.recording.added_mass))
                moving = np.all([np.abs(v) > 0.05 * np.abs(v).max() for v in row.v], axis=0)
                x, v = [p[moving] for p in row.x], [p[moving] for p in row.v]
                for mass, a in zip(model.masses, row.a, strict=True):
                    u = model.driving(robot, x[0], v[0], row.u[moving])
                    acceleration = model.accelerations(robot, mass.number, x, v, u, [np.sign(p) for p in v])
                    if self.sine:
                        none, zero, side = np.zeros_like(x[0]), np.zeros_like(v[0]), [np.ones_like(v[0])]
                        flat, slope = (
                            float(model.accelerations(robot, 1, [none + d], [zero], zero, side)[0]) for d in (0.0, 1.0)
                        )
                        acceleration = acceleration + (flat - slope) * (x[0] - np.sin(x[0]))
                    parts.append((acceleration - a[moving]) / size)
            return np.nan_to_num(np.concatenate(parts), nan=1e6, posinf=1e6, neginf=-1e6)

        minima = list[tuple[float, float, Array]]()
        for by in _SPREAD:
            z = np.where(log, math.log(by), np.array([free[name] for name in names]) / scale)
            one = optimize.least_squares(
                off, np.maximum(z, low + 1e-6), bounds=(low, np.inf), loss="soft_l1", x_scale="jac", max_nfev=200
            )
            minima.append((float(one.cost), float(np.mean(np.asarray(one.fun) ** 2)), np.asarray(one.x)))
            if minima[-1][1] <= _MOST_LEFT:
                break
        _, left, best = min(minima, key=lambda each: each[0])
        return left, out(best)


def fit(
    solver: Solver | str | Path,
    recordings: Recordings,
    *,
    fitted: Sequence[str] | None = None,
    known: Given = None,
    start: Values | None = None,
    sine: bool = False,
    rate: float | None = None,
    **options: Unpack[Options],
) -> Fit:
    """The parameters of any solver's model, by least squares on its exact motions, with their 95 % intervals.

    solver: or its name or folder. recordings: one, several, or their files, each with a column named as a coordinate of
    the model with its unit, or `position` of a model with one, and one named as the input, if there is one; without it
    the largest free decay is fitted. fitted: names of parameters; if not given all that are not known, but for stops,
    limits and friction that is higher at rest. known: values of others, or the name of a fitted one that it is alike;
    what is neither has its default. start: of fitted ones, where the search may begin. sine: the spring of an angle is
    gravity's, K sin(z) about where it rests in place of K z. rate [Hz]: of a model with a law, that of its controller;
    recordings then have a column of the target, by the model's name or as goal, command or setpoint, and the gains are
    known. options: `Options`.

    The fit's `robot()` has its numbers. Raises HopformError for recordings that are not of the model, and for names that
    are none of its parameters, MissingExtra without scipy.
    """
    core = solver if isinstance(solver, Solver) else load_solver(solver)
    return fit_model(core.Robot.solver, recordings, fitted, known, start, sine, rate, options)
