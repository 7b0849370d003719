"""`hopform model prove`: every model's formulas hold, and a fault in one turns a row red that names it."""

import json
from copy import copy
from dataclasses import replace
from functools import cache
from pathlib import Path

import jsonschema
import pytest
import sympy as sp

import hopform
from derive import derivation, prove
from derive.derivation import Derivation
from derive.maths import energy
from derive.model.declare import Draft
from hopform import _front as cli
from hopform._building import Made
from hopform._cli import prove as command
from hopform._solver.choice import DEFAULT
from hopform._solver.loading import loaded
from tests import needs
from tests.derived import MODELS, SHIPPED, built, model_file

SHIPPING = sorted(p.stem for p in SHIPPED.glob("[!_]*.py"))
OF_TESTS = {p.stem for p in MODELS.glob("*.py")} - {*SHIPPING, "__init__"}
ALL = sorted((*SHIPPING, *OF_TESTS), key=lambda name: (name != "joint", name))
BARE = {
    "an integrator": 'm = parameter("m", "kg", "mass", "positive")\nx = coordinate("x", "m", m)\nfriction(x, 2)\n',
    "two masses without a damper": 'm = parameter("m", "kg", "mass", "positive")\nx = coordinate("x", "m", m)\n'
    'z = coordinate("z", "m", 3*m)\nleg = spring(x - z, 50)\n',
    "two masses with a damper between them": 'm = parameter("m", "kg", "mass", "positive")\nx = coordinate("x", "m", m)\n'
    'z = coordinate("z", "m", 3*m)\nd = parameter("d", "N s/m", "damping", "nonnegative", 0)\nspring(x - z, 50).damper(d)\n',
}
"""Models whose denominators have roots at 0 whatever the robot."""

Proven = tuple[Derivation, Draft]


@cache
def derived(name: str) -> Proven:
    return prove.source(SHIPPED / f"{name}.py" if name in SHIPPING else model_file(name))


def checks_of(proven: Proven, count: int = prove.ROBOTS) -> list[prove.Check]:
    """All rows, of so many robots that are drawn, and of those at the edges."""
    return [*prove.identities(*proven), *prove.numbers(*proven, prove.robots(proven[0], count))]


def failing(checks: list[prove.Check]) -> dict[str, str]:
    return {each.what: each.where for each in checks if not each.holds}


# ---- every model ----


@pytest.mark.parametrize("name", needs.the_first(ALL))
def test_the_formulas_of_a_model_hold(name):
    assert failing(checks := checks_of(derived(name))) == {}
    compared = {each.what.partition(",")[0] for each in checks}
    assert {"The state over time", "Denominators of the transforms and their roots"} <= compared


def test_the_formulas_of_two_masses_hold_of_one_robot():
    """What the slices do with many robots, and by algebra."""
    found, draft = derived("sea")
    assert failing(list(prove.numbers(found, draft, prove.robots(found)[:1]))) == {}


@pytest.mark.sliced
@pytest.mark.parametrize("name", BARE)
def test_the_formulas_of_a_model_with_poles_at_0_hold(name, tmp_path):
    (file := tmp_path / "bare.py").write_text(f"from hopform.model import *\n{BARE[name]}", "utf-8")
    assert failing(checks_of(prove.source(file), 3)) == {}


def test_robots_are_drawn_within_domains_and_at_their_edges():
    found, _ = derived("joint")
    drawn = prove.robots(found)
    domains = {each.name: each.interval for each in found.model.parameters}
    assert all(value in domains[name] for robot in drawn for name, value in robot.values.items())
    edges = {robot.name: robot.values for robot in drawn[prove.ROBOTS :]}
    assert {"robot 1 with b = 0", "robot 1 with k = 0", "robot 1 with k, b, F_p, F_m, F_sp, F_sm = 0"} <= edges.keys()
    assert drawn == prove.robots(found)
    (double,) = (edges[name] for name in edges if "poles" in name)
    assert abs(double["b"] ** 2 / (4 * double["k"] * double["J"]) - 1) < 1e-12


# ---- planted faults ----


def spoiled(name: str, key: str, change) -> tuple[Proven, str]:
    """A derivation whose formula `key` is another where nothing is held, and what the model calls it."""
    found, draft = derived(name)
    (before,) = (each for each in found.formulas if each.key == key)
    assert change(before.value) != before.value
    wrong = copy(found)
    faulty = tuple(replace(each, value=change(each.value)) if each is before else each for each in found.formulas)
    wrong.__dict__.update(formulas=faulty, modes=found.modes[:1])
    return (wrong, draft), before.name


