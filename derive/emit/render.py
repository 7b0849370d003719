"""A model in, the texts of its solver's folder out: each part renders itself."""

from dataclasses import replace
from pathlib import Path

from ..model.equations import Model
from ..model.precisions import PRECISIONS, Precision
from ..shipped import HOPPER
from . import firmware, library, package, pages
from .program import program
from .sources import Solver

PARTS = (library.PART, package.PART, firmware.PART, pages.PART)


def render(model: Model = HOPPER, precisions: tuple[Precision, ...] = PRECISIONS) -> dict[Path, str]:
    """The text of every generated file of a model, by path relative to the output folder; precisions: of the C library."""
    solver = Solver(model, precisions, program(model), library.NO_LAYOUT)
    solver = replace(solver, layout=library.layout_of(solver))
    texts = dict(solver.instances())
    for part in PARTS:
        for name in filter(solver.has, part):
            texts |= solver.filled(name, part[name](solver))
    return texts
