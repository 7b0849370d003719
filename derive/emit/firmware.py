"""The part packages/ of a solver: the C library for each build system, and programs for boards."""

from collections.abc import Callable
from typing import Any

import sympy as sp

from .. import VERSION
from ..maths import contact, elements
from ..maths.inverse import Inverse, inverse_of
from ..model import quantities
from ..model.equations import Model
from ..model.names import in_c
from ..model.structs import member_name
from . import c
from .examples import example_input, example_robot, example_start
from .facts import ROUNDING, members_of_start
from .programs import program_of
from .sources import Part, Solver
from .texts import manifest


def _files(solver: Solver) -> list[str]:
    """The files of the C library that firmware compiles or includes, relative to its folder."""
    not_here = ("c/workstation/", "c/notes/")
    return sorted(
        path.removeprefix("c/") for path, source in solver.library().items() if not source.startswith(not_here)
    )


def _package(solver: Solver) -> dict[str, Any]:
    return {"summary": _summary(solver), "version": VERSION}


def _summary(solver: Solver) -> str:
    """What a manifest says of the package."""
    model = solver.model
    return manifest(solver.program.summary if model.has_contact else f"{model.title.rstrip('.')}, solved exactly")


def _units(solver: Solver) -> dict[str, Any]:
    return {"units": [name for name in _files(solver) if name.endswith(".c")]}


def _example(solver: Solver) -> dict[str, Any]:
    model, start = solver.model, example_start(solver.model)
    return {
        "example": example_robot(model), "example_input": example_input(model),
        "example_members": ", ".join(f"{each['name']} [{each['unit']}]" for each in members_of_start(model)),
        "example_start": ", ".join(repr(start[str(axis)]) for axis in start),
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


# ---- the program of a model without a contact ----


def _coordinate(model: Model) -> dict[str, str]:
    """The coordinate that the control moves: the first, which the input drives."""
    names = {"name": quantities.x1, "velocity": quantities.v1}
    return {key: in_c(elements.name_of(model, symbol)) for key, symbol in names.items()} | {
        "unit": members_of_start(model)[0]["unit"]
    }


def _drives(model: Model) -> list[dict[str, str]]:
    """What the program sets at a tick, one thing or nothing."""
    if "free" in program_of(model).folders or model.input is None:
        return []
    what = f"{model.input.name} [{model.input.unit}], {model.input.meaning}"
    if model.law is None:
        return [{"what": what, "arguments": "float input", "input": "input", "unused": ""}]
    current = model.law.current
    asked = f"{current.name} [{current.unit}], {current.meaning}"
    return [{
        "what": f"{what}; of a drive without a law {asked}, which the law asks for",
        "arguments": "float target, float asked", "input": "target", "unused": "\n    (void)asked;",
    }]  # fmt: skip


def _in_program(model: Model, value: sp.Expr, mover: dict[sp.Symbol, str]) -> str:
    """An expression in parameters and coordinates as a program spells it; mover: those of the first mass, and others that
    are no member of a reading.
    """
    names = {parameter.symbol: f"robot.{member_name(parameter)}" for parameter in model.parameters}
    state = (quantities.x1, quantities.v1, quantities.x2, quantities.v2)
    names |= {symbol: f"now->{in_c(elements.name_of(model, symbol))}" for symbol in state} | mover
    return c.SPELLED(model.value(value).xreplace({symbol: sp.Symbol(name) for symbol, name in names.items()}))


def _feedforward(model: Model) -> dict[str, Any]:
    """The input that a reference of the first coordinate needs."""
    mover = {quantities.x1: "reference->position", quantities.v1: "reference->velocity"}
    spelled = (_in_program(model, value, mover) for value in inverse_of(model))
    unit = _coordinate(model)["unit"]
    texts = {
        "feedback": f"Largest error under feedback alone [1e-9 {unit}]: ",
        "compensated": f"Largest error with compensation [1e-9 {unit}]: ",
    }
    inverse = dict(zip(Inverse._fields, spelled, strict=True))
    return {"coordinate": _coordinate(model), "inverse": inverse, "limit": _limit(model), "texts": texts}


def _law(model: Model) -> dict[str, Any]:
    """The current that a law asks for."""
    asked = -model.pull / quantities.gamma2
    coordinate = _coordinate(model)
    texts = {
        "step": f"{coordinate['name']} at the end of a step [1e-6 {coordinate['unit']}]: ",
        "short": f"short of the target by [1e-6 {coordinate['unit']}]: ",
    }
    spelled = _in_program(model, asked, {quantities.u: "target"})
    return {"asked": spelled, "coordinate": coordinate, "limit": _limit(model), "texts": texts}


def _limit(model: Model) -> str:
    return _in_program(model, quantities.u_max if model.declares(quantities.u_max) else sp.oo, {})


def _program(*names: str) -> Callable[[Solver], dict[str, Any]]:
    """Some of what build files ask of a program."""
    return lambda solver: {name: getattr(program_of(solver.model), name) for name in names}


def _some(names: tuple[str, ...], values: Callable[[Solver], dict[str, Any]]) -> Callable[[Solver], dict[str, Any]]:
    """Of some values those with these names."""
    return lambda solver: {name: values(solver)[name] for name in names}


def _moves(solver: Solver) -> dict[str, Any]:
    return {"drives": _drives(solver.model), "members": members_of_start(solver.model)}


PART: Part = {
    "packages/arduino/library.properties": _package,
    "packages/arduino/examples/Stance/Stance.ino": _example,
    "packages/cmake/CMakeLists.txt": lambda solver: _package(solver) | _units(solver) | {"rounding": ROUNDING},
    "packages/cmsis-pack/Hopform.hopform.pdsc": lambda solver: (
        _package(solver) | _units(solver) | {"board": program_of(solver.model)}
    ),
    "packages/esp-idf/CMakeLists.txt": lambda solver: _units(solver) | {"rounding": ROUNDING},
    "packages/esp-idf/idf_component.yml": _package,
    "packages/example.c": _example,
    "packages/files.txt": lambda solver: {"files": _files(solver)},
    "packages/platformio/library.json": lambda solver: (
        _package(solver) | {"board": program_of(solver.model), "rounding": ROUNDING}
    ),
    "packages/program/cmake/CMakeLists.txt": _program("name", "sources", "test"),
    "packages/program/esp-idf/CMakeLists.txt": _program("name"),
    "packages/program/esp-idf/main/CMakeLists.txt": _program("sources"),
    "packages/program/feedforward/control.c": lambda solver: _feedforward(solver.model),
    "packages/program/free/control.c": _some(("members",), _moves),
    "packages/program/hopper/main.c": lambda solver: {"plant": _plant(solver.model), "quantities": quantities},
    "packages/program/hopper/plant.c": lambda solver: {"plant": _plant(solver.model)},
    "packages/program/law/control.c": lambda solver: _law(solver.model),
    "packages/program/machine/hardware.h": _some(("drives", "members"), _moves),
    "packages/program/machine/main.c": _some(("members",), _moves),
    "packages/program/machine/plant.c": _some(("drives",), _moves),
    "packages/program/zephyr/CMakeLists.txt": _program("name", "sources"),
    "packages/program/zephyr/sample.yaml": _program("name", "sentence"),
    "packages/zephyr/zephyr/CMakeLists.txt": lambda solver: _units(solver) | {"rounding": ROUNDING},
    "packages/zephyr/zephyr/Kconfig": lambda solver: {"summary": _summary(solver)},
}
