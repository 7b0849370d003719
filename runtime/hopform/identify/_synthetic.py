"""Synthetic recordings of any robot, with noise, encoder quantum and rate: to plan experiments with, and to prove the
fits.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, SupportsFloat

import numpy as np

from hopform import HopformError, Robot, Solver, solve_motion
from hopform._checks import MEMORY, flag, mapping, real, word
from hopform._motion import Start
from hopform._robots import checked_robot
from hopform._solver.package import Steps, records
from hopform._stance import Current
from hopform.extend import finite, positive, whole
from hopform.identify._closed_loop import Loop, law_of
from hopform.identify._motion import MAX_PHASES, Array, drop_and_compression, held_at, slide
from hopform.identify._recordings import OTHER, SI, Column, Recording, current_steps

TESTS = ("drop", "free", "decay", "step", "air")
MOTION = "motion"
"""What is recorded of any model: its motion from a start."""
DRIVEN = ("step", "air")
"""Tests of an actuator, whose body is held or in the air."""

MOST_SAMPLES = MEMORY // 1024
"""Samples of a recording at most: in arrays and as text each takes up to 1 kB."""
NOISE = 2e-4
QUANTUM = 1.0 / 56000.0
FREE_STROKE = "recorded on a rig without stops and without a limit of the spring's travel"
"""Remark of a recording that --free-stroke asked for."""


def record(
    robot: Robot,
    test: str,
    *,
    duration: SupportsFloat | None = None,
    rate: SupportsFloat = 500.0,
    noise: SupportsFloat = NOISE,
    quantum: SupportsFloat = QUANTUM,
    height: SupportsFloat | None = None,
    current: SupportsFloat | None = None,
    hold: SupportsFloat | None = None,
    added_mass: SupportsFloat = 0.0,
    repeats: int = 1,
    free_stroke: bool = False,
    start: Start = None,
    u: Current = 0.0,
    control_rate: SupportsFloat | None = None,
    dead_time: SupportsFloat = 0.0,
    seed: int | None = None,
) -> Recording:
    """A synthetic recording of a robot in a test, within the robot's stroke and its spring's travel.

    test: "drop" (released at hop height `height` [m], actuator held, flights and impacts included), "free" (the same,
    the actuator free within its stops under currents of both signs from the release on; x1 is recorded too), "decay"
    (the body fixed to its spring, pulled down by `height`), "step" (the body held, currents +-`current` [A] in turn),
    "air" (the same without a spring). An actuator that is held is so at x1 = 0, or at the stop next
    to it; one that is driven begins where its motion lies in the middle of its stroke.

    height, if not given: 0.2 m, of a decay 0.04 m; current: u_max, 1 A if that is infinite; both the largest that stays
    within stroke and travel if that is less. hold [s]: of stillness at first, but in a decay; 0.2 s if not given.
    duration [s]: of a motion; 2 s if not given. A drop or a decay is repeated `repeats` times, the body taken back by
    hand in between. rate [Hz], noise [m] (standard deviation), quantum [m] (0 for none). free_stroke: on a rig without
    stops, whose spring's travel has no limit, as the recording's remarks say. The same seed gives the same recording,
    None another one each time.

    test "motion": any model from `start` under `u`, as `solve_motion` takes them; every position is recorded, noise and
    quantum in its unit, and the input where it is not 0. What the other tests are set by is refused. control_rate [Hz]:
    of a model with a law, that of a controller which sets the current at its ticks and holds it; each acts dead_time [s]
    later. Then the target is recorded too.

    Raises HopformError for a value that is not allowed, and for a height or a current under which the actuator reaches
    a stop, or the spring the end of its travel; the message has the largest that fits. In a free drop the actuator may
    reach its stops.

    >>> import hopform
    >>> recording = record(hopform.load_robot("hopper_c"), "step", seed=1)
    >>> recording.time.size, sorted(recording.columns)
    (1001, ['current', 'x1'])
    """
    word("test", test, (*TESTS, MOTION))
    checked_robot(robot, "motion" if test == MOTION else "identify")
    whole("repeats", repeats, most=1000)
    if repeats > 1 and test not in ("drop", "decay"):
        raise HopformError(f"repeats are for a drop or a decay, got {test!r}")
    # Of one seed each test has noise of its own.
    of_test = None if seed is None else [whole("seed", seed, 0, math.inf), (*TESTS, MOTION).index(test)]
    draw = np.random.default_rng(of_test)
    encoder = finite("noise", noise, "m", 0.0), finite("quantum", quantum, "m", 0.0), draw
    controller = None if control_rate is None else positive("control_rate", control_rate, "Hz")
    late = finite("dead_time", dead_time, "s", 0.0)
    length = positive("duration", 2.0 if duration is None else duration, "s")
    hertz = positive("rate", rate, "Hz")
    if not 18.5 < length * hertz < records.MOST_STEPS - 0.5:
        message = f"duration times rate must give 20 to {records.MOST_STEPS} samples, got {length * hertz + 1.0:.6g}"
        raise HopformError(message)
    time = np.arange(round(length * hertz) + 1) / hertz
    if repeats * (time.size + hertz) > MOST_SAMPLES:
        most = int(MOST_SAMPLES / (time.size + hertz))
        raise HopformError(f"repeats must be at most {most} for so many samples each, got {repeats}")
    set_by = {"height": height, "current": current, "hold": hold, "added_mass": added_mass or None,
              "free_stroke": flag("free_stroke", free_stroke) or None}  # fmt: skip
    if test == MOTION:
        if wrong := [name for name, value in set_by.items() if value is not None]:
            raise HopformError(f"{', '.join(wrong)}: a motion is set by start and u alone")
        return _motion(robot, start, u, time, encoder, controller, late)
    if mapping("start", start, 64) or isinstance(u, Sequence) or real("u", u, "A") != 0.0 or controller or late:
        raise HopformError(f"start, u, control_rate and dead_time are for the test {MOTION!r}, got {test!r}")
    still = finite("hold", 0.2 if hold is None else hold, "s", 0.0)
    if not still <= time[-1]:
        raise HopformError(f"hold must be <= {float(time[-1])!r} s, the duration, got {still!r}")
    rig = robot
    if free_stroke:
        rig = replace(robot, x1_min=-math.inf, x1_max=math.inf, travel=math.inf)
    bench = _Bench(rig, test, time, still, finite("added_mass", added_mass, "kg", 0.0))
    motion_made = bench.made(_given(bench, height, current))
    columns = dict[str, Column]()
    if motion_made.x2 is not None:
        x, time = _again(motion_made.x2, repeats, hertz) if repeats > 1 else (motion_made.x2, time)
        columns["x2"] = _column("x2_m", 2, x, *encoder)
    if motion_made.u is not None:
        columns["current"] = Column("current_A", "current", 3, motion_made.u)
    if motion_made.x1 is not None:
        columns["x1"] = _column("x1_m", 4 if test == "free" else 2, motion_made.x1, *encoder)
    remarks = (FREE_STROKE,) if free_stroke else ()
    name = f"{robot.name or 'robot'}, {test}"
    return Recording(name, time, columns, (2 + len(remarks),), bench.mass, remarks, remarks)


def hardest(robots: Sequence[Robot], test: str, duration: float) -> tuple[str, float, str]:
    """The setting of a test that none of some robots is harmed by, its value and unit: the smallest of those that fit
    each. HopformError where a robot has none.
    """
    name, unit = ("current", "A") if test in DRIVEN else ("height", "m")
    time = np.arange(round(500.0 * duration) + 1) / 500.0
    values = [_given(_Bench(each, test, time, 0.2, 0.0), None, None)[name] for each in robots]
    return name, min(values), unit


def to_csv(recording: Recording) -> str:
    """A recording as the CSV text that `read_recording` reads."""
    columns = sorted(recording.columns.values(), key=lambda column: column.place)
    head = [*(f"# {each}" for each in recording.remarks), ",".join(["time_s", *(column.title for column in columns)])]
    rows = zip(recording.time.tolist(), *(column.values.tolist() for column in columns), strict=True)
    return "\n".join([*head, *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n"


Encoder = tuple[float, float, np.random.Generator]
"""Of a position: noise and quantum, and what draws the noise."""


def _motion(
    robot: Robot, start: Start, u: Current, time: Array, encoder: Encoder, control_rate: float | None, dead_time: float
) -> Recording:
    """The motion of any model from a start under its input; HopformError where it ends before the last sample."""
    if control_rate is not None:
        return _controlled(robot, start, u, time, control_rate, dead_time, encoder)
    if dead_time > 0.0:
        raise HopformError("dead_time is that of a controller: give control_rate")
    facts = robot.solver.facts
    solved = solve_motion(robot, start=start, u=u, horizon=float(time[-1]) * _PAST)
    if solved.status not in ("rest", "horizon"):
        message = f"the motion ends by {solved.status} after {solved.duration:.6g} s, before the last sample"
        raise HopformError(f"{message}: a shorter duration, or another start, is needed")
    state, columns = solved.at(np.minimum(time, solved.duration)), dict[str, Column]()
    for axis in ("x1", "x2"):
        if axis in facts.axes:
            name, unit = (str(facts.axes[axis][part]) for part in ("name", "unit"))
            x = np.asarray(getattr(state, name), dtype=np.float64)
            columns[name.lower()] = _column(f"{name}_{unit}", len(columns) + 2, x, *encoder)
    drive = solved.current(time) if facts.inputs else np.zeros(time.size)
    if drive.any():
        name, unit = (str((facts.currents or facts.inputs)[0][part]) for part in ("name", "unit"))
        title, quantity = f"{name}_{unit.replace(' ', '')}", _QUANTITIES.get(unit, OTHER)
        columns[name.lower()] = Column(title, quantity, len(columns) + 2, np.asarray(drive, np.float64))
    return Recording(f"{robot.name or facts.name}, {MOTION}", time, columns)


def _controlled(
    robot: Robot, start: Start, u: Current, time: Array, rate: float, dead_time: float, encoder: Encoder
) -> Recording:  # fmt: skip
    """The motion of a model under a law that a controller computes at its ticks, at multiples of a period, and whose
    current acts later by a dead time; the first one also before.
    """
    core = robot.solver
    facts, law = core.facts, law_of(core)
    if law is None:
        raise HopformError(f"control_rate: the model {facts.name} has no law")
    ends = float(time[-1]) * rate
    if not ends <= MOST_SAMPLES:
        raise HopformError(f"control_rate must be at most {MOST_SAMPLES / float(time[-1]):.6g} Hz, got {rate!r}")
    steps = tuple((float(t), float(level)) for t, level in (u if isinstance(u, Sequence) else ((0.0, u),)))
    (place, speed), loop = (str(facts.axes[axis]["name"]) for axis in ("x1", "v1")), Loop(core, law, robot.parameters)
    state = {place: 0.0, speed: 0.0} | {name: float(value) for name, value in (start or {}).items()}
    ticks = np.arange(math.floor(ends + 1e-9) + 1) / rate
    kinds = ((ticks, "tick"), (ticks + dead_time, "acts"), (time, "sample"))
    order = sorted((round(t, 12), n, kind) for n, (times, kind) in enumerate(kinds) for t in times.tolist())
    now, asked, acting = 0.0, list[float](), 0
    x, i = list[float](), list[float]()
    for t, _, kind in order:
        if t > float(time[-1]) + 1e-12:
            break
        if t > now:
            state = loop.end(robot, state, asked[max(acting - 1, 0)], t - now)
            now = t
        if kind == "tick":
            target = float(held_at(steps, t + 1e-12))
            asked.append(loop.limited(float(loop.asked(robot.parameters, state[place], state[speed], target))))
        elif kind == "acts":
            acting += 1
        else:
            x.append(state[place])
            i.append(asked[max(acting - 1, 0)])
    targets = held_at(steps, time + 1e-12)
    unit, (drive, goal) = str(facts.axes["x1"]["unit"]), (facts.currents[0], facts.inputs[0])
    columns = {place.lower(): _column(f"{place}_{unit}", 2, np.array(x), *encoder)}
    for n, (table, values) in enumerate(((goal, targets), (drive, np.array(i))), 3):
        name, in_unit = str(table["name"]), str(table["unit"])
        columns[name.lower()] = Column(
            f"{name}_{in_unit.replace(' ', '')}", _QUANTITIES.get(in_unit, OTHER), n, values + 0.0
        )
    return Recording(f"{robot.name or facts.name}, {MOTION}", time, columns)


_QUANTITIES = {unit: quantity for quantity, unit in SI.items()}


def _column(title: str, place: int, x: Array, noise: float, quantum: float, rng: "np.random.Generator") -> Column:
    """A position [m, rad] as a sensor of a noise and a quantum [m, rad] has it."""
    with np.errstate(over="ignore"):
        values = x + noise * rng.standard_normal(x.size)
    if not bool(np.isfinite(values).all()):
        raise HopformError(
            f"height, current and noise must be smaller: {title} leaves the range of floating-point numbers"
        )
    if quantum > np.spacing(np.abs(values)).max():  # a step that is finer than the last digit rounds nothing
        values = quantum * np.round(values / quantum)
    return Column(title, _QUANTITIES[title.rpartition("_")[2]], place, values)


# ---- settings that fit ----

Settings = Mapping[str, float]
"""Height [m] and current [A] of a test, by their names."""


def _given(bench: "_Bench", height: SupportsFloat | None, current: SupportsFloat | None) -> Settings:
    """The settings of a test: those that are given, if they fit; others the usual ones, or less where these do not."""
    robot, test = bench.robot, bench.test
    usual = {"height": 0.04 if test == "decay" else 0.2}
    usual |= {"current": robot.u_max if math.isfinite(robot.u_max) else 1.0}
    given = dict[str, float]()
    if height is not None:
        given["height"] = positive("height", height, "m")
    if current is not None:
        given["current"] = positive("current", current, "A")
        if given["current"] > robot.u_max:
            raise HopformError(f"current must be <= u_max = {robot.u_max!r} A, got {given['current']!r}")
    names = [name for name, tests in _SETTINGS.items() if test in tests]
    asked = {name: given.get(name, usual[name]) for name in names}
    if test in DRIVEN and robot.x1_min == robot.x1_max:
        what = f"x1_min = x1_max = {robot.x1_min!r} m locks the actuator of {robot.name or 'this robot'}"
        raise HopformError(f"test: {test!r} moves the actuator, and {what}; {_ANOTHER}")
    beyond = bench.made(asked).beyond
    if not beyond:
        return asked
    fitting = _fitting(bench, asked, sorted(names, key=given.__contains__))
    less = {name: value for name, value in (fitting or {}).items() if value != asked[name]}
    if fitting and not less.keys() & given.keys():
        return fitting
    units, ways = {"height": "m", "current": "A"}, " and ".join(names)
    limits = [f"{name} must be <= {value!r} {units[name]}, got {asked[name]!r}" for name, value in less.items()]
    raise HopformError(f"{' and '.join(limits) or f'no {ways} fits'}: {beyond}; {_ANOTHER}")


def _fitting(bench: "_Bench", asked: Settings, names: Sequence[str]) -> Settings | None:
    """The settings with the first of those named that can be made to fit as large as it fits, then with all."""

    def largest(name: str, settings: Settings) -> Settings | None:
        value = _largest(lambda each: not bench.made({**settings, name: each}).beyond, settings[name])
        return {**settings, name: value} if value else None

    fitting = next((each for name in names if (each := largest(name, asked))), None)
    if fitting or len(names) == 1:
        return fitting
    lowest = largest("height", {**asked, "current": 0.0})
    while lowest and lowest["height"] > 1e-6 * asked["height"]:
        if fitting := largest("current", {**lowest, "current": asked["current"]}):
            return fitting
        lowest = {**lowest, "height": 0.5 * lowest["height"]}
    return None


def _largest(fits: Callable[[float], bool], most: float) -> float:
    """The largest value up to `most` that fits, to three digits, by halving; 0 if none does down to a millionth."""
    if fits(most):
        return most
    low, high = 0.5 * most, most
    while not fits(low):
        low, high = 0.5 * low, low
        if not low > 1e-6 * most:
            return 0.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    step = 10.0 ** (math.floor(math.log10(low)) - 2)
    rounded = float(f"{step * math.floor(low / step):.3g}")
    return rounded if rounded > 0.0 and fits(rounded) else low


_SETTINGS = {"current": ("free", *DRIVEN), "height": ("drop", "free", "decay")}
"""Tests that a setting is of."""
_ANOTHER = "free_stroke (--free-stroke) records on a rig without stops"


# ---- motions ----


class _Made(NamedTuple):
    """What a test is to record, x2, x1 [m] and the current [A] where it does, and what of it the robot cannot do."""

    x2: Array | None
    x1: Array | None
    u: Array | None
    beyond: str


class _Bench(NamedTuple):
    """A test of a robot: sample times, stillness at first [s], mass that the body carries beside its own [kg]."""

    robot: Robot
    test: str
    time: Array
    still: float
    mass: float

    @property
    def place(self) -> float:
        """Where an actuator is held, or rests at the release [m]."""
        return min(max(0.0, self.robot.x1_min), self.robot.x1_max)

    def made(self, settings: Settings) -> _Made:
        """What the test makes of the robot."""
        if self.test in DRIVEN:
            return self._driven(settings["current"])
        return self._decay(settings["height"]) if self.test == "decay" else self._drop(**settings)

    def current(self, most: float) -> Array:
        """The current over the test: after stillness pulses of both signs."""
        time, still = self.time, self.still
        pattern = np.array(_PATTERNS[self.test])
        part = np.floor(pattern.size * (time - still) / max(float(time[-1]) - still, 1e-9)).astype(int)
        return np.where(time < still, 0.0, pattern[np.clip(part, 0, pattern.size - 1)] * most)

    def _slide(self, start: dict[str, float], u: Steps, **parameters: float) -> Any:
        """The motion of what moves alone, as the slide that ships, over the test."""
        robot: Any = Solver(slide()).Robot(**parameters)  # type: ignore[arg-type]
        moved = solve_motion(robot, start=start, u=u, horizon=float(self.time[-1]) * _PAST, max_phases=MAX_PHASES)
        if moved.status == "too_many_phases":
            raise HopformError(f"the motion has more than {MAX_PHASES} phases: too little friction for so long a test")
        return moved

    def _driven(self, most: float) -> _Made:
        """The actuator under a current, its body held where the spring is relaxed, or in the air. In a phase it moves
        one way, so where phases begin are the ends of its way.
        """
        robot, held = self.robot, self.test == "step"
        u = self.current(most)
        forces = {"k": robot.k, "load": 0.0} if held else {"k": 0.0, "load": robot.k * robot.c}
        moved = self._slide({}, current_steps(self.time, u), m=robot.m_eff, b=robot.b1, F=robot.m_eff * robot.f1,
                            k_f=-robot.gamma2, **forces)  # fmt: skip
        x = np.asarray(moved.at(np.minimum(self.time, moved.duration)).x)
        ways: list[float] = [each.state.x for each in moved.phases] + [moved.end.x]
        if max(map(abs, ways)) > _FARTHEST:
            raise HopformError(f"current moves the actuator by more than {_FARTHEST:g} m: a smaller one is needed")
        low, high, stroke = min(ways), max(ways), robot.x1_max - robot.x1_min
        beyond = ""
        if not high - low < stroke:
            beyond = f"the actuator moves over {1e3 * (high - low):.4g} mm, its stroke is {1e3 * stroke:.4g} mm"
        elif held and robot.c + high > robot.travel:
            beyond = _compressed(robot.c + high, robot.travel)
        return _Made(None, x + _begin(robot, low, high), u, beyond)

    def _under(self, steps: Steps, force: float) -> tuple[float, Steps]:
        """gamma2 and the current under which an actuator feels a constant force [N] besides that of its current."""
        gamma2 = self.robot.gamma2
        return (gamma2, tuple((t, u - force / gamma2) for t, u in steps)) if gamma2 else (-1.0, ((0.0, force),))

    def _decay(self, pull: float) -> _Made:
        """The body on its spring, which pushes and pulls; x2 counts from its rest. The pull is the deepest place."""
        robot = self.robot
        mass = robot.m_s + self.mass
        moved = self._slide({"x": -pull}, _NONE, m=mass, k=robot.k, b=robot.b2, F=mass * robot.f2)
        x = np.asarray(moved.at(np.minimum(self.time, moved.duration)).x)
        deepest = pull + mass * robot.g / robot.k
        return _Made(x, None, None, _compressed(deepest, robot.travel) if deepest > robot.travel else "")

    def _drop(self, height: float, current: float = 0.0) -> _Made:
        """The body that is let go after a while, over an actuator that is held, or free under a current."""
        robot, place, free = self.robot, self.place, self.test == "free"
        if not height > place:
            raise HopformError(f"height must be > {place!r} m, where the actuator is held or rests, got {height!r}")
        falls = self.time >= self.still
        x, x1 = np.full(self.time.size, robot.L0 + robot.c + height), np.full(self.time.size, place)
        since = self.time[falls] - self.still
        leg = robot.parameters._replace(m_s=robot.m_s + self.mass, L0=robot.L0 + robot.c, c=0.0)
        u, steps = None, _NONE
        if free:
            u = self.current(current)
            # A sample holds until the next.
            begun = ((0.0, 0.0), *((float(since[0]) + t, each) for t, each in current_steps(since, u[falls])))
            gamma2, steps = self._under(begun, robot.k * robot.c)
            leg = leg._replace(gamma2=gamma2)
        else:
            leg = leg._replace(x1_min=place, x1_max=place)
        moved, deepest = drop_and_compression(leg, (place, 0.0, float(x[0]), 0.0), steps, since)
        x1[falls], x[falls] = moved.states[:, 0], moved.states[:, 2]
        beyond = _compressed(deepest, robot.travel) if deepest > robot.travel else ""
        return _Made(x, x1 if free else None, u, beyond)


_PATTERNS = dict.fromkeys(("step", "air"), (1.0, -1.0, 0.5, -0.5)) | {"free": (0.7, -0.35, 1.0, -0.7, 0.35)}
"""Shares of the largest current, held as long each."""
_FARTHEST = 100.0
"""[m] what no actuator moves by."""
_PAST = 1.0 + 1e-12
_NONE: Steps = ((0.0, 0.0),)
"""No current."""


def _begin(robot: Robot, low: float, high: float) -> float:
    """Where an actuator begins [m] whose way from there goes from low to high: so that this lies in the middle of its
    stroke, or as far from its only stop as it is long; at 0 without stops.
    """
    if math.isfinite(robot.x1_min) and math.isfinite(robot.x1_max):
        return 0.5 * (robot.x1_min + robot.x1_max - low - high)
    if math.isfinite(robot.x1_min):
        return max(0.0, robot.x1_min + high - 2.0 * low)
    return min(0.0, robot.x1_max + low - 2.0 * high) if math.isfinite(robot.x1_max) else 0.0


def _compressed(by: float, travel: float) -> str:
    return f"the spring is compressed by {1e3 * by:.4g} mm, its travel is {1e3 * travel:.4g} mm"


def _again(x: Array, repeats: int, rate: float) -> tuple[Array, Array]:
    """A motion several times, between which a hand takes the body back within 0.6 s and holds it for 0.3 s; and its
    times.
    """
    t = np.linspace(0.0, 1.0, max(round(0.6 * rate), 2))
    back = x[-1] + (x[0] - x[-1]) * (3.0 * t**2 - 2.0 * t**3)
    whole = np.concatenate([x, *([back, np.full(max(round(0.3 * rate), 1), x[0]), x] * (repeats - 1))])
    return whole, np.arange(whole.size) / rate
