"""The controller, and where it can lead. At touchdown the state is known, and a current is chosen so that the next apex
is the desired one, (25)-(27).

The exact form solves apex(u) = h_des over the whole range of currents; docs/explanation/controller.md says how, and
what is proven. The form that the paper prints, J minimised on a grid of currents, is here to be compared with;
docs/how-to/choose-a-current.md shows how far the two are apart. Reachability is the next apex over the apex before it for
every current (the paper's Figs. 5, 11), and what follows from it.

Heights and apexes are hop heights [m] on flat ground. The robot drops from rest, its actuator at rest at its origin, or
at the end of its stroke next to it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple, SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._batch import solve_stances
from hopform._broadcast import Progress
from hopform._checks import MEMORY, Array, finite, flag, function, nonnegative, numbers, positive, shaped, shown, whole
from hopform._errors import HopformError
from hopform._motion import precision_of
from hopform._robots import Robot, checked_robot, falling_robot
from hopform._show import Arrays, Card, Curve, Shown, span
from hopform._solver.package import COMMANDS, MAX_PHASES, NUMBERS, Target, records
from hopform._stance import solve_stance, start_of
from hopform._warnings import RISES, said

TRIED = 601
"""Currents of the curve of a command."""


class Question(NamedTuple):
    """What a command answers: the robot, its state at touchdown, and h_des, datum, stop_margin, horizon."""

    robot: Robot
    start: records.LegState
    target: Target


@dataclass(frozen=True, repr=False, eq=False)
class Command(Shown):
    """The answer of the controller.

    u [A]. apex [m]: the hop height that follows in the model, NaN without take-off. status: "reached"; "nearest", the
    desired apex is out of reach and this is the admissible current that comes nearest; "no_takeoff", no current is
    admissible, u = 0. solved: how many stances it took.
    """

    u: float
    apex: float
    status: records.CommandStatus
    solved: int
    question: Question = field(compare=False)

    def curve(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Currents over all that is allowed [A], and the next apex [m] that each gives, NaN where not admissible."""
        robot, start, (_, datum, margin, horizon) = self.question
        limit = float(robot.letters.u_max)
        u = np.linspace(-limit, limit, TRIED if limit > 0.0 else 1)
        apex, peak = robot.solver.compiled().apexes(robot.parameters, [start], u, horizon)
        return u, np.where(peak[0] < limit_of(robot, margin), apex[0] - datum, np.nan)

    def _curve(self) -> Curve:
        return "apex [m] over u [A]", *self.curve()

    def _card(self) -> Card:
        start, (h_des, datum, margin, _) = self.question.start, self.question.target
        given = [("h_des", h_des), ("v2", start.v2), ("x1", start.x1), ("v1", start.v1)]
        if datum or margin:
            given += [("datum", f"{datum:.5g} m"), ("stop margin", f"{margin:.5g} m")]
        rows: list[tuple[str, object]] = [("u", self.u), ("apex", self.apex), ("stances solved", self.solved)]
        rows += [("warning", each) for each in self.warnings]
        return Card(f"Command for {self.question.robot.label}: {self.status}", given, rows)

    def __hash__(self) -> int:
        return hash((self.u, self.status, self.solved))

    @property
    def warnings(self) -> tuple[str, ...]:
        """A body that rises at touchdown, v2 > 0 from F = 0: no fall leads there, the sign of v2 may be wrong."""
        return tuple(said((RISES,), partial(getattr, self.question.start)))

    def _arrays(self) -> Arrays:
        u, apex = self.curve()
        arrays: dict[str, Any] = {"u": (("u",), u), "apex": (("u",), apex), "h_des": ((), self.question.target[0])}
        return arrays | {"chosen_u": ((), self.u), "chosen_apex": ((), self.apex), "status": ((), self.status)}


