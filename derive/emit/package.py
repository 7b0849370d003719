"""The part python/ of a solver: formulas, records and tables of the package that needs NumPy alone."""

from .. import VERSION
from ..ir import DOMAINS, Record
from ..maths import elements, energy, mode_table, stability
from ..model import kinds, quantities, words
from ..model.equations import Model
from . import c, numpy
from .examples import example_robot, example_start
from .facts import shown
from .sources import Part, Solver

LEDGERS = {
    "Ledger": """Energy ledger since touchdown: energy that each term has added [J]; losses are negative.

    {sums}
    """,
    "FlightLedger": """Energy ledger of the actuator since take-off: energy that each term has added [J]; losses are negative.

    The sum is the change of H.
    """,
}
"""Meanings of the ledgers that a stance and a flight return, by the record of their work."""


def _sums(model: Model) -> str:
    """What the entries of a ledger sum to; a model without a contact has no E."""
    if not (of_body := energy.names_of(model, energy.body_entries(model))):
        return "They sum to the change of H."
    *others, last = of_body
    listed = f"{', '.join(others)} and {last}" if others else last
    apart = "All but spring_work" if quantities.spring_work in energy.body_entries(model) else "They"
    return f"{apart} sum to the change of H; {listed} sum to that of E, the AED."


def _records(solver: Solver) -> tuple[Record, ...]:
    """All records, and the ledgers that a user sees."""
    model = solver.model
    ledgers = (
        energy.with_stop_loss(model, solver.program.record(name), words.text(model, meaning.format(sums=_sums(model))))
        for name, meaning in LEDGERS.items()
        if model.has_contact or name == "Ledger"
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
        "elements": elements, "model": solver.model, "numpy": numpy, "shown": shown(solver.model), "table": mode_table,
        "axes": [coordinate["axis"] for coordinate in shown(solver.model)],
        "flight": [(elements.rows_of_flight(solver.model), elements.columns_of_flight(solver.model))]
        if solver.model.has_contact
        else [],
        "further_rows": ", hop height of the apex, AED" if solver.model.has_contact else "",
    },
    "python/hopform_solver/formulas.py": lambda solver: {
        "numbers": "; equation numbers are the paper's" if solver.model.is_of_the_paper else "", "numpy": numpy,
        "program": solver.program,
    },
    "python/hopform_solver/records.py": lambda solver: {
        "body_entries": [energy.names_of(solver.model, energy.body_entries(solver.model))] if solver.model.has_contact else [],
        "domains": DOMAINS.values(), "elements": elements,
        "energy": energy, "flight_events": [elements.flight_events_of(solver.model)] if solver.model.has_contact else [],
        "kinds": kinds, "limits": [quantities.TRAVEL] if solver.model.has_contact else [], "model": solver.model,
        "numpy": numpy, "records": _records(solver),
    },
    "python/hopform_solver/robot.py": lambda solver: {"numpy": numpy, "robot": solver.model.robot},
    "python/hopform_solver/stability.py": lambda solver: {
        "model": solver.model, "numpy": numpy, "stability": stability
    },
    "python/hopform_solver/structs.py": lambda solver: {
        "public_structs": c.public_structs(solver.model, solver.program)
    },
}  # fmt: skip
