"""Modes as linear systems, and symbols as a user of sympy makes them.

Matrices are compared with the force balances of test_derivation_door.py, which are written down by hand, and with what
scipy.signal and python-control make of the same numbers.
"""

import inspect
import re

import numpy as np
import pytest
import sympy as sp

from derive.model.equations import ModelError
from hopform import _front as cli
from hopform.model import derive
from tests.needs import sliced
from tests.unit.test_derivation_door import AT, DIGITS, ROBOT, derivation_of, exact, matrix_of, mp, texts_of

HELD = "nothing", "actuator", "body"
MODES = [
    ("leg_damper", "nothing"),
    ("joint", "nothing"),
    *((name, held) for name in ("hopper", "second_spring") for held in HELD),
]
OF_MODES = pytest.mark.parametrize(("name", "held"), [*MODES[:2], *sliced(*MODES[2:])])
SLIPS = {"nothing": (True, True), "actuator": (False, True), "body": (True, False)}
CASES = {
    "as it is": {}, "no viscous friction": {"b1": 0, "b2": 0, "b12": 0, "b": 0},
    "overdamped": {"b1": 900, "b2": 70, "b": 900},
    "a slow pole": {"b1": 1e-9, "b2": 1e-9, "b12": 0, "b": 1e-9}, "long after": {"t": 3},
    "three real poles": {"b1": 330, "b2": 150, "b": 330},
}  # fmt: skip
EQUAL = {"J": 4, "k": 900, "b": 120}
"""The joint with a double pole, exactly."""
TRIPLE = {"m_eff": 1, "m_s": 1, "b1": 2, "b2": 2, "b12": 1, "k": 2}
"""Two equal masses with a damper in the leg: s + b and s^2 + (b + 2 b12) s + 2 k have the root -2 three times."""
POLES = {
    "a double pole": EQUAL, "a triple pole": TRIPLE, "nearly a triple pole": TRIPLE | {"b1": 2.0000001},
    "two equal poles of three": TRIPLE | {"k": 1.5},
}  # fmt: skip
PROPAGATED = [
    ("joint", "nothing", "a double pole"), *(("leg_damper", "nothing", case) for case in [*POLES][1:]),
    *((*mode, "as it is") for mode in MODES), *((*mode, case) for mode in MODES[:2] for case in [*CASES][1:]),
]  # fmt: skip


# ---- symbols ----


def test_symbols_are_those_that_a_user_of_sympy_makes():
    joint = derive("joint")
    k, J = sp.symbols("k J")
    assert joint.poles["q_1"] == k / J == sp.sympify("k/J")
    assert joint.poles["q_1"].subs({"k": 2, "J": 4}) == sp.Rational(1, 2)
    for found in (joint, derivation_of("leg_damper")):
        for mode in found.modes:
            used = set().union(*(each.value.free_symbols | each.in_code.free_symbols for each in mode.formulas))
            used |= {each.equation.lhs for each in mode.formulas} | mode.M.free_symbols | mode.drive.free_symbols
            used |= mode.denominator.as_expr().free_symbols | set().union(
                *(each.free_symbols for each in mode.held_while.values())
            )
            assert used == {sp.Symbol(symbol.name) for symbol in used}
            assert all(mode.symbols[symbol.name] == symbol for symbol in used if mode.formulas)


def test_equations_that_are_pasted_are_those_of_the_formulas():
    joint, spaces = derive("joint"), dict[str, object]()
    exec(joint.show("q_time_to_rest", "sympy"), spaces)
    for equation in spaces["equations"]:
        assert equation == joint.formula(equation.lhs.name).equation


def test_assumptions_are_those_of_the_domains_on_request():
    plain, assumed = derive("joint"), derive("joint", assumptions=True)
    kinds = {name: symbol for name, symbol in assumed.symbols.items() if name in assumed.inputs}
    assert kinds["J"].is_positive and kinds["k"].is_nonnegative and not kinds["k"].is_positive
    assert kinds["q"].is_real and kinds["q"].is_positive is None
    assert kinds["q_max"].is_extended_real and not kinds["q_max"].is_finite
    assert kinds["s"].is_real is None and assumed.symbols["X1"].is_real is None
    assert sp.sqrt(kinds["J"] ** 2) == kinds["J"]
    names = {symbol: sp.Symbol(name) for name, symbol in assumed.symbols.items()}
    for one, other in zip(plain.formulas, assumed.formulas, strict=True):
        assert other.value.free_symbols <= {*assumed.symbols.values()}
        difference = other.value.xreplace(names) - one.value
        numbers = {symbol: sp.Rational(3, 7) for symbol in difference.free_symbols}
        assert abs(sp.N(difference.xreplace(numbers), DIGITS)) < 1e-35, one.name
    assert assumed.value("q_1", {"k": 2, "J": 4}) == 0.5
    assert plain.value("q_upper_stop", {"q_max": float("inf"), "q": 1}) == sp.oo