def choose_current(
    robot: Robot,
    *,
    v2: SupportsFloat,
    h_des: SupportsFloat,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    x2: SupportsFloat | None = None,
    compression: SupportsFloat | None = None,
    datum: SupportsFloat = 0.0,
    stop_margin: SupportsFloat = 0.0,
    horizon: SupportsFloat = 2.0,
    dtype: Any = np.float64,
) -> Command:
    """The current of least |u| in [-u_max, u_max] after which the next apex is h_des; the nearest one if none reaches
    it.

    State at touchdown as for `solve_stance`. h_des [m]: hop height, from the length of the leg without load (L0 + c)
    above the ground, less `datum` [m], the level that it counts from less the ground under the foot. Admissible is a
    current with a take-off within `horizon` [s] and x1 < x1_max - stop_margin [m] throughout, unless the actuator is
    locked. Raises HopformError, which names what is not allowed: h_des + datum < 0, stop_margin < 0, g = 0,
    u_max = inf, and what `solve_stance` refuses.

    >>> from hopform import load_robot, touchdown_velocity
    >>> robot = load_robot("hopper_c")
    >>> command = choose_current(robot, v2=touchdown_velocity(robot, 0.20), h_des=0.20)
    >>> command.status, round(command.u, 6), round(command.apex, 9)
    ('reached', 2.735551, 0.2)
    """
    precision = precision_of(dtype)
    start = start_of(robot, x1, v1, x2, v2, compression, "command")
    target = checked_target(robot, h_des, datum, stop_margin, horizon)
    u, apex, code, solved = robot.solver.compiled().choose_current(
        robot.parameters, start, target, MAX_PHASES, precision
    )
    status = COMMANDS[code]
    limit = float(robot.letters.u_max)
    u = min(max(u, -limit), limit)  # which single precision may have rounded up
    question = Question(robot, start, target)
    return Command(u, math.nan if status == "no_takeoff" else apex, status, solved, question)


def limit_of(robot: Robot, margin: float) -> float:
    """Upper limit of x1 [m]; a locked actuator is exempt."""
    return robot.letters.x1_max - margin if robot.letters.x1_min < robot.letters.x1_max else math.inf


def checked_target(robot: Robot, h_des: object, datum: object, stop_margin: object, horizon: object) -> Target:
    """h_des, datum, stop_margin, horizon, checked, and that the robot can be controlled at all."""
    falling_robot(robot, "command", "an apex")
    if not math.isfinite(limit := robot.letters.u_max):
        motor = robot.solver.facts.inputs[0]
        raise HopformError(f"the controller needs a finite {motor['limit']}, got {limit!r} {motor['unit']}")
    apex, level = finite("h_des", h_des, "m"), finite("datum", datum, "m")
    if apex + level < 0.0:
        message = f"h_des + datum must be >= 0 m, the apex must not lie below the ground, got {apex + level!r}"
        raise HopformError(message)
    return apex, level, nonnegative("stop_margin", stop_margin, "m"), positive("horizon", horizon, "s")


ROWS = 16
"""Heights that are solved between two calls of the progress callback."""
MOST_CELLS = MEMORY // 256
"""Heights x currents of a map at most: in arrays and as text a cell takes up to 256 B."""
_CLOSED = 1e-9  # [m] a bracket that ends with a larger gap holds a jump and no fixed point


@dataclass(frozen=True)
class FixedPoint:
    """A height that a constant current gives back: apex(height, u) = height.

    multiplier: d apex/d height there, exact through the events; the point is stable if it is within -1 .. 1, NaN where an
    event grazes. admissible: x1 stays below its limit.
    """

    u: float
    height: float
    multiplier: float
    admissible: bool

    @property
    def stable(self) -> bool:
        return abs(self.multiplier) < 1.0


