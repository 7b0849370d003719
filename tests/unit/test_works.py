"""The work of each force over a phase, (24) in closed form, with 40 digits: against quadrature and the engine. Robots are
random, stiff, and those at which poles meet, or sums of poles vanish.
"""

import math
import random
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp
from mpmath.calculus.quadrature import GaussLegendre

import hopform
from derive.emit.forms import IN_CODE
from derive.maths.kernels import nodes
from derive.model.precisions import F32, F64
from derive.page import page
from derive.paper.register import REGISTER
from hopform.model import Derivation, derive
from tests import needs
from tests.derived import MODELS, SHIPPED, solver_of

DIGITS = 40
mp = mpmath.mp
FILES = {name: name for name in ("hopper", "joint", "sea")} | {"tendon": MODELS / "tendon.py"}
BASE = {
    "hopper": {
        "m_eff": 25, "m_s": 3, "k": 1200, "L0": 0.4, "c": 0.003, "b1": 150, "b2": 5, "f1": 0.78, "f2": 0.6,
        "gamma2": -65, "g": 9.81, "u": 2.5, "x1_0": 0.004, "v1_0": 0.3, "x2_0": 0.39, "v2_0": -1.93,
    },
    "joint": {
        "J": 0.031, "k": 3, "q_0": 0.1, "b": 0.0085, "F_p": 0.042, "F_m": 0.03, "k_t": 0.1, "load": 0.2, "i": 0.7,
        "q_0_": 0.05, "q_dot_0": 1.3,
    },
    "sea": {
        "J_m": 3e-5, "N": 50, "k_m": 0.05, "b_m": 1e-5, "F_m": 0.5, "k": 200, "d": 0.05, "J_l": 0.1, "b_l": 0.02,
        "F_l": 0.1, "load": 0.3, "i": 0.7, "theta_0": 0.1, "theta_dot_0": 1.3, "q_0": 0.03, "q_dot_0": -0.8,
    },
    "tendon": {
        "J_m": 0.002, "J_l": 0.05, "k_t": 0.3, "K": 40, "c_t": 0.05, "F_d": 0.2, "i": 0.7, "drum_0": 0.1,
        "drum_dot_0": 1.3, "leg_0": 0.03, "leg_dot_0": -0.8,
    },
}  # fmt: skip
SIDES = {"side_1": 1, "side_2": -1}
TIME = {"hopper": 0.07, "joint": 0.3, "sea": 0.1, "tendon": 0.08}
Values = dict[str, sp.Rational]

DEGENERATE = {
    "hopper": {
        "no viscous friction": {"b1": 0, "b2": 0},
        "nearly none": {"b1": "1e-9", "b2": "1e-10"},
        "a triple pole": {"m_eff": 24, "m_s": 3, "k": 8, "b1": 0, "b2": 9, "t": 1},
        "nearly a triple pole": {"m_eff": 24, "m_s": 3, "k": 8, "b1": "1e-8", "b2": 9, "t": 1},
        "a double pole": {"m_eff": 4, "m_s": 4, "k": 2, "b1": 8, "b2": 8, "t": 1},
        "nearly a double pole": {"m_eff": 4, "m_s": 4, "k": "2.0000001", "b1": 8, "b2": 8, "t": 1},
        "stiff": {"b1": "2e5", "k": "4e4"},
        "stiff in the body": {"b2": "3e5", "b1": 0},
        "shortly": {"t": "1e-7"},
        "late": {"t": 40},
    },
    "joint": {
        "a double pole": {"J": 4, "k": 900, "b": 120},
        "nearly a double pole": {"J": 4, "k": "900.0000001", "b": 120},
        "no viscous friction": {"b": 0},
        "no spring": {"k": 0},
        "hardly a spring": {"k": "1e-10"},
        "neither": {"b": 0, "k": 0},
        "stiff": {"b": 900},
        "late": {"t": 60},
    },
    "sea": {
        "only the damper of the spring": {"b_m": 0, "b_l": 0},
        "nothing damps": {"b_m": 0, "b_l": 0, "d": 0},
        "nearly nothing": {"b_m": "1e-14", "b_l": "1e-10", "d": "1e-10"},
        "stiff": {"d": 80},
        "stiff without drift": {"d": 80, "b_m": 0, "b_l": "1e-9"},
    },
    "tendon": {"nothing damps the tendon": {"c_t": 0}, "stiff": {"c_t": 40}},
}  # fmt: skip


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    with mpmath.workdps(DIGITS + 25):
        yield


