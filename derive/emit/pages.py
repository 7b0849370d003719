"""What a solver has beside its code, and the modules of Python that are made of the same: the register of the paper, the
answers of commands, and the facts that are read before anything is imported.
"""

import json
from typing import Any

from ..maths import elements, energy
from ..model.answers import Answer, answers, schema
from ..paper import claims, register
from .facts import facts
from .sources import Part, Solver
from .toml import toml


def _answers(solver: Solver) -> tuple[Answer, ...]:
    model = solver.model
    ledger = energy.with_stop_loss(model, solver.program.record("Ledger"), "")
    verdicts = {"VERDICTS": tuple(register.VERDICTS), "CLAIMED": tuple(claims.VERDICTS)}
    return answers(model, ledger, verdicts, elements.kinds_of(model))


def _schema(solver: Solver) -> dict[str, Any]:
    answered = _answers(solver)
    return {"schema": lambda header: json.dumps({"$comment": header} | schema(answered), indent=2)}


def _facts(solver: Solver) -> dict[str, Any]:
    """The facts, with the sources of the library that Python loads, and of that which has notes."""
    units = sorted(path for path in solver.library() if path.endswith(".c"))
    notes = [path for path in units if path.startswith("c/notes/")]
    build = {"sources": [path for path in units if path not in notes], "notes": [*notes, "c/src/version.c"]}
    return {"facts": toml(facts(solver.model, solver.layout, build))}


PART: Part = {
    "EQUATIONS.md": lambda _: {"register": register, "claims": claims},
    "python/hopform_solver/equations.py": lambda solver: {
        "entries": register.REGISTER if solver.model.has_contact else (),
        "register": register,
        "claimed": claims.CLAIMS if solver.model.has_contact else (),
        "claims": claims,
    },
    "JSON.md": lambda solver: {"answers": _answers(solver)},
    "schema.json": _schema,
    "python/hopform_solver/answers.py": lambda solver: {"answers": _answers(solver)},
    "solver.toml": _facts,
}