@dataclass(frozen=True, repr=False, eq=False)
class Reachability(Shown):
    """The reachable apexes of the next hop. H heights [m], U currents [A]; arrays of shape (H, U) or (H,).

    apex (H, U): the next apex [m], NaN without take-off. admissible (H, U): takes off, and x1 < x1_max - stop_margin
    throughout; what takes off and is not admissible is limited by the stroke. lowest, highest (H,): the least and the
    largest apex over all admissible currents in [-u_max, u_max], not only those of the map, with the currents u_lowest,
    u_highest; NaN where there is none. hold (H,): the current of least |u| that gives the height back, NaN where it
    cannot be held. fixed_points: by current of the map, then by height.
    """

    robot: Robot
    heights: Array
    currents: Array
    stop_margin: float
    apex: Array
    admissible: NDArray[np.bool_]
    lowest: Array
    u_lowest: Array
    highest: Array
    u_highest: Array
    hold: Array
    fixed_points: tuple[FixedPoint, ...]

    @property
    def limited(self) -> NDArray[np.bool_]:
        """Where it takes off, but the stroke does not allow it, (H, U)."""
        return np.isfinite(self.apex) & ~self.admissible

    def _curve(self) -> Curve:
        return "highest next apex [m] over height [m]", self.heights, self.highest

    def _card(self) -> Card:
        shape = f"{self.heights.size} heights, {self.currents.size} currents"
        given = [("height", span(self.heights)), ("u", span(self.currents)), ("stop margin", f"{self.stop_margin:g} m")]
        held = span(self.heights[np.isfinite(self.hold)])
        rows = [("lowest", span(self.lowest)), ("highest", span(self.highest)), ("heights held", f"{held} m"),
                 ("fixed points", len(self.fixed_points))]  # fmt: skip
        return Card(f"Reachability of {self.robot.label}: {shape}", given, rows)

    def _arrays(self) -> Arrays:
        points = {name: [getattr(each, name) for each in self.fixed_points] for name in ("u", "height", "multiplier")}
        arrays: dict[str, Any] = {"height": (("height",), self.heights), "u": (("u",), self.currents)}
        arrays |= {name: (("height", "u"), getattr(self, name)) for name in ("apex", "admissible")}
        bounds = ("lowest", "u_lowest", "highest", "u_highest", "hold")
        arrays |= {name: (("height",), getattr(self, name)) for name in bounds}
        return arrays | {f"fixed_{name}": (("fixed_point",), values) for name, values in points.items()}

    def gaps(self, row: int) -> tuple[tuple[float, float], ...]:
        """Ranges of currents of the map without take-off, between two that take off, at a height."""
        lifts = np.flatnonzero(np.isfinite(self.apex[whole("row", row, 0, self.heights.size - 1)]))
        jumps = np.flatnonzero(np.diff(lifts) > 1)
        return tuple((float(self.currents[lifts[n]]), float(self.currents[lifts[n + 1]])) for n in jumps)


def next_apex(robot: Robot, height: ArrayLike, u: ArrayLike, *, horizon: SupportsFloat = 2.0) -> Any:
    """The apex [m] that follows a drop from hop heights [m] under currents [A], which broadcast; NaN without take-off.

    Raises HopformError: a height that is not above the actuator's origin, g = 0, and what `solve_stance` refuses.

    >>> from hopform import load_robot
    >>> print(round(next_apex(load_robot("hopper_c"), 0.20, 1.25), 4))
    0.1162
    """
    checked_robot(robot, "reach")
    heights, currents = numbers("height", height, "m"), numbers("u", u, "A")
    try:
        size = math.prod(np.broadcast_shapes(heights.shape, currents.shape))
    except ValueError:
        raise HopformError(f"height and u must broadcast, got shapes {heights.shape} and {currents.shape}") from None
    check_map(size, 1)
    longest = checked_target(robot, 0.0, 0.0, 0.0, horizon)[3]
    v2 = np.reshape([start.v2 for start in _drops(robot, heights.reshape(-1))], heights.shape)
    stances = solve_stances(robot, x1=robot.home, v2=v2, u=currents, horizon=longest)
    if np.any(stances.status < 0):
        raise HopformError(records.REFUSALS[NUMBERS["error_numbers"]])
    return shaped(stances.apex, stances.apex)


def reachability(
    robot: Robot,
    heights: ArrayLike,
    currents: ArrayLike,
    *,
    stop_margin: SupportsFloat = 0.0,
    horizon: SupportsFloat = 2.0,
    progress: Progress | None = None,
) -> Reachability:
    """The next apex from each of `heights` [m] under each of `currents` [A], both increasing; bounds, fixed points,
    holds.

    progress: called with the number of heights done and their total. Raises HopformError: heights or currents that do
    not increase, a height that is not above the actuator's origin, g = 0, u_max = inf, stop_margin < 0.

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> reach = reachability(load_robot("hopper_c"), np.linspace(0.05, 0.35, 7), np.array([2.0, 3.0]))
    >>> [round(point.height, 3) for point in reach.fixed_points if point.u == 3.0]
    [0.252]
    """
    checked_robot(robot, "reach")
    rows, columns = _increasing("heights", heights, "m"), _increasing("currents", currents, "A")
    check_map(rows.size, columns.size)
    function("progress", progress)
    margin, longest = checked_target(robot, 0.0, 0.0, stop_margin, horizon)[2:]
    library = robot.solver.compiled()
    how: dict[str, Any] = {"horizon": longest}
    starts = _drops(robot, rows)
    apex, peak = np.empty((rows.size, columns.size)), np.empty((rows.size, columns.size))
    bounds = np.full((5, rows.size), np.nan)
    for first in range(0, rows.size, ROWS):
        part = slice(first, min(first + ROWS, rows.size))
        apex[part], peak[part] = library.apexes(robot.parameters, starts[part], columns, longest)
        for row in range(part.start, part.stop):
            choose = partial(choose_current, robot, x1=starts[row].x1, v2=starts[row].v2, stop_margin=margin, **how)
            bounds[:, row] = _bounds(choose, float(rows[row]), apex[row])
        if progress is not None:
            progress(part.stop, rows.size)
    limit = limit_of(robot, margin)
    admissible = np.isfinite(apex) & (peak < limit)
    points = _fixed_points(partial(_hop, robot, limit, how), rows, columns, apex)
    low, at_low, high, at_high, hold = bounds
    return Reachability(robot, rows, columns, margin, apex, admissible, low, at_low, high, at_high, hold, points)


