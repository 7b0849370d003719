"""The part python/ of a solver: formulas, records and tables of the package that needs NumPy alone."""

from .. import VERSION
from ..ir import DOMAINS, Record
from ..maths import elements, energy, stability
from ..model import kinds, quantities
from ..model.equations import Model
from . import c, numpy
from .examples import example_robot, example_start
from .facts import shown
from .sources import Part, Solver

LEDGERS = {
    "Ledger": """Where energy came from and went to since touchdown, signed as it enters, [J].

    {sums}
    Further terms of a model of one's own have their entries behind these.
    """,
    "FlightLedger": """Where the actuator's energy came from and went to since take-off, signed as it enters, [J].

    The sum is the change of H.
    """,
}
"""Meanings of the ledgers that a stance and a flight return, by the record of their work."""
SUMS = {
    True: "All but spring_work sum to the change of H; spring_work, viscous_2 and coulomb_2 sum to that of E, the AED (24).",
    False: "They sum to the change of H.",
}
"""What the entries of a ledger sum to, by whether the model has a contact, without which there is no E."""


def _records(solver: Solver) -> tuple[Record, ...]:
    """All records, and the ledgers that a user sees."""
    model = solver.model
    sums = SUMS[model.has_contact]
    ledgers = (
        energy.with_stop_loss(model, solver.program.record(name), meaning.format(sums=sums))
        for name, meaning in LEDGERS.items()
        if model.has_contact or name != "FlightLedger"
    )
    return (*solver.program.records, *ledgers)


def _start(model: Model) -> str:
    """The entries of a dictionary with the start of the example, by the names of the model."""
    start = example_start(model)
    return ", ".join(f'"{each["name"]}": {start[each["axis"]]!r}' for each in shown(model) if each["axis"] in start)


PART: Part = {
    "python/hopform_solver/__init__.py": lambda solver: {
        "example": example_robot(solver.model), "example_start": _start(solver.model), "layout": solver.layout,
        "program": solver.program, "version": VERSION,
    },
    "python/hopform_solver/elements.py": lambda solver: {
        "elements": elements, "model": solver.model, "numpy": numpy, "shown": shown(solver.model),
        "axes": [coordinate["axis"] for coordinate in shown(solver.model)],
    },
    "python/hopform_solver/formulas.py": lambda solver: {"numpy": numpy, "program": solver.program},
    "python/hopform_solver/records.py": lambda solver: {
        "domains": DOMAINS.values(), "elements": elements, "energy": energy, "kinds": kinds, "model": solver.model,
        "flight_events": [elements.flight_events_of(solver.model)] if solver.model.has_contact else [],
        "numpy": numpy, "quantities": quantities, "records": _records(solver),
    },
    "python/hopform_solver/robot.py": lambda solver: {"numpy": numpy, "robot": solver.model.robot},
    "python/hopform_solver/stability.py": lambda solver: {
        "model": solver.model, "numpy": numpy, "stability": stability
    },
    "python/hopform_solver/structs.py": lambda solver: {
        "public_structs": c.public_structs(solver.model, solver.program)
    },
}  # fmt: skip
