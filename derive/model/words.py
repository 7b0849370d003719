"""What a model calls what the derivation has a word, a glyph or a number of the paper for.

The derivation is written in the words of the paper's hopper: an actuator, a body on a leg, a compression, a current. The
words of a model are those that its file declares. Texts of formulas, records, functions and facts are put into them here
and nowhere else; a model of the paper's equations keeps the numbers of these.
"""

import re
from collections.abc import Iterator
from dataclasses import replace

from ..ir import Quantity
from . import quantities as Q
from .equations import MASSES, Input, Model

EQUATIONS = (
    ((1, 2, 3, 4), "equation of motion", "equations of motion"),
    ((5,), "friction at rest", "friction at rest"),
    ((6, 7, 11, 16, 17), "transform", "transforms"),
    ((8, 9, 10), "constant", "constants"),
    ((12, 13, 14, 15), "numerator", "numerators"),
    ((18, 19, 20, 21), "state over time", "states over time"),
    ((22, 23), "energy", "energies"),
    ((24,), "work", "work"),
    ((25, 26, 27), "control", "control"),
)
"""What the equations of the paper are, by their numbers: one of them, several."""
_NUMBER = r"\(([1-9]|1\d|2[0-7])\)"
_NUMBERS = re.compile(rf"(?<!\w){_NUMBER}(?:(?:, | and |-){_NUMBER})*")


def text(model: Model, of_hopper: str) -> str:
    """A text about the hopper in the words of a model."""
    phrases = dict(_phrases(model))
    longest_first = "|".join(map(re.escape, sorted(phrases, key=len, reverse=True)))
    worded = re.sub(rf"(?<![\w\\])(?:{longest_first})(?!\w)", lambda match: phrases[match[0]], of_hopper)
    return worded if model.is_of_the_paper else _NUMBERS.sub(_in_words, worded)


def _in_words(numbers: re.Match[str]) -> str:
    """What the equations of some numbers are; at the start of a text, what it says of them stands behind a colon."""
    (word,) = (several if numbers[2] else one for those, one, several in EQUATIONS if int(numbers[1]) in those)
    if numbers.start() > 0:
        return f"the {word}"
    behind = numbers.string[numbers.end() :]
    return f"{word}:" if re.match(r" \w", behind) else word


def _phrases(model: Model) -> Iterator[tuple[str, str]]:
    """Each phrase about the hopper that a model has another one for, and that."""
    for number, (named, thing) in enumerate(zip(model.names, MASSES, strict=True), 1):
        if named is None:
            yield from (
                (thing, f"mass {number}"),
                (f"the {thing}", f"mass {number}"),
                (f"The {thing}", f"Mass {number}"),
            )
            yield from ((f"x_{number}", "0"), (f"v_{number}", "0"))
            continue
        yield thing, named.thing
        for letter, name in (("x", named.coordinate), ("v", named.velocity)):
            if name != f"{letter}{number}":
                yield from ((f"{letter}_{number}", name), (f"{letter}{number}", name))
    driven = model.driven_by
    if driven is not None:
        yield from (("u", driven.name), ("motor", driven.thing))
    yield from (("current", noun(driven)), ("currents", f"{noun(driven)}s"))
    if not model.has_contact:
        yield from _without_contact(model)


def _without_contact(model: Model) -> Iterator[tuple[str, str]]:
    """What stands on no leg, and is not as high as a body."""
    second, springs = model.names[1], model.called(Q.k)
    thing = "mass 2" if second is None else f"the {second.thing}"
    yield from (("height of the body", f"displacement of {thing}"), ("the body's height", f"{thing}'s displacement"))
    for height in ("height of the body over the ground under the foot", "hop height of the body"):
        yield height, f"displacement of {thing}"
    yield "Height of the body over the ground under the foot", f"Displacement of {thing}"
    for deflection in ("compression", "compression of the leg", "spring deflection"):
        yield deflection, stretch(model)
    if springs:
        yield "leg", springs[0]
    else:
        yield from (("leg", "spring"), ("spring deflection, from its free length", stretch(model)))
        yield "spring deflection at t = 0, from its free length", f"{stretch(model)} at t = 0"
    yield from (("The hopper", "The mechanism"), ("the hopper", "the mechanism"))
    yield from (("stance", "motion"), ("stances", "motions"))
    yield from (
        ("since touchdown", "since the start"),
        ("at touchdown", "at the start"),
        ("of the take-off", "of the ending"),
    )
    yield "no take-off, an event", "an event"


