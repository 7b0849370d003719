"""The controller as the paper prints it, (25)-(27): J minimised on a grid of currents.

It is here to be compared with. `choose_current` solves the exact form; docs/how-to/choose-a-current.md shows
how far the two are apart.
"""

import math
from dataclasses import dataclass
from typing import SupportsFloat

import numpy as np

from hopform._batch import solve_stances
from hopform._checks import finite, flag, positive, shown
from hopform._control.exact import checked_target
from hopform._errors import HopformError
from hopform._robots import Robot
from hopform._solver.package import formulas
from hopform._stance import start_of

_TAKEOFF = 1
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
    datum: SupportsFloat = 0.0,
    grid: SupportsFloat = 0.01,
    half: bool = True,
    signed: bool = False,
    spring_coordinate: bool = False,
    horizon: SupportsFloat = 2.0,
    backend: str | None = None,
) -> PrintedCommand:
    """The current of a grid, `grid` [A] apart over [-u_max, u_max], at which J of (27) is least; of equals the least
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
    start = start_of(robot, x1, v1, x2, v2)
    halved, with_sign = flag("half", half), flag("signed", signed)
    with_spring = flag("spring_coordinate", spring_coordinate)
    wanted, level, _, longest = checked_target(robot, h_des, datum, 0.0, horizon)
    count = math.ceil(min(robot.u_max / positive("grid", grid, "A"), MOST + 1.0))
    if count > MOST:
        raise HopformError(f"grid must be >= {robot.u_max / MOST!r} A, u_max/{MOST}, got {shown(grid)}")
    u = np.linspace(-robot.u_max, robot.u_max, 2 * count + 1)
    u = u[np.argsort(np.abs(u), kind="stable")]
    height = None if x2 is None else finite("x2", x2, "m")
    batch = solve_stances(
        robot, x1=start.x1, v1=start.v1, v2=start.v2, x2=height, u=u, horizon=longest, backend=backend
    )
    lifts = np.flatnonzero(batch.status == _TAKEOFF)
    if not lifts.size:
        return PrintedCommand(0.0, math.nan, math.nan, "no_takeoff")
    rise = (-level if with_sign else abs(level)) * (0.5 if halved else 1.0)
    x1_end = np.asarray(batch.end.x1)[lifts]
    objective = formulas.objective(robot.parameters, start, batch.aed[lifts], x1_end, wanted, rise, float(with_spring))
    best = int(np.argmin(objective))
    place = lifts[best]
    return PrintedCommand(float(u[place]), float(batch.apex[place]) - level, float(objective[best]), "found")