@pytest.mark.parametrize("name", ["hopper", "joint"])
def test_what_a_derivation_prints_is_at_most_ten_lines_and_names_what_it_has(name):
    found = derivation_of(name)
    lines = repr(found).splitlines()
    assert len(lines) <= 10 and found.model.title in lines[0]
    for each in (*found.state, *(parameter.name for parameter in found.model.parameters)):
        assert any(each in line for line in lines), each
    assert f"states {len(found.states)}" in repr(found)
    assert all(mode.name in repr(found) and mode.name in repr(mode) for mode in found.modes)
    assert all(len(repr(mode)) < 100 for mode in found.modes[1:])


def test_a_formula_is_a_function_of_numpy_with_the_names_and_units_of_what_it_takes():
    found = derivation_of("leg_damper")
    given = {name: float(value) for name, value in (ROBOT | AT).items()}
    for name in ("x2_t", "acc_1", "int_v1_squared", "contact_force"):
        function = found.lambdify(name)
        taken = list(inspect.signature(function).parameters)
        assert taken == [quantity.name for quantity in found._library.taken(found._needed([sp.Symbol(name)]))]
        values = {each: given[each] for each in taken}
        wanted = float(found.value(name, {key: str(value) for key, value in values.items()}))
        assert float(function(**values)) == float(function(*values.values())) == pytest.approx(wanted, rel=1e-12)
        for each in taken:
            assert f"{each} [{found.inputs[each].unit}] " in function.__doc__
    times = np.linspace(0.0, 0.1, 7)
    along = found.lambdify("x2_t")
    values = {each: given[each] for each in inspect.signature(along).parameters} | {"t": times}
    assert along(**values) == pytest.approx([float(along(**values | {"t": t})) for t in times], rel=1e-15)
    assert along(**values)[0] == given["x2_0"]


# ---- matrices ----


def mode_of(name: str, held: str):
    return derivation_of(name).mode(held)


def by_hand(name: str, held: str, given: dict):
    """M of the members of z and the constant part, from the force balance."""
    slips = SLIPS[held]
    of = exact(given)
    whole = matrix_of(name, of)
    rows = [row for n in (0, 1) if slips[n] and not (name == "joint" and n) for row in (2 * n, 2 * n + 1)]
    fixed = [0 if held != "actuator" else of["x1"], 0, 0 if held != "body" else of["x2"], 0]
    drive = [
        whole[row, 4] + sum(whole[row, column] * fixed[column] for column in range(4) if column not in rows)
        for row in rows
    ]
    return [[whole[row, column] for column in rows] for row in rows], drive


@OF_MODES
def test_a_mode_is_the_linear_system_of_the_force_balance(name, held):
    mode = mode_of(name, held)
    signs = {"actuator": {"side_1": 0}, "body": {"side_2": 0}}.get(held, {})
    given = ROBOT | AT | signs
    M, drive = by_hand(name, held, given)
    numbers = {key: sp.Rational(str(value)) for key, value in given.items()}
    for found, wanted in ((mode.M.tolist(), M), ([[each] for each in mode.drive], [[each] for each in drive])):
        for values, row in zip(found, wanted, strict=True):
            for value, number in zip(values, row, strict=True):
                exactly = sp.sympify(value).xreplace(
                    {symbol: numbers[symbol.name] for symbol in sp.sympify(value).free_symbols}
                )
                assert abs(mp.mpf(str(sp.N(exactly, DIGITS))) - number) < mp.mpf(10) ** -30
    forces = [mode.symbols[mode._names["u"]], *sp.symbols(mode.channels[1:])]
    by_channels = mode.B * sp.Matrix(forces)
    assert (mode.drive - by_channels).diff(forces[0]).applyfunc(sp.expand) == sp.zeros(len(mode.state), 1)


