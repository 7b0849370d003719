"""What there is to know of a solver before any of it is imported: `solver.toml`, data made from the derivation's objects.

Names, units, domains and words are those that every reader uses: tables, headers, plots, errors, JSON and help.
`can` says what the model can do, `lacks` of everything else what it would need.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import sympy as sp

from .. import VERSION
from ..ir import Quantity
from ..maths import elements, energy
from ..model import quantities as Q
from ..model.equations import EXCESS, FALLING, MASSES, Model

FORMAT = 1
"""Of solver.toml: a reader refuses another."""

ROUNDING = ("-ffp-contract=off", "-fno-tree-slp-vectorize", "-fno-math-errno")
"""Flags of every build: each operation is rounded as it is written, and a square root is an instruction. Without the
second gcc -O3 -march=x86-64-v3 makes one vfmsubadd of a sum and a difference of products, whatever the first says.
"""
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=default", *ROUNDING)
"""Of the compiler that makes the library which Python loads."""

HOPPING = ("flight", "hop", "command", "reach")
"""What a body allows that flies under gravity with an input."""
ALL = ("motion", "stance", *HOPPING, "identify")
"""What a model can: a motion, always; a stance, if it has a contact; what identifies the paper's equations."""

NEEDS = {
    "foot": (("stance", *HOPPING), "a contact, because its foot is bolted to the ground"),
    "body": (HOPPING, "a body that flies, because it is bolted to the ground"),
}
"""What a bolt takes from a model, and what it then lacks."""

DIRECTIONS = {"actuator": ("extends", "retracts"), "body": ("slips up", "slips down")}
"""Words for the two directions of a coordinate."""

BELONGS: dict[str, tuple[sp.Symbol, ...]] = {
    "actuator": (Q.m_eff, Q.b1, Q.f1, Q.f1_excess, Q.x1_min, Q.x1_max),
    "motor": (Q.gamma2, Q.u_max),
    "body": (Q.m_s, Q.b2, Q.f2, Q.f2_excess),
    "spring": (Q.k, Q.L0, Q.c),
    "gravity": (Q.g,),
    "contact": (Q.impact_loss,),
}
"""The element of each parameter of the robot."""

LABELS: dict[str, dict[sp.Symbol, str]] = {
    "actuator": {
        Q.viscous_1: "actuator, viscous friction",
        Q.coulomb_1: "actuator, Coulomb friction",
        Q.STOP_LOSS.symbol: "actuator, lost at stops",
    },
    "motor": {Q.motor_work: "work of the motor"},
    "body": {Q.viscous_2: "body, viscous friction", Q.coulomb_2: "body, Coulomb friction"},
    "spring": {
        Q.offset_work: "work of the offset force k c",
        Q.spring_work: "the actuator's work on the body",
    },
}
"""The entries of the ledger of each element, and what a table calls them."""

OUTPUT_UNITS = {"T": "s", "apex": "m", "aed": "J"}


def facts(model: Model, layout: str, sources: Iterable[str]) -> dict[str, Any]:
    """The facts of a model's solver, whose library is compiled from these sources, by paths in its folder."""
    lacks = dict(_lacks(model))
    return {
        "format": FORMAT,
        "name": model.name,
        "title": model.title,
        "version": VERSION,
        "layout": layout,
        "can": [act for act in ALL if act not in lacks],
        "lacks": lacks,
        "build": {"flags": list(FLAGS), "sources": sorted(sources)},
        "coordinates": list(_coordinates()),
        "parameters": [{**_quantity(each), "element": element_of(model, each)} for each in model.robot.quantities],
        "limits": [{**_quantity(Q.TRAVEL), "element": "spring"}],
        "elements": [*_masses(model), *_others(model), *_terms(model)],
        "inputs": [{**_named(Q.CURRENT), "limit": str(Q.u_max), "per_unit": str(Q.gamma2), "element": "motor"}],
        **({} if "foot" in model.fixed else {"contact": _contact(model)}),
        **({} if model.fixed else {"flight": {"falls": str(model.fall), "impact_loss": str(Q.impact_loss)}}),
        "outputs": [{"name": name, "unit": OUTPUT_UNITS.get(name) or _unit_of(name)} for name in elements.OUTPUTS],
        "energies": [_named(each) for each in Q.ENERGY.quantities],
    }


