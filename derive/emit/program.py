"""The derivation as a program: the functions and records of all its modules, for one model.

Straight-line formulas only. What loops or branches (roots of the cubic, choice of a regime, isolation of
events, the chain of phases) stands once per language in runtime/engine and calls these.
"""

from dataclasses import replace

from ..ir import Authored, Definition, Function, Program, Quantity, Record
from ..maths import (
    contact,
    control,
    elements,
    energy,
    flight,
    laplace,
    law,
    linear,
    modes,
    partial_fractions,
    sensitivity,
    time_domain,
)
from ..model import quantities, words
from ..model.equations import Model
from ..shipped import HOPPER
from .facts import state_of

MODULES = (
    laplace, law, linear, elements, modes, partial_fractions, time_domain, energy, control, sensitivity, contact, flight
)  # fmt: skip


def program(model: Model = HOPPER) -> Program:
    """The functions and records of a model, in the order in which they are defined."""
    of_model = {
        record.name: record
        for record in (
            model.robot, elements.letters_record(model), energy.ledger_record(model), energy.moments_record(model),
            flight.flight_ledger_record(model), sensitivity.changes(model.robot),
        )
    }  # fmt: skip
    defined = [value for module in MODULES for value in vars(module).values()]
    zeros = [step.symbol for step in model.in_parameters(laplace.rates_of(model)) if step.value == 0]
    if model.law is not None:
        under_law = {step.symbol for step in model.in_parameters(laplace.rates_under_law(model)) if step.value == 0}
        zeros = [symbol for symbol in zeros if symbol in under_law]
    named = {value.name: value for value in (*vars(quantities).values(), *defined) if isinstance(value, Record)}
    of_model = {name: _worded(model, record) for name, record in (named | of_model).items()}
    of_model[quantities.STATE.name] = replace(of_model[quantities.STATE.name], quantities=state_of(model))
    functions = (value.of(model, of_model).without(zeros) for value in defined if isinstance(value, Definition))
    return Program(
        "Closed-form stance of a series-elastic hopper with viscous and Coulomb friction.",
        "Exact stances of a series-elastic hopper with dry friction, in closed form, and its controller",
        tuple(of_model.values()),
        tuple(_in_words(model, function) for function in functions),
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
