"""Controllers compared on grounds: a dataset of xarray whose dimensions have the names of what is compared."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

import numpy as np

from hopform import HopformError, Robot
from hopform.extend import dataset, items, progress_bar, shown, whole
from hopform.hopping._run import NONE, Errors, simulate
from hopform.hopping.controllers import Controller, Preparing
from hopform.hopping.terrain import heights_of

if TYPE_CHECKING:
    import xarray

Thing = TypeVar("Thing")
Progress = Callable[[int, int], object]
MOST_HOPS = 2**24
"""Hops of a comparison at most: each takes up to 128 B."""
MOST_RUNS = 2**20
"""Runs of a comparison at most: with its names and its place in the answer each takes up to 2 kB."""


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

    >>> from hopform import load_robot
    >>> from hopform.hopping import compare, controllers
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
    if not (progress is None or callable(progress)):
        raise HopformError(f"progress must be a function, got {shown(progress)}")
    axes: dict[str, list[Any]] = {"controller": [*laws], "ground": [*rough], "errors": [*kinds], "seed": draws}
    dims, shape, hops = tuple(axes), tuple(map(len, axes.values())), max(map(len, rough.values()))
    total = math.prod(shape)
    if total > MOST_RUNS:
        raise HopformError(f"runs to compare must be at most {MOST_RUNS}, got {total}")
    if not draws or total * hops > MOST_HOPS:
        raise HopformError(f"hops to compare must be 1 to {MOST_HOPS}, got {total * hops}")
    status, count = np.empty(shape, "U15"), np.zeros(shape, int)
    series = {name: np.full((*shape, hops), np.nan) for name in ("apex", "miss", "u")}
    series["bottoms_out"] = np.zeros((*shape, hops), bool)
    with progress_bar("runs") as bar:
        cells = product(laws, enumerate(rough), enumerate(kinds), draws)
        for n, (law, (at, ground), (among, kind), seed) in enumerate(cells):
            try:
                run = simulate(robot, rough[ground], laws[law], height=height, errors=kinds[kind], seed=seed,
                               cell=(at, among), horizon=horizon)  # fmt: skip
            except HopformError as error:
                where = f"controller {law}, ground {ground}, errors {kind}, seed {seed}"
                raise HopformError(f"{where}: {error}") from None
            done = len(run.hops)
            status.flat[n], count.flat[n] = run.status, done
            columns = {name: run.table[name] for name in ("apex", "u", "bottoms_out")}
            columns["miss"] = columns["apex"] - (run.h_des[:done] or np.nan)
            for name, values in columns.items():
                series[name].reshape(total, hops)[n, :done] = values
            (progress or bar)(n + 1, total)
    arrays: dict[str, Any] = {dim: ((dim,), each) for dim, each in axes.items()}
    arrays |= {"hop": (("hop",), np.arange(hops)), "status": (dims, status), "hops": (dims, count)}
    arrays |= {name: ((*dims, "hop"), values) for name, values in series.items()}
    return dataset(arrays, f"{total} runs of up to {hops} hops")


def _numbered(grounds: Sequence[Thing]) -> dict[int, Thing]:
    return dict(enumerate(items("grounds", grounds, "terrains", MOST_RUNS)))


def _named(name: str, things: Mapping[Any, Thing]) -> dict[Any, Thing]:
    """What is compared, by name."""
    if not isinstance(things, Mapping):
        raise HopformError(f"{name} must be a mapping of names to values, got {shown(things)}")
    named = dict(items(name, things.items(), "a mapping of names to values", MOST_RUNS))
    if not named:
        raise HopformError(f"{name} must be at least one, got none")
    return named
