"""What there is to know of a solver before any of it is imported: `solver.toml`, data made from the derivation's objects.

Names, units, domains and words are those that every reader uses: tables, headers, plots, errors, JSON and help.
`can` says what the model can do, `lacks` of everything else what it would need.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import sympy as sp

from .. import VERSION
from ..ir import Quantity
from ..maths import elements, energy
from ..model import quantities as Q
from ..model import words
from ..model.equations import EXCESSES, LETTER_OF_ENTRY, MASSES, Input, Model
from ..model.names import in_c
from ..model.units import base_units

FORMAT = 3
"""Of solver.toml, and of the functions and structs of the library beside it: a reader refuses another, because it would
call a library in a way that this does not know.
"""

ROUNDING = ("-ffp-contract=off", "-fno-tree-slp-vectorize", "-fno-math-errno")
"""Flags of every build: each operation is rounded as it is written, and a square root is an instruction. Without the
second gcc -O3 -march=x86-64-v3 makes one vfmsubadd of a sum and a difference of products, whatever the first says.
"""
FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=default", *ROUNDING)
"""Of the compiler that makes the library which Python loads."""

EVERY = ("motion", "fit", "batches", "derivatives", "plots", "export")
"""What every model can."""
STANDING = ("stance", "flight", "hop")
"""What a contact brings."""
CHOOSING = ("command", "reach")
"""What an input brings to a hop: the choice of a current, and the map of all apexes."""
IDENTIFY = "identify"
"""What is of the paper's equations alone."""

LACKS_CONTACT = "a contact()"
LACKS_INPUT = "a current()"
LACKS_EQUATIONS = "the equations of motion of the hopper"

MASS_OF = {Q.viscous_1: 0, Q.coulomb_1: 0, Q.STOP_LOSS.symbol: 0, Q.viscous_2: 1, Q.coulomb_2: 1}
"""The entries of the ledger that belong to a mass, by its index."""

OF_FORCES = ("N", "N m", "N s/m", "N/m")
"""Units of what no table lists: forces, and gains of the law in flight."""

OUTPUT_UNITS = {"T": "s", "apex": "m", "aed": "J"}


def facts(model: Model, layout: str, sources: Mapping[str, list[str]]) -> dict[str, Any]:
    """The facts of a model's solver, whose libraries are compiled from these sources, by paths in its folder."""
    lacks = dict(_lacks(model))
    known = {
        "format": FORMAT,
        "name": model.name,
        "title": model.title,
        "version": VERSION,
        "layout": layout,
        "can": [act for act in (*EVERY, *STANDING, *CHOOSING, IDENTIFY) if act not in lacks],
        "lacks": lacks,
        "build": {"flags": list(FLAGS), **sources},
        "coordinates": list(_coordinates(model)),
        "parameters": [{**_quantity(each), "element": element_of(model, each)} for each in model.parameters],
        "limits": [{**_quantity(Q.TRAVEL), "element": _spring(model)}] if model.has_contact else [],
        "elements": [*_masses(model), *_others(model), *_further(model)],
        "inputs": list(_inputs(model)),
        **({} if model.law is None else {"currents": list(_currents(model))}),
        **({"contact": _contact(model)} if model.has_contact else {}),
        **({"flight": _flight(model)} if model.has_contact else {}),
        "outputs": [
            {"name": name, "unit": model.unit(OUTPUT_UNITS.get(output, "")) or _unit_of(model, output)}
            for output, name in zip(elements.outputs(model), elements.rows(model), strict=True)
        ],
        "energies": [_named(each) for each in Q.ENERGY.quantities if each.symbol == Q.total or model.has_contact],
    }
    tables = (table for value in known.values() if isinstance(value, list) for table in value)
    units = {str(table["unit"]) for table in tables if isinstance(table, Mapping) and "unit" in table}
    return known | {"dimensions": {unit: base_units(unit) for unit in sorted({*units, *OF_FORCES})}}


def _lacks(model: Model) -> Iterator[tuple[str, str]]:
    """What the model cannot do, and what it lacks for that."""
    if not model.has_contact:
        yield from ((act, LACKS_CONTACT) for act in (*STANDING, *CHOOSING, IDENTIFY))
        return
    if model.input is None:
        yield from ((act, LACKS_INPUT) for act in CHOOSING)
    if not model.is_of_the_paper:
        changed = " and ".join(force.meaning for force in model.further)
        yield IDENTIFY, f"{LACKS_EQUATIONS}{f', to which it adds {changed}' if changed else ''}"


def abilities(known: Mapping[str, Any]) -> Iterator[str]:
    """What a model can by its facts, and in a sentence for each reason what it cannot; what needs a stance is not listed
    beside it.
    """
    yield f"It can: {', '.join(known['can'])}."
    for why in dict.fromkeys(known["lacks"].values()):
        acts = [act for act, own in known["lacks"].items() if own == why]
        *others, last = [act for act in acts if act in STANDING] or acts
        listed = f"{', '.join(others)} or {last}" if others else last
        has_not = f"has no {why[2:]}" if why.startswith("a ") else f"does not have {why}"
        yield f"No {listed}: the model {has_not}."