def mirrored(value):
    """The formula with the sign of one of its terms changed."""
    first, *others = sp.Add.make_args(value)
    return sp.Add(-first, *others)


def last_case(value):
    return value.args[-1][0]


def at_once(value):
    """The formula at t = 0."""
    return value.subs({symbol: 0 for symbol in value.free_symbols if symbol.name == "t"})


def in_case(n, change):
    """A change in the n-th case of a formula."""
    return lambda value: sp.Piecewise(*((change(v) if n == m else v, c) for m, (v, c) in enumerate(value.args)))


OBEYS, JOIN = "the state over time obeys the equations of motion", "phases join: the state at t = 0 is the start"
KERNELS, ROOTS = "kernels have the poles, in each case", "poles are roots, in each case"
LEDGER = "ledger: powers add up to the rate of the energy"
STATES, POLES, WORKS = (
    "The state over time",
    "Denominators of the transforms and their roots",
    "The work of each force over a phase",
)
FRACTIONS, ENERGIES = "Partial fractions of the transforms", "Energies, and the power of each force"
FAULTS = {
    ("joint", "x1_t"): (mirrored, (OBEYS, STATES)),
    ("joint", "viscous_1_work"): (mirrored, (WORKS,)),
    ("joint", "v1_t"): (mirrored, (OBEYS, STATES)),
    ("joint", "H2_1"): (lambda value: 2 * value, (OBEYS, STATES)),
    ("joint", "q_1"): (lambda value: 2 * value, (OBEYS, POLES)),
    ("joint", "disc"): (lambda value: -value, (KERNELS, POLES)),
    ("joint", "R1"): (last_case, (STATES,)),
    ("joint", "R2"): (at_once, (KERNELS, STATES)),
    ("joint", "D_hat"): (mirrored, ("partial fractions add up to the transforms", FRACTIONS)),
    ("joint", "X1"): (lambda value: -value, ("transforms are those of the state over time", "Laplace transforms")),
    ("joint", "H4_hat"): (mirrored, ("transforms are those of the state over time", "Numerators of the transforms")),
    ("joint", "acc_1"): (mirrored, ("forces: Lagrange's equations are the elements'", "Accelerations and their coefficients")),
    ("joint", "force_1"): (mirrored, ("forces: Lagrange's equations are the elements'", "Lagrangian and generalised forces")),
    ("joint", "total"): (lambda value: 2 * value, (LEDGER, ENERGIES)),
    ("joint", "viscous_1_power"): (lambda value: -value, (LEDGER, ENERGIES)),
    ("joint", "x1_stick_margin_forward"): (mirrored, ("Event functions: the first zero ends a phase",)),
    ("joint", "int_WW"): (in_case(0, lambda value: 2 * value), (WORKS,)),
    ("joint", "int_eR"): (in_case(0, mirrored), (WORKS,)),
    ("sea", "a_least"): (last_case, (WORKS,)),
    ("sea", "int_e1W1"): (mirrored, (WORKS,)),
    ("sea", "int_v1v2"): (mirrored, (WORKS,)),
    ("sea", "sigma"): (lambda value: 2 * value, (ROOTS, POLES)),
    ("sea", "a"): (in_case(1, lambda value: 2 * value), (ROOTS, POLES)),
    **{("sea", f"apart, case {n}"): (in_case(n, lambda value: 2 * value), (ROOTS,)) for n in range(4)},
    ("sea", "W"): (in_case(0, mirrored), (KERNELS,)),
    ("sea", "chi"): (mirrored, (KERNELS, FRACTIONS)),
    ("sea", "C"): (lambda value: -value, ("partial fractions add up to the transforms", FRACTIONS)),
    ("sea", "H1_2"): (mirrored, (OBEYS, STATES)),
    ("hopper", "aed_work"): (mirrored, (WORKS,)),
    ("hopper", "contact_force"): (mirrored, ("Event functions: the first zero ends a phase",)),
    ("hopper", "E_dist"): (mirrored, ("Quantities of the controller",)),
}  # fmt: skip
"""Faults of a formula of a model, by its name in the derivation, and rows that are to name it."""


@pytest.mark.parametrize("fault", needs.the_first([*FAULTS], 2), ids="-".join)
def test_a_fault_turns_rows_red_that_name_the_formula(fault, monkeypatch):
    """Of identities only those that are to be red are tried."""
    name, key = fault
    change, rows = FAULTS[fault]
    wrong, called = spoiled(name, key.partition(",")[0], change)
    monkeypatch.setattr(prove, "IDENTITIES", {row: prove.IDENTITIES[row] for row in rows if row in prove.IDENTITIES})
    checks = list(prove.identities(*wrong))
    if len(checks) < len(rows):
        checks += prove.numbers(*wrong, prove.robots(wrong[0], 1))
    red = failing(checks)
    assert all(any(what.startswith(row) for what in red) for row in rows), red
    assert any(called in where for where in red.values()), red


