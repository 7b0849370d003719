"""`hopform.model.derive`: its formulas are those of the mechanism, in every form in which they are pasted.

Motions are compared with the matrix exponential of force balances that are written down here by hand, with 40 digits;
printed forms are read back, run and compiled, and compared with the value of the formula.
"""

import doctest
import json
import math
from functools import cache, cached_property

import mpmath
import pytest
import sympy as sp

import hopform
from derive import derivation, ir, mode, mode_formulas
from derive.maths import formulas
from derive.maths.formulas import GROUPS
from derive.model import declare
from hopform import _front as cli
from hopform.model import Derivation, ModelError, derive
from tests import needs
from tests.derived import MODELS, SHIPPED, model_file, model_of, no_hopper

NAMES = ("joint", "hopper", "leg_damper", "second_spring")
EACH = pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
THAT_SHIP = ", ".join(sorted(path.stem for path in SHIPPED.glob("[!_]*.py")))
DIGITS = 40
mp = mpmath.mp.clone()
mp.dps = DIGITS + 20


@cache
def derivation_of(name: str) -> Derivation:
    return derive(name if name == "hopper" else model_file(name))


def texts_of(found: mode.Mode, given: dict) -> dict[str, str]:
    """What a derivation takes of numbers, as texts: decimals are meant exactly."""
    return {name: str(value) for name, value in given.items() if name in found.inputs}


# ---- the mechanisms, by hand ----

ROBOT = {
    "m_eff": 21, "m_s": 3.2, "k": 1250, "L0": 0.41, "c": 0.003, "b1": 33, "b2": 4, "f1": 0.7, "f2": 0.4, "gamma2": -60,
    "g": 9.81, "x1_min": -0.01, "x1_max": 0.08, "u_max": 5, "impact_loss": 0.05, "travel": 0.16, "b12": 11, "k_2": 300,
    "L_2": 0.37, "load": 5, "J": 21, "phi_0": -0.413, "b": 33, "F_plus": 14.7, "F_minus": 4.2, "k_t": 60,
    "phi_min": -0.01, "phi_max": 0.08, "i_max": 5, "f1_excess": 0.3, "f2_excess": 0.15,
}  # fmt: skip
AT = {
    "x1": 0.013, "v1": 0.21, "x2": 0.35, "v2": -1.1, "x1_0": 0.004, "v1_0": 0.3, "x2_0": 0.36, "v2_0": -1.9, "u": 2.5,
    "side_1": 1, "side_2": -1, "t": 0.07, "s": 2.5, "X1": 0.13, "X2": 0.41, "height": 0.2, "aed": 1.7, "h_des": 0.3,
    "step": 0.02, "x1_T": 0.05, "y": 0.02, "phi": 0.013, "phi_dot": 0.21, "phi_0_": 0.004, "phi_dot_0": 0.3, "i": 2.5,
}  # fmt: skip


def forces(name, of, x1, v1, x2, v2):
    """The forces on actuator and body [N] but for Coulomb friction and the current, as one draws them."""
    if name == "joint":
        return -of["k"] * (x1 - of["phi_0"]) - of["b"] * v1 + of["load"], 0
    spring = of["k"] * (x1 - x2 + of["L0"] + of["c"])
    on_1, on_2 = -spring + of["k"] * of["c"] - of["b1"] * v1, spring - of["b2"] * v2 - of["m_s"] * of["g"]
    leg = in_leg(name, of, x1, v1, x2, v2)
    return on_1 - leg, on_2 + leg


def in_leg(name, of, x1, v1, x2, v2):
    """What acts in the leg beside its spring [N]."""
    others = {"leg_damper": of["b12"] * (v1 - v2), "second_spring": of["k_2"] * (x1 - x2 + of["L_2"])}
    return others.get(name, 0)


def friction(name, of, side_1, side_2):
    """Coulomb friction [N]: the joint's differs by the sign of the velocity."""
    if name == "joint":
        return -of["F_minus" if side_1 < 0 else "F_plus"] * side_1, 0
    return -of["m_eff"] * of["f1"] * side_1, -of["m_s"] * of["f2"] * side_2


def at_rest(name, of, n):
    """How much more friction [N] holds a mass at rest than in motion."""
    return 0 if name == "joint" else of[("m_eff", "m_s")[n - 1]] * of[f"f{n}_excess"]


def accelerations(name, of, x1, v1, x2, v2):
    """Accelerations of actuator and body; a joint has no body."""
    (on_1, on_2), (dry_1, dry_2) = forces(name, of, x1, v1, x2, v2), friction(name, of, of["side_1"], of["side_2"])
    if name == "joint":
        return (on_1 + dry_1 + of["k_t"] * of["i"]) / of["J"], 0
    acc_1 = (on_1 + dry_1 - of["gamma2"] * of["u"]) / of["m_eff"]
    return acc_1, (on_2 + dry_2) / of["m_s"]


