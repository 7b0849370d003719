"""Hopping: what stances and flights add up to. Runs over rough ground under a controller, controllers compared, the GIF
of a run, touchdown from a noisy signal.

    >>> from hopform import load_robot
    >>> from hopform.hopping import controllers, simulate
    >>> run = simulate(load_robot("hopper_c"), [0.0, 0.02, -0.01], controllers.FeedForward(0.2), height=0.2)
    >>> [round(hop.apex, 9) for hop in run.hops]
    [0.2, 0.2, 0.2]

An application of hopform: it imports its public names alone.
"""

from collections.abc import Mapping
from typing import Any

from hopform.extend import pictures
from hopform.hopping import controllers, terrain
from hopform.hopping._animation import Animation, animate
from hopform.hopping._compare import compare
from hopform.hopping._run import Errors, Hop, Run, simulate
from hopform.hopping._touchdown import TouchdownDetector, delayed_apex

__all__ = [
    "Animation", "Errors", "Hop", "Run", "TouchdownDetector", "animate", "compare", "controllers", "delayed_apex",
    "simulate", "terrain",
]  # fmt: skip


def _of_room() -> Mapping[type, Any]:
    from hopform.hopping._pictures import OF_RESULTS

    return OF_RESULTS


pictures(_of_room, Run, Hop)