def element_of(model: Model, parameter: Quantity) -> str:
    """The element that a parameter of the robot belongs to: the first that the file declares with it."""
    things = {"gravity": "gravity", "contact": "contact"}
    for letter, thing in _letters_of(model):
        if parameter.symbol in model.constants[letter].free_symbols:
            return thing
    for element in model.listed:
        if parameter.name in element.parameters:
            return things.get(element.kind, element.name)
    return ""


def _letters_of(model: Model) -> Iterator[tuple[sp.Symbol, str]]:
    """The letters with the element that each belongs to."""
    first, second = (each.thing if each else "" for each in model.names)
    motor = model.input.thing if model.input else ""
    letters_of = {
        first: (Q.m_eff, Q.b1, Q.f1, Q.f1_minus, *EXCESSES[0], Q.x1_min, Q.x1_max), motor: (Q.gamma2, Q.u_max, *Q.OF_LAW),
        second: (Q.m_s, Q.b2, Q.f2, Q.f2_minus, *EXCESSES[1]), _spring(model): (Q.k, Q.L0, Q.c), "gravity": (Q.g,),
        "contact": (Q.impact_loss,),
    }  # fmt: skip
    for thing, letters in letters_of.items():
        yield from ((letter, thing) for letter in letters if thing)


def _spring(model: Model) -> str:
    """What a file calls the spring that the stretch is of."""
    return next(iter(model.called(Q.k)), "spring")


def _named(quantity: Quantity) -> dict[str, Any]:
    return {"name": quantity.name, "glyph": quantity.glyph, "unit": quantity.unit, "meaning": quantity.meaning}


def _quantity(quantity: Quantity) -> dict[str, Any]:
    """A parameter; one without a default must be given."""
    default = {} if quantity.default is None else {"default": quantity.default}
    return {**_named(quantity), "domain": quantity.domain, **default}


def _unit_of(model: Model, name: str) -> str:
    units = {each.name: each.unit for each in (*Q.STATE.quantities, Q.BODY_HEIGHT)}
    return model.unit(units[name], name)


def _coordinates(model: Model) -> Iterator[dict[str, Any]]:
    """The members of a state, and the height of the body that people give in place of the compression: under the names
    of the model, with `axis`, the engine's.
    """
    masses = {Q.x1: 0, Q.v1: 0, Q.v2: 1, Q.x2: 1}
    for quantity in (*Q.STATE.quantities, Q.BODY_HEIGHT):
        own = model.names[masses[quantity.symbol]] if quantity.symbol in masses else None
        if own is None and (quantity.symbol in masses or None in model.names):
            continue
        worded = _named(words.of_quantity(model, quantity)) | {"name": elements.name_of(model, quantity.symbol)}
        if own is not None and own.meaning and quantity.symbol in (Q.x1, Q.x2):
            worded["meaning"] = own.meaning
        yield worded | {"axis": quantity.name}


def state_of(model: Model) -> tuple[Quantity, ...]:
    """The members of the engine's state as the file of a model counts them: their meanings begin with what each is in
    its coordinates and parameters.
    """
    return tuple(
        replace(each, unit=model.unit(each.unit, each.name), meaning=_in_the_file(model, each))
        for each in Q.STATE.quantities
    )


def height_of(model: Model) -> Quantity:
    """The second coordinate, which results have in place of y, as the file of a model counts it."""
    return replace(words.of_quantity(model, Q.BODY_HEIGHT), meaning=_in_the_file(model, Q.BODY_HEIGHT))


def compression_of(model: Model) -> sp.Expr:
    """The member y of the state in the coordinates and parameters of the file."""
    still = {x: sp.S.Zero for x, element in zip((Q.x1, Q.x2), model.names, strict=True) if element is None}
    named = {x: sp.Symbol(elements.name_of(model, x), real=True) for x in (Q.x1, Q.x2) if x not in still}
    return sp.expand(model.value(model.ratio * Q.x1 - Q.x2 + model.length).xreplace(still | named))


def _in_the_file(model: Model, member: Quantity) -> str:
    meaning = words.of_quantity(model, member).meaning
    if member.symbol == Q.y:
        return f"{compression_of(model)}: {meaning}"
    name = elements.name_of(model, member.symbol)
    return meaning if name == member.name else f"{name}: {meaning}"


def shown(model: Model) -> list[dict[str, Any]]:
    """The coordinates and velocities that a state is shown by, mass after mass, as `solver.toml` has them."""
    by_axis = {each["axis"]: each for each in _coordinates(model)}
    return [by_axis[axis] for axis in ("x1", "v1", "x2", "v2") if axis in by_axis]


def members_of_start(model: Model) -> list[dict[str, str]]:
    """The coordinates and velocities as C has them: name, unit, meaning, and how a program prints it at an ending."""
    return [
        {
            "name": in_c(each["name"]), "unit": each["unit"], "meaning": each["meaning"],
            "ending": f"{each['name']} at its ending [1e-6 {each['unit']}]: ",
        }
        for each in shown(model)
    ]  # fmt: skip


