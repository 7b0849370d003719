# SPDX-License-Identifier: MIT-0
"""A stance, or a motion, solved as a textbook has it: phases by the closed form, events by samples and bracketing.

Each mass slips forwards, slips backwards, or is held by its friction. While this mode stays, the equations of motion
are linear with constant coefficients, and the closed form has the state at any time. A phase ends at the first zero of
an event function: a velocity, the distance to a stop, the contact force, the stick margin of a mass that is held, the
room of a law to its limits. The mode changes, and the next phase begins.

The C library certifies that no zero is left out. This module does not: it looks at `samples` times in each half period,
and between two of them a function may cross zero twice. It is meant to be read, to run where there is no library, and
as a second opinion. It has stances and motions, no flight and no derivatives.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import formulas
from .checked import attributes
from .elements import AXES, EVENTS, HAS_CONTACT, MODES, MOVING, RATES, State
from .kernels import basis_at, factor_cubic
from .records import ENDINGS, Ending, EventKind, LegState, Numerators, Poles, Rates, Robot, Start
from .robot import Robot as CheckedRobot
from .stability import conditions

Array: TypeAlias = NDArray[np.float64]
Steps: TypeAlias = Sequence[tuple[float, float]]
Sides: TypeAlias = tuple[int, int]
Guard: TypeAlias = tuple[str, int, int]
"""An event function: what happens at its zero, to which element, and to which side, or limit, that then goes."""

EPS = 2.0**-52
ROUNDING = 16.0 * EPS
"""Relative to the size that a function has had in the phase: what lies this close to zero is zero."""
MOST_PHASES = 4096


# ---- the answer ----


class Event(NamedTuple):
    """Something that happened during a motion."""

    time: float
    """[s] since the start"""
    kind: EventKind


class Phase(NamedTuple):
    """A part of a motion in which the mode stays: of each mass +1 where it moves forwards, -1 backwards, 0 held.

    Where a law sets the current mode_2 is +1 or -1 at the limit of the current to that side, 0 in between.
    """

    start: float
    """[s] since the start"""
    end: float
    """[s]"""
    mode_1: int
    mode_2: int
    u: float
    """the input, or the limit of a law"""
    state: State
    """where it starts"""


@dataclass(frozen=True)
class Motion:
    """A motion: how and when it ended [s], the state there, events and phases in their order."""

    status: Ending
    duration: float
    end: State
    events: tuple[Event, ...]
    phases: tuple[Phase, ...]
    _robot: Robot = field(repr=False)
    _closed: tuple["ClosedForm", ...] = field(repr=False)

    def at(self, t: Any) -> State:
        """The state at times t [s], a number or an array, in t's shape; behind the event at the time of one.

        ValueError for a time that is not within 0 .. duration; any later one is allowed after rest.
        """
        times = np.asarray(t, dtype=np.float64)
        latest = math.inf if self.status == "rest" else self.duration
        if not ((times >= 0.0) & (times <= latest)).all():
            raise ValueError(f"t must be within 0 .. {latest!r} s, got {t!r}")
        flat = np.minimum(times.ravel(), self.duration)
        starts = [phase.start for phase in self.phases]
        number = np.searchsorted(starts, flat, side="right") - 1
        columns = np.empty((len(LegState._fields), flat.size))
        for n, form in enumerate(self._closed):
            here = number == n
            if here.any():
                columns[:, here] = form.at(flat[here] - starts[n])
        shown = np.array(shown_of(self._robot, LegState(*columns)))
        shown[:, flat == self.duration] = np.array(self.end)[:, np.newaxis]  # behind what a stop takes there, too
        return State(*(each.reshape(times.shape) if times.ndim else float(each[0]) for each in shown))


# ---- the closed form of a phase ----


class ClosedForm(NamedTuple):
    """The motion in a mode: P(s) by its factors, and the numerators over it, from the state at the start."""

    start: LegState
    poles: Poles
    numerators: Numerators

    def at(self, t: Array) -> LegState:
        """The state at times t since the phase began, by the closed form: W is the response of the poles to an impulse."""
        basis = basis_at(Poles(*(np.full_like(t, each) for each in self.poles)), t)
        at = formulas.state_at(self.start, self.numerators, basis)
        return LegState(at.x1_t, at.v1_t, at.v2_t, at.y_t)


def factors_of(coefficients: Sequence[float]) -> Poles:
    """The denominator of a mode by its factors: (s + a)(s^2 + p s + q), or s^2 + p s + q where one mass slips."""
    if len(coefficients) == 2:
        p, q = coefficients
        return Poles(0.0, p, q, p, q, 0.0)
    return Poles(*(each.item() for each in factor_cubic(*(np.array([each]) for each in coefficients))))


# ---- the chain of phases ----


@dataclass
class Chain:
    """The motion while it grows: the time [s], the state, of each element the side to which it slips, 0 if held, and the
    limit that the input of a law is at, 0 under it.
    """

    robot: Robot
    steps: Steps
    state: LegState
    t: float = 0.0
    step: int = 0
    side: Sides = (0, 0)
    limit: int = 0
    events: list[Event] = field(default_factory=list[Event])
    phases: list[Phase] = field(default_factory=list[Phase])
    forms: list[ClosedForm] = field(default_factory=list[ClosedForm])

    # -- what acts in a mode --

    @property
    def rates(self) -> Rates:
        """Coefficients of the equations of motion and of the denominators."""
        return RATES[self.limit](self.robot)

    @property
    def u(self) -> float:
        """The input of a mode: that of the model; with a law the target, or the limit that the law is at."""
        u = self.steps[self.step][1]
        return float(formulas.input_at_limit(self.robot, u, self.limit)) if self.limit else u

    def closed_form(self, side: Sides) -> ClosedForm:
        """The motion from the present state in a mode; none where all is held."""
        rates = self.rates
        for mode in MODES:
            if mode.slips == slipping(side):
                numerators = mode.motion(rates, formulas.drive_of(self.robot, rates, self.u, *side), self.state)
                return ClosedForm(self.state, factors_of([rates[n] for n in mode.polynomial]), numerators)
        return ClosedForm(self.state, factors_of((0.0, 0.0)), Numerators(*[0.0] * len(Numerators._fields)))

    # -- the hold rule --

    def level(self, element: int, side: int) -> float:
        """Friction at rest against a start to a side, as an acceleration: that in motion and the excess."""
        up, down = formulas.excess_of(self.robot)[2 * element : 2 * element + 2]
        return float(formulas.friction_of(self.robot)[element] + (up if side > 0 else down))

    def blocked(self, element: int, side: int) -> bool:
        """Whether a stop keeps an element from going to a side."""
        low, high = formulas.lower_stop(self.robot), formulas.upper_stop(self.robot)
        beyond = self.state.x1 <= low if side < 0 else self.state.x1 >= high
        return element == 0 and bool(beyond or not low < high)

    def drift(self, element: int) -> float:
        """The first derivative of the free acceleration of an element that is held, of those that are not zero."""
        held = (0, self.side[1]) if element == 0 else (self.side[0], 0)
        free = (formulas.free_numerator_1, formulas.free_numerator_2)[element]
        return first_nonzero(free(self.rates, self.closed_form(held).numerators))

    def direction(self, element: int) -> int:
        """Where an element at rest goes: it is held while |a_i| <= f_s,i, else it starts in the direction of a_i.

        On the threshold the first derivative of a_i that is not zero decides; outwards means slipping at once.
        """
        free = float(formulas.free_accelerations(self.rates, self.state, self.u)[element])
        terms = float(formulas.free_terms(self.rates, self.state, self.u)[element])
        level = self.level(element, sign(free))
        near = ROUNDING * (terms + level)
        if abs(abs(free) - level) <= near:
            drift = self.drift(element) if len(MOVING) > 1 else 0.0
            outwards = free * drift > 0.0 or self.level(element, sign(drift)) <= near
            goes = sign(drift) if outwards else 0
        else:
            goes = sign(free) if abs(free) > level else 0
        return 0 if goes == 0 or self.blocked(element, goes) else goes

    def settle(self, resting: Sequence[int]) -> None:
        """The mode where some elements are at rest: where both are, each may depend on what the other does."""
        beyond = {limit: limit * (switching - level) for limit, switching, level in self.levels(self.state)}
        self.limit = next((limit for limit, far in beyond.items() if far > 0.0), 0)
        for element in [*resting] * len(resting):
            self.side = with_side(self.side, element, self.direction(element))
        for limit, far in beyond.items():
            if far == 0.0:  # it leaves the level, or not, by its rate
                rate = formulas.switching_numerator(self.robot, self.state, self.closed_form(self.side).numerators)
                self.limit = limit if limit * first_nonzero(rate) > 0.0 else 0

    def levels(self, state: LegState) -> Iterator[tuple[int, Any, float]]:
        """Of each limit of the input: its sign, the switching function, which is what a law asks of the motor, [N], and the
        level of that beyond which the input is at the limit.
        """
        lower, upper = formulas.switching_levels(self.robot)
        switching = formulas.switching_of(self.robot, state, self.steps[self.step][1])
        for limit, level in ((-1, float(lower)), (1, float(upper))):
            if math.isfinite(level):
                yield limit, switching, level

    # -- event functions --

    def event_functions(self, state: LegState) -> Iterator[tuple[Guard, Any]]:
        """The event functions, positive while the phase lasts, in order of tie-break priority: the contact's, mass 1, whose stop
        comes before its velocity, mass 2, the limits of a law.
        """
        if HAS_CONTACT:
            yield ("releases", 0, 0), formulas.contact_of(self.robot, state)
        stop = formulas.upper_stop(self.robot) if self.side[0] > 0 else formulas.lower_stop(self.robot)
        if self.side[0] != 0 and math.isfinite(stop):
            yield ("hits_stop", 0, 0), self.side[0] * (stop - state.x1)
        free = formulas.free_accelerations(self.rates, state, self.u)
        for element in MOVING:
            side = self.side[element]
            if side != 0:
                yield ("stops", element, 0), side * (state.v1, state.v2)[element]
            for goes in (-1, 1):
                if side == 0 and not self.blocked(element, goes):
                    yield ("slips", element, goes), self.level(element, goes) - goes * free[element]
        for limit, switching, level in self.levels(state):  # its room to a level; at a limit how far it is beyond
            if self.limit == 0:
                yield ("limit", -1, limit), limit * (level - switching)
            if self.limit == limit:
                yield ("limit", -1, 0), limit * (switching - level)

    def first_event(self, form: ClosedForm, limit: float, samples: int) -> tuple[float, Guard | None]:
        """The first zero of an event function within the limit: its time since the phase began, and of which.

        The first time at which a function is negative, and the one before, are a bracket. It is sampled as often again,
        until its ends are equal to rounding. Negative means beyond rounding, because a function may begin at zero or
        touch it; one that has been found so is then followed to its zero.
        """
        low, sizes = 0.0, np.zeros(1)
        while low < limit:
            times, near = window(form.poles, low, limit, samples), np.array(ROUNDING)
            while True:
                guards, values = zip(*self.event_functions(form.at(times)), strict=True)
                table = np.array([np.broadcast_to(each, times.shape) for each in values])
                sizes = np.maximum(sizes, np.abs(table).max(axis=1))
                negative = table < -(near * sizes)[:, np.newaxis]
                if not negative.any():
                    low = float(times[-1])
                    break
                n = int(negative.any(axis=0).argmax())
                low, high = float(times[n - 1]) if n else low, float(times[n])
                if high - low <= EPS * (self.t + limit):
                    return low, guards[negative[:, n].argmax()]
                times = np.linspace(low, high, samples + 1)[1:]
                near = np.where(negative[:, n] & (low > 0.0), 0.0, ROUNDING)
        return limit, None

    # -- from phase to phase --

    def advance(self, horizon: float, samples: int) -> Ending | None:
        """Solve one phase, and pass what ends it; the ending, if that is there."""
        if len(self.phases) == MOST_PHASES:
            self.events = [event for event in self.events if event.time < self.t]
            return "too_many_phases"
        form, is_last, rests = self.begin_phase(), self.step + 1 == len(self.steps), not any(slipping(self.side))
        if rests and is_last:
            return "rest"
        until = horizon if is_last else min(self.steps[self.step + 1][0], horizon)
        length, guard = (until - self.t, None) if rests else self.first_event(form, until - self.t, samples)
        self.state = LegState(*(float(each[0]) for each in form.at(np.array([length]))))
        self.t = until if guard is None else min(self.t + length, until)
        if guard is not None and guard[0] == "releases":
            return ENDINGS[1]
        if guard is not None:
            self.passes(guard)
        elif until == horizon:
            return "horizon"
        else:
            self.next_step()
        return None

    def begin_phase(self) -> ClosedForm:
        """The motion of the phase that begins, which is listed."""
        form = self.closed_form(self.side)
        shown = shown_of(self.robot, self.state)
        first, second = self.side
        second += self.limit  # of one mass, whose second sign is 0
        self.phases.append(Phase(self.t, self.t, first, second, self.steps[self.step][1], shown))
        self.forms.append(form)
        return form

    def passes(self, guard: Guard) -> None:
        """The state and the mode behind an event, which is listed; what the limits of a law do is none."""
        what, element, goes = guard
        if what == "limit":
            self.limit = goes
            return
        before = self.side[element]
        if what == "slips":
            self.side = with_side(self.side, element, goes)
        else:
            self.state = self.state._replace(**{("v1", "v2")[element]: 0.0})  # at a stop inelastic
            if what == "hits_stop":
                stop = formulas.upper_stop if before > 0 else formulas.lower_stop
                self.state = self.state._replace(x1=float(stop(self.robot)))
            self.settle([element])
            if what == "stops":
                what = "reverses" if self.side[element] else "sticks"
        if self.side[element] != before:
            self.happens(element, what)

    def next_step(self) -> None:
        """The input takes its next value: what is held may begin to slip."""
        held = [element for element in MOVING if self.side[element] == 0]
        self.step += 1
        self.settle(held)
        for element in held:
            if self.side[element] != 0:
                self.happens(element, "slips")

    def happens(self, element: int, what: str) -> None:
        """List an event."""
        self.events.append(Event(self.t, EVENTS[element][what]))

    def motion(self, status: Ending) -> Motion:
        """The answer. A rest begins when the last mass is held: steps of the input since then have moved nothing."""
        count = len(self.phases)
        while status == "rest" and count > 1 and not any(slipping(self.phases[count - 2][2:4])):
            count -= 1
        duration = self.phases[count - 1].start if status == "rest" else self.t
        ends = [*(phase.start for phase in self.phases[1:count]), duration]
        phases = [phase._replace(end=end) for phase, end in zip(self.phases[:count], ends, strict=True)]
        end, forms = shown_of(self.robot, self.state), tuple(self.forms[:count])
        return Motion(status, duration, end, tuple(self.events), tuple(phases), self.robot, forms)


def slipping(side: Sequence[int]) -> tuple[bool, ...]:
    """Which elements slip."""
    return tuple(element in MOVING and each != 0 for element, each in enumerate(side))


def with_side(side: Sides, element: int, own: int) -> Sides:
    """The sides with another one of an element."""
    return (own, side[1]) if element == 0 else (side[0], own)


def sign(value: float) -> int:
    """1, -1, or 0."""
    return int(value > 0.0) - int(value < 0.0)


def first_nonzero(derivatives: Iterable[float]) -> float:
    """The first that is not zero, 0 if all are."""
    return next((float(each) for each in derivatives if each != 0.0), 0.0)


def window(poles: Poles, low: float, limit: float, samples: int) -> Array:
    """The times at which the event functions are looked at next, behind `low`.

    While the pair of poles rings they are spread over half a period, in which a motion of the pair has one sign change.
    Else all fades: each window is as long as what has passed, and a quarter of the samples is enough. The first window
    has others besides, each closer to the start by the square root of 2, because an event may follow another at once.
    """
    frequency = math.sqrt(max(poles.q - 0.25 * poles.p * poles.p, 0.0))
    rings = frequency > 0.0 and poles.p * low < 80.0  # exp(-40) is nothing beside what there was
    fastest = poles.s_1 + math.sqrt(poles.s_2)  # no pole is further from 0
    length = math.pi / frequency if rings else max(low, 1.0 / fastest if fastest > 0.0 else limit)
    high = min(low + length, limit)
    times = np.linspace(low, high, (samples if rings else max(samples // 4, 1)) + 1)[1:]
    if low > 0.0:
        return times
    return np.unique(np.concatenate([times, high * np.exp2(-0.5 * np.arange(1, samples + 1))]))


# ---- in and out ----


def shown_of(robot: Robot, state: LegState) -> State:
    """A state in the coordinates of the model."""
    own = state._asdict() | {"x2": formulas.second_position(robot, state.x1, state.y)}
    return State(*(own[axis] for axis in AXES))


def start_of(robot: Robot, start: Mapping[str, float]) -> LegState:
    """The state at the start by coordinates and velocities; what is left out is 0, and so is y where there is a contact."""
    known = dict(zip(State._fields, AXES, strict=True)) | ({"y": "y"} if len(MOVING) > 1 else {})
    given = {known[name]: float(value) for name, value in start.items() if name in known}
    if len(given) < len(start) or given.keys() >= {"x2", "y"}:
        raise ValueError(f"start may have {', '.join(known)}, but one of x2 and y, got {', '.join(start)}")
    x1, low, high = given.get("x1", 0.0), formulas.lower_stop(robot), formulas.upper_stop(robot)
    if not low <= x1 <= high:
        raise ValueError(f"start {AXES[0]} must be within the stops {low!r} .. {high!r}, got {x1!r}")
    y = given.get("y", 0.0)
    if "x2" in given or not ("y" in given or HAS_CONTACT):
        x2, length = given.get("x2", 0.0), float(formulas.second_position(robot, 0.0, 0.0))
        y = float(formulas.state_of_start(robot, Start(*(given.get(axis, 0.0) for axis in AXES))).y)
        touches = HAS_CONTACT and abs(y) <= 4.0 * EPS * max(abs(x1), abs(x2), abs(length))
        y = 0.0 if touches else y
    if HAS_CONTACT and y < 0.0:
        raise ValueError(f"the contact must not pull at the start, got y = {y!r}")
    return LegState(x1, given.get("v1", 0.0), given.get("v2", 0.0), y)


def steps_of(u: float | Steps) -> Steps:
    """An input, or steps (t, u) of it, as steps that begin at 0."""
    steps = [(float(t), float(value)) for t, value in u] if isinstance(u, Sequence) else [(0.0, float(u))]
    times = [t for t, _ in steps]
    if not steps or times[0] != 0.0 or any(not before < after for before, after in zip(times, times[1:], strict=False)):
        raise ValueError(f"the times of u must begin at 0 and increase, got {times!r}")
    return steps


def begun(robot: Robot, start: LegState, steps: Steps) -> Chain:
    """A motion at its start. What a mass does there is no event; a stop that it would move into takes its velocity."""
    chain = Chain(robot, steps, start)
    chain.side = (sign(start.v1) if 0 in MOVING else 0, sign(start.v2) if 1 in MOVING else 0)
    if chain.side[0] != 0 and chain.blocked(0, chain.side[0]):
        chain.state, chain.side = start._replace(v1=0.0), (0, chain.side[1])
    chain.settle([element for element in MOVING if chain.side[element] == 0])
    return chain


def checked(robot: Robot | CheckedRobot) -> Robot:
    """The parameters, each within its domain; ValueError names the condition that lets a motion grow."""
    given = robot if isinstance(robot, Robot) else robot.parameters
    names = attributes(CheckedRobot)
    parameters = CheckedRobot(**{names[name]: getattr(given, name) for name in Robot._fields}).parameters
    for name, value, who in conditions(formulas.rates_of(parameters)):
        if value < 0.0:
            condition = f"Routh's condition {name} >= 0 is violated, {name} = {value!r}"
            raise ValueError(f"the robot is unstable, {who}: {condition}")
    return parameters


def solve(
    robot: Robot | CheckedRobot,
    start: Mapping[str, float],
    u: float | Steps = 0.0,
    horizon: float = 2.0,
    samples: int = 64,
) -> Motion:
    """Solve a stance, or a motion of a model without a contact.

    start: coordinates and velocities by their names, of a stance those after the impact; what is left out is 0. u: the
    input, a number or steps (t, u) [s]. horizon [s]: the longest time. samples: how many there are in half a period.
    ValueError for a robot that is unstable or out of its domain, and for what no motion can start from.
    """
    if not (horizon > 0.0 and samples >= 1):
        raise ValueError(f"horizon must be > 0 s and samples >= 1, got {horizon!r} and {samples!r}")
    parameters = checked(robot)
    chain = begun(parameters, start_of(parameters, start), steps_of(u))
    while (status := chain.advance(horizon, samples)) is None:
        pass
    return chain.motion(status)
