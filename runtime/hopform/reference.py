"""A canonical benchmark of dry friction: cases with exact answers, events and derivatives, and the score of a simulator.

    >>> from hopform.reference import cases, score, smoothed
    >>> [case.name for case in cases()][:3]
    ['spin-down', 'hold', 'slow-sine']
    >>> (drop,) = score(smoothed, "drop")
    >>> [(each.of, each.by, f"{each.exact:.4f}", f"{each.differences:.4f}") for each in drop.gradients][2:]
    [('v2_end', 'v2', '-0.7221', '-0.7224'), ('v2_end', 'm_2', '0.4643', '0.4636')]

The answers are those of a solver of 60 digits that is written from the physics alone; hopform has no part in them.
"""

from hopform._reference.cases import Answer, Case, Gradient, Held, cases
from hopform._reference.folder import write
from hopform._reference.scores import GradientScore, Score, score
from hopform._reference.simulators import solve
from hopform._reference.smoothed import smoothed

__all__ = [
    "Answer", "Case", "Gradient", "GradientScore", "Held", "Score", "cases", "score", "smoothed", "solve", "write",
]  # fmt: skip