def exact(values):
    return {key: mp.mpf(str(value)) for key, value in values.items()}


def matrix_of(name, of):
    """The 5 x 5 matrix of the motion of (x1, v1, x2, v2, 1), column by column."""
    zero = accelerations(name, of, *[mp.mpf(0)] * 4)
    matrix = mp.zeros(5, 5)
    for n in (0, 1):
        matrix[2 * n, 2 * n + 1] = 1
        matrix[2 * n + 1, 4] = zero[n]
        for column in range(4):
            unit = [mp.mpf(int(row == column)) for row in range(4)]
            matrix[2 * n + 1, column] = accelerations(name, of, *unit)[n] - zero[n]
    return matrix


def moved(name, of):
    start = mp.matrix([of["x1_0"], of["v1_0"], of["x2_0"], of["v2_0"], 1])
    return mp.expm(matrix_of(name, of) * of["t"], method="taylor") * start


STATES = ("x1_t", "v1_t", "x2_t", "v2_t")
OF_JOINT = ("phi_t", "phi_dot_t")


@EACH
def test_the_states_are_those_of_the_force_balance(name):
    """As it is written down here: `hopform model prove` reads the file."""
    given = ROBOT | AT
    wanted = moved(name, exact(given) | ({"v2_0": mp.mpf(0)} if name == "joint" else {}))
    for row, state in enumerate(OF_JOINT if name == "joint" else STATES):
        found = derivation_of(name).value(state, texts_of(derivation_of(name), given), DIGITS + 20)
        assert abs(mp.mpf(str(found)) - mp.mpf(str(wanted[row]))) < mp.mpf(10) ** -28, state


def test_a_pair_of_equal_poles_is_no_exception():
    """The joint with p^2 = 4 q, exactly."""
    given = ROBOT | AT | {"J": 4, "k": 900, "b": 120, "v2_0": 0}
    wanted = moved("joint", exact(given))
    assert derivation_of("joint").value("disc", texts_of(derivation_of("joint"), given)) == 0
    found = derivation_of("joint").value("phi_t", texts_of(derivation_of("joint"), given), DIGITS)
    assert abs(mp.mpf(str(found)) - wanted[0]) < mp.mpf(10) ** -30


@EACH
def test_event_functions_are_those_of_the_force_balance(name):
    of = exact(ROBOT | AT)
    at = of["x1"], of["v1"], of["x2"], of["v2"]
    found = derivation_of(name)

    def value(each):
        return mp.mpf(str(found.value(each, texts_of(found, of), DIGITS)))

    first = "phi" if name == "joint" else "x1"
    ends = (of["phi_min"], of["phi_max"]) if name == "joint" else (of["x1_min"], of["x1_max"])
    wanted = {"velocity": at[1], "lower_stop": at[0] - ends[0], "upper_stop": ends[1] - at[0]}
    wanted = {f"{first}_{each}": number for each, number in wanted.items()}
    if name != "joint":
        leg = of["k"] * (at[0] - at[2] + of["L0"] + of["c"])
        leg += in_leg(name, of, *at)
        wanted |= {"contact_force": leg, "x2_velocity": at[3]}
    for n in (1,) if name == "joint" else (1, 2):
        still = [speed if index != 2 * n - 1 else mp.mpf(0) for index, speed in enumerate(at)]
        motor = of["k_t"] * of["i"] if name == "joint" else -of["gamma2"] * of["u"]
        driven = forces(name, of, *still)[n - 1] + (motor if n == 1 else 0)
        mass = of["J"] if name == "joint" else of[("m_eff", "m_s")[n - 1]]
        for way, side in (("forward", 1), ("backward", -1)):
            most = -friction(name, of, side, side)[n - 1] * side + at_rest(name, of, n)
            wanted[f"{first if n == 1 else 'x2'}_stick_margin_{way}"] = (most - side * driven) / mass
    known = {each for each in found.event_functions if not each.endswith(("_coulomb_level", "_free_acceleration"))}
    assert known == {*wanted}
    for each, number in wanted.items():
        assert abs(value(each) - number) < mp.mpf(10) ** -30, each


