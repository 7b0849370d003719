"""Names that authors use: symbols of the field, words that C and Python have for something else, letters beyond ASCII.

The model is a mass under many constant forces, x = x_0 + t^2/(2 m) sum of n F_n, so that each name has a number of its
own in each answer.
"""

import io
import itertools
import json
import math
import re
import subprocess
import tomllib
from contextlib import redirect_stdout
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import sympy as sp

from derive.derivation import Derivation
from derive.model.names import in_c, in_python, why_not
from derive.shipped import FILES, shipped
from hopform import HopformError
from hopform import _front as cli
from hopform._robots import BaseRobot, robot_from_toml
from tests import needs
from tests.derived import model_of, solver_of

pytestmark = needs.library


def words(text: str) -> list[str]:
    return text.split()


SYMBOLS = words("""m M J I J_m J_L I_y k k_s k_t k_e K K_p K_P K_d K_D K_i b B b_m c C d D D_m f F F_c F_s f_s f_v g G h H_0 l
L l_0 L_0 L_a r R R_a R_A R_m r_p n N_g i_g p P p_s A A0 A_p V V_0 U E E_m e_0 s S d_s d_p t T T_L T_c T_f t_0 q_0 w W x_0
X y_0 Y z_0 Z alpha beta eta mu mu_s mu_k phi psi rho sigma tau_m theta_0 omega_0 zeta delta B0 B1 C1 K1 L1 name""")
"""Usual symbols of mechanics, drives and control."""
WORDS = words("""letters fit fall fields sample parameters model description solver start horizon robot
dtype int float real double sqrt count index domain Rates Letters Robot Real PI EACH NULL min abs near linux errno final
this I_ I__ A0_ k_real k_f64 hopform_x d_letters value lambda_ θ θ_0 Δ U0003B8
NEVER EPSILON INT32_MAX M_PI BITS signed restrict inline template nullptr bool true register typeof property tuple type
super k_f32 d_tau my_HOPFORM größe np value_real""")
"""Words that a robot, Python, C, the library or one of its macros has for something else, and beyond ASCII."""
NAMES = [*SYMBOLS, *WORDS]
MASS, *FORCES = NAMES
PRODUCTS = [FORCES[n : n + 4] for n in range(0, len(FORCES), 4)]
"""Of which each is a term of the force: a file may have 64 terms."""
UNITS = {MASS: "kg", **{name: "1" for name in FORCES}, **{names[0]: "N" for names in PRODUCTS}}
LINES = [f'"{name}", "{UNITS[name]}", "number {n}", "positive", {n + 2}' for n, name in enumerate(NAMES)]
MODEL = "\n".join((
    '"""A mass under many forces."""', "from hopform.model import *",
    *(f"p{n} = parameter({line})" for n, line in enumerate(LINES)),
    'x = coordinate("x", "m", p0, "block")', 'i = current("i")',
    f'force(x, {" + ".join("*".join([str(n), *(f"p{NAMES.index(name)}" for name in names)]) for n, names in enumerate(PRODUCTS, 1))}, "push")',
    'force(x, 2*i, "M_PI")',
))  # fmt: skip
VALUES = {name: n + 2.0 for n, name in enumerate(NAMES)}
HORIZON = 0.25


@pytest.fixture(scope="module")
def solver(store, tmp_path_factory) -> Any:
    file = tmp_path_factory.mktemp("names") / "names.py"
    file.write_text(MODEL, "utf-8")
    return solver_of(store, file)


@pytest.fixture(scope="module")
def robot(solver) -> Any:
    return solver.load_robot("names")


def place(values: dict[str, float], u: float = 0.0) -> float:
    """x at the horizon, in closed form."""
    force = sum(n * math.prod(values[name] for name in names) for n, names in enumerate(PRODUCTS, 1)) + 2.0 * u
    return force * HORIZON**2 / (2.0 * values[MASS])


def test_there_are_as_many_symbols_as_the_field_uses():
    assert len(set(SYMBOLS)) == len(SYMBOLS) >= 80
    assert not [name for name in NAMES if why_not(name) is not None]