def noun(driven: Input | None) -> str:
    """What an input is in a word: what its file says of it, if that is one."""
    return driven.meaning if driven is not None and driven.meaning.isalpha() else "input"


def stretch(model: Model) -> str:
    """What y of a model without a contact is: how far its spring is stretched, or where there is none how far what moves
    has moved.
    """
    if springs := model.called(Q.k):
        return f"stretch of the {springs[0]}"
    return f"displacement of the {next(own.thing for own in model.names if own is not None)}"


# ---- glyphs ----

_GLYPH = re.compile(
    r"\\(?P<dots>d?dot)\{x\}_(?P<rate>[12])|(?<![A-Za-z\\{])X_(?P<transform>[12])|(?<![A-Za-z\\])x_(?P<place>[12])"
    r"|(?<![A-Za-z\\])(?P<u>u)(?![A-Za-z])"
)


def glyph(model: Model, of_hopper: str) -> str:
    r"""LaTeX in the paper's glyphs of coordinates, velocities, transforms and input in those of a model. A letter of the
    derivation that is a glyph of the model's, too, has a tilde: \tilde{q} of a joint with the coordinate q.
    """

    def replaced(match: re.Match[str]) -> str:
        if match["u"]:
            return match[0] if model.driven_by is None else model.driven_by.glyph
        named = model.names[int(match["rate"] or match["transform"] or match["place"]) - 1]
        if named is None:
            return match[0]
        if match["rate"]:
            return over(named.glyph, match["dots"])
        return re.sub("^x(?=_|$)", "X", named.glyph) if match["transform"] else named.glyph

    spelled, end = "", 0
    for match in _GLYPH.finditer(of_hopper):
        spelled += _apart(model, of_hopper[end : match.start()]) + replaced(match)
        end = match.end()
    return spelled + _apart(model, of_hopper[end:])


def _apart(model: Model, latex: str) -> str:
    theirs = {parameter.glyph for parameter in model.parameters}
    theirs |= {named.glyph for named in model.names if named is not None}
    theirs |= {driven.glyph for driven in (model.input, model.driven_by) if driven is not None}
    for letter in sorted(theirs - {Q.TIME.glyph}, key=len, reverse=True):  # time is tau where t is taken
        if letter in latex:
            alone = rf"(?<![A-Za-z\\])(?<!\\hat{{)(?<!\\mathcal{{){re.escape(letter)}(?![A-Za-z0-9_{{])"
            told_apart = over(letter, "tilde").replace("\\", r"\\")
            latex = re.sub(alone, told_apart, latex)
    return latex


def over(latex: str, accent: str) -> str:
    r"""A glyph with an accent over it, but for its index.

    >>> over("x_1", "dot"), over(r"\theta_{m}", "ddot")
    ('\\dot{x}_1', '\\ddot{\\theta}_{m}')
    """
    head, mark, index = latex.partition("_")
    return rf"\{accent}{{{latex}}}" if head.count("{") != head.count("}") else rf"\{accent}{{{head}}}{mark}{index}"


# ---- quantities ----


def of_quantity(model: Model, quantity: Quantity) -> Quantity:
    """A quantity of the derivation with the glyph, the unit and the meaning that it has in a model; its name stays."""
    meaning = text(model, quantity.meaning)
    if quantity.symbol == Q.u and model.driven_by is not None:
        meaning = model.driven_by.meaning
    for number, (named, thing) in enumerate(zip(model.names, MASSES, strict=True), 1):
        if named is None and re.search(rf"\b{thing}\b", quantity.meaning):
            meaning = f"0: the model has no mass {number}"
    return replace(
        quantity, glyph=glyph(model, quantity.glyph), unit=model.unit(quantity.unit, quantity.name), meaning=meaning
    )