def _inputs(model: Model) -> Iterator[dict[str, Any]]:
    """The input; of a current its limit and the force per unit of it."""
    if (quantity := model.input) is not None:
        yield _of_input(quantity) | (_per_unit(model) if model.law is None else {}) | {"element": quantity.thing}


def _currents(model: Model) -> Iterator[dict[str, Any]]:
    """The current that a law sets, with its limit, the force per unit of it, and the parameters of the law's gains."""
    if (law := model.law) is not None:
        letters = {str(each) for of in (Q.K_p, Q.K_d) for each in sp.sympify(model.constants[of]).free_symbols}
        gains = [each.name for each in model.parameters if each.name in letters]
        yield {**_of_input(law.current), **_per_unit(model), "gains": gains, "element": law.current.thing}


def _of_input(quantity: Input) -> dict[str, Any]:
    return {"name": quantity.name, "glyph": quantity.glyph, "unit": quantity.unit, "meaning": quantity.meaning}


def _per_unit(model: Model) -> dict[str, Any]:
    """The limit of a current, if it has one, and the force per unit of it, against x_1."""
    limit = {"limit": str(model.constants[Q.u_max])} if model.declares(Q.u_max) else {}
    return limit | {"per_unit": str(model.constants[Q.gamma2])}


def _masses(model: Model) -> Iterator[dict[str, Any]]:
    """The elements that slip or are held."""
    work = energy.with_stop_loss(model, energy.ledger_record(model), "")
    for element, names in zip(elements.ELEMENTS, model.names, strict=True):
        if names is None:
            continue
        mass, forward, backward, _ = MASSES[element.name]
        levels = [forward, *([backward] if model.by_sign[element.number - 1] else [])]
        excess = EXCESSES[element.number - 1][: len(levels)]
        stops = {"lower": Q.x1_min, "upper": Q.x1_max} if element.position is not None else {}
        yield {
            "name": names.thing,
            "kind": "mass",
            "velocity": names.velocity,
            "fixed": False,
            "directions": list(names.directions),
            "friction": [str(model.constants[level]) for level in levels if model.declares(level)],
            "excess": [str(model.constants[level]) for level in excess if model.declares(level)],
            "stops": {end: str(model.constants[stop]) for end, stop in stops.items() if model.declares(stop)},
            "events": dict(_events(model, element)),
            "ledger": {
                entry.name: f"{names.thing}, {_label(model, entry.symbol)}"
                for entry in sorted(work.quantities, key=lambda each: [*MASS_OF, each.symbol].index(each.symbol))
                if MASS_OF.get(entry.symbol) == element.number - 1
            },
        }


def _label(model: Model, entry: sp.Symbol) -> str:
    """What a table calls an entry of the ledger that belongs to a mass: the elements whose work it is."""
    if entry == Q.STOP_LOSS.symbol:
        (stop,) = dict.fromkeys((*model.called(Q.x1_min), *model.called(Q.x1_max)))
        return "lost at stops" if stop == "stop" else f"lost at the {stop}"
    return " and ".join(model.called(LETTER_OF_ENTRY[entry]))


def _events(model: Model, element: elements.Element) -> Iterator[tuple[str, str]]:
    """The events of an element, with the words for each."""
    names = model.names[element.number - 1]
    if names is not None:
        events = elements.events_by_element(model)[element.number - 1]
        yield from ((event, f"{names.thing} {what.replace('_', ' ')}") for what, event in events.items())


def _others(model: Model) -> Iterator[dict[str, Any]]:
    """The elements that letters stand for beside the masses."""
    entries = {each.symbol: each.name for each in energy.ledger_record(model).quantities}
    kinds = {each.kind for each in model.listed}
    driven = " and ".join(model.called(Q.gamma2))
    ledgers = {
        "motor": {Q.motor_work: f"work of the {driven}"},
        "spring": {
            Q.offset_work: "work of the offset force k c",
            Q.spring_work: words.text(model, "the actuator's work on the body"),
        },
    }
    names = {"motor": model.input.thing if model.input else "", "spring": _spring(model)}
    for kind in ("motor", "spring", "gravity", "contact"):
        if kind in kinds or (kind == "motor" and model.input is not None):
            ledger = {entries[entry]: label for entry, label in ledgers.get(kind, {}).items() if entry in entries}
            yield {"name": names.get(kind, kind), "kind": kind, "ledger": ledger}


def _further(model: Model) -> Iterator[dict[str, Any]]:
    """The elements that no letter stands for."""
    things = [names.thing if names else "" for names in model.names]
    for force in model.further:
        ledger = {work.entry.name: f"{things[work.mass - 1]}, {force.name}" for work in energy.works_of(model, force)}
        yield {"name": force.name, "kind": "force", "meaning": force.meaning, "ledger": ledger}


def _contact(model: Model) -> dict[str, Any]:
    force, rest = (str(sp.expand(model.value(each))) for each in (model.stiffness * model.contact, model.rest))
    return {"coordinate": str(Q.y), "force": force, "rest": rest}


def _flight(model: Model) -> dict[str, Any]:
    return {"falls": str(model.value(model.fall)), "impact_loss": str(model.constants[Q.impact_loss])}