def test_modes_have_an_order_a_denominator_and_the_conditions_that_may_fail():
    damper, fed = derivation_of("leg_damper"), derive(MODELS / "feedforward.py")
    assert [(each.held, each.order) for each in damper.modes] == [
        ((), 3), (("actuator",), 2), (("body",), 2), (("actuator", "body"), 0)
    ]  # fmt: skip
    s = sp.Symbol("s")
    of = {sp.Symbol(key): sp.Rational(str(value)) for key, value in ROBOT.items()}
    matrix = matrix_of("leg_damper", exact(ROBOT | AT))
    wanted = [1, -(matrix[1, 1] + matrix[3, 3])]
    found = [mp.mpf(str(sp.N(each.subs(of), 20))) for each in damper.modes[0].denominator.all_coeffs()]
    assert all(abs(a - b) < 1e-15 * abs(b) for a, b in zip(found[:2], wanted, strict=True))
    assert damper.modes[0].denominator.gens == (s,)
    assert [each.conditions for each in damper.modes] == [{}] * 4
    condition = sp.sympify("(b1 - k_fed)/m_eff").replace(lambda each: each.is_Symbol, lambda each: sp.Symbol(each.name))
    assert [list(each.conditions) for each in fed.modes] == [[], [], ["p_1"], []]
    assert sp.expand(fed.modes[2].conditions["p_1"] - condition) == 0
    assert [each.held for each in derivation_of("joint").modes] == [(), ("joint",)]


# ---- names, numbers, units ----


def test_the_hopper_has_every_equation_of_the_paper():
    numbers = {number for each in derivation_of("hopper").formulas for number in each.numbers}
    assert numbers == set(range(1, 28))
    assert [each.name for each in derivation_of("hopper").found("(14)")] == ["H2"]
    assert {each.group for each in derivation_of("hopper").formulas} == {*GROUPS}


