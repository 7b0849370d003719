"""Stances in columns of any numbers, also those that are refused, as the library takes them."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._solver.choice import DEFAULT, Solver
from hopform._solver.package import MAX_PHASES, by_name, results_like


def solved(*states: ArrayLike, robots: NDArray[Any], solver: Solver = DEFAULT) -> dict[str, NDArray[Any]]:
    """Results by name of stances from x1, v1, v2, y, u, horizon; the fields of the robots on their last axis."""
    real = robots.dtype
    columns = [np.asarray(each, real) for each in (*states, *np.moveaxis(robots, -1, 0))]
    flat = [np.ascontiguousarray(each).reshape(-1) for each in np.broadcast_arrays(*columns)]
    results = results_like(flat[0].size, real)
    solver.compiled().solve_columns(flat, results, {}, MAX_PHASES, events=False)
    return by_name(results, flat[0].shape)
