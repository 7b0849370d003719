"""For those who extend hopform: what its own applications are made of, `hopform.identify` and `hopform.hopping`.

    >>> from dataclasses import dataclass, field
    >>> from hopform.extend import Checked, by, positive
    >>> @dataclass(frozen=True)
    ... class Payload(Checked):
    ...     mass: float = field(metadata=by(positive, "kg"))
    >>> Payload(-1.0)
    Traceback (most recent call last):
    hopform._errors.HopformError: mass must be > 0 kg, got -1.0

Names of values (`finite`, `whole`, ...) refuse what is not allowed by a HopformError that names the field, the value and
what is allowed. A result derives from `OverTime`: it shows itself, gives a dataset, and has pictures by `pictures`. A
command makes `Outputs` before it computes, and emits through it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hopform._checks import Checked, by, finite, items, positive, shown, stream, whole
    from hopform._cli.bands import robot_and_draws
    from hopform._cli.options import option
    from hopform._cli.output import Outputs, table
    from hopform._cli.use import in_use
    from hopform._figures.palette import PALETTE
    from hopform._figures.plots import framed, name_axis
    from hopform._files import read_rows, write
    from hopform._progress import progress_bar
    from hopform._robots import falling_robot
    from hopform._show import Card, OverTime, dataset, needs, pictures

ROOMS = {
    "_checks": ("Checked", "by", "finite", "items", "positive", "shown", "stream", "whole"),
    "_cli.bands": ("robot_and_draws",),
    "_cli.options": ("option",),
    "_cli.output": ("Outputs", "table"),
    "_cli.use": ("in_use",),
    "_figures.palette": ("PALETTE",),
    "_figures.plots": ("framed", "name_axis"),
    "_files": ("read_rows", "write"),
    "_progress": ("progress_bar",),
    "_robots": ("falling_robot",),
    "_show": ("Card", "OverTime", "dataset", "needs", "pictures"),
}
"""What is offered, by the room that has it, which is imported when the name is asked for: matplotlib and the command
line are loaded by nobody who only checks a value.
"""

__all__ = [
    "Card", "Checked", "OverTime", "Outputs", "PALETTE", "by", "dataset", "falling_robot", "finite", "framed", "in_use",
    "items", "name_axis", "needs", "option", "pictures", "positive", "progress_bar", "read_rows", "robot_and_draws",
    "shown", "stream", "table", "whole", "write",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    room = next((room for room, names in ROOMS.items() if name in names), None)
    if room is None:
        raise AttributeError(f"module 'hopform.extend' has no attribute {name!r}", name=name)
    found = getattr(import_module(f"hopform.{room}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
