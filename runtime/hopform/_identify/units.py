"""Units of recordings: what the name of a column declares, and the units of the parameters that follow from it.

A rotary recording has its position as an angle. Then masses are moments of inertia about its axis [kg m^2], forces are
torques [N m], lengths are angles [rad]; the equations of motion stay as they are.
"""

import math
import re
from typing import NamedTuple

COLUMNS: dict[str, tuple[str, float]] = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6),
    "m": ("length", 1.0), "cm": ("length", 1e-2), "mm": ("length", 1e-3), "um": ("length", 1e-6),
    "rad": ("angle", 1.0), "mrad": ("angle", 1e-3), "deg": ("angle", math.pi / 180.0), "rev": ("angle", 2.0 * math.pi),
    "A": ("current", 1.0), "mA": ("current", 1e-3),
    "V": ("voltage", 1.0), "mV": ("voltage", 1e-3),
    "N": ("force", 1.0), "kN": ("force", 1e3),
    "Nm": ("torque", 1.0), "mNm": ("torque", 1e-3),
}  # fmt: skip
"""Units after the last underscore of a column's name: the quantity, and the multiple of its SI unit."""
COUNTS = re.compile(r"([0-9]+(?:\.[0-9]+)?)per(rev|rad|deg|m|mm)")
"""The unit of an encoder's counts: how many a turn, or a length, has."""
DRIVES = {"current": "A", "voltage": "V", "force": "N", "torque": "N m"}
"""What may drive an actuator, with its SI unit."""
SI = {"time": "s", "length": "m", "angle": "rad", **DRIVES, "": ""}
"""The SI units of what a column may hold; of one that no fit uses, none."""
_ROTARY = {
    "kg": "kg m^2", "N/m": "N m/rad", "N s/m": "N m s/rad", "m/s^2": "rad/s^2", "m": "rad", "m/s": "rad/s", "N": "N m",
}  # fmt: skip


def unit_of(text: str) -> tuple[str, float] | None:
    """The quantity of a column's unit and the multiple of its SI unit; None for one that is not known."""
    if (counts := COUNTS.fullmatch(text)) and float(counts[1]) > 0.0:
        quantity, factor = COLUMNS[counts[2]]
        return quantity, factor / float(counts[1])
    return COLUMNS.get(text)


class Units(NamedTuple):
    """The SI units of a position, m or rad, and of what drives it."""

    position: str = "m"
    drive: str = "A"

    @property
    def force(self) -> str:
        """N, or N m about an axis."""
        return "N" if self.position == "m" else "N m"

    def of(self, unit: str) -> str:
        """The unit of a parameter whose unit is `unit` in a hopper, which moves in m by A."""
        if unit == "N/A":
            return f"{self.force}/{self.drive}" if self.drive != self.force else ""
        if unit == "A":
            return self.drive
        return unit if self.position == "m" else _ROTARY.get(unit, unit)

    def shown(self, quantity: str) -> tuple[str, float]:
        """The unit in which people are shown a quantity of a `Trace`, and its factor."""
        if quantity in ("x1", "x2"):
            return f"m{self.position}", 1e3
        return self.force if quantity == "force" else self.drive, 1.0


HOPPER = Units()
