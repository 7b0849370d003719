"""LaTeX of the formulas of every model: each quantity has a glyph of its own, no glyph is a name, and all of it is set."""

import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import mpmath
import pytest
import sympy as sp

from derive.maths.formulas import Formula
from hopform.model import Derivation, derive
from tests import needs
from tests.derived import MODELS, SHIPPED

MODEL_FILES = {path.stem if folder == SHIPPED else f"tests/models/{path.name}": path
               for folder in (SHIPPED, MODELS) for path in sorted(folder.glob("[!_]*.py"))}  # fmt: skip
NAMES = sorted(MODEL_FILES, key=lambda name: (name != "hopper", name != "tests/models/door.py", name))
UPRIGHT = re.compile(r"\\(?:text|mathrm|mathcal)\{[^{}]*\}|\\[A-Za-z]+")
"""What sets letters upright, and commands."""
BESIDE = re.compile(r"[_^]\{[^{}]*\}")
"""An index or an exponent, in which letters stand together."""
INNERMOST_CASES = re.compile(r"\\begin\{cases\}((?:(?!\\begin\{cases\}).)*?)\\end\{cases\}")


@cache
def derivation_of(name: str) -> Derivation:
    return derive(name if SHIPPED in MODEL_FILES[name].parents else Path(MODEL_FILES[name]))


def all_formulas(found: Derivation) -> Iterator[Formula]:
    yield from found.formulas
    for mode in found.modes:
        yield from mode.formulas


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_each_quantity_has_a_glyph_of_its_own(name):
    """A coordinate over time is one quantity: NAME_t by W and NAME_split by partial fractions."""
    found, names = derivation_of(name), defaultdict[str, set[str]](set)
    for quantity in (*found.inputs.values(), *(each.quantity for each in all_formulas(found))):
        names[quantity.glyph].add(re.sub("_split$", "_t", quantity.name))
    assert {glyph: taken for glyph, taken in names.items() if len(taken) > 1} == {}
    glyphs = defaultdict[str, set[str]](set)
    for quantity in (*found.inputs.values(), *(each.quantity for each in all_formulas(found))):
        glyphs[quantity.name].add(quantity.glyph)
    assert {taken: of_name for taken, of_name in glyphs.items() if len(of_name) > 1} == {}


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_no_glyph_is_a_name(name):
    """Letters that stand together would be read as a product."""
    found = derivation_of(name)
    for quantity in (*found.inputs.values(), *(each.quantity for each in all_formulas(found))):
        letters = UPRIGHT.sub(" ", quantity.glyph)
        while (fewer := BESIDE.sub("", letters)) != letters:
            letters = fewer
        assert not re.search(r"[A-Za-z]{2}|[A-Za-z]\d|_[A-Za-z0-9]{2}", letters), (quantity.name, quantity.glyph)


def set_in_pieces(latex: str) -> Iterator[str]:
    """A formula without cases, of which a setter of one line knows nothing, and what stands in these."""
    while match := INNERMOST_CASES.search(latex):
        for row in match[1].split(r"\\"):
            yield from row.split("&")
        latex = f"{latex[: match.start()]}X{latex[match.end() :]}"
    yield latex


@cache
def is_set(piece: str) -> None:
    """Once for all models, most formulas of which are alike."""
    mathtext = pytest.importorskip("matplotlib.mathtext")
    mathtext.MathTextParser("path").parse(f"${piece}$")


@pytest.mark.parametrize("name", needs.the_first([*NAMES[1:], NAMES[0]]))
def test_all_latex_is_set(name):
    found = derivation_of(name)
    whole = (line for line in found.show("states", "latex", whole=True).splitlines() if not line.startswith("%"))
    for latex in (*(found.latex(each.name) for each in found.formulas), *whole):
        for piece in set_in_pieces(latex):
            if piece.strip():
                is_set(piece.strip())


def test_18_is_the_sum_of_its_partial_fractions():
    """As the paper prints it, and equal to the form by W."""
    found = derivation_of("hopper")
    assert r"x_2(t) = A + B t + C e^{-at} + D \dot{R} + E_R R" in found.show("18", "latex").splitlines()
    assert found.formula("x2_split").numbers == (18,) and found.formula("x1_split").numbers == (20,)


@pytest.mark.parametrize("name", needs.the_first(["hopper", "cart", "joint", "sea", "tests/models/door.py"], 1))
def test_a_sum_of_partial_fractions_is_the_state_over_time(name):
    found = derivation_of(name)
    values = {key: sp.Rational(n + 7, 2 * n + 9) for n, key in enumerate(found.inputs)}
    with mpmath.workdps(40):
        for each in (each for each in found.formulas if each.name.endswith("_split")):
            other = found.value(each.name.replace("_split", "_t"), values, 30)
            assert abs(found.value(each.name, values, 30) - other) < sp.Rational(1, 10**27) * abs(other)
    free = {"hopper": 2, "cart": 1, "joint": 1, "sea": 2, "tests/models/door.py": 1}
    assert sum(each.name.endswith("_split") for each in found.formulas) == free[name]


# ---- whole formulas ----


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_a_whole_formula_is_in_what_one_gives_and_in_what_stands_before_it(name):
    found = derivation_of(name)
    for each in found.formulas:
        known = set(found.inputs)
        for step, value in found.full(each.name).items():
            assert {symbol.name for symbol in value.free_symbols} <= known, (each.name, step)
            known.add(step)
        assert step == each.name


def test_a_whole_formula_has_the_value_of_the_formula():
    found = derivation_of("hopper")
    values = {key: sp.Rational(n + 7, 2 * n + 9) for n, key in enumerate(found.inputs)}
    for name in ("x2_t", "H2_2", "viscous_2_work"):
        known = dict(values)
        for step, value in found.full(name).items():
            known[step] = sp.N(value.xreplace({each: known[each.name] for each in value.free_symbols}), 60)
        assert abs(known[name] - found.value(name, values, 30)) < sp.Rational(1, 10**28) * abs(known[name])
