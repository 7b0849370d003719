"""Identification: a robot's parameters from its own measurements, with what the data can and cannot identify.

    >>> import hopform
    >>> from hopform._identify import fit_drop_test, record
    >>> recording = record(hopform.load_robot("hopper_c"), "drop", height=0.2, seed=1)
    >>> fit = fit_drop_test(recording, known={"m_s": 3.0})
    >>> fit["k"].low < 1200.0 < fit["k"].high
    True

Importing this needs NumPy alone; fitting needs the extra `identify` (scipy).
"""

from hopform._identify.drop import fit_drop_test
from hopform._identify.estimation import Estimate
from hopform._identify.fits import Fit, Options, Trace
from hopform._identify.joint import fit_robot
from hopform._identify.ramp import Onset, Threshold, friction_threshold
from hopform._identify.recordings import Recording, parse_recording, read_recording
from hopform._identify.step import fit_force, fit_step_response
from hopform._identify.synthetic import record, to_csv

__all__ = [
    "Estimate", "Fit", "Onset", "Options", "Recording", "Threshold", "Trace", "fit_drop_test", "fit_force",
    "fit_robot", "fit_step_response", "friction_threshold", "parse_recording", "read_recording", "record", "to_csv",
]  # fmt: skip
