# SPDX-License-Identifier: MIT-0
"""Touchdown and take-off from a noisy signal of contact: two thresholds, then a number of samples in a row."""

from dataclasses import dataclass
from typing import NamedTuple

TOUCHDOWN, TAKEOFF = 1, 2


@dataclass(frozen=True)
class Detector:
    """Thresholds in units of the signal, and how many samples in a row must say the same."""

    high: float
    low: float
    count: int


class Contact(NamedTuple):
    """What is known after a sample: whether the signal is above, whether the foot touches, for how many samples they
    disagree.
    """

    above: bool = False
    touches: bool = False
    run: int = 0


def touchdown(detector: Detector, contact: Contact, sample: float) -> tuple[Contact, int]:
    """What is known after one more sample, and TOUCHDOWN, TAKEOFF or 0: what has been detected by it.

    A run that this detector leaves nowhere behind, for instance one of a detector of more samples, counts as 0.
    """
    above = sample >= (detector.low if contact.above else detector.high)
    before = contact.run if 0 < contact.run < detector.count else 0
    run = before + 1 if above != contact.touches else 0
    if run < detector.count:
        return Contact(above, contact.touches, run), 0
    return Contact(above, above, 0), TOUCHDOWN if above else TAKEOFF
