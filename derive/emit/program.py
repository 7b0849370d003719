"""The derivation as a program: the functions and records of all its modules, for one model.

Straight-line formulas only. What loops or branches (roots of the cubic, choice of a regime, isolation of
events, the chain of phases) stands once per language in runtime/engine and calls these.
"""

from dataclasses import replace

from ..ir import Authored, Definition, Function, Program, Quantity, Record, Spelled
from ..maths import (
    contact,
    control,
    elements,
    energy,
    flight,
    flight_sensitivity,
    laplace,
    law,
    linear,
    modes,
    partial_fractions,
    sensitivity,
    start,
    time_domain,
    transition,
    work,
)
from ..model import quantities, words
from ..model.equations import Model
from ..shipped import HOPPER
from .facts import shown, state_of

OF_CONTACT = (contact, control, flight, flight_sensitivity)
"""Modules of which a model without a contact has nothing."""
MODULES = (
    laplace, law, linear, elements, modes, partial_fractions, time_domain, transition, energy, work, control, sensitivity, contact, flight, flight_sensitivity,
    start,
)  # fmt: skip


_OF_HOPPER = (
    "Closed-form stance of a series-elastic hopper with viscous and Coulomb friction.",
    "Exact stances of a series-elastic hopper with dry friction, in closed form, and its controller",
)
"""Meaning and summary of a program with a contact."""


def program(model: Model = HOPPER) -> Program:
    """The functions and records of a model, in the order in which they are defined."""
    of_model = {
        record.name: record
        for record in (
            model.robot, laplace.rates_record(model), elements.letters_record(model), sensitivity.slopes_record(model), energy.ledger_record(model), energy.moments_record(model),
            energy.energy_record(model), sensitivity.changes(model.robot), _start_record(model),
            modes.forces_record(model), *((flight.flight_ledger_record(model),) if model.has_contact else ()),
        )
    }  # fmt: skip
    modules = (module for module in MODULES if model.has_contact or module not in OF_CONTACT)
    defined = [value for module in modules for value in vars(module).values()]
    zeros = [step.symbol for step in model.in_parameters(laplace.rates_of(model)) if step.value == 0]
    if model.has_law:
        under_law = {step.symbol for step in model.in_parameters(laplace.rates_under_law(model)) if step.value == 0}
        zeros = [symbol for symbol in zeros if symbol in under_law]
    named = {value.name: value for value in (*vars(quantities).values(), *defined) if isinstance(value, Record)}
    of_model = {name: _worded(model, record) for name, record in (named | of_model).items()}
    of_model[quantities.STATE.name] = replace(of_model[quantities.STATE.name], quantities=state_of(model))
    functions = (
        value.of(model, of_model).without(zeros)
        for value in defined
        if isinstance(value, Definition) and (model.has_contact or not value.of_contact)
    )
    return Program(
        *(
            _OF_HOPPER
            if model.has_contact
            else (model.title, f"{model.title.rstrip('.')}: exact motions with dry friction")
        ),
        tuple(of_model.values()),
        tuple(_in_words(model, function) for function in functions),
    )


def _start_record(model: Model) -> Record:
    """The coordinates and velocities that move under their names in the file, with the engine's letter of each."""
    return start.START.of(
        *(
            Spelled(each["name"], each["glyph"], each["unit"], each["meaning"], letter=each["axis"])
            for each in shown(model)
        )
    )


def _worded(model: Model, record: Record) -> Record:
    """A record in the words and units of a model; what its file names is in them already."""
    own = tuple(each if isinstance(each, Authored) else words.of_quantity(model, each) for each in record.quantities)
    return replace(record, meaning=words.text(model, record.meaning), quantities=own)


def _in_words(model: Model, function: Function) -> Function:
    """A function whose meaning, arguments and comments are in the words of a model. Its records are already, and so are the
    sources of letters, which are the elements of the file.
    """

    def worded(argument: Record | Quantity) -> Record | Quantity:
        return argument if isinstance(argument, Record | Authored) else words.of_quantity(model, argument)

    letters = {letter.name for letter in model.constants}
    steps = (
        step if step.symbol.name.removeprefix("d_") in letters else replace(step, source=words.text(model, step.source))
        for step in function.steps
    )
    return replace(
        function, meaning=words.text(model, function.meaning), takes=tuple(map(worded, function.takes)),
        steps=tuple(steps), returns=worded(function.returns),
    )  # fmt: skip
