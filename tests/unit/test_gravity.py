"""Gravity is potential energy of what it acts on, whichever coordinate a file declares first; its ledger closes."""

from itertools import combinations, permutations

import pytest
import sympy as sp

from derive.derivation import Derivation
from tests import needs
from tests.derived import model_of, solver_of

HEAD = """
m, n, k, d = (parameter(name, unit, name, "positive", 2.5) for name, unit in (
    ("m", "kg"), ("n", "kg"), ("k", "N/m"), ("d", "N s/m")))
"""
COORDINATES = {"a": 'a = coordinate("a", "m", m, "cage")\n', "b": 'b = coordinate("b", "m", n, "bucket")\n'}
BETWEEN = 'spring(a - b - 1, k, "rope").damper(d, "rope damping")\nfriction(b, 1, name="rail")\n'
PULLED = ["".join(each) for count in (1, 2) for each in combinations("ab", count)]
m, n, a, b, a_dot, b_dot = sp.symbols("m n a b a_dot b_dot")
WEIGHTS = {"a": sp.Rational(981, 100) * m * a, "b": sp.Rational(981, 100) * n * b}
ORDERS = [*permutations("ab")]


def text(order: tuple[str, ...], pulled: str) -> str:
    """A cage and a bucket on a rope, their coordinates declared in an order, gravity on some of them."""
    weights = "".join(f"gravity({each}, 9.81)\n" for each in order if each in pulled)
    return HEAD + "".join(COORDINATES[each] for each in order) + BETWEEN + weights


@pytest.mark.parametrize("pulled", PULLED)
@pytest.mark.parametrize("order", ORDERS, ids="".join)
def test_a_weight_is_energy_of_what_it_acts_on(order, pulled):
    found = Derivation(model_of(text(order, pulled)))
    total = found.energies["total"]
    still = total.subs({a_dot: 0, b_dot: 0})
    assert sp.expand(still - still.subs({m: 0, n: 0}) - sum(WEIGHTS[each] for each in pulled)) == 0
    assert not [name for name in found.energies if "gravity" in name]


@pytest.mark.parametrize("pulled", PULLED)
@pytest.mark.parametrize("order", ORDERS, ids="".join)
def test_the_energy_changes_by_the_powers_of_the_ledger(order, pulled):
    found = Derivation(model_of(text(order, pulled)))
    total, motion = found.energies["total"], found.equations_of_motion
    rates = {a: a_dot, b: b_dot}
    names = [own.velocity for own in found.model.names if own is not None]
    rates |= {sp.Symbol(name): motion[f"acc_{number}"] for number, name in enumerate(names, 1)}
    powers = sum(value for name, value in found.energies.items() if name.endswith("_power"))
    assert sp.simplify(sum(total.diff(each) * rate for each, rate in rates.items()) - powers) == 0


@needs.library
@pytest.mark.sliced
def test_a_motion_under_gravity_has_the_same_numbers_in_either_order(store):
    found = []
    for order in ORDERS:
        file = store / f"gravity_{''.join(order)}.py"
        file.write_text(f'"""A bucket on a rope."""\nfrom hopform.model import *\n{text(order, "ab")}', "utf-8")
        solver = solver_of(store, file)
        start = {"a": 1.2, "b": 0.1, "a_dot": 0.3, "b_dot": 0.0}
        motion = solver.solve_motion(solver.Robot(), start=start, horizon=0.7)
        gain = float(motion.total_energy(0.7) - motion.total_energy(0.0))
        works = [float(each) for own in motion.ledger_by_element(0.7).values() for each in own.values()]
        assert sum(works) == pytest.approx(gain, abs=1e-12)
        end = motion.end
        found.append([float(motion.total_energy(0.7)), *(float(getattr(end, name)) for name in start)])
    assert found[0] == pytest.approx(found[1], rel=1e-12)
