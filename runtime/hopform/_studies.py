"""Studies: a sweep of stances over axes, and controllers compared on grounds; both answer with a dataset of xarray.

What is swept or compared is a dimension with its name; units stand in `attrs`.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from hopform._batch import INPUTS, Motions, check_names, solve_motions, solve_stances
from hopform._checks import MEMORY, function, items, mapping, numbers, refuse_any, whole
from hopform._errors import HopformError, noted
from hopform._hopping.run import NONE, Errors, simulate
from hopform._motion import axes_by_name
from hopform._progress import Progress, progress_bar
from hopform._robots import Robot, checked_robot
from hopform._show import UNITS, Array, dataset, xarray_of
from hopform.controllers import Controller, Preparing
from hopform.terrain import heights_of

if TYPE_CHECKING:
    import xarray

Thing = TypeVar("Thing")
EACH = 128
"""[B] a hop of a comparison."""
MOST_RUNS = MEMORY // 2048
"""Runs of a comparison at most: with its names and its place in the answer each takes up to 2 kB."""


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
    states = INPUTS if stands else (*named, "u", "horizon")
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
        raise HopformError(f"either height or v2 must be given, got {'neither' if drop is None else 'both'}")
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


def compare(
    robot: Robot,
    controllers: Mapping[str, Controller | Preparing | SupportsFloat],
    grounds: Mapping[str, Iterable[SupportsFloat]] | Sequence[Iterable[SupportsFloat]],
    errors: Mapping[str, Errors] | Errors = NONE,
    seeds: Sequence[int] = (0,),
    *,
    height: SupportsFloat,
    horizon: SupportsFloat = 2.0,
    progress: Progress | None = None,
) -> "xarray.Dataset":
    """Runs of each controller on each ground with each kind of errors and each seed, by `simulate`.

    Errors are drawn independently for each ground, kind and seed; the controllers meet the same ones, so differences
    between them are not those of their luck. `simulate(..., seed=seed, cell=(ground, errors))`, the latter two numbered
    from 0 in their order, is the same run.

    controllers, errors by name; grounds by name, or numbered. The answer, over controller, ground, errors and seed:
    status and hops (how many were completed); with hop as a further dimension apex, u, bottoms_out, and miss: the apex
    less the controller's `h_des`, NaN for one that has none. progress: called with the runs done and their total; a bar
    where a person is there to see it if left out. Raises HopformError as `simulate` does, with the names of the run.

    >>> from hopform import controllers, load_robot
    >>> laws = {"exact": controllers.FeedForward(0.2), "3 A": 3.0}
    >>> found = compare(load_robot("hopper_c"), laws, [[0.0, 0.01], [0.0, -0.01]], height=0.2)
    >>> dict(found.sizes), bool(abs(found.miss.sel(controller="exact")).max() < 1e-9)
    ({'controller': 2, 'ground': 2, 'errors': 1, 'seed': 1, 'hop': 2}, True)
    """
    laws = _named("controllers", controllers)
    terrains = grounds if isinstance(grounds, Mapping) else _numbered(grounds)
    rough = {name: heights_of(each) for name, each in _named("grounds", terrains).items()}
    kinds = _named("errors", errors if isinstance(errors, Mapping) else {"none" if errors is NONE else "given": errors})
    draws = [whole(f"seeds[{n}]", each, 0) for n, each in enumerate(items("seeds", seeds, "whole numbers", MOST_RUNS))]
    function("progress", progress)
    axes: dict[str, list[Any]] = {"controller": [*laws], "ground": [*rough], "errors": [*kinds], "seed": draws}
    dims, shape, hops = tuple(axes), tuple(map(len, axes.values())), max(map(len, rough.values()))
    total = math.prod(shape)
    if total > MOST_RUNS:
        raise HopformError(f"runs to compare must be at most {MOST_RUNS}, got {total}")
    if not draws or total * hops > MEMORY // EACH:
        raise HopformError(f"hops to compare must be 1 to {MEMORY // EACH}, got {total * hops}")
    status, count = np.empty(shape, "U15"), np.zeros(shape, int)
    series = {name: np.full((*shape, hops), np.nan) for name in ("apex", "miss", "u")}
    series["bottoms_out"] = np.zeros((*shape, hops), bool)
    with progress_bar("runs") as bar:
        cells = product(laws, enumerate(rough), enumerate(kinds), draws)
        for n, (law, (at, ground), (among, kind), seed) in enumerate(cells):
            with noted(f"controller {law}, ground {ground}, errors {kind}, seed {seed}: "):
                run = simulate(robot, rough[ground], laws[law], height=height, errors=kinds[kind], seed=seed,
                               cell=(at, among), horizon=horizon)  # fmt: skip
            done = len(run.hops)
            status.flat[n], count.flat[n] = run.status, done
            found = {name: run.table[name] for name in ("apex", "u", "bottoms_out")}
            found["miss"] = found["apex"] - (run.h_des[:done] or np.nan)
            for name, values in found.items():
                series[name].reshape(total, hops)[n, :done] = values
            (progress or bar)(n + 1, total)
    arrays: dict[str, Array] = {dim: ((dim,), each) for dim, each in axes.items()}
    arrays |= {"hop": (("hop",), np.arange(hops)), "status": (dims, status), "hops": (dims, count)}
    arrays |= {name: ((*dims, "hop"), values) for name, values in series.items()}
    return dataset(arrays, f"{total} runs of up to {hops} hops")


def _numbered(grounds: Sequence[Thing]) -> dict[int, Thing]:
    return dict(enumerate(items("grounds", grounds, "terrains", MOST_RUNS)))


def _named(name: str, things: Mapping[Any, Thing]) -> dict[Any, Thing]:
    """What is compared, by name."""
    found = mapping(name, things, MOST_RUNS)
    if not found:
        raise HopformError(f"{name} must be at least one, got none")
    return found