@pytest.mark.sliced
def test_every_name_has_its_own_number_in_a_motion(solver, robot):
    motion = solver.solve_motion(robot, start={}, horizon=HORIZON)
    assert motion.at(HORIZON).x == pytest.approx(place(VALUES), rel=1e-12)
    by = motion.sensitivities
    assert by.matrix.shape[1] >= len(NAMES)
    for n, names in enumerate(PRODUCTS, 1):
        product = n * math.prod(VALUES[name] for name in names)
        for name in names:
            expected = product / VALUES[name] * HORIZON**2 / (2.0 * VALUES[MASS])
            assert by["x", name] == pytest.approx(expected, rel=1e-11), name
    assert by["x", MASS] == pytest.approx(-place(VALUES) / VALUES[MASS], rel=1e-11)


@pytest.mark.sliced
def test_every_name_is_that_of_its_number_in_a_robot(solver, robot):
    assert {name: robot[name] for name in NAMES} == VALUES == robot.parameters._asdict()
    for n, name in enumerate(NAMES):
        if name not in ("name", "description", "fit"):  # texts and the fit of every robot have these arguments
            assert solver.Robot(**{name: n + 0.5})[name] == n + 0.5, name
        if name == in_python(name):
            assert getattr(robot, name) == robot[name]
    with pytest.raises(HopformError, match=r"the model names has no parameter 'J_l', did you mean 'J_L'\?"):
        robot["J_l"]


@pytest.mark.sliced
def test_every_name_can_be_given_to_a_batch_or_is_an_argument_of_it(solver, robot):
    arguments = {"robot", "start", "horizon", "dtype"}
    for name in [name for name in NAMES if name not in arguments][::9]:
        at = [VALUES[name], VALUES[name] + 1.0]
        found = solver.solve_motions(robot, start={}, horizon=HORIZON, **{name: np.array(at)}).end.x
        assert found == pytest.approx([place(VALUES | {name: each}) for each in at], rel=1e-12), name


@pytest.mark.sliced
def test_files_and_answers_have_every_name(solver, robot):
    text = robot.to_toml()
    assert robot_from_toml(text, kind=solver.Robot) == robot
    table = tomllib.loads(text)
    apart = table.pop("parameters")
    assert set(apart) == {"name", "model", "description", "fit", "parameters"} & set(NAMES)
    assert {name: (table | apart)[name] for name in NAMES} == VALUES
    for changed in (text + "k = 1.0\n", text.replace("[parameters]", "[parameters]\nnope = 1.0")):
        with pytest.raises(HopformError, match=r"k is given twice|unknown parameter 'nope'"):
            robot_from_toml(changed, kind=solver.Robot)
    with redirect_stdout(io.StringIO()) as out:
        place_of = str(solver._core.folder.path("solver.toml").parent)
        assert cli.main(["--solver", place_of, "motion", "--set", "name=7", "--set", "J_L=9", "--json"]) == 0
    answered = json.loads(out.getvalue())["robot"]
    assert answered | answered.pop("parameters") | {"name": 7.0} == (VALUES | {"name": 7.0, "J_L": 9.0}) | {
        key: answered[key] for key in answered if key not in VALUES
    }


MACROS_OF_BOARDS = {
    **{f"A{n}": str(14 + n) for n in range(16)}, **{f"D{n}": str(n) for n in range(16)},
    **{f"B{n:b}": str(n) for n in range(16)}, "PI": "3.14", "HALF_PI": "1.57", "DEFAULT": "1", "EULER": "2.7",
    "F(text)": "(text)", "HIGH": "1", "LOW": "0", "INPUT": "0", "OUTPUT": "1", "LED_BUILTIN": "13", "DEC": "10",
    "HEX": "16", "E": "2.7", "P0": "((int *)0)", "GPIOA": "((int *)0)", "TIM2": "((int *)0)", "SCB": "((int *)0)",
    "SysTick": "((int *)0)", "CoreDebug": "((int *)0)", "DWT": "((int *)0)", "ITM": "((int *)0)", "RTC": "((int *)0)",
    "Serial": "SerialUSB", "abs(x)": "((x) > 0 ? (x) : -(x))", "min(a, b)": "((a) < (b) ? (a) : (b))",
    "max(a, b)": "((a) > (b) ? (a) : (b))", "sq(x)": "((x) * (x))", "round(x)": "((long)(x))", "J_L": "7", "T_L": "8",
}  # fmt: skip
"""Of Arduino.h, binary.h and CMSIS, and two of a header of one's own."""
HEADERS = ("assert", "complex", "ctype", "errno", "fenv", "float", "inttypes", "iso646", "limits", "locale", "math",
           "setjmp", "signal", "stdalign", "stdarg", "stdbool", "stddef", "stdint", "stdio", "stdlib", "stdnoreturn",
           "string", "tgmath", "threads", "time", "termios", "netdb", "netinet/in", "sys/stat")  # fmt: skip


