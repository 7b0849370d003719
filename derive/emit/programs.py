"""The program for a board that a package has for a robot: which folders of packages/program it is made of, and what it is
called.
"""

from typing import NamedTuple

from ..maths.inverse import is_driven
from ..model.equations import Model

OF_SOME = ("hopper", "machine", "feedforward", "law", "free")
"""Folders of packages/program that are not in the program of every model."""


class BoardProgram(NamedTuple):
    """The folders that it is made of beside those that all have; its name in build files and as a folder; its sources,
    its test and what it does, in a few words.
    """

    folders: tuple[str, ...]
    name: str
    sources: tuple[str, ...]
    test: str
    sentence: str
    control: str = ""
    """What decides on the input of a machine without a contact, in a sentence."""

    @property
    def title(self) -> str:
        return self.name.title()


HOPS = BoardProgram(("hopper",), "hopper", ("main.c", "plant.c"), "hops", "a robot hops")
MOVES = BoardProgram(("machine",), "machine", ("main.c", "control.c", "plant.c"), "moves", "a machine moves")


def program_of(model: Model) -> BoardProgram:
    """The program of a model."""
    if model.has_contact:
        return HOPS
    if model.law is not None:
        return _under("law", "the target of the law steps there and back")
    if is_driven(model):
        return _under(
            "feedforward",
            "a reference is followed under feedback alone, then with the compensation that follows from the equation of "
            "motion, friction in it",
        )
    return _under("free", "each reading is compared with the motion that was solved at the start")


def _under(control: str, sentence: str) -> BoardProgram:
    return MOVES._replace(folders=("machine", control), control=f"In `control.c` {sentence}.")
