"""The commands about model files, `hopform model show` and its sisters: what follows from a mechanism's equations of
motion.
"""

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

from hopform import HopformError
from hopform import model as door
from hopform._checks import shown
from hopform._cli.options import Form
from hopform._files import path_of, read_text

LARGEST_MODEL = 2**20
"""[B] the largest model file."""


@contextmanager
def in_one_line() -> Generator[None, None, None]:
    """What the derivation refuses is bad input, said in one line."""
    try:
        yield
    except door.ModelError as error:
        raise HopformError(str(error)) from None


def derived(model: str) -> Any:
    """The Derivation of a model file, or of a model that ships."""
    if model not in door.part("derivation").SHIPPED:
        if not model.endswith(".py"):
            known = ", ".join(door.part("derivation").SHIPPED)
            raise HopformError(
                f"FILE must be a model file, whose name ends in .py, or one of {known}, got {shown(model)}"
            )
        read_text(path_of("FILE", model), LARGEST_MODEL)
    with in_one_line():
        return door.derive(model)


def spelled(derivation: Any, formula: str | None, form: Form, f32: bool = False) -> str:
    """Formulas of a derivation as they are pasted."""
    if f32 and form != Form.c:
        raise HopformError(f"--f32 is for --as c, got --as {form}")
    with in_one_line():
        return str(derivation.show(formula, str(form), single=f32))


def model_show(model: str, formula: str | None = None, form: Form = Form.text, f32: bool = False) -> None:
    """Print the formulas that follow from a model, to paste into a paper, a notebook or firmware.

    FORMULA is a name, a group (lagrangian, equations_of_motion, transfer, numerators, poles, partial_fractions, states,
    energies, control, event_functions) or a number of the paper.
    """
    print(spelled(derived(model), formula, form, f32), end="")
