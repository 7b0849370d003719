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

from hopform._errors import HopformError, MissingExtra

_NAMES = ("derive.model", "hopform._derive.model")


@cache
def _derivation() -> ModuleType:
    """The one that is running, else the one that is there."""
    for name in _NAMES:
        if name in sys.modules:
            return sys.modules[name]
    for name in reversed(_NAMES):
        try:
            return import_module(name)
        except ModuleNotFoundError as error:
            if error.name == "sympy":
                raise MissingExtra("hopform.model", "derive") from None
            if error.name != name.removesuffix(".model"):
                raise
    message = "hopform.model is the derivation's, which is neither installed here nor in this folder's checkout"
    raise HopformError(message)


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    return getattr(_derivation(), name)
