"""The models that ship, by name: a file each in models/."""

from functools import cache
from pathlib import Path

from .model.equations import Model
from .model_file import read_model

FILES = {path.stem: path for path in sorted(Path(__file__).with_name("models").glob("[!_]*.py"))}
"""Their files, by name."""


@cache
def shipped(name: str) -> Model:
    """A model that ships."""
    return read_model(FILES[name])


HOPPER = shipped("hopper")
"""The hopper of the paper."""