def check_map(heights: int, currents: int) -> None:
    """HopformError for a map of more cells than fit into memory."""
    if heights * currents > MOST_CELLS:
        raise HopformError(f"heights x currents must be at most {MOST_CELLS}, got {heights} x {currents}")


def _increasing(name: str, value: ArrayLike, unit: str) -> Array:
    array = np.atleast_1d(numbers(name, value, unit))
    if array.ndim != 1 or not array.size:
        raise HopformError(f"{name} must be a list of at least one number in {unit}, got shape {array.shape}")
    if not bool(np.all(np.diff(array) > 0.0)):
        index = int(np.flatnonzero(~(np.diff(array) > 0.0))[0])
        before, after = array[index : index + 2].tolist()
        raise HopformError(f"{name} must increase, got {after!r} {unit} after {before!r}")
    return array


def _drops(robot: Robot, heights: Array) -> list[records.LegState]:
    """The touchdowns after drops from heights."""
    home = robot.home
    for height in heights.tolist():
        if not height > home:
            raise HopformError(f"height must be > {home!r} m, the foot must be above the ground, got {height!r}")
    velocity = robot.solver.package.formulas.touchdown_velocity(robot.parameters, heights - home)
    return [records.LegState(home, 0.0, v2, 0.0) for v2 in velocity.tolist()]


def _bounds(choose: Callable[..., Command], height: float, apex: Array) -> tuple[float, float, float, float, float]:
    """lowest and its current, highest and its current, the current that holds the height."""
    low = choose(h_des=0.0)
    if low.status == "no_takeoff":
        return math.nan, math.nan, math.nan, math.nan, math.nan
    far = 1.0 + 2.0 * float(np.nanmax(np.append(apex, low.apex)))
    high, hold = choose(h_des=far), choose(h_des=height)
    return low.apex, low.u, high.apex, high.u, hold.u if hold.status == "reached" else math.nan


# ---- fixed points ----


_Hop = Callable[[float, float], tuple[float, list[FixedPoint]]]
_HopFrom = Callable[[float], tuple[float, list[FixedPoint]]]


def _fixed_points(hop: _Hop, heights: Array, currents: Array, apex: Array) -> tuple[FixedPoint, ...]:
    gain = apex - heights[:, np.newaxis]
    fixed_points: list[FixedPoint] = []
    for column, u in enumerate(currents.tolist()):
        signs = np.sign(gain[:, column])
        changes = (signs[:-1] != signs[1:]) & (signs[:-1] != 0.0) & np.isfinite(signs[:-1] + signs[1:])
        for row in np.flatnonzero(changes):
            (low, high), (at_low, at_high) = heights[row : row + 2].tolist(), gain[row : row + 2, column].tolist()
            fixed_points += _fixed_point(partial(hop, u), low, at_low, high, at_high)
        for row in np.flatnonzero(signs == 0.0):
            fixed_points += hop(u, float(heights[row]))[1]
    return tuple(fixed_points)


def _fixed_point(hop: _HopFrom, low: float, at_low: float, high: float, at_high: float) -> list[FixedPoint]:
    """The fixed point in a bracket, by the slope kept inside it; none where it closes on a jump."""
    height = low + (high - low) * at_low / (at_low - at_high)
    gain, points = at_low, list[FixedPoint]()
    for n in range(100):
        gain, points = hop(height)
        if not abs(gain) > 4e-16 * height or not low < height < high:
            break
        low, high = (height, high) if (gain > 0.0) == (at_low > 0.0) else (low, height)
        slope = points[0].multiplier - 1.0 if points else math.nan
        newton = height - gain / slope if slope != 0.0 else math.nan
        if abs(newton - height) <= 1e-15 * height:
            break
        height = newton if low < newton < high and n % 4 != 3 else 0.5 * (low + high)
    return points if points and abs(gain) <= _CLOSED else []