@cache
def derivation_of(name: str) -> Derivation:
    return derive(FILES[name])


def drawn(name: str, seed: int) -> Values:
    """A robot and a start: every number of the base times up to 4 or its reciprocal, its sign at times another."""
    random_of = random.Random(f"{name} {seed}")
    values = dict[str, sp.Rational]()
    for key, value in BASE[name].items():
        factor = sp.Rational(round(4 ** random_of.uniform(-1, 1) * 2**20), 2**20)
        sign = random_of.choice((-1, 1)) if key.endswith(("_0", "u", "i")) and key != "q_0_" else 1
        values[key] = sp.Rational(str(value)) * factor * sign
    time = sp.Rational(str(TIME[name])) * sp.Rational(round(2 ** random_of.uniform(-2, 1) * 2**20), 2**20)
    return values | {key: sp.Integer(side) for key, side in SIDES.items()} | {"t": time}


def case_of(name: str, case: str) -> Values:
    given = BASE[name] | SIDES | {"t": TIME[name]} | DEGENERATE[name][case]
    return {key: sp.Rational(str(value)) for key, value in given.items()}


def cases(names: Iterator[str] | tuple[str, ...], seeds: int) -> list[tuple[str, str | int]]:
    return [(name, case) for name in names for case in (*range(seeds), *DEGENERATE[name])]


def values_of(name: str, case: str | int) -> Values:
    return drawn(name, case) if isinstance(case, int) else case_of(name, case)


def value(name: str, formula: str, values: Values) -> mpmath.mpf:
    return mp.mpf(str(derivation_of(name).value(formula, values, DIGITS + 10)))


def first_of(values: list[tuple[str, str | int]], count: int) -> list:
    """So many always, the others in slices."""
    return [*values[:count], *needs.sliced(*values[count:])]


# ---- the motion, by the accelerations of the derivation alone ----


class Motion:
    """z = (x1, v1, x2, v2, 1) over time by the exponential of its matrix, and the powers, of a model."""

    def __init__(self, name: str, values: Values) -> None:
        found = derivation_of(name)
        self.found, self.values = found, values
        self.names = [member for own in found.model.names if own for member in (own.coordinate, own.velocity)]
        self.matrix = mp.zeros(len(self.names) + 1)
        zero = self._accelerations([mp.mpf(0)] * len(self.names))
        for n, constant in enumerate(zero):
            self.matrix[2 * n, 2 * n + 1] = 1
            self.matrix[2 * n + 1, len(self.names)] = constant
        for column in range(len(self.names)):
            unit = [mp.mpf(int(row == column)) for row in range(len(self.names))]
            for n, acceleration in enumerate(self._accelerations(unit)):
                self.matrix[2 * n + 1, column] = acceleration - zero[n]
        starts = [f"{member}_0" for member in self.names]
        self.start = mp.matrix(
            [*(mp.mpf(1) * values[self._named(each)].p / values[self._named(each)].q for each in starts), 1]
        )

    def _named(self, name: str) -> str:
        return f"{name}_" if name in {each.name for each in self.found.model.parameters} else name

    def _number(self, expression: sp.Expr, state: list[mpmath.mpf]) -> mpmath.mpf:
        known = dict(zip(self.names, state, strict=True))
        given = {key: mp.mpf(each.p) / each.q for key, each in self.values.items()} | known
        symbols = sorted(expression.free_symbols, key=str)
        return sp.lambdify(symbols, expression, "mpmath")(*(given[each.name] for each in symbols))

    def _accelerations(self, state: list[mpmath.mpf]) -> list[mpmath.mpf]:
        motion = self.found.equations_of_motion
        return [self._number(motion[f"acc_{n}"], state) for n, own in enumerate(self.found.model.names, 1) if own]

    @property
    def time(self) -> mpmath.mpf:
        return mp.mpf(self.values["t"].p) / self.values["t"].q

    def integrated(self, expressions: dict[str, sp.Expr]) -> dict[str, mpmath.mpf]:
        """Integrals of functions of a state, by Gauss's rule in steps that are short beside all rates."""
        steps = int(mp.ceil(mp.norm(self.matrix, "inf") * self.time / 16)) + 1
        h, state = self.time / steps, self.start
        nodes = [(mp.mpf(1 + x) / 2 * h, mp.mpf(w) / 2 * h) for x, w in _gauss()]
        to = [mp.expm(self.matrix * place, method="taylor") for place, _ in nodes]
        across, sums = mp.expm(self.matrix * h, method="taylor"), dict.fromkeys(expressions, mp.mpf(0))
        given = {key: mp.mpf(each.p) / each.q for key, each in self.values.items()}
        compiled = {}
        for name, expression in expressions.items():
            symbols = sorted(expression.free_symbols, key=str)
            compiled[name] = symbols, sp.lambdify(symbols, expression, "mpmath")
        for _ in range(steps):
            for matrix, (_, weight) in zip(to, nodes, strict=True):
                known = given | dict(zip(self.names, list(matrix * state)[:-1], strict=True))
                for name, (symbols, function) in compiled.items():
                    sums[name] += weight * function(*(known[each.name] for each in symbols))
            state = across * state
        return sums


