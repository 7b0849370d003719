"""Routh's conditions: which of them are asked for, that they mean what the poles say,
and that no legal robot is refused.

tests/models/feedforward.py has a damping of either sign: with k_fed > b1 the actuator runs away.
"""

import ctypes
import dataclasses
import importlib
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from derive.emit.folder import GENERATED
from derive.ir import Parameter, unfold
from derive.maths import flight, laplace
from derive.maths.stability import open_conditions
from derive.model import kinds
from derive.model import quantities as Q
from derive.model.equations import Force
from derive.model_file import read_model
from derive.shipped import HOPPER
from hopform import HopformError
from hopform._solver import c as native
from hopform._solver.c import C
from tests.derived import Derived, derived, hopper_with, model_file

UNSTABLE = next(word.number for word in kinds.STATUSES.words if word.text == "error_unstable")
D = Parameter("d", "d", "N s/m", "damping of either sign")
FED = hopper_with('viscous(h.x1, -parameter("d", "N s/m", "damping of either sign"), "fed")')
LINKED = dataclasses.replace(
    HOPPER,
    parameters=(*HOPPER.parameters, D),
    further=(Force("linked", D.symbol * (Q.v1 - Q.v2), D.symbol * (Q.v2 - Q.v1)),),
)
"""What a file is refused: a damper between the masses that may drive them."""


# ---- the conditions ----


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (HOPPER, ()),
        (read_model(model_file("back_emf")), ()),
        (read_model(model_file("further_forces")), ()),
        (FED, ("p_1",)),
        (LINKED, ("p_1", "p_2", "s_2", "s_1 s_2 - s_3")),
    ],
    ids=["hopper", "back-EMF", "further forces", "fed", "linked"],
)
def test_only_conditions_that_a_robot_may_violate_are_asked_for(model, names):
    assert tuple(condition.name for condition in open_conditions(model)) == names


def drawn(count: int, seed: int) -> np.ndarray:
    """Robots over many orders of magnitude, with d around what b1 and b2 make up for:
    rows of m_eff, m_s, k, b1, b2, d.
    """
    draw = np.random.default_rng(seed)
    m_eff, m_s, k = 10.0 ** draw.uniform([[-1.0], [-1.0], [1.0]], [[2.0], [1.0], [4.0]], (3, count))
    slow = np.sqrt(k * np.minimum(m_eff, m_s))
    b1, b2 = slow * 10.0 ** draw.uniform(-2.0, 1.0, (2, count)) * (draw.random((2, count)) > 0.2)
    return np.array([m_eff, m_s, k, b1, b2, draw.uniform(-1.0, 1.5, count) * (b1 + b2 * (draw.random(count) > 0.5))])


SYMBOLS = (Q.m_eff, Q.m_s, Q.k, Q.b1, Q.b2, D.symbol)


def numbers(expression: sp.Expr, robots: np.ndarray) -> np.ndarray:
    value = sp.lambdify(SYMBOLS, expression, "numpy")(*robots)
    return np.broadcast_to(np.asarray(value, dtype=float), robots.shape[1])


def growth(matrix: sp.Matrix, robots: np.ndarray) -> np.ndarray:
    """The largest real part of the eigenvalues over the largest absolute value of one."""
    entries = np.array([[numbers(entry, robots) for entry in row] for row in matrix.tolist()])
    values = np.linalg.eigvals(np.moveaxis(entries, -1, 0))
    return values.real.max(axis=1) / np.abs(values).max(axis=1)


@pytest.mark.parametrize("model", [FED, LINKED], ids=["fed", "linked"])
def test_the_open_conditions_hold_where_no_eigenvalue_has_a_positive_real_part(model):
    """In each mode, over 20 000 robots; where the sign is within rounding of 0 there is nothing to compare."""
    robots = drawn(20_000, 5)
    rates = laplace.rates_of(model)
    held = [[0, 1, 2], [0, 1], [0, 2]]
    modes = [
        laplace.matrix_of(model).extract(rows, rows).applyfunc(lambda entry: unfold(entry, rates)) for rows in held
    ]
    largest = np.max([growth(matrix, robots) for matrix in modes], axis=0)
    least = np.min([numbers(unfold(each.value, rates), robots) for each in open_conditions(model)], axis=0)
    clear = np.abs(largest) > 1e-6
    np.testing.assert_array_equal(least[clear] < 0.0, largest[clear] > 0.0)
    assert min(np.sum(largest[clear] > 0.0), np.sum(largest[clear] < 0.0)) > 4000


def test_the_conditions_of_linked_masses_do_not_follow_from_one_another():
    """Each refuses some robot that the others let pass, but for s_2 >= 0:
    where s_1 > 0, s_3 >= 0 that follows from the last.
    """
    robots, rates, asked = drawn(20_000, 6), laplace.rates_of(LINKED), open_conditions(LINKED)
    violated = np.array([numbers(unfold(each.value, rates), robots) < 0.0 for each in asked])
    alone = violated & (violated.sum(axis=0) == 1)
    names = {each.name for each, some in zip(asked, alone.any(axis=1), strict=True) if some}
    assert names == {"p_1", "p_2", "s_1 s_2 - s_3"}


def test_the_flight_is_stable_where_the_actuator_alone_is():
    """Its own pole is p_1, and gains are not negative."""
    rates = {step.symbol: step.value for step in flight.flight_rates_of(FED)}
    p_1 = unfold(Q.p_1, laplace.rates_of(FED))
    assert sp.expand(rates[flight.p_free] - p_1) == 0
    assert sp.expand(rates[flight.p_law] - p_1 - flight.Kd / Q.m_eff) == 0
    assert sp.expand(rates[flight.q_law] - flight.Kp / Q.m_eff) == 0


