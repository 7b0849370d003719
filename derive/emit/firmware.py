"""The part packages/ of a solver: the C library for each build system, and programs for boards."""

from typing import Any

import sympy as sp

from .. import VERSION
from ..maths import contact
from ..model import quantities
from ..model.equations import Model
from ..model.structs import member_name
from . import c
from .examples import example_robot, example_start
from .facts import ROUNDING, compression_of
from .sources import Part, Solver


def _files(solver: Solver) -> list[str]:
    """The files of the C library that firmware compiles or includes, relative to its folder."""
    not_here = ("c/workstation/", "c/notes/")
    return sorted(
        path.removeprefix("c/") for path, source in solver.library().items() if not source.startswith(not_here)
    )


def _package(solver: Solver) -> dict[str, Any]:
    return {"program": solver.program, "version": VERSION}


def _units(solver: Solver) -> dict[str, Any]:
    return {"units": [name for name in _files(solver) if name.endswith(".c")]}


def _example(solver: Solver) -> dict[str, Any]:
    return {
        "compression": compression_of(solver.model), "example": example_robot(solver.model),
        "example_start": ", ".join(map(repr, example_start(solver.model).values())),
    }  # fmt: skip


def _plant(model: Model) -> dict[str, str]:
    """What a program for a board computes of the equations of motion, in its own names."""
    smooth = [
        acceleration.subs({quantities.side_1: 0, quantities.side_2: 0})
        for acceleration in (*model.in_compression, *model.in_flight)
    ]
    values = dict(zip(("stance_1", "stance_2", "flight_1", "flight_2"), smooth, strict=True))
    values |= {"length": model.length, "contact": model.contact, "fall": model.fall}
    for n, (level, (up, down)) in enumerate(zip(model.levels, model.excesses, strict=True), 1):
        values |= {f"level_{n}": level, f"up_{n}": level + up, f"down_{n}": level + down}
    values |= {
        "lowest": quantities.x1_min, "highest": quantities.x1_max, "impact_loss": quantities.impact_loss,
        "per_unit": quantities.gamma2, "limit": quantities.u_max, "leg_time": contact.leg_time(model)[-1].value,
    }  # fmt: skip
    names = {parameter.symbol: f"robot.{member_name(parameter)}" for parameter in model.parameters}
    names |= {member.symbol: member.name for member in quantities.STATE.quantities}
    moving = {quantities.v1: "velocity_1", quantities.v2: "velocity_2", quantities.y: "compression()"}
    at_takeoff = {quantities.v1: "start.v1", quantities.v2: "start.v2"}

    def spelled(value: sp.Expr, state: dict[sp.Symbol, str]) -> str:
        symbols = {symbol: sp.Symbol(name) for symbol, name in (names | state).items()}
        return c.SPELLED(model.value(value).xreplace(symbols))

    released = spelled(contact.compression_at_takeoff(model)[-1].value, at_takeoff)
    return {name: spelled(sp.sympify(value), moving) for name, value in values.items()} | {"released": released}


PART: Part = {
    "packages/arduino/library.properties": _package,
    "packages/arduino/examples/Stance/Stance.ino": _example,
    "packages/cmake/CMakeLists.txt": lambda solver: _package(solver) | _units(solver) | {"rounding": ROUNDING},
    "packages/cmsis-pack/Hopform.hopform.pdsc": lambda solver: _package(solver) | _units(solver),
    "packages/esp-idf/CMakeLists.txt": lambda solver: _units(solver) | {"rounding": ROUNDING},
    "packages/esp-idf/idf_component.yml": _package,
    "packages/example.c": _example,
    "packages/files.txt": lambda solver: {"files": _files(solver)},
    "packages/platformio/library.json": lambda solver: _package(solver) | {"rounding": ROUNDING},
    "packages/program/all/main.c": lambda solver: {"plant": _plant(solver.model), "quantities": quantities},
    "packages/program/all/plant.c": lambda solver: {"plant": _plant(solver.model)},
    "packages/zephyr/zephyr/CMakeLists.txt": lambda solver: _units(solver) | {"rounding": ROUNDING},
    "packages/zephyr/zephyr/Kconfig": lambda solver: {"program": solver.program},
}
