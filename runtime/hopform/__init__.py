"""Exact motions of one or two masses with dry friction, stops and contact.

    >>> import hopform
    >>> robot = hopform.load_robot("hopper_c")
    >>> stance = hopform.solve_stance(robot, v2=hopform.touchdown_velocity(robot, 0.2), u=3.0)
    >>> stance.status, round(stance.duration, 5), round(stance.apex, 5), round(stance.aed, 4)
    ('takeoff', 0.18813, 0.22329, 1.9216)

Importing hopform loads nothing, and NumPy alone once something of it is used. Equation
numbers are those of the paper that the register (`hopform.equations`) covers.
"""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hopform._all import *  # noqa: F403

__version__: str

MOVED = {
    "hopping": (
        "Errors", "Hop", "Run", "TouchdownDetector", "animate", "compare", "controllers", "delayed_apex", "simulate",
        "terrain",
    ),
    "identify": (
        "fit", "fit_drop_test", "fit_force", "fit_robot", "read_recording", "record",
        "simulator_file",
    ),
}  # fmt: skip
"""What was here up to 0.1 and is in a room of its own."""


def __getattr__(name: str) -> Any:
    """What `_all` has of this name; from then on it is an attribute like any other."""
    if name == "__version__":
        return version("hopform")
    # `from hopform import _control` asks here for a module that is not loaded yet: `_all` would import it in a circle.
    if not name.startswith("_") or name == "__all__":
        offered = import_module("hopform._all")
        globals().update({each: getattr(offered, each) for each in offered.__all__})
        globals()["__all__"] = ["__version__", *offered.__all__]
        if name in globals():
            return globals()[name]
    moved = next((room for room, names in MOVED.items() if name in names), None)
    place = f": it is in hopform.{moved}, `from hopform.{moved} import {name}`" if moved else ""
    place = f" before `import hopform.{name}`" if name in MOVED else place
    raise AttributeError(f"module 'hopform' has no attribute {name!r}{place}", name=name)


def __dir__() -> list[str]:
    return sorted(["__version__", *import_module("hopform._all").__all__])
