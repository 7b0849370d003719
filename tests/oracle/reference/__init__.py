"""The yardstick of the tests: stances to 50 digits, by Taylor series in exact integers.

It shares nothing with what it judges: no import but the standard library and mpmath, no closed form of the motion.
motion.py is the phase, skip.py the long steps of stiff robots, chain.py what
sticks, slips and stops, stance.py the whole; energy.py is the ledger, conditioning.py scales errors and conditions
them.
"""

from .conditioning import condition, scales
from .records import Event, Phase, State
from .stance import Reference, solve

__all__ = ["Event", "Phase", "Reference", "State", "condition", "scales", "solve"]
