"""All recordings of a robot, fitted together into one robot.

The spring is the same in drop tests and in step responses against it: one weighed mass gives the scale of every force.
A ramp adds its threshold (5) with its uncertainty. Each recording counts by its own noise.
"""

from collections.abc import Mapping
from typing import Unpack

from hopform._identify.drop import ATTACHED, FREE, GROUND
from hopform._identify.fits import Fit, Options
from hopform._identify.kinds import Kind, Recordings, read_several
from hopform._identify.ramp import RAMP
from hopform._identify.recipe import fit
from hopform._identify.step import AIR, HELD

KINDS: Mapping[str, Kind] = {
    "drop": GROUND, "decay": ATTACHED, "step": HELD, "air": AIR, "free": FREE, "ramp": RAMP,
}  # fmt: skip
"""Of each role its kind; a free drop comes late, since it shows least about its starts."""
LETTERS = tuple(dict.fromkeys(letter for kind in (GROUND, FREE) for letter in (*kind.letters, *kind.given)))


def fit_robot(
    *,
    drops: Recordings = (),
    free_drops: Recordings = (),
    decays: Recordings = (),
    steps: Recordings = (),
    air: Recordings = (),
    ramps: Recordings = (),
    known: Mapping[str, float] | None = None,
    **options: Unpack[Options],
) -> Fit:
    """All parameters that the recordings identify, from all of them together; `fit.robot(base)` puts them into a robot.

    drops: of the body onto the ground, actuator held; free_drops: the same, actuator free; decays: of a body fixed to
    its spring; steps: of the actuator against its spring, the body held; air: of the actuator with the leg in the air;
    ramps: as `friction_threshold` takes them. known as in `fit_drop_test` and `fit_step_response`; options: `Options`.
    Raises HopformError where a recording cannot be what it is given as, or none is given.
    """
    handed = {
        "drops": (GROUND, drops), "decays": (ATTACHED, decays), "steps": (HELD, steps), "air": (AIR, air),
        "free_drops": (FREE, free_drops), "ramps": (RAMP, ramps),
    }  # fmt: skip
    return fit({kind: read_several(some, name) for name, (kind, some) in handed.items()}, known, **options)
