"""EQUATIONS.md of a model: its derivation, held sets, guards, energies and conditions, made from its file."""

import re
from collections.abc import Iterable, Iterator

import sympy as sp

from . import VERSION
from .derivation import Derivation, HeldSet
from .emit.facts import facts
from .emit.texts import cell, math_on_page
from .ir import Quantity
from .maths.formulas import GROUPS, Formula
from .model.equations import Model

INTRODUCTION = """\
Derived from `{file}` by hopform {version}. Units are SI and A. {coordinates}; $x_i(0)$,
$\\dot{{x}}_i(0)$ are a state at the start of a phase, in which friction and current are constant. Numbers in brackets are those of the paper's hopper, of which each formula is the counterpart here.
"""
GUARDS = {
    "takeoff": "the contact force falls to 0",
    "reverses": "its velocity is 0, and its acceleration without friction is beyond the friction at rest",
    "sticks": "its velocity is 0, and friction holds it",
    "slips": "what friction has left to hold it falls to 0",
    "hits_stop": "it meets a stop and loses its velocity",
}
"""When an event happens, by the last words of its name."""


def page(derivation: Derivation, file: str = "model.py") -> str:
    """The page as Markdown, with LaTeX that GitHub renders, of a model that stands in a file."""
    return re.sub("\n{3,}", "\n\n", "\n".join(_lines(derivation, file)).rstrip() + "\n")


def _lines(derivation: Derivation, file: str) -> Iterator[str]:
    known = facts(derivation.model, "", {})
    yield from (
        f"# {cell(derivation.model.title.rstrip('.'))}",
        "",
        INTRODUCTION.format(file=file, version=VERSION, coordinates=_coordinates(derivation.model)),
    )
    yield f"The model can: {', '.join(known['can'])}."
    if known["lacks"]:
        yield from ("", "| it cannot | because it lacks |", "| --- | --- |")
        yield from (f"| {act} | {why} |" for act, why in known["lacks"].items())
    yield from ("", "## Parameters", "", *_parameters(derivation.model.robot.quantities))
    for group, heading in GROUPS.items():
        members = [each for each in derivation.formulas if each.group == group]
        if members:
            yield from ("", f"## {heading}", "", *_formulas(derivation, members))
    yield from ("", "## Held sets", "", *_held_sets(derivation))
    yield from ("", "## Events", "", *_events(derivation, known["elements"]))
    yield from ("", "## Conditions", "", *_conditions(derivation.held_sets))


def _coordinates(model: Model) -> str:
    """What is called x_1 and x_2."""
    both = zip(("x_1", "x_2"), model.names, strict=True)
    return ", ".join(f"${x}$ is `{own.coordinate}` of the {cell(own.thing)}" for x, own in both if own is not None)


def _parameters(quantities: Iterable[Quantity]) -> Iterator[str]:
    yield from ("| parameter | glyph | unit | allowed | default | meaning |", "| --- | --- | --- | --- | --- | --- |")
    for each in quantities:
        default = "" if each.default is None else each.default
        domain = each.interval.allowed
        yield f"| `{each.name}` | ${math_on_page(each.glyph)}$ | {cell(each.unit)} | {domain} | {default} | {cell(each.meaning)} |"


def _formulas(derivation: Derivation, members: Iterable[Formula]) -> Iterator[str]:
    for each in members:
        numbers = f" {', '.join(f'({number})' for number in each.numbers)}" if each.numbers else ""
        said = cell(f"{each.quantity.meaning} [{each.quantity.unit}]")
        yield from (f"`{each.name}`{numbers} {said}", "", "```math", derivation.latex(each.name), "```", "")


def _held_sets(derivation: Derivation) -> Iterator[str]:
    yield from (
        "| held | slips | order | denominator | held while >= 0 |", "| --- | --- | --: | --- | --- |"
    )  # fmt: skip
    for each in derivation.held_sets:
        denominator = _polynomial(each.denominator, derivation.glyphs)
        held, slips = (", ".join(names) or "nothing" for names in (each.held, each.slipping))
        yield f"| {cell(held)} | {cell(slips)} | {each.order} | ${math_on_page(denominator)}$ | {', '.join(f'`{n}`' for n in each.held_while)} |"


def _polynomial(polynomial: sp.Poly, glyphs: dict[sp.Symbol, str]) -> str:
    """A polynomial in s as LaTeX, its highest power first."""
    terms = []
    for power, coefficient in zip(range(polynomial.degree(), -1, -1), polynomial.all_coeffs(), strict=True):
        factor = "" if coefficient == 1 and power else sp.latex(sp.expand(coefficient), symbol_names=glyphs)
        factor = rf"\left({factor}\right)" if power and sp.expand(coefficient).is_Add else factor
        terms.append(f"{factor}{f' s^{power}' if power > 1 else ' s' if power else ''}".strip())
    return " + ".join(terms)


def _events(derivation: Derivation, elements: Iterable[dict[str, object]]) -> Iterator[str]:
    yield from ("| event | when | function |", "| --- | --- | --- |")
    functions = list(derivation.event_functions)
    if "contact_force" in functions:
        yield f"| `takeoff` | {GUARDS['takeoff']}, the leg extending | `contact_force` |"
    for element in elements:
        events: object = element.get("events", {})
        for event in events if isinstance(events, dict) else ():
            what = next(each for each in GUARDS if str(event).endswith(f"_{each}"))
            coordinate = str(event).removesuffix(f"_{what}")
            of = {"reverses": "velocity", "sticks": "velocity", "slips": "holds", "hits_stop": "stop"}[what]
            names = [f"`{each}`" for each in functions if each.startswith(coordinate) and of in each]
            yield f"| `{event}` | {GUARDS[what]} | {', '.join(names)} |"


def _conditions(held_sets: Iterable[HeldSet]) -> Iterator[str]:
    """What parameters must obey, by the held set that asks for it."""
    asked = [(each, name, value) for each in held_sets for name, value in each.conditions.items()]
    if not asked:
        yield "No motion of a held set grows, whatever the parameters in their domains (Routh)."
        return
    yield "A robot that violates one of these is refused: a motion of the held set would grow (Routh)."
    yield from ("", "| held | condition |", "| --- | --- |")
    for each, name, value in asked:
        yield f"| {cell(', '.join(each.held)) or 'nothing'} | `{name}` = `{value}` >= 0 |"
