"""What `hopform model prove` shows of a model: identities by algebra, and every formula as a number at 40 digits.

mechanics     energies, forces and powers of the file's elements, each by the law of its kind
own           what each formula is to be, from these alone
robots        robots that are drawn, and at the edges of the domains
algebra       identities: the closed form obeys the elements' equations, phases join, the ledger adds up
"""

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mpmath
import sympy as sp

from ..derivation import Derivation, derive
from ..maths.formulas import GROUPS, Formula
from ..mode import Mode
from ..model.declare import Draft
from ..model.equations import ModelError
from ..model_file import draft_of
from ..shipped import FILES
from .algebra import Algebra, Residual, is_zero
from .mechanics import Mechanics
from .own import WORKING, Known, Own, exactly, number
from .robots import ROBOTS, Robot, robots

DIGITS = 40
"""Of each number that is compared."""
BOUND = 10.0**-DIGITS
FLOOR = mpmath.mpf(10) ** -60
"""What an error is relative to at least: an exact 0 is 1e-120 by another way."""


@dataclass(frozen=True)
class Check:
    """A row: what was compared, how many comparisons, the worst error, its bound, and a formula and a robot: of the first
    error beyond the bound, else of the worst.

    Of an identity the error is the number of those that do not hold, and the bound 0; of a number it is relative to its
    size.
    """

    what: str
    count: int
    error: float
    bound: float
    where: str = ""

    @property
    def holds(self) -> bool:
        """Whether nothing is above the bound, and there was something to compare."""
        return self.count > 0 and self.error <= self.bound


def source(model: str | Path) -> tuple[Derivation, Draft]:
    """The derivation of a model that ships or of a file, and what its file declares."""
    return derive(model), draft_of(FILES.get(str(model), Path(model)))


IDENTITIES: dict[str, Callable[[Algebra], Iterator[Residual]]] = {
    "forces: Lagrange's equations are the elements'": Algebra.forces,
    "the state over time obeys the equations of motion": Algebra.obeys,
    "phases join: the state at t = 0 is the start": Algebra.join,
    "transforms are those of the state over time": Algebra.transforms,
    "poles are roots, in each case": Algebra.poles,
    "partial fractions add up to the transforms": Algebra.fractions,
    "kernels have the poles, in each case": Algebra.kernels,
    "ledger: powers add up to the rate of the energy": Algebra.ledger,
}
"""What is shown by algebra, for every robot of a model and at all times."""


def identities(derivation: Derivation, draft: Draft) -> Iterator[Check]:
    """A row for each kind of identity, of all modes."""
    mechanics = Mechanics(derivation.model, draft)
    of_modes = [(mode, Algebra(mechanics, formulas, moving)) for mode, moving, formulas in modes_of(derivation)]
    for what, residuals in IDENTITIES.items():
        count, wrong = 0, list[str]()
        for mode, algebra in of_modes:
            try:
                for key, residual in residuals(algebra):
                    count += 1
                    if not is_zero(residual):
                        wrong.append(_named(algebra.by_key, key, mode))
            except (
                ModelError,
                sp.PolynomialError,
                ValueError,
                TypeError,
                LookupError,
                AttributeError,
            ) as error:  # a formula of another form
                count += 1
                wrong.append(f"a formula of another form where {_slips(mode)} slips: {error}")
        if count:
            yield Check(what, count, float(len(wrong)), 0.0, ", ".join(dict.fromkeys(wrong)))


def _named(formulas: Mapping[str, Formula], key: str, mode: Mode) -> str:
    """A formula by the name that it has in the model, and the mode."""
    return f"{formulas[key].name if key in formulas else key} where {_slips(mode)} slips"


def _slips(mode: Mode) -> str:
    return " and ".join(mode.slipping)


def modes_of(derivation: Derivation) -> Iterator[tuple[Mode, tuple[int, ...], Sequence[Formula]]]:
    """The modes in which something slips, the numbers of the masses that do, and the formulas."""
    masses = derivation.model.moving
    slipping = masses, *(tuple(n for n in masses if n != held) for held in masses)
    for mode, moving in zip(derivation.modes, slipping, strict=False):
        if moving:
            yield mode, moving, mode.formulas if mode.held else derivation.formulas


# ---- numbers ----