def _hop(robot: Robot, limit: float, how: dict[str, Any], u: float, height: float) -> tuple[float, list[FixedPoint]]:
    """Height gained by a hop under a current, and the fixed point there; NaN and none without take-off."""
    ((x1, _, v2, _),) = _drops(robot, np.array([height]))
    stance = solve_stance(robot, x1=x1, v2=v2, u=u, **how)
    if stance.takeoff is None:
        return math.nan, []
    slope = float(stance.sensitivities["apex", "v2"]) * robot.fall * (1.0 - robot.letters.impact_loss) / v2
    peak = max(stance.end.x1, *(phase.state.x1 for phase in stance.phases))
    return stance.apex - height, [FixedPoint(u, height, slope, bool(peak < limit))]


# ---- the controller as the paper prints it ----

MOST = 1_000_000
"""Largest number of currents of a grid on either side of 0."""


@dataclass(frozen=True)
class PrintedCommand:
    """u [A]; apex [m]: the hop height that follows in the model; objective [J]: J of (27); status: "found" or
    "no_takeoff".

    Without a take-off at any current of the grid u is 0, apex and objective are NaN.
    """

    u: float
    apex: float
    objective: float
    status: str


def choose_current_as_printed(
    robot: Robot,
    *,
    v2: SupportsFloat,
    h_des: SupportsFloat,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    x2: SupportsFloat | None = None,
    compression: SupportsFloat | None = None,
    datum: SupportsFloat = 0.0,
    grid: SupportsFloat = 0.01,
    half: bool = True,
    signed: bool = False,
    spring_coordinate: bool = False,
    horizon: SupportsFloat = 2.0,
) -> PrintedCommand:
    """The current of a grid, `grid` [A] apart over [-u_max, u_max], at which J of (27) is least; of several the least
    |u|.

    half: the factor 1/2 of (26); signed: the step's sign in place of its absolute value; spring_coordinate: the terms
    in x1 that (27) leaves out. The defaults are as printed. With half=False, signed=True, spring_coordinate=True J
    vanishes where the apex is h_des, up to the grid. Inputs and errors otherwise as for `choose_current`; grid > 0.

    >>> from hopform import load_robot, touchdown_velocity
    >>> robot = load_robot("hopper_c")
    >>> command = choose_current_as_printed(robot, v2=touchdown_velocity(robot, 0.20), h_des=0.20)
    >>> round(command.u, 2), round(command.apex, 3)
    (2.57, 0.186)
    """
    start = start_of(robot, x1, v1, x2, v2, compression, "command")
    halved, with_sign = flag("half", half), flag("signed", signed)
    with_spring = flag("spring_coordinate", spring_coordinate)
    apex, level, _, limit = checked_target(robot, h_des, datum, 0.0, horizon)
    limit = float(robot.letters.u_max)
    count = math.ceil(min(limit / positive("grid", grid, "A"), MOST + 1.0))
    if count > MOST:
        raise HopformError(f"grid must be >= {limit / MOST!r} A, u_max/{MOST}, got {shown(grid)}")
    u = np.linspace(-limit, limit, 2 * count + 1)
    u = u[np.argsort(np.abs(u), kind="stable")]
    how: dict[str, Any] = {"compression": start.y, "horizon": limit}
    batch = solve_stances(robot, x1=start.x1, v1=start.v1, v2=start.v2, u=u, **how)
    lifts = np.flatnonzero(batch.words == "takeoff")
    if not lifts.size:
        return PrintedCommand(0.0, math.nan, math.nan, "no_takeoff")
    rise = (-level if with_sign else abs(level)) * (0.5 if halved else 1.0)
    x1_end = np.asarray(batch.end.x1)[lifts]
    formulas = robot.solver.package.formulas
    objective = formulas.objective(robot.parameters, start, batch.aed[lifts], x1_end, apex, rise, float(with_spring))
    best = int(np.argmin(objective))
    place = lifts[best]
    return PrintedCommand(float(u[place]), float(batch.apex[place]) - level, float(objective[best]), "found")