def _lacks(model: Model) -> Iterator[tuple[str, str]]:
    """What the model cannot do, and what it lacks for that."""
    for bolted in model.fixed:
        acts, why = NEEDS[bolted]
        yield from ((act, why) for act in acts)
    further = [f"the term '{term.name}'" for term in model.terms]
    further += [f"a bolted {bolted}" for bolted in model.fixed]
    further += [f"friction by sign of the {mass}" for mass in model.friction_by_sign]
    if further:
        yield "identify", f"the equations of motion (3), (4), which it changes by {' and '.join(further)}"


def element_of(model: Model, parameter: Quantity) -> str:
    """The element that a parameter of the robot belongs to: a term, if its force has the parameter."""
    for name, symbols in BELONGS.items():
        if parameter.symbol in symbols or parameter in _below(name):
            return name
    forces = {term.name: sp.Tuple(term.force_1, term.force_2) for term in model.terms}
    return next((name for name, force in forces.items() if parameter.symbol in force.free_symbols), "")


def _below(mass: str) -> tuple[Quantity, ...]:
    """The friction of a mass with a velocity below 0, in motion and at rest, where that is a parameter of its own."""
    return (FALLING[mass], EXCESS[mass][1]) if mass in MASSES else ()


def _named(quantity: Quantity) -> dict[str, Any]:
    return {"name": quantity.name, "glyph": quantity.glyph, "unit": quantity.unit, "meaning": quantity.meaning}


def _quantity(quantity: Quantity) -> dict[str, Any]:
    """A parameter; one without a default must be given."""
    default = {} if quantity.default is None else {"default": quantity.default}
    return {**_named(quantity), "domain": quantity.domain, **default}


def _unit_of(name: str) -> str:
    return next(each.unit for each in (*Q.STATE.quantities, Q.BODY_HEIGHT) if each.name == name)


def _coordinates() -> Iterator[dict[str, Any]]:
    """The members of a state, and the height of the body that people give in place of the compression."""
    yield from map(_named, (*Q.STATE.quantities, Q.BODY_HEIGHT))


def _masses(model: Model) -> Iterator[dict[str, Any]]:
    """The elements that slip or are held."""
    for each in elements.ELEMENTS:
        by_sign = [quantity.symbol for quantity in _below(each.name) if each.name in model.friction_by_sign]
        friction = [MASSES[each.name][1], *by_sign[:1]]
        excess = [EXCESS[each.name][0], *by_sign[1:]]
        yield {
            "name": each.name,
            "kind": "mass",
            "velocity": str(each.velocity),
            "fixed": each.name in model.fixed,
            "directions": list(DIRECTIONS[each.name]),
            "friction": list(map(str, friction)),
            "excess": list(map(str, excess)),
            "stops": list(map(str, each.stops)),
            "events": dict(_events(each)),
            "ledger": _ledger(each.name),
        }


def _events(element: elements.Element) -> Iterator[tuple[str, str]]:
    """The events of an element, with the words for each."""
    for what, number in element.events.items():
        if number:
            yield f"x{element.number}_{what}", f"{element.name} {what.replace('_', ' ')}"


def _ledger(name: str) -> dict[str, str]:
    return {str(entry): label for entry, label in LABELS.get(name, {}).items()}


def _others(model: Model) -> Iterator[dict[str, Any]]:
    """The elements that every model has beside its masses."""
    for name in BELONGS:
        if name not in MASSES and not (name == "contact" and "foot" in model.fixed):
            yield {"name": name, "kind": name, "ledger": _ledger(name)}


def _terms(model: Model) -> Iterator[dict[str, Any]]:
    """The elements that the model's file adds."""
    for term in model.terms:
        own = {work.entry.name: f"{tuple(MASSES)[work.mass - 1]}, {term.name}" for work in energy.works_of(term)}
        yield {"name": term.name, "kind": "term", "meaning": term.meaning, "ledger": own}


def _contact(model: Model) -> dict[str, Any]:
    return {"coordinate": str(Q.y), "force": str(sp.expand(model.stiffness * model.contact)), "rest": str(model.rest)}