@pytest.mark.parametrize("matrix", ["M", "drive", "B", "propagator"])
def test_a_wrong_matrix_of_a_mode_turns_its_row_red(matrix, monkeypatch):
    true = prove._linear_system
    monkeypatch.setattr(
        prove, "_linear_system", lambda mode: (found := true(mode)) | {matrix: [2 * e for e in found[matrix]]}
    )
    red = failing(list(prove.numbers(*derived("cart"), prove.robots(derived("cart")[0], 1)[:1])))
    assert red == {prove.LINEAR_SYSTEM: f"{matrix} of robot 1"}


@pytest.mark.sliced
def test_a_wrong_entry_of_the_ledger_turns_its_rows_red(monkeypatch):
    """In the derivation itself, from which the C has it."""
    true = energy.powers
    monkeypatch.setattr(energy, "powers", lambda model: {entry: 2 * power for entry, power in true(model).items()})
    red = failing(checks_of((Derivation(derivation.derive("cart").model), derived("cart")[1]), 2))
    assert "motor_power" in red[LEDGER]
    assert red.keys() >= {ENERGIES, WORKS}


# ---- C = NumPy ----


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("name", SHIPPING)
def test_c_is_numpy(store, name):
    solver = DEFAULT if name == "hopper" else loaded(built(store, SHIPPED / f"{name}.py"))
    found, draft = derived(name)
    drawn = prove.robots(found, 2)[:: 3 if name == "hopper" else 1]
    checks = list(command.c_against_numpy(solver, found, draft, drawn))
    assert [each.what for each in checks] == [command.IN_C_AND_NUMPY.format(each) for each in ("plan", "motion")]
    assert failing(checks) == {} and all(each.count > 5 for each in checks)


@needs.library
@pytest.mark.sliced
def test_numpy_that_is_not_c_turns_a_row_red(monkeypatch):
    from hopform_solver import formulas

    true = formulas.state_at
    monkeypatch.setattr(formulas, "state_at", lambda *given: (at := true(*given))._replace(v1_t=at.v1_t * (1.0 + 1e-9)))
    found, draft = derived("hopper")
    _, motion = command.c_against_numpy(DEFAULT, found, draft, prove.robots(found, 2)[:2])
    assert not motion.holds and "v1 of robot" in motion.where


# ---- the command ----


@pytest.fixture
def joint(store, monkeypatch):
    """The solver of the joint where the command builds it, and two robots alone."""
    folder, drawn = built(store, SHIPPED / "joint.py"), prove.robots(derived("joint")[0], 2)[:2]
    monkeypatch.setattr(command, "solver_of", lambda model, out, bar: Made(folder, None))
    monkeypatch.setattr(prove, "robots", lambda found: drawn)
    monkeypatch.setattr(prove, "source", lambda model: derived("joint"))
    return folder


def test_the_command_prints_a_table_and_json_of_its_schema(joint, capsys):
    assert cli.main(["model", "prove", "joint"]) == 0
    table = capsys.readouterr().out
    assert "C = NumPy = exact: motion" in table and "fails" not in table and "2 robots" in table
    assert cli.main(["model", "prove", "joint", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {each["verdict"] for each in answer["checks"]} == {"holds"} and len(answer["robots"]) == 2
    schema = json.loads((Path(hopform.__file__).parents[2] / "generated" / "schema.json").read_text("utf-8"))
    jsonschema.validate(answer, {"$ref": "#/$defs/hopform model prove", "$defs": schema["$defs"]})


def test_where_something_fails_the_exit_code_is_1_and_the_line_names_formula_and_robot(joint, capsys, monkeypatch):
    wrong, called = spoiled("joint", "x1_t", mirrored)
    monkeypatch.setattr(prove, "source", lambda model: wrong)
    assert cli.main(["model", "prove", "joint"]) == 1
    table = capsys.readouterr().out
    assert any("fails" in line and f"{called} of robot" in line for line in table.splitlines()), table


def test_without_a_library_its_row_says_so(joint, capsys, monkeypatch):
    bare = loaded(joint)
    monkeypatch.setattr(bare, "folder", replace(bare.folder, library=joint / "none.so"))
    assert cli.main(["model", "prove", "joint"]) == 0
    printed = capsys.readouterr()
    assert any("C = NumPy" in line and "left out" in line for line in printed.out.splitlines())
    assert "there is no library" in printed.out + printed.err