@pytest.mark.parametrize(("name", "held", "case"), [*PROPAGATED[:4], *sliced(*PROPAGATED[4:])])
def test_the_propagator_is_the_exponential_of_the_force_balance(name, held, case):
    given = ROBOT | AT | (CASES | POLES)[case]
    mode = mode_of(name, held)
    M, _ = by_hand(name, held, given)
    size, t = len(M), mp.mpf(str(given["t"]))
    masses = (
        [given["J"]]
        if name == "joint"
        else [given[m] for m, slips in zip(("m_eff", "m_s"), SLIPS[held], strict=True) if slips]
    )
    whole = mp.zeros(size + len(masses), size + len(masses))
    for row in range(size):
        for column in range(size):
            whole[row, column] = M[row][column]
    for n, mass in enumerate(masses):
        whole[2 * n + 1, size + n] = 1 / mp.mpf(str(mass))
    wanted = mp.expm(whole * t, method="taylor")
    phi, gamma = mode.propagator(texts_of(mode, given))
    for row in range(size):
        for column in range(size):
            assert phi[row, column] == pytest.approx(float(wanted[row, column]), rel=1e-14, abs=1e-300)
        for n in range(len(masses)):
            assert gamma[row, 1 + n] == pytest.approx(float(wanted[row, size + n]), rel=1e-14, abs=1e-300)


@pytest.mark.parametrize(("name", "held"), [MODES[1], *sliced(MODES[0], *MODES[2:])])
def test_transfer_functions_are_those_of_the_force_balance(name, held):
    """C (s - A)^-1 B + D at a complex s, of positions, velocities, an acceleration and a force in the leg."""
    mode, point = mode_of(name, held), mp.mpc(1.5, 40)
    given = ROBOT | AT
    values = texts_of(mode, given)
    M, _ = by_hand(name, held, given)
    resolvent = (point * mp.eye(len(M)) - mp.matrix(M)) ** -1
    outputs = [*mode.state, *([] if name == "joint" else ["contact_force"]), "acc_1"]
    A, B, C, D = (mp.matrix(each.tolist()) for each in mode.state_space(values, outputs=outputs))
    for n, output in enumerate(outputs):
        for column, channel in enumerate(mode.channels):
            above, below = mode.transfer_function(values, output=output, input=channel)
            found = mp.polyval(list(map(mp.mpf, above)), point) / mp.polyval(list(map(mp.mpf, below)), point)
            wanted = (C[n, :] * resolvent * B[:, column])[0] + D[n, column]
            assert abs(found - wanted) <= 1e-12 * abs(wanted) + mp.mpf(10) ** -25, (output, channel)
            assert below[0] == 1 and len(above) <= len(below)
            symbolic = mode.transfer_function(output=output, input=channel)
            numbers = {symbol: sp.Rational(values[symbol.name]) for symbol in symbolic.free_symbols - {sp.Symbol("s")}}
            exactly = sp.lambdify("s", symbolic.xreplace(numbers), mp)(point) if symbolic != 0 else 0
            assert abs(exactly - wanted) <= 1e-12 * abs(wanted) + mp.mpf(10) ** -25, (output, channel)
    assert max(abs(A[i, j] - M[i][j]) for i in range(len(M)) for j in range(len(M))) <= 1e-12


def test_a_pole_that_an_output_does_not_show_cancels_exactly():
    sea = derive("sea")
    assert len(sea.transfer_function(sea.defaults, output="q")[1]) == 5
    above, below = sea.transfer_function(sea.defaults, output="k*(theta - q)")
    assert len(below) == 4 and below[-1] != 0 and len(above) == 2
    assert sea.eigenvalues(sea.defaults)[0] == 0


def test_the_transfer_function_of_the_input_is_a_formula():
    """Of s complex by NumPy: a frequency response."""
    sea = derive("sea")
    along = 1j * np.logspace(-1, 3, 9)
    for name, output in (("X1_by_u", "theta"), ("X2_by_u", "q")):
        above, below = sea.transfer_function(sea.defaults, output=output, input="i")
        function = sea.lambdify(name)
        given = {key: sea.defaults[key] for key in inspect.signature(function).parameters if key != "s"}
        assert function(**given, s=along) == pytest.approx(
            np.polyval(above, along) / np.polyval(below, along), rel=1e-12
        )