@cache
def _gauss() -> list[tuple[mpmath.mpf, mpmath.mpf]]:
    """The 48 nodes and weights of Gauss's rule over -1 .. 1."""
    return list(GaussLegendre(mp).get_nodes(-1, 1, 5, mp.prec))


def powers_of(name: str) -> dict[str, sp.Expr]:
    """The power of each force, by the name of its work."""
    energies = derivation_of(name).energies
    known = {sp.Symbol(key): power for key, power in energies.items()}
    return {
        f"{key.removesuffix('_power')}_work": power.xreplace(known)
        for key, power in energies.items()
        if key.endswith("_power")
    }


def entries_of(name: str) -> list[str]:
    return [key for key in powers_of(name) if key != "aed_work"]


def size_of(name: str, values: Values) -> mpmath.mpf:
    """What a work is compared with: all of them, in size."""
    return sum(abs(value(name, entry, values)) for entry in entries_of(name))


# ---- what the works are ----


@pytest.mark.parametrize("name", FILES)
def test_every_force_has_a_work(name):
    works = derivation_of(name).works
    assert {*powers_of(name)} == {key for key in works if key.endswith("_work")}


MEETING = [(name, case) for name in ("joint", "hopper", "sea", "tendon") for case in DEGENERATE[name] if case != "late"]
"""Robots at which poles meet exactly, or sums of poles vanish: `hopform model prove` draws floats, which only come near."""


@pytest.mark.parametrize(("name", "case"), first_of(MEETING, 1))
def test_the_works_are_the_integrals_of_the_powers(name, case):
    """By quadrature along the exponential of the matrix of the motion."""
    values = values_of(name, case)
    wanted, size = Motion(name, values).integrated(powers_of(name)), size_of(name, values)
    for work, number in wanted.items():
        assert abs(value(name, work, values) - number) < mp.mpf(10) ** -DIGITS * size, work


# ---- what is computed with rounded numbers ----


@cache
def pasted_of(name: str) -> dict[str, Callable[..., float]]:
    """The functions that `show` prints as NumPy."""
    spaces = dict[str, Callable[..., float]]()
    exec(derivation_of(name).show("works", "numpy"), spaces)
    return spaces


def pasted(name: str, formula: str, values: Values) -> float:
    """A formula by its function of NumPy."""
    found = derivation_of(name)
    needed = found._library.needed([found.formula(formula)], IN_CODE)
    taken = found._library.taken(needed, IN_CODE)
    return float(pasted_of(name)[formula](*(float(values[each.name]) for each in taken)))


@pytest.mark.parametrize(("name", "case"), first_of(cases((*FILES,), 3), 2))
def test_the_works_pasted_as_numpy_are_those_of_40_digits(name, case):
    values = values_of(name, case)
    size = float(size_of(name, values))
    for entry in entries_of(name):
        assert pasted(name, entry, values) == pytest.approx(float(value(name, entry, values)), abs=1e-9 * size), entry


@pytest.mark.parametrize(("name", "part"), first_of([(name, part) for name in FILES for part in (1000, 30, 5)], 2))
def test_a_motion_from_rest_has_integrals_of_its_own_size_as_numpy(name, part):
    """Where velocities are those of the accelerations alone, from far within the power series to behind it."""
    rest = {key: 0 for key in BASE[name] if key.endswith("dot_0") or key in ("v1_0", "v2_0")}
    given = BASE[name] | SIDES | rest | {"t": TIME[name]}
    values = {key: sp.Rational(str(each)) for key, each in given.items()}
    values["t"] /= part
    squares = [
        key for key in derivation_of(name).works if key.endswith("_squared") and not key.startswith(("slow", "least"))
    ]
    assert squares
    for integral in squares:
        wanted = float(value(name, integral, values))
        assert wanted > 0 and pasted(name, integral, values) == pytest.approx(wanted, rel=1e-9, abs=0), integral


