"""The controller: at touchdown the state is known, and a current is chosen so that the next apex is the desired one,
(25)-(27).

The exact form solves apex(u) = h_des over the whole range of currents; docs/explanation/controller.md says
how, and what is proven.
"""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from hopform._checks import finite, nonnegative, positive
from hopform._errors import HopformError
from hopform._robots import Robot, checked_robot
from hopform._show import Arrays, Card, Curve, Shown, name_of
from hopform._solver.package import COMMANDS, MAX_PHASES, records
from hopform._stance import precision_of, start_of

TRIED = 601
"""Currents of the curve of a command."""


class Question(NamedTuple):
    """What a command answers: the robot, its state at touchdown, and h_des, datum, stop_margin, horizon."""

    robot: Robot
    start: records.LegState
    target: tuple[float, float, float, float]
    backend: str


@dataclass(frozen=True, repr=False)
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
        robot, start, (_, datum, margin, horizon), backend = self.question
        u = np.linspace(-robot.u_max, robot.u_max, TRIED if robot.u_max > 0.0 else 1)
        apex, peak = robot.solver.back_end(backend).apexes(robot.parameters, [start], u, horizon, MAX_PHASES)
        return u, np.where(peak[0] < limit_of(robot, margin), apex[0] - datum, np.nan)

    def _curve(self) -> Curve:
        return "apex [m] over u [A]", *self.curve()

    def _card(self) -> Card:
        start, (h_des, datum, margin, _) = self.question.start, self.question.target
        given = [("h_des", h_des), ("v2", start.v2), ("x1", start.x1), ("v1", start.v1)]
        if datum or margin:
            given += [("datum", f"{datum:.5g} m"), ("stop margin", f"{margin:.5g} m")]
        found = [("u", self.u), ("apex", self.apex), ("stances solved", self.solved)]
        title = f"Command for {name_of(self.question.robot)}: {self.status}"
        return Card(title, given, found)

    def _arrays(self) -> Arrays:
        u, apex = self.curve()
        metres = {"units": "m"}
        return {
            "u": (("u",), u), "apex": (("u",), apex), "h_des": ((), self.question.target[0]),
            "chosen_u": ((), self.u, {"units": "A"}), "chosen_apex": ((), self.apex, metres),
            "status": ((), self.status),
        }  # fmt: skip


def choose_current(
    robot: Robot,
    *,
    v2: SupportsFloat,
    h_des: SupportsFloat,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    x2: SupportsFloat | None = None,
    datum: SupportsFloat = 0.0,
    stop_margin: SupportsFloat = 0.0,
    horizon: SupportsFloat = 2.0,
    backend: str | None = None,
    dtype: Any = np.float64,
) -> Command:
    """The current of least |u| in [-u_max, u_max] after which the next apex is h_des; the nearest one if none reaches
    it.

    State at touchdown as for `solve_stance`. h_des [m]: hop height, from L0 + c above the ground, less `datum` [m], the
    level that it counts from less the ground under the foot. Admissible is a current with a take-off within `horizon`
    [s] and x1 < x1_max - stop_margin [m] throughout, unless the actuator is locked. Raises HopformError, which names
    what is not allowed: h_des + datum < 0, stop_margin < 0, g = 0, u_max = inf, and what `solve_stance` refuses.

    >>> from hopform import load_robot, touchdown_velocity
    >>> robot = load_robot("hopper_c")
    >>> command = choose_current(robot, v2=touchdown_velocity(robot, 0.20), h_des=0.20)
    >>> command.status, round(command.u, 6), round(command.apex, 9)
    ('reached', 2.735551, 0.2)
    """
    precision = precision_of(dtype)
    start = start_of(robot, x1, v1, x2, v2)
    target = checked_target(robot, h_des, datum, stop_margin, horizon)
    back_end = robot.solver.back_end(backend)
    u, apex, code, solved = back_end.choose_current(robot.parameters, start, target, MAX_PHASES, precision)
    status = COMMANDS[code]
    u = min(max(u, -robot.u_max), robot.u_max)  # which single precision may have rounded up
    question = Question(robot, start, target, back_end.name)
    return Command(u, math.nan if status == "no_takeoff" else apex, status, solved, question)


def limit_of(robot: Robot, margin: float) -> float:
    """Upper limit of x1 [m]; a locked actuator is exempt."""
    return robot.x1_max - margin if robot.x1_min < robot.x1_max else math.inf


def checked_target(
    robot: Robot, h_des: object, datum: object, stop_margin: object, horizon: object
) -> tuple[float, float, float, float]:
    """h_des, datum, stop_margin, horizon, checked, and that the robot can be controlled at all."""
    if not checked_robot(robot).g > 0.0:
        raise HopformError(f"an apex needs g > 0 m/s^2, got {robot.g!r}")
    if not math.isfinite(robot.u_max):
        raise HopformError(f"the controller needs a finite u_max, got {robot.u_max!r} A")
    apex, level = finite("h_des", h_des, "m"), finite("datum", datum, "m")
    if apex + level < 0.0:
        raise HopformError(
            f"h_des + datum must be >= 0 m, the apex must not lie below the ground, got {apex + level!r}"
        )
    return apex, level, nonnegative("stop_margin", stop_margin, "m"), positive("horizon", horizon, "s")