# ---- what is generated ----


@pytest.fixture(scope="module")
def fed(store: Path) -> Derived:
    return derived(store, "feedforward", "fed")


@pytest.fixture(scope="module")
def package(fed: Derived) -> Any:
    return fed.package


@pytest.fixture(scope="module")
def library(fed: Derived) -> native.Library:
    return fed.library


def status_of(library: native.Library, dtype: Any, parameters: Any) -> tuple[int, bool]:
    """What plan_init of the library answers, and whether the plan is made."""
    types = library.types(np.dtype(dtype))
    plan = types.Plan(made=1)
    function = library.function("plan_init", types)
    status = function(ctypes.byref(plan), ctypes.byref(types.Robot(*parameters)))
    return status, plan.made != 0


def arrays(robot: Any, dtype: Any) -> Any:
    """The fields of one robot as arrays, as the NumPy package takes them."""
    return type(robot)(*(np.array([each], dtype) for each in robot))


REFUSED = r"the actuator moving alone: Routh's condition p_1 >= 0 is violated, p_1 = -\d"
BY_DTYPE = pytest.mark.parametrize("dtype", [np.float32, np.float64])


@BY_DTYPE
def test_a_robot_that_runs_away_is_refused_by_the_condition(package, library, hopper_c, dtype):
    """By the least that negative damping can be; a robot without any damping is legal."""
    b1 = dtype(hopper_c.b1)
    state, records = package.LegState(0.0, 0.01, -1.9, 0.0), importlib.import_module("fed_solver.records")

    def fly(robot, start):
        return C(library).solve_flight(tuple(robot), start, 0.0, None, 2.0, 64, np.dtype(dtype)).flight

    for d, legal in ((b1, True), (np.nextafter(b1, dtype(1e9)), False), (dtype(400.0), False)):
        robot = package.Robot(*hopper_c.parameters, float(d))
        start = state._replace(v2=1.9)
        if legal:
            assert status_of(library, dtype, robot) == (0, True)
            assert package.solve(robot, {"v1": 0.01, "v2": -1.9}, 1.0).status in records.ENDINGS.values()
            assert fly(robot, start).ending in records.FLIGHT_ENDINGS
            continue
        assert status_of(library, dtype, robot) == (UNSTABLE, False)
        with pytest.raises(ValueError, match=REFUSED):
            package.solve(robot, {"v1": 0.01, "v2": -1.9}, 1.0)
        with pytest.raises(HopformError, match="Routh's conditions p_i"):
            fly(robot, start)
        with pytest.raises(HopformError, match="Routh's conditions p_i"):
            C(library).solve_stance(tuple(robot), state, ((0.0, 1.0),), 2.0, 64, np.dtype(dtype))


def test_the_hopper_of_the_paper_is_asked_nothing(fed):
    """The domains of its parameters prove all of the conditions."""
    for folder, asked in ((GENERATED, False), (fed.folder, True)):
        facts = (folder / "c" / "src" / "facts.h").read_text("utf-8")
        (asks,) = re.findall(r"^#define HOPFORM_STABILITY\(X\)(.*)$", facts, re.MULTILINE)
        assert bool(asks) == asked


@BY_DTYPE
def test_no_legal_robot_is_refused(package, library, dtype):
    """A hundred thousand over nearly all exponents of the type, without friction, with the least,
    and with d up to b1.
    """
    count, draw, info = 100_000, np.random.default_rng(11), np.finfo(dtype)
    largest = int(info.maxexp * 0.3)
    m_eff, m_s, k, b1, b2 = 2.0 ** draw.integers(-largest, largest, (5, count)) * (1.0 + draw.random((5, count)))
    least = float(info.smallest_subnormal)
    kind = draw.integers(0, 6, (2, count))
    b1, b2 = (np.choose(which, [b, b, b, b, 0.0 * b, least]) for which, b in zip(kind, (b1, b2), strict=True))
    m_eff, m_s, k, b1, b2 = (value.astype(dtype) for value in (m_eff, m_s, k, b1, b2))
    share = draw.choice([0.0, 1.0, -1.0, 0.5, 1.0 - info.epsneg], count).astype(dtype)
    d = (b1 * share).astype(dtype)
    assert (d <= b1).all()
    zero = np.zeros(count, dtype)
    order = {"m_eff": m_eff, "m_s": m_s, "k": k, "b1": b1, "b2": b2, "k_fed": d}
    robots = package.Robot(*(order.get(name, zero) for name in package.Robot._fields))
    formulas, stability = (importlib.import_module(f"fed_solver.{name}") for name in ("formulas", "stability"))
    with np.errstate(all="ignore"):
        values = [np.asarray(value) for _, value, _ in stability.conditions(formulas.rates_of(robots))]
    assert values and not any((value < 0.0).any() for value in values)
    types = library.types(np.dtype(dtype))
    rows = np.array(robots).T.copy()
    plan, function = types.Plan(), library.function("plan_init", types)
    width = rows.strides[0]
    statuses = np.array(
        [function(ctypes.byref(plan), ctypes.c_void_p(rows.ctypes.data + n * width)) for n in range(count)]
    )
    assert set(statuses) <= {0, 4, -8}  # 4: too stiff for the type, -8: the numbers left its range
    assert np.sum(statuses == 0) > count // 2
    assert np.sum((d == b1) & (b1 > 0) & (statuses == 0)) > count // 20