def test_a_parameter_may_have_a_name_of_the_derivation(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(
        "from hopform.model import *\n"
        'beta = parameter("beta", "N s/m", "drag", "nonnegative", 0)\n'
        "viscous(include('hopper').x1, beta, 'drag')\n"
    )
    found = derive(file)
    assert sp.Symbol("beta") in found.equations_of_motion["acc_1"].free_symbols
    assert sp.Symbol("beta_") in found.numerators["H4"].free_symbols
    assert found.formula("beta_").group == "transfer"


def test_a_coordinate_may_have_a_name_of_the_derivation():
    """The start of y is no formula; the stretch at the start, which is called so elsewhere, has an underscore."""
    text = "m = parameter('m', 'kg', 'mass', 'positive')\nx, y = coordinate('x', 'm', m), coordinate('y', 'm', 2*m)\n"
    found = Derivation(model_of(f"{text}spring(x - y, 50)\n"))
    assert not {each.name for each in found.formulas} & found.inputs.keys()
    assert found.states["y_0_"] == sp.sympify("x_0 - y_0")
    assert found.lambdify("y_t")(m=1.0, x_0=0.0, v_0=0.0, y_0=1.0, y_dot_0=0.0, t=0.0) == 1.0


BASE = {"kg": 1.7, "m": 2.3, "s": 0.6, "A": 3.1, "rad": 1.0}
BASE |= {"N": BASE["kg"] * BASE["m"] / BASE["s"] ** 2, "1": 1.0}
BASE |= {"J": BASE["N"] * BASE["m"], "W": BASE["N"] * BASE["m"] / BASE["s"]}


def size(unit):
    above, *below = unit.split("/")
    powers = [(word, 1) for word in above.split()] + [(word, -1) for group in below for word in group.split()]
    return math.prod(BASE[word.split("^")[0]] ** (sign * int((word + "^1").split("^")[1])) for word, sign in powers)


@pytest.mark.parametrize("name", needs.the_first(["joint", "leg_damper"]))
def test_units_balance_in_every_formula(name):
    """In other units of mass, length, time and current every formula has the value that its unit says."""
    found = derivation_of(name)
    given = ROBOT | AT
    units = {each: quantity.unit for each, quantity in found.inputs.items()} | {"X1": "m s", "X2": "m s"}
    scaled = {key: value * size(units.get(key, "1")) for key, value in given.items()}
    for each in found.formulas:
        one, other = (float(found.value(each.name, texts_of(found, values))) for values in (given, scaled))
        assert other == pytest.approx(one * size(each.quantity.unit), rel=1e-8, abs=1e-12), each.name


# ---- forms ----


def test_json_has_the_texts_and_units_of_the_formulas():
    found = derivation_of("hopper")
    lines = [line for line in found.show().splitlines() if line and not line.startswith("#")]
    in_json = json.loads(found.show(form="json"))
    assert len(lines) == len(in_json) == len(found.formulas)
    for line, entry, formula in zip(lines, in_json, found.formulas, strict=True):
        left, _, right = line.partition("  # ")[0].partition(" = ")
        assert left == entry["name"] == formula.name and entry["unit"] == formula.quantity.unit
        assert right == entry["text"], line


def test_latex_is_in_glyphs_that_balance():
    found = derivation_of("leg_damper")
    glyphs = {quantity.glyph for quantity in found.inputs.values()}
    for formula in found.formulas:
        comment, line = found.show(formula.name, "latex").splitlines()
        assert comment.startswith(f"% {formula.name}: ")
        assert line.startswith(f"{formula.quantity.glyph} = ")
        assert line.count("{") == line.count("}") and "_t" not in line.replace(r"\_t", "")
        for symbol in formula.value.free_symbols:
            assert found.inputs.get(symbol.name) is None or found.inputs[symbol.name].glyph in line, line
    assert r"b_{12}" in glyphs


def test_the_notebook_runs_cell_by_cell():
    book = json.loads(derivation_of("leg_damper").show(form="notebook"))
    spaces: dict[str, object] = {}
    for cell in book["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), spaces)
    assert {group for group in GROUPS if group in spaces} == {
        each.group for each in derivation_of("leg_damper").formulas
    }
    assert len({cell["id"] for cell in book["cells"]}) == len(book["cells"]) and book["nbformat"] == 4


# ---- the door ----


def test_every_documented_example_of_the_derivation_runs():
    for module, least in ((derivation, 9), (mode, 20), (mode_formulas, 30), (formulas, 3), (ir, 3), (declare, 1)):
        cached = {
            f"{kind.__name__}.{name}": value.__doc__ or ""
            for kind in vars(module).values() if isinstance(kind, type) and kind.__module__ == module.__name__
            for name, value in vars(kind).items() if isinstance(value, cached_property)
        }  # fmt: skip
        outcome = doctest.testmod(module)  # which does not look into cached properties
        runner, parser = doctest.DocTestRunner(), doctest.DocTestParser()
        for name, text in cached.items():
            runner.run(parser.get_doctest(text, dict(vars(module)), name, None, None))
        assert outcome.failed == runner.failures == 0 and outcome.attempted + runner.tries >= least


def test_the_door_says_what_is_wrong(tmp_path):
    with pytest.raises(ModelError, match=f"there is no model file .*nothing; models that ship: {THAT_SHIP}$"):
        derive(tmp_path / "nothing")
    with pytest.raises(ModelError, match=r"hopper has no formula 'H22'; did you mean H2_2\?"):
        derivation_of("hopper").show("H22")
    with pytest.raises(ModelError, match=r"hardening.py: line 4: spring .*changes with x1, x2; the Laplace"):
        derive(no_hopper(tmp_path, "hardening"))
    with pytest.raises(ModelError, match="s_1 of hopper takes b1"):
        derivation_of("hopper").value("s_1", {"b2": 1, "m_eff": 1, "m_s": 1})


@pytest.mark.parametrize(
    ("arguments_of", "said"),
    [
        (["model", "show", "hopper", "H22"], "did you mean H2_2?"),
        (["model", "show", "nothing"], f"whose name ends in .py, or one of {THAT_SHIP}, got 'nothing'"),
        (["model", "show", "nothing.py"], "nothing.py cannot be read: No such file"),
        (["model", "show", "undeclared.py"], "damping is k_emf, and k_emf is not declared"),
        (["model", "show", "hopper", "--as", "numpy", "--f32"], "--f32 goes with --as c"),
        (["equations", "14", "--as", "c", "--json"], "exclude each other"),
        (["equations", "28", "--as", "c"], "known: (1) to (27)"),
    ],
)
def test_the_commands_refuse_in_one_line(capsys, tmp_path, monkeypatch, arguments_of, said):
    monkeypatch.chdir(no_hopper(tmp_path, "undeclared").parent)
    assert cli.main(arguments_of) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and said in printed.err and printed.err.count("\n") == 1


def test_the_commands_print_what_the_derivation_shows(capsys):
    assert cli.main(["model", "show", str(SHIPPED / "leg_damper.py"), "acc_1", "--as", "latex"]) == 0
    assert capsys.readouterr().out == derivation_of("leg_damper").show("acc_1", "latex")
    assert cli.main(["equations", "(14)", "--as", "c"]) == 0
    assert capsys.readouterr().out == derivation_of("hopper").show("14", "c")
    assert cli.main(["equations", "--as", "text"]) == 0
    assert capsys.readouterr().out == derivation_of("hopper").show("paper")
    assert cli.main(["model", "show", "hopper", "x2_t", "--as", "c", "--f32"]) == 0
    assert "static inline float hopper_x2_t(" in capsys.readouterr().out
    assert cli.main(["model", "show", "hopper", "x2_t", "--whole"]) == 0
    assert capsys.readouterr().out == derivation_of("hopper").show("x2_t", whole=True)
    assert hopform.model.derive is derive