# ---- the engine, and NumPy ----


def solver_named(name: str, store: Path) -> hopform.Solver:
    if name == "hopper":
        return hopform.load_solver(name)
    return solver_of(store, SHIPPED / f"{name}.py" if FILES[name] == name else FILES[name])


def solved(name: str, case: str | int, store: Path) -> tuple[hopform.Motion, dict[str, float], Values]:
    """The motion of the engine, its start, and the values, of a time in its first phase, that its numbers are."""
    solver, model, values = solver_named(name, store), derivation_of(name).model, values_of(name, case)
    rounded = {key: float(each) for key, each in values.items()}
    fields = {field.name for field in solver.Robot.fields()}
    members = [member for own in model.names if own for member in (own.coordinate, own.velocity)]
    start = {member: rounded[f"{member}_0_" if f"{member}_0" in fields else f"{member}_0"] for member in members}
    robot = solver.Robot(**{key: each for key, each in rounded.items() if key in fields})
    assert model.input is not None
    motion = solver.solve_motion(robot, start=start, u=rounded[model.input.name], horizon=rounded["t"])
    rounded["t"] = 0.9 * min(motion.phases[0].end, rounded["t"])
    for n, own in enumerate(model.names, 1):
        rounded[f"side_{n}"] = math.copysign(1.0, start[own.velocity]) if own else 0.0
    return motion, start, {key: sp.Rational(each) for key, each in rounded.items()}


ROUNDING = 1e-15
"""Of the ledger of the engine, over the sum of the sizes of its entries; measured is 2e-16."""


@needs.library
@pytest.mark.parametrize(("name", "case"), first_of(cases((*FILES,), 3), 2))
def test_the_engines_ledger_is_the_closed_form(store, name, case):
    motion, _, values = solved(name, case, store)
    ledger, size = motion.ledger(float(values["t"]))._asdict(), float(size_of(name, values))
    works = {
        f"{entry.removesuffix('_work')}_work": float(each) for entry, each in ledger.items() if entry != "stop_loss"
    }
    assert {*works} == {*entries_of(name)}
    for work, found in works.items():
        assert found == pytest.approx(float(value(name, work, values)), abs=ROUNDING * size), work


@pytest.mark.parametrize(("name", "case"), first_of(cases(("hopper", "sea"), 3), 1))
def test_the_works_of_the_numpy_package_are_those_of_40_digits(store, name, case):
    motion, start, values = solved(name, case, store)
    package, robot = motion.robot.solver.package, motion.robot.parameters
    formulas, kernels = package.formulas, package.kernels
    side = (float(values["side_1"]), float(values["side_2"]))
    t, u = np.array([float(values["t"])]), float(values[derivation_of(name).model.input.name])
    state = formulas.state_of_start(robot, package.records.Start(**start))
    rates = formulas.rates_of(robot)
    poles = kernels.factor_cubic(*(np.array([each]) for each in (rates.s_1, rates.s_2, rates.s_3)))
    numerators = formulas.motion_of_both(rates, formulas.drive_of(robot, rates, u, *side), state)
    basis, split = kernels.basis_at(poles, t), kernels.split_of(poles)
    squares = formulas.squares_of(split, kernels.fades_at(split, t), basis)
    moments = formulas.moments_of(state, numerators, basis, squares, t)
    ledger = formulas.ledger_of(robot, moments, u, *side, 0.0, state[0])._asdict()
    size = float(size_of(name, values))
    for entry, found in ledger.items():
        wanted = float(value(name, f"{entry.removesuffix('_work')}_work", values))
        assert np.squeeze(found) == pytest.approx(wanted, abs=1e-9 * size), entry


@pytest.mark.parametrize(("precision", "stated"), [(F64, 5e-17), (F32, 5e-9)])
def test_the_remainder_of_the_engines_rule_is_as_stated(precision, stated):
    """Of exp(z t), abs(z) at most 8, over the unit of time: (n!)^4 z^2n/((2n + 1) (2n)!^3), Abramowitz and Stegun 25.4.30."""
    n = nodes(precision)
    remainder = math.factorial(n) ** 4 * 8 ** (2 * n) / ((2 * n + 1) * math.factorial(2 * n) ** 3)
    assert 0.5 * stated < remainder < stated
    said = f"{stated:.0e}".replace("e-0", "e-")
    assert said in page(derivation_of("hopper")) and said in REGISTER[23].reason
