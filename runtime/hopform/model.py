"""What a model file takes: `Quantity`, `Term`, and the symbols of the robot, its state and its current.

    from hopform.model import Quantity, Term, v1

    damping = Quantity("k_emf", "k_{emf}", "N s/m", "damping by the back-EMF, k_t^2/R", "nonnegative")
    parameters = (damping,)
    terms = (Term("back-EMF", -damping.symbol * v1, 0),)

It is the derivation's own module, which needs the extra `derive`: that of a checkout where `python -m derive` runs,
else the one that is installed with hopform, `python -m hopform._derive`.
"""

import sys
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from hopform._errors import MissingExtra


@cache
def _derivation() -> ModuleType:
    for name in ("derive.model", "hopform._derive.model"):
        if name in sys.modules:
            return sys.modules[name]
    try:
        return import_module("hopform._derive.model")
    except ModuleNotFoundError as error:
        if error.name == "sympy":
            raise MissingExtra("hopform.model", "derive") from None
    return import_module("derive.model")


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    return getattr(_derivation(), name)