def situation(mechanics: Mechanics, robot: Robot, generator: random.Random) -> dict[str, Any]:
    """The robot's parameters, and a state, a start, an input and a time that are drawn; by the names of formulas."""
    known = {name: mpmath.mpf(value) for name, value in robot.values.items()}
    for key, symbol in mechanics.inputs.items():
        known[symbol.name] = mpmath.mpf(generator.uniform(0.1, 1.0) * generator.choice((-1, 1)))
        if key in ("s", "height", "t"):
            known[symbol.name] = abs(known[symbol.name])
        if key.startswith("side_"):
            known[symbol.name] = mpmath.sign(known[symbol.name])
    return known


OF_MODE = ("transfer", "numerators", "poles", "partial_fractions", "states", "works")
"""Groups of formulas that each mode has its own of."""


def exact(value: float) -> Any:
    """A float as a number of the arithmetic here."""
    return mpmath.mpf(value)


LINEAR_SYSTEM = "Linear system: M, drive, B and the propagator"


def _linear_system(mode: Mode) -> dict[str, list[sp.Expr]]:
    """The entries of the matrices of a mode, row by row; Phi and Gamma of the propagator beside each other."""
    matrices = {"M": mode.M, "drive": mode.drive, "B": mode.B, "propagator": sp.Matrix.hstack(*mode.propagator())}
    return {name: list(matrix) for name, matrix in matrices.items()}


def numbers(derivation: Derivation, draft: Draft, drawn: Sequence[Robot]) -> Iterator[Check]:
    """Each formula of each mode at robots, against own values: a row for each group and mode."""
    mechanics = Mechanics(derivation.model, draft)
    for mode, moving, formulas in modes_of(derivation):
        found, linear = dict[str, list[tuple[float, str]]](), _linear_system(mode)
        generator = random.Random(2)
        for robot in drawn:
            with mpmath.workdps(WORKING):
                known = situation(mechanics, robot, generator)
                mode_of_robot = Own(mechanics, moving, known)
                known[mechanics.inputs["t"].name] *= 3 / mode_of_robot.rate  # neither long nor short
                own = mode_of_robot.values()
                values = _values(formulas, known)
                for each in formulas:
                    if each.group in OF_MODE or not mode.held:
                        error = _error(values[each.name], own, each)
                        if error is not None:
                            found.setdefault(each.group, []).append((error, f"{each.name} of {robot.name}"))
                for name, entries in mode_of_robot.linear_system().items():
                    for value, wanted in zip(linear[name], entries, strict=True):
                        error = float(abs(number(value, values) - wanted) / max(abs(wanted), FLOOR))
                        found.setdefault(LINEAR_SYSTEM, []).append((error, f"{name} of {robot.name}"))
        slips = "" if len(derivation.modes) <= 2 else f", {_slips(mode)} slipping"
        for group in (*GROUPS, LINEAR_SYSTEM):
            if group in found:
                worst = max(found[group], key=lambda each: each[0])
                beyond = (each for each in found[group] if each[0] > BOUND)
                _, where = next(beyond, worst)  # the first that fails is what others read
                said = slips if group in (*OF_MODE, LINEAR_SYSTEM) else ""
                yield Check(f"{GROUPS.get(group, group)}{said}", len(found[group]), worst[0], BOUND, where)


def _values(formulas: Sequence[Formula], known: Known) -> dict[str, Any]:
    """Every formula as a number, each from those that it reads; None where it divides by 0, or reads one that does."""
    by_name, values = {each.name: each for each in formulas}, dict[str, Any](known)

    def visit(formula: Formula) -> Any:
        if formula.name not in values:
            read = [visit(by_name[s.name]) for s in formula.value.free_symbols if s.name in by_name]
            try:
                values[formula.name] = None if None in read else number(formula.value, values)
            except ZeroDivisionError:
                values[formula.name] = None
        return values[formula.name]

    for each in formulas:
        visit(each)
    return values


def _error(value: Any, own: Mapping[str, Any], formula: Formula) -> float | None:
    """How far a formula is from its own value, relative to that; None where there is none, as at a pole. A formula whose
    own value nobody knows is not right.
    """
    wanted = own.get(formula.key, mpmath.inf)
    if wanted is None:
        return None
    return (
        float("inf") if value is None or wanted == mpmath.inf else float(abs(value - wanted) / max(abs(wanted), FLOOR))
    )


__all__ = [
    "ROBOTS", "Check", "Mechanics", "Own", "Robot", "exact", "exactly", "identities", "number", "numbers", "robots", "situation", "source",
]  # fmt: skip
