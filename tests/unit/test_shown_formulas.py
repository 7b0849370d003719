"""The formulas of every model as they are shown: no form has a number that is none, and what each form computes of a
motion is what the solver computes, at parameters that are 0 as well.
"""

import ctypes
import math
import re
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

import hopform
from derive.derivation import FORMS
from derive.page import page
from hopform.model import Derivation, derive
from tests.derived import SHIPPED, model_of, solver_of
from tests.needs import the_first

THAT_SHIP = sorted(
    (path.stem for path in SHIPPED.glob("[!_]*.py")), key=lambda name: (name not in ("cart", "servo"), name)
)
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


@pytest.mark.parametrize("name", [*the_first(THAT_SHIP, 2), *AT_ZERO])
def test_no_formula_has_a_number_that_is_none(name):
    found = derivation_of(name)
    for formulas in (found.formulas, *(each.formulas for each in found.modes)):
        for each in formulas:
            assert not each.value.has(sp.zoo, sp.nan, sp.oo, -sp.oo), each
            assert not each.in_code.has(sp.zoo, sp.nan, sp.oo, -sp.oo), each
    assert states_of(found).keys() <= {each.name for each in found.found("states")}


@pytest.mark.parametrize("name", [*the_first(THAT_SHIP, 2), "two integrators"])
def test_no_form_shows_a_number_that_is_none(name):
    found = derivation_of(name)
    for form in FORMS:
        assert (wrong := NO_NUMBER.search(found.show(form=form))) is None, (form, wrong)
    blocks = "".join(re.findall(r"```math\n(.*?)\n```", page(found), re.DOTALL))
    assert blocks and NO_NUMBER.search(blocks) is None


# ---- the motion ----


def named(found: Derivation, name: str) -> str:
    """A name of the derivation beside the parameters of the model."""
    while name in {each.name for each in found.model.parameters}:
        name += "_"
    return name


def numbers(solver: Any) -> dict[str, float]:
    """The robot that the solver comes with; a stop would end the phase."""
    robot = solver.load_robot("hopper_c" if solver.name == "hopper" else solver.name)
    fields = {field.name: field for field in type(robot).fields()}
    return {name: getattr(robot, name) for name in fields if fields[name].domain not in ("lower", "upper")}


def variants(solver: Any) -> Iterator[tuple[str, dict[str, float]]]:
    """That robot, each of its parameters that may be 0 at 0, near 0 and at 1, and all of them at 0."""
    base = numbers(solver)
    domains = {field.name: field.domain for field in solver.Robot.fields()}
    zero = [name for name in base if domains[name] in ("real", "nonnegative", "fraction")]
    yield "as it is", base
    yield "all 0", base | dict.fromkeys((name for name in zero if domains[name] == "nonnegative"), 0.0)
    for name in zero:
        yield f"{name} = 0", base | {name: 0.0}
    for name in zero:
        if domains[name] == "nonnegative":
            yield f"{name} = 1e-13", base | {name: 1e-13}
    if "k" in zero:
        yield "k and b near 0", base | {name: 1e-13 for name in ("k", "b") if name in zero}


def starts(found: Derivation) -> dict[str, float]:
    """A start at which all that moves does, by names of the model; a leg is compressed."""
    first, second = found.model.names
    start = {}
    if first is not None:
        start |= {first.coordinate: 0.0011, first.velocity: 0.23}
    if second is not None:
        length = 0.0 if first is not None and not found.model.has_contact else 0.38
        start |= {second.coordinate: length - 0.0013, second.velocity: -0.17}
    return start


def compiled(found: Derivation, folder: Path) -> ctypes.CDLL:
    code = "\n".join(found.show(name, "c") for name in states_of(found))
    (folder / "all.c").write_text(re.sub("^static inline ", "", code, flags=re.MULTILINE))
    flags = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "all.c", "-o", "all.so", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "all.so"))


def states_of(found: Derivation) -> dict[str, str]:
    """The formulas of the state over time, with the names of what they are."""
    members = [member for own in found.model.names if own for member in (own.coordinate, own.velocity)]
    return {named(found, f"{member}_t"): member for member in members}


@pytest.mark.parametrize("name", the_first(THAT_SHIP, 2))
def test_every_form_has_the_motion_of_the_solver(store, tmp_path, name):
    """In the first phase, at half of it and after a hundredth: numbers of sympy, NumPy and C, of 1e-12 and 1e-9 of the
    largest size of the member.
    """
    found = derivation_of(name)
    solver = hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")
    start, u = starts(found), 0.7
    library, spaces = compiled(found, tmp_path), dict[str, Any]()
    for each in states_of(found):
        exec(found.show(each, "numpy"), spaces)
    seen = 0
    for variant, robot in variants(solver):
        try:
            motion = solver.solve_motion(solver.Robot(**robot), start=start, u=u, horizon=0.4)
        except hopform.HopformError:  # damping that makes a motion grow, friction at rest below that in motion
            assert variant != "as it is"
            continue
        end = motion.phases[0].end
        given = {named(found, f"{key}_0"): value for key, value in start.items()}
        law = found.model.law
        given |= {} if found.model.input is None else {named(found, found.model.input.name): u}
        given |= {} if law is None else {named(found, law.current.name): float(motion.current(0.0))}
        for n, names in enumerate(found.model.names, 1):
            given |= {f"side_{n}": 0.0} if names is None else {f"side_{n}": math.copysign(1.0, start[names.velocity])}
        if law is not None and abs(given[law.current.name]) < robot["i_max"]:
            continue  # the formulas of the states are those of a constant current
        for t in (0.5 * end, 0.01 * end):
            values = robot | given | {"t": t}
            at = motion.at(t)
            for formula, member in states_of(found).items():
                wanted = float(getattr(at, member))
                size = max(abs(start[member]), abs(wanted), abs(wanted - start[member]), 1e-3)
                exact = float(found.value(formula, {key: sp.Rational(value) for key, value in values.items()}))
                assert exact == pytest.approx(wanted, abs=1e-11 * size), (variant, formula, t)
                taken = found._library.taken(found._library.needed([found.formula(formula)]))
                arguments = [float(values[quantity.name]) for quantity in taken]
                by_numpy = float(spaces[formula](*arguments))
                function = library[f"{found._library.prefix}_{formula}"]
                function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * len(arguments)
                assert by_numpy == pytest.approx(exact, abs=1e-9 * size), (variant, formula, t)
                assert function(*arguments) == pytest.approx(exact, abs=1e-9 * size), (variant, formula, t)
                seen += 1
    assert seen > 20