@pytest.mark.sliced
@pytest.mark.filterwarnings(
    "ignore:Badly conditioned"
)  # of what scipy makes of the matrices of a system with a pole at 0
def test_scipy_takes_what_a_mode_gives():
    signal = pytest.importorskip("scipy.signal")
    sea = derive("sea")
    for mode in sea.modes[:-1]:
        output, w = mode.state[-2], np.logspace(0, 2.5, 7)
        system = signal.StateSpace(*mode.state_space(sea.defaults, outputs=[output], inputs=[mode.channels[-1]]))
        rational = signal.TransferFunction(
            *mode.transfer_function(sea.defaults, output=output, input=mode.channels[-1])
        )
        assert system.freqresp(w)[1] == pytest.approx(rational.freqresp(w)[1], rel=1e-9)
        sampled = signal.cont2discrete(mode.state_space(sea.defaults), 1e-3)
        for found, wanted in zip(mode.propagator(sea.defaults | {"t": "0.001"}), sampled, strict=False):
            assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_python_control_takes_what_a_mode_gives():
    control = pytest.importorskip("control")
    sea, w = derive("sea"), np.logspace(0, 2.5, 7)
    names = {"states": list(sea.state), "inputs": list(sea.channels), "outputs": list(sea.state)}
    system = control.StateSpace(*sea.state_space(sea.defaults), **names)
    rational = control.TransferFunction(*sea.transfer_function(sea.defaults, output="q", input="i"))
    assert system["q", "i"](1j * w) == pytest.approx(rational(1j * w), rel=1e-9)


@OF_MODES
def test_eigenvalues_are_those_of_the_force_balance(name, held):
    mode = mode_of(name, held)
    M, _ = by_hand(name, held, ROBOT | AT)
    wanted = [complex(each) for each in mp.eig(mp.matrix(M))[0]]
    found = list(mode.eigenvalues(texts_of(mode, ROBOT)))
    assert len(found) == len(wanted) == len(mode.eigenvalues())
    for each in wanted:
        nearest = min(found, key=lambda one: abs(one - each))
        found.remove(nearest)
        assert nearest == pytest.approx(each, rel=1e-14, abs=1e-25)


# ---- when what slips alone comes to rest ----

RESTS = {
    "rings": {}, "double pole": EQUAL, "two real poles": {"b": 900}, "an integrator": {"k": 0, "load": -60, "i": 0},
    "no damping, no spring": {"k": 0, "b": 0, "load": -60, "i": 0}, "a weak spring": {"k": 1e-9, "load": -60, "i": 0},
    "hardly damped": {"b": 1e-9}, "hardly damped, no spring": {"k": 0, "b": 1e-9, "load": -60, "i": 0}, "near a double pole": EQUAL | {"b": 120.0000001},
    "nearly a double pole, ringing": EQUAL | {"b": 119.9999999}, "from rest": {"phi_dot_0": 0, "side_1": -1},
    "backwards": {"phi_dot_0": -0.3, "side_1": -1},
}  # fmt: skip


@pytest.mark.parametrize("case", RESTS)
def test_what_slips_alone_is_at_rest_when_its_formula_says_so(case):
    """The velocity of the force balance is 0 then, for the first time; code has the digits of the formula."""
    joint = derivation_of("joint")
    given = ROBOT | AT | {"v2_0": 0} | RESTS[case]
    values = texts_of(joint, given)
    side = given["side_1"]
    if case == "from rest":
        values |= {"phi_0_": "0.1"}
        given |= {"phi_0_": 0.1}
    braking = float(joint.value("phi_braking", values))
    assert braking > 0 or float(joint.value("disc", values)) < 0
    rest = mp.mpf(str(joint.value("phi_time_to_rest", values, DIGITS)))
    start = [mp.mpf(str(given["phi_0_"])), mp.mpf(str(given["phi_dot_0"])), mp.mpf(0), mp.mpf(0), mp.mpf(1)]
    matrix = matrix_of("joint", exact(given))

    def velocity(t):
        return (mp.expm(matrix * t, method="taylor") * mp.matrix(start))[1]

    assert rest > 0 and abs(velocity(rest)) < mp.mpf(10) ** -25
    assert all(side * velocity(rest * n / 50) > 0 for n in range(1, 50))
    function = joint.lambdify("phi_time_to_rest")
    taken = inspect.signature(function).parameters
    assert float(function(**{each: float(values[each]) for each in taken})) == pytest.approx(float(rest), rel=1e-12)


