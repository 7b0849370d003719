"""The formulas of every model as they are shown: no form has a number that is none.

What each form computes is compared with 40 digits in tests/conformance/test_pasted_formulas.py, and 40 digits with the
solver in tests/unit/test_proofs.py, at parameters that are 0 as well.
"""

import re
from functools import cache

import pytest
import sympy as sp

from derive.emit.forms import FORMS
from derive.page import page
from hopform.model import Derivation, derive
from tests.derived import SHIPPED, model_of
from tests.needs import the_first

THAT_SHIP = sorted(path.stem for path in SHIPPED.glob("[!_]*.py"))
ONE = 'm = parameter("m", "kg", "mass", "positive")\nx = coordinate("x", "m", m)\nforce(x, 4)\n'
TWO = f'{ONE}z = coordinate("z", "m", 3*m)\nleg = spring(x - z, 50)\n'
DAMPED = 'd = parameter("d", "N s/m", "damping", "nonnegative", 0)\n'
AT_ZERO = {
    "an integrator": f"{ONE}{DAMPED}viscous(x, d)\n",
    "two integrators": f"{ONE}friction(x, 2)\n",
    "two masses without a damper": TWO,
    "two masses with a damper between them": f"{TWO}{DAMPED}leg.damper(d)\n",
}
"""Models whose denominator has a root at 0 whatever the robot."""
NO_NUMBER = re.compile(
    r"zoo|\bnan\b|\boo\b|\binf(inity)?\b|\\infty|\\text\{NaN\}|HUGE_VAL|ComplexInfinity", re.IGNORECASE
)


@cache
def derivation_of(name: str) -> Derivation:
    if name in AT_ZERO:
        return Derivation(model_of(AT_ZERO[name]))
    return derive(name)


# ---- every form ----


def states_of(found: Derivation) -> set[str]:
    """The names of the formulas of the state over time, beside the parameters of the model."""
    parameters = {each.name for each in found.model.parameters}
    members = [f"{member}_t" for own in found.model.names if own for member in (own.coordinate, own.velocity)]
    return {f"{member}_" if member in parameters else member for member in members}


@pytest.mark.parametrize("name", the_first([*AT_ZERO, *THAT_SHIP], 2))
def test_no_formula_has_a_number_that_is_none(name):
    found = derivation_of(name)
    for formulas in (found.formulas, *(each.formulas for each in found.modes)):
        for each in formulas:
            assert not each.value.has(sp.zoo, sp.nan, sp.oo, -sp.oo), each
            assert not each.in_code.has(sp.zoo, sp.nan, sp.oo, -sp.oo), each
    assert states_of(found) <= {each.name for each in found.found("states")}


@pytest.mark.parametrize(
    "name", the_first(["servo", "two integrators", *(each for each in THAT_SHIP if each != "servo")], 2)
)
def test_no_form_shows_a_number_that_is_none(name):
    found = derivation_of(name)
    for form in FORMS:
        assert (wrong := NO_NUMBER.search(found.show(form=form))) is None, (form, wrong)
    blocks = "".join(re.findall(r"```math\n(.*?)\n```", page(found), re.DOTALL))
    assert blocks and NO_NUMBER.search(blocks) is None
