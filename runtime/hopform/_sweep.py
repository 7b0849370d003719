"""A sweep of stances or motions over axes: a dataset of xarray whose dimensions have the names of what is swept."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from hopform._batch import Motions, solve_motions, solve_stances
from hopform._broadcast import INPUTS, check_names
from hopform._checks import numbers, refuse_any
from hopform._errors import HopformError
from hopform._motion import axes_by_name
from hopform._progress import Progress, progress_bar
from hopform._robots import Robot, checked_robot
from hopform._show import UNITS, xarray_of

if TYPE_CHECKING:
    import xarray


def sweep(
    robot: Robot,
    *,
    height: ArrayLike | None = None,
    threads: int = 1,
    progress: Progress | None = None,
    **inputs: ArrayLike,
) -> "xarray.Dataset":
    """The stances of all combinations of inputs: each list of numbers is an axis, a DataArray has its own.

    inputs: those of `solve_stances`, states, u, horizon and fields of the robot; height [m]: of a drop, in place of v2.
    Of a model without a contact they are motions, and states are coordinates and velocities by the names of its file.
    The answer has status (in words), duration, apex, aed, event_count and the state at the ending, over the axes; an
    input that is one number is a coordinate without a dimension. progress: called with the stances done and their
    total; a bar where a person is there to see it if left out. Raises HopformError as `solve_stances` and
    `solve_motions` do, and MissingExtra without xarray.

    >>> from hopform import load_robot
    >>> found = sweep(load_robot("hopper_c"), height=[0.1, 0.2], u=[0.0, 1.0, 3.0], k=1100.0)
    >>> dict(found.sizes), found.apex.attrs["units"], round(float(found.apex.sel(height=0.2, u=3.0)), 4)
    ({'height': 2, 'u': 3}, 'm', 0.229)
    """
    stands, named = "stance" in checked_robot(robot).solver.can, axes_by_name(robot.solver.facts)
    states = INPUTS["stance"] if stands else (*named, "u", "horizon")
    check_names(
        inputs,
        [*(["height"] if stands else []), *states, *(field.name for field in robot.fields())],
        "stance" if stands else "motion",
        states,
    )
    if height is not None and not stands:
        raise robot.solver.cannot("stance")
    units = UNITS | robot.solver.facts.units
    axes: dict[str, Any] = {**({} if height is None else {"height": height}), **inputs}
    of_xarray, single = xarray_of(), dict[str, Any]()
    for name, value in axes.items():
        array = numbers(name, value, units.get(name, "1"))
        if isinstance(value, of_xarray.DataArray):
            axes[name] = value.copy(data=array)
        elif array.ndim > 1:
            raise HopformError(f"{name} must be a number, a list of numbers or a DataArray, got shape {array.shape}")
        elif array.ndim:
            axes[name] = of_xarray.DataArray(array, dims=name, coords={name: array})
        else:
            single[name] = array
    drop = axes.pop("height", None)
    if stands and (drop is None) == ("v2" not in axes):
        raise HopformError(f"give either height or v2, got {'neither' if drop is None else 'both'}")
    if drop is not None:
        given = np.asarray(drop)
        refuse_any("height", given, given >= 0.0, lambda bad: f"must be >= 0 m, got {bad!r}")
        own = {name: axes[name] for name in robot.parameters._fields if name in axes}
        axes["v2"] = robot.solver.package.formulas.touchdown_velocity(robot.parameters._replace(**own), drop)
    solve: Callable[..., Motions] = solve_stances
    what = "stances"
    if not stands:
        start = {name: axes.pop(name) for name in named if name in axes}
        solve, what = partial(solve_motions, start=start), "motions"
    with progress_bar(what) as bar:
        batch = solve(robot, **axes, threads=threads, progress=progress or bar)
    fixed = {name: of_xarray.Variable((), value, {"units": units[name]}) for name, value in single.items()}
    found: Any = batch.to_xarray()
    return cast("xarray.Dataset", found.assign_coords(fixed))