def test_what_is_driven_on_never_comes_to_rest():
    """Two real poles, driven along: no braking, and the velocity keeps its sign."""
    joint = derivation_of("joint")
    given = ROBOT | AT | {"v2_0": 0, "b": 900, "k": 1e-6, "load": 200}
    values = texts_of(joint, given)
    assert joint.value("phi_braking", values) < 0
    assert all(joint.value("phi_dot_t", values | {"t": str(t)}) > 0 for t in (0.01, 1, 30))


def test_of_two_masses_the_one_that_slips_alone_comes_to_rest():
    for held in ("actuator", "body"):
        mode = mode_of("hopper", held)
        n = {"actuator": 2, "body": 1}[held]
        names = [each.name for each in mode.found("states")]
        assert f"x{n}_time_to_rest" in names and f"x{3 - n}_time_to_rest" not in names
        values = texts_of(mode, ROBOT | AT)
        rest = mode.value(f"x{n}_time_to_rest", values, DIGITS)
        assert rest > 0 and abs(mode.value(f"v{n}_t", values | {"t": rest}, 20)) < 1e-15
    assert not [name for name in derivation_of("hopper").states if name.endswith("_time_to_rest")]


# ---- what is refused, and the command ----


def test_a_mode_refuses_what_it_does_not_have():
    sea = derive("sea")
    with pytest.raises(
        ModelError,
        match="a mode of sea is named by the masses that are held, one of 'nothing', 'motor', 'load', 'motor, load'.*got 'knee'",
    ):
        sea.mode("knee")
    with pytest.raises(ModelError, match="an input of sea is one of i, force_theta, force_q, got 'u'"):
        sea.transfer_function(output="q", input="u")
    with pytest.raises(ModelError, match=r"output q\*x of sea has x; allowed: theta, theta_dot, q, q_dot"):
        sea.state_space(outputs=["q*x"])
    with pytest.raises(ModelError, match=r"output q\*theta of sea is not linear in theta, theta_dot, q, q_dot, i$"):
        sea.state_space(outputs=["q*theta"])
    with pytest.raises(ModelError, match=r"output 'q\*' of sea is no expression of sympy"):
        sea.transfer_function(output="q*")
    for name, value, allowed in (("k", "a lot", "> 0"), ("k", float("inf"), "> 0"), ("J_m", 0, "> 0"), ("d", -1, ">= 0"),
                                 ("load", float("nan"), "finite"), ("load", [1, 2], "finite")):  # fmt: skip
        with pytest.raises(ModelError, match=f"{name} of sea must be {allowed}.*, got {re.escape(repr(value))}"):
            sea.propagator(sea.defaults | {"t": 0.1, name: value})
    with pytest.raises(ModelError, match="sea has no parameter or input 'J_M': did you mean J_m"):
        sea.value("s_1", sea.defaults | {"J_M": 1e-5})
    with pytest.raises(ModelError, match=r"of sea takes t, got \['F_l'.*'theta_min'\]$"):
        sea.propagator(sea.defaults)
    with pytest.raises(ModelError, match=r"of sea takes .*, got \['N'\]"):
        sea.state_space({"N": 50})
    with pytest.raises(ModelError, match="nothing moves in sea with motor, load held"):
        sea.mode("load,motor").show()
    with pytest.raises(ModelError, match="nothing moves in pogo with body held: it has no inputs"):
        derivation_of("pogo").mode("body").transfer_function(output="h")
    with pytest.raises(
        ModelError, match="sea has no formula '14'; known: the groups lagrangian, .*, works, event_functions, and"
    ):
        sea.show("14")


def test_the_command_prints_the_formulas_of_a_mode(capsys):
    for held in ("actuator", "body"):
        assert cli.main(["model", "show", "hopper", "states", "--mode", held, "--as", "numpy"]) == 0
        assert capsys.readouterr().out == mode_of("hopper", held).show("states", "numpy")
    assert cli.main(["model", "show", "hopper", "x2_t", "--mode", "actuator", "--as", "c"]) == 0
    assert "hopper_actuator_held_x2_t(" in capsys.readouterr().out
    assert cli.main(["model", "show", "hopper", "--mode", "knee"]) == 2
    assert "one of 'nothing', 'actuator', 'body', 'actuator, body'" in capsys.readouterr().err
