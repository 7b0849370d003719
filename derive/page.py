"""EQUATIONS.md of a model: its derivation, modes, guards, energies and conditions, made from its file."""

import re
from collections.abc import Iterable, Iterator

import sympy as sp

from . import VERSION
from .derivation import Derivation
from .emit.facts import abilities, facts
from .emit.texts import cell, math_on_page
from .ir import Quantity
from .maths.formulas import GROUPS, Formula
from .mode import Mode
from .model.equations import Model

INTRODUCTION = (
    "Derived from `{file}` by hopform {version}; `hopform model prove {file}` compares the formulas with the elements of "
    "that file. Units are SI. {coordinates}"
)
STATE = (
    " A (0) behind a coordinate or velocity means the start of a phase, in which the sign of each friction and {constant} "
    "constant."
)
OF_THE_PAPER = "Numbers in brackets are those of the paper's equations."
NOTES = {
    "works": "The library's C computes these integrals by quadrature: Gauss's rule over a time of at most 4/(s_1 + "
    "sqrt(s_2)), whose remainder is at most 5e-17 (single precision: 5e-9) of the products of two modes, and doubling "
    "of that time.",
}
"""What a page says of a group of formulas."""
GUARDS = {
    "takeoff": "the contact force falls to 0",
    "reverses": "its velocity is 0, and its free acceleration exceeds the friction at rest",
    "sticks": "its velocity is 0, and friction holds it",
    "slips": "its stick margin falls to 0",
    "hits_stop": "it meets a stop and loses its velocity",
}
"""When an event happens, by the last words of its name."""


def page(derivation: Derivation, file: str = "model.py") -> str:
    """The page as Markdown, with LaTeX that GitHub renders, of a model that stands in a file."""
    return re.sub("\n{3,}", "\n\n", "\n".join(_lines(derivation, file)).rstrip() + "\n")


def _lines(derivation: Derivation, file: str) -> Iterator[str]:
    model, known = derivation.model, facts(derivation.model, "", {})
    constant = "the input are" if model.input is not None else "each stop are"
    yield from (f"# {cell(model.title.rstrip('.'))}", "")
    yield INTRODUCTION.format(file=file, version=VERSION, coordinates=_coordinates(model)) + STATE.format(
        constant=constant
    )
    yield from (OF_THE_PAPER, "") if model.is_of_the_paper else ("",)
    yield from abilities(known)
    yield from ("", "## Parameters", "", *_parameters(derivation.model.robot.quantities))
    for group, heading in GROUPS.items():
        members = [each for each in derivation.formulas if each.group == group]
        if members:
            note = (NOTES[group], "") if group in NOTES else ()
            yield from ("", f"## {heading}", "", *note, *_formulas(derivation, members))
    yield from ("", "## Modes", "", *_modes(derivation))
    yield from ("", "## Events", "", *_events(derivation, known["elements"]))
    yield from ("", "## Conditions", "", *_conditions(derivation.modes))


def _coordinates(model: Model) -> str:
    """What the glyphs of the coordinates are, and which index other quantities of each have."""
    listed = (
        f"${math_on_page(named.glyph)}$ is `{named.coordinate}` of the {cell(named.thing)} (index {n})"
        for n, named in enumerate(model.names, 1)
        if named is not None
    )
    return f"{', '.join(listed)}; the index of a quantity says whose it is."


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


def _modes(derivation: Derivation) -> Iterator[str]:
    yield from (
        "| held | slips | order | denominator | held while its margins are >= 0 |", "| --- | --- | --: | --- | --- |"
    )  # fmt: skip
    for each in derivation.modes:
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
            of = {"reverses": "velocity", "sticks": "velocity", "slips": "stick_margin", "hits_stop": "stop"}[what]
            names = [f"`{each}`" for each in functions if each.startswith(coordinate) and of in each]
            yield f"| `{event}` | {GUARDS[what]} | {', '.join(names)} |"


def _conditions(modes: Iterable[Mode]) -> Iterator[str]:
    """What parameters must obey, by the mode that asks for it."""
    asked = [(each, name, value) for each in modes for name, value in each.conditions.items()]
    if not asked:
        yield "No motion of a mode grows, whatever the parameters in their domains (Routh)."
        return
    yield "A robot that violates one of these is refused: a motion of the mode would grow (Routh)."
    yield from ("", "| held | condition |", "| --- | --- |")
    for each, name, value in asked:
        yield f"| {cell(', '.join(each.held)) or 'nothing'} | `{name}` = `{value}` >= 0 |"
