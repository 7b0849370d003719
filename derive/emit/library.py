"""The part c/ of a solver: public headers, facts and formulas for the engine, README."""

import hashlib
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..ir import DOMAINS, Member
from ..maths import contact, elements, energy, kernels, mode_table, modes, stability
from ..model import kinds, quantities, selftest, structs
from ..model.precisions import CONSTANTS
from . import c, numpy
from .expressions import snake
from .facts import ROUNDING, members_of_start, state_of
from .instantiate import by_contact
from .programs import program_of
from .sources import Part, Solver

WALKED = ("Robot", "State", "Ledger", "FlightLedger", "Numerators", "Basis")
"""Records whose members the engine goes through one after the other."""

BY_INDEX = dict.fromkeys(("Drive", "Free", "Friction", "Resisted"), "Element") | {
    "State": "Axis", "Excess": "Side", "Slopes": "Share", "RobotChange": "Field", "Basis": "Order"
}  # fmt: skip
"""Records that the engine goes through as arrays, and what counts them; further ones of the axes of a state."""
BY_AXIS = Member("later", "At"), Member("rates", "Speeds"), Member("change", "StateChange")

IN_HEADER = (
    "start", "stance", "states", "energy", "forces", "plant", "sensitivity", "control", "flight", "flight_sensitivity",
    "touchdown", "selftest", "batch", "flights", "hops",
)  # fmt: skip
"""The engine's files with public functions, in the order of the header."""


def _public_functions(solver: Solver) -> list[str]:
    """The engine's public functions as the header declares them: comment and first lines of each definition."""
    begins = re.compile(r"^(/\*(?:(?!\*/).)*\*/\n\w+ hopform_\w+_real\([^;{]*\)) \{", re.MULTILINE | re.DOTALL)
    texts = {
        Path(name).name.partition("_real")[0]: by_contact(text, has_contact=solver.model.has_contact)
        for name, text in solver.engine()
    }
    return [f"{definition[1]};" for name in IN_HEADER for definition in begins.finditer(texts.get(name, ""))]


def _formulas(solver: Solver) -> dict[str, Any]:
    """The formulas that the engine calls, by name or for each mode, and the structs that these or the engine need."""
    words = {word for _, text in solver.engine() for word in re.findall(r"\w+(?=_real\b)", text)}
    words |= {"second_position"} | {f"motion_of_{form.name}" for form in mode_table.forms(solver.model)}
    words |= {*mode_table.rates(solver.model)}
    words |= {snake(record) for record in BY_INDEX} | {snake(member.type) for member in BY_AXIS} | {"numerators"}
    functions = [function for function in solver.program.functions if function.name in words]
    return {
        "c": c, "functions": functions,
        "internal_structs": c.internal_structs(solver.program, functions, words), "program": solver.program,
    }  # fmt: skip


def _arrays(solver: Solver) -> list[dict[str, Any]]:
    return [
        {"record": solver.program.record(name), "name": f"{name}By{by}", "views": BY_AXIS if by == "Axis" else ()}
        for name, by in BY_INDEX.items()
    ]


HEADERS: Part = {
    "c/include/hopform/hopform.h": lambda solver: {
        "c": c, "elements": elements, "kinds": kinds, "model": solver.model, "precisions": solver.precisions,
        "program": solver.program, "state": state_of(solver.model),
    },
    "c/include/hopform/hopform_real.h": lambda solver: {
        "c": c, "program": solver.program, "public_functions": _public_functions(solver),
        "public_structs": c.public_structs(solver.model, solver.program),
        "search_candidates": structs.SEARCH_CANDIDATES,
    },
    "c/src/facts.h": lambda solver: {
        "c": c, "contact": contact, "elements": elements, "energy": energy,
        "kinds": kinds,
        "layout": solver.layout, "model": solver.model, "modes": modes, "numpy": numpy, "quantities": quantities,
        "stability": stability, "table": mode_table,
        "walked_records": [record for record in solver.program.records if record.name in WALKED],
    },
}  # fmt: skip
"""What a package and its library must agree on."""

PART: Part = HEADERS | {
    "c/src/formulas_real.h": _formulas,
    "c/src/model_real.h": lambda solver: {"by_index": _arrays(solver), "c": c, "quantities": quantities},
    "c/src/mode_table_real.h": lambda solver: {"c": c, "model": solver.model, "table": mode_table},
    "c/src/precision_real.h": lambda solver: {"c": c, "constants": CONSTANTS, "domains": DOMAINS.values()},
    "c/src/selftest_cases_real.h": lambda solver: {
        "c": c, "robot": solver.model.robot, "selftest": selftest
    },
    "c/src/series_real.h": lambda solver: {"kernels": kernels},
    "c/README.md": lambda solver: {
        "board": program_of(solver.model), "kinds": elements.kinds_of(solver.model),
        "members": members_of_start(solver.model), "robot": solver.model.robot,
        "rounding": ROUNDING, "state": state_of(solver.model), "title": solver.model.title.rstrip("."),
    },
}  # fmt: skip

NO_LAYOUT = "0" * 16
"""What the headers that the layout is a hash of have in its place."""


def layout_of(solver: Solver) -> str:
    """A hash of what a package and its library must agree on, without comments and however lines are broken. It stands
    in both, so that a library with other structs or numbers is refused; it says nothing of how the library computes.
    """
    solver = replace(solver, layout=NO_LAYOUT)
    texts = dict(text for name, values in HEADERS.items() for text in solver.filled(name, values(solver)))
    code = (re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL) for _, text in sorted(texts.items()))
    words = "\n".join(" ".join(text.replace("\\\n", " ").split()) for text in code)
    return hashlib.sha256(words.encode()).hexdigest()[: len(NO_LAYOUT)]