def macros_of_compiler() -> set[str]:
    """The macros without arguments that a compiler and the headers of an operating system define."""
    text = "".join(f"#include <{name}.h>\n" for name in HEADERS)
    shown = subprocess.run(["gcc", "-dM", "-E", "-"], input=text, capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"#define (\w+)(?= |$)", shown, re.MULTILINE))


def test_no_name_of_c_is_a_macro_and_no_two_are_one():
    real = macros_of_compiler() | {name for name in MACROS_OF_BOARDS if name.isidentifier()}
    assert {"I", "errno", "B110", "M_PI", "stdin", "linux"} < real
    known = {name for name in real if why_not(name) is None} | {*NAMES}
    letters = ("I", "_", "U", "0", "A", "θ", "h", "opform", "U0003B8", "x", "_real")
    known |= {"".join(each) for size in range(1, 5) for each in itertools.product(letters, repeat=size)}
    several = [name for name in sorted(known | {f"{name}_" for name in known}) if why_not(name) is None]
    spelled = dict(zip(several, map(in_c, several), strict=True))
    assert len(set(spelled.values())) == len(several)
    assert not {name for name in spelled.values() if name in real}
    assert all(
        re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name) and "hopform" not in name.lower() for name in spelled.values()
    )


def test_names_of_the_models_that_ship_are_spelled_as_they_are():
    for model in FILES:
        for each in shipped(model).parameters:
            assert in_c(each.name) == in_python(each.name) == each.name


def test_attributes_of_a_robot_are_those_that_python_renames():
    """A parameter of any other name is an attribute of that name."""
    own = {name for name in dir(BaseRobot) if not name.startswith("_")} | {each.name for each in fields(BaseRobot)}
    own |= {"CHECKS", "solver", "parameters"}
    assert {name for name in own if in_python(name) == name} == {"travel"}  # which is no name of a parameter


@pytest.mark.sliced
def test_headers_and_programs_for_boards_compile_beside_their_macros(solver, tmp_path):
    """The public header, a robot by its members, and the library without them."""
    folder = solver._core.folder.path("solver.toml").parent / "c"
    members = ", ".join(f".{in_c(name)} = {value!r}" for name, value in VALUES.items())
    defined = "".join(
        f"#undef {name.partition('(')[0]}\n#define {name} {value}\n" for name, value in MACROS_OF_BOARDS.items()
    )
    includes = "".join(f"#include <{name}.h>\n" for name in HEADERS)
    sketch = (
        f'{includes}{defined}#include "hopform/hopform.h"\nconst hopform_robot_f64 robot = {{{members}}};\n'
        f"double sum(void) {{ return {' + '.join(f'robot.{in_c(name)}' for name in NAMES)}; }}\n"
    )
    (tmp_path / "sketch.c").write_text(sketch, "utf-8")
    flags = ["-std=gnu11", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", f"-I{folder / 'include'}",
             f"-I{folder / 'src'}"]  # fmt: skip
    for unit in (tmp_path / "sketch.c", *sorted((folder / "src").glob("hopform_*.c"))):
        subprocess.run(["gcc", *flags, str(unit)], check=True)
    header = (folder / "include" / "hopform" / "hopform_f64.h").read_text("utf-8")
    for name in NAMES:
        said = f"{name}: number" if in_c(name) != name else "number"
        assert re.search(rf"double {re.escape(in_c(name))};\s+/\*\*< \[\w+\] {said}", header), name


def test_time_is_tau_beside_a_parameter_t():
    beside = Derivation(model_of('m = parameter("m", "kg", "mass", "positive")\nt = parameter("t", "N", "force")\n'
                                 'x = coordinate("x", "m", m, "block")\nforce(x, t, "push")'))  # fmt: skip
    assert beside.inputs["t"].unit == "N" and beside.inputs["tau"].unit == "s"
    assert beside.inputs["tau"].glyph == r"\tau"
    for each in beside.formulas:
        assert "(t)" not in each.quantity.glyph
        assert not {"t_"} & {symbol.name for symbol in each.value.free_symbols}
    assert sp.Symbol("tau") in set().union(*(each.value.free_symbols for each in beside.formulas))
