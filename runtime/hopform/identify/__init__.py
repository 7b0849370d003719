"""Identification: a robot's parameters from its own measurements, with what the data can and cannot identify.

    >>> import hopform
    >>> from hopform import identify
    >>> recording = identify.record(hopform.load_robot("hopper_c"), "drop", height=0.2, seed=1)
    >>> fit = identify.fit_drop_test(recording, known={"m_s": 3.0})
    >>> fit["k"].low < 1200.0 < fit["k"].high
    True

Importing it needs NumPy alone; fitting needs the extra `identify` (scipy).
"""

from collections.abc import Mapping
from typing import Any

from hopform.extend import pictures
from hopform.identify._drop import fit_drop_test
from hopform.identify._fits import Fit
from hopform.identify._force import fit_force
from hopform.identify._joint import fit_robot
from hopform.identify._models import fit
from hopform.identify._recordings import Recording, read_recording
from hopform.identify._simulators import simulator_file
from hopform.identify._synthetic import record

__all__ = [
    "Fit", "Recording", "fit", "fit_drop_test", "fit_force", "fit_robot", "read_recording", "record", "simulator_file",
]  # fmt: skip


def _of_room() -> Mapping[type, Any]:
    from hopform.identify._pictures import OF_RESULTS

    return OF_RESULTS


pictures(_of_room, Recording, Fit)
