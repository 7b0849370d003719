"""What `hopform model show` prints to be pasted, run: each formula of each model as NumPy, as C in double and in single
precision, as text and as sympy, against 40 digits.

A rounded number is compared with the exact one in units in the last place of the *scale* of its formula: its size, what
it changes by, in proportion, where all inputs change by their own size up or down (so an error of an ulp in each input is
one of an ulp here), and the sizes of the terms that are written in it, and in the integral of velocities or the partial
fraction that it reads. A formula in which digits cancel between steps, as (18) as printed does
near equal poles, is off by millions of them.
"""

import ctypes
import json
import math
import random
import re
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from sympy.printing.pycode import MpmathPrinter

from derive.emit.examples import example_value
from derive.emit.forms import IN_CODE
from derive.maths.formulas import Formula
from hopform import _front as cli
from hopform.model import Derivation, derive
from tests import needs
from tests.derived import MODELS, SHIPPED

mp = mpmath.mp
MODEL_FILES = {path.stem if folder == SHIPPED else f"tests/models/{path.name}": path
               for folder in (SHIPPED, MODELS) for path in sorted(folder.glob("[!_]*.py"))}  # fmt: skip
NAMES = sorted(MODEL_FILES, key=lambda name: (name != "hopper", name != "tests/models/door.py", name))
DIGITS = 120
"""While computing: where poles are equal to 1e-16, terms are 1e48 times their sum."""
ULPS = 100
"""Of the scale, that a pasted formula may be off by."""
DIRECTIONS = 5
"""Of a change of the inputs, whose signs are drawn."""
DAMPING = ("N s/m", "N m s/rad")
Values = dict[str, float]


@cache
def derivation_of(name: str) -> Derivation:
    return derive(name if SHIPPED in MODEL_FILES[name].parents else MODEL_FILES[name])


# ---- robots ----


def drawn(found: Derivation, seed: int) -> tuple[str, Values]:
    """A robot, a start and a time, that single precision holds; what damps, and the springs, are degenerate in turn."""
    random_of, parameters = random.Random(f"{found.model.name} {seed}"), {p.name: p for p in found.model.parameters}
    values = dict[str, float]()
    for name in found.inputs:
        if name in parameters:
            value = example_value(parameters[name])
            value = value if math.isfinite(value) else math.copysign(50.0, value)
            value = value or (
                random_of.random() if parameters[name].domain in ("real", "nonnegative", "fraction") else 0
            )
            values[name] = value * 4 ** random_of.uniform(-1, 1 if parameters[name].domain != "fraction" else 0)
        else:
            values[name] = random_of.uniform(-1, 1) * (1.0 if name.startswith("v") or "dot" in name else 0.05)
    damping = [name for name, each in parameters.items() if each.unit in DAMPING and 0.0 in each.interval]
    springs = [name for name, each in parameters.items() if each.unit in ("N/m", "N m/rad")]
    values["t"] = random_of.choice((1e-3, 0.01, 0.05, 0.3)) * 2 ** random_of.uniform(-1, 1)
    case = CASES[seed % len(CASES)]
    if case in ("nothing damps", "1e-9", "1e-6", "0.01"):
        values |= dict.fromkeys(damping, 0.0 if case == "nothing damps" else float(case))
    if case == "stiff" and damping:
        values[random_of.choice(damping)] *= 1e3
    for name in springs if case == "soft" else ():
        values[name] *= 0.0 if 0.0 in parameters[name].interval else 1e-8
    values["t"] *= {"shortly": 1e-4, "late": 10}.get(case, 1)
    values |= {name: random_of.choice((-1.0, 1.0)) for name in ("side_1", "side_2") if name in values}
    values |= {name: abs(value) for name, value in values.items() if name in ("s", "height")}
    if case == "equal poles":
        factor = _to_a_double_pole(found, values, damping)
        values |= {name: factor * values[name] for name in damping}
    return case, {name: float(np.float32(value)) for name, value in values.items()}


CASES = (
    "any", "nothing damps", "1e-6", "equal poles", "stiff", "0.01", "soft", "shortly", "1e-9", "late", "any other"
)  # fmt: skip


def _to_a_double_pole(found: Derivation, values: Values, damping: list[str]) -> float:
    """By what all damping grows so that the pair is nearly equal; 1 where that is not found."""
    low, high = 1e-3, 1e5

    def discriminant(factor: float) -> mpmath.mpf:
        given = values | {name: factor * values[name] for name in damping}
        with mpmath.workdps(30):
            return exact_of(found.model.name, found)(given).get("disc") or mp.mpf(0)

    if not damping or discriminant(low) * discriminant(high) >= 0:
        return 1.0
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if discriminant(middle) * discriminant(high) >= 0 else (middle, high)
    return low


TRIPLE = {"m_eff": 3.0, "m_s": 24.0, "k": 800.0, "b1": 90.0, "b2": 0.0, "t": 0.05}
"""A hopper whose three poles are equal."""


def robots(found: Derivation, count: int) -> Iterator[tuple[str, Values]]:
    yield from (drawn(found, seed) for seed in range(count))
    if found.model.name == "hopper":
        base = drawn(found, 0)[1]
        yield "a triple pole", base | TRIPLE
        yield "nearly a triple pole", base | TRIPLE | {"b1": float(np.float32(90.001)), "b2": 0.0009765625}


def neighbours(found: Derivation, values: Values, epsilon: float) -> Iterator[Values]:
    """The robots with 16 units in the last place more and less damping."""
    damping = [each.name for each in found.model.parameters if each.unit in DAMPING]
    for factor in (1 + 16 * epsilon, 1 - 16 * epsilon):
        yield values | {name: factor * values[name] for name in damping}


# ---- exactly ----


class _Printer(MpmathPrinter):
    def _print_Symbol(self, expr: Any) -> str:
        return f"v[{expr.name!r}]"


def _printed(value: sp.Expr) -> str:
    return str(_Printer({"fully_qualified_modules": True}).doprint(value))


@cache
def exact_of(_: str, found: Derivation) -> Callable[[Values], dict[str, Any]]:
    """All formulas of a model, from values of parameters and inputs; None where one divides by 0."""
    lines = ["def formulas(values):", "    v = {name: mpmath.mpf(value) for name, value in values.items()}"]
    for each in found._library.needed(found.formulas):
        lines += (
            "    try:",
            f"        v[{each.name!r}] = {_printed(each.value)}",
            "    except (ZeroDivisionError, TypeError):",
            f"        v[{each.name!r}] = None",
        )
    space: dict[str, Any] = {"mpmath": mpmath, "math": math}
    exec("\n".join((*lines, "    return v")), space)
    return space["formulas"]


def size_of_terms(value: sp.Expr, known: dict[str, Any], sizes: dict[str, mpmath.mpf]) -> mpmath.mpf:
    """The sum of the sizes of the terms of an expression, some of which have sizes of their own; that of cases is 0."""
    if isinstance(value, sp.Symbol) and value.name in sizes:
        return sizes[value.name]
    if isinstance(value, sp.Add):
        return sum(size_of_terms(each, known, sizes) for each in value.args)
    if isinstance(value, sp.Mul):
        return mpmath.fprod(size_of_terms(each, known, sizes) for each in value.args)
    if isinstance(value, sp.Pow) and value.exp == sp.S.Half and isinstance(value.base, sp.Abs):
        root = abs(_number(value)(known))
        return size_of_terms(value.base.args[0], known, sizes) / root if root else root
    if isinstance(value, sp.Pow) and value.exp.is_Integer and value.exp > 0:
        return size_of_terms(value.base, known, sizes) ** int(value.exp)
    return mp.mpf(0) if value.has(sp.Piecewise) else abs(_number(value)(known))


def has_terms_of_its_own(formula: Formula) -> bool:
    """Whether the terms of a formula count where it is read: of the integral of velocities, which is as large where they
    fade as where they do not, and of a partial fraction or the discriminant of a pair, which need poles apart.
    """
    of_velocities = formula.name.startswith("int_") and not re.search("W|eR", formula.name)
    return of_velocities or formula.group == "partial_fractions" or formula.key == "disc"


@cache
def _number(value: sp.Expr) -> Callable[[dict[str, Any]], Any]:
    return eval(f"lambda v: {_printed(value)}", {"mpmath": mpmath})  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Exact:
    """A formula at a robot: its value, and the scale of its rounding errors."""

    value: mpmath.mpf
    scale: mpmath.mpf

    def off(self, number: float, epsilon: float, least: float) -> mpmath.mpf:
        """By how many units in the last place of the scale a number is off, beside what underflows."""
        return abs(mp.mpf(number) - self.value) / (epsilon * self.scale + least)


def exactly(found: Derivation, values: Values) -> dict[str, Exact]:
    """Each formula that has a real value, by name."""
    with mpmath.workdps(DIGITS):
        formulas, step = exact_of(found.model.name, found), mp.mpf(10) ** -40
        known = formulas(values)
        names = [each.name for each in found.formulas if known[each.name] is not None and mp.im(known[each.name]) == 0]
        scales, sizes = dict[str, mpmath.mpf](), dict[str, mpmath.mpf]()
        for each in found._library.needed(found.formulas):
            if each.name in names:
                size = size_of_terms(each.value, known, sizes) + abs(known[each.name])
                scales[each.name] = size
                sizes |= {each.name: size} if has_terms_of_its_own(each) else {}
        changes = dict.fromkeys(names, mp.mpf(0))
        for direction in range(DIRECTIONS):
            signs = random.Random(direction)
            moved = formulas({
                name: value if name.startswith("side_") else value * (1 + step * signs.choice((-1, 1)))
                for name, value in values.items()
            })  # fmt: skip
            for each in names:
                change = mp.mpf(0) if moved[each] is None else abs(moved[each] - known[each]) / step
                changes[each] = max(changes[each], change)
        scales = {each: scales[each] + changes[each] for each in names}
        return {name: Exact(known[name], scales[name]) for name in names}


# ---- the forms ----


def taken_by(found: Derivation) -> dict[str, list[str]]:
    library = found._library
    return {each.name: [quantity.name for quantity in library.taken(library.needed([each], IN_CODE), IN_CODE)]
            for each in found.formulas}  # fmt: skip


WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")


def compiled(found: Derivation, folder: Path, *, single: bool) -> ctypes.CDLL:
    """The header that is printed, compiled as it is, each function behind one that is no static."""
    kind, prefix = "float" if single else "double", found._library.prefix
    (folder / "formulas.h").write_text(found.show(None, "c", single=single), "utf-8")
    lines = ['#include "formulas.h"', '#include "formulas.h"']
    for name, taken in taken_by(found).items():
        arguments = ", ".join(f"{kind} a{n}" for n, _ in enumerate(taken)) or "void"
        call = f"{prefix}_{name}({', '.join(f'a{n}' for n, _ in enumerate(taken))})"
        lines += (f"{kind} pasted_{name}({arguments});", f"{kind} pasted_{name}({arguments}) {{ return {call}; }}")
    (folder / "all.c").write_text("\n".join(lines) + "\n", "utf-8")
    flags = ("-std=c99", "-O1", "-ffp-contract=off", "-shared", "-fPIC")
    subprocess.run(["cc", *flags, *WARNINGS, "all.c", "-o", "all.so", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "all.so"))


def by_c(found: Derivation, library: ctypes.CDLL, values: Values, *, single: bool) -> dict[str, float]:
    kind, numbers = ctypes.c_float if single else ctypes.c_double, dict[str, float]()
    for name, taken in taken_by(found).items():
        function = library[f"pasted_{name}"]
        function.restype, function.argtypes = kind, [kind] * len(taken)
        numbers[name] = function(*(values[each] for each in taken))
    return numbers


def by_numpy(found: Derivation, cases: list[Values]) -> list[dict[str, float]]:
    """Of all robots in one call of each function."""
    space, columns = dict[str, Any](), dict[str, Any]()
    exec(found.show(None, "numpy"), space)
    for name, taken in taken_by(found).items():
        column = space[name](*(np.array([values[each] for values in cases]) for each in taken))
        columns[name] = np.broadcast_to(column, len(cases))
    return [{name: float(column[n]) for name, column in columns.items()} for n, _ in enumerate(cases)]


MAY_HAVE_NO_VALUE = ("partial_fractions", "transfer", "control")
"""Groups of formulas that need poles apart, or a height above 0."""


def may_have_no_value(formula: Formula) -> bool:
    """What slips may never come to rest."""
    return formula.group in MAY_HAVE_NO_VALUE or formula.name.endswith("_time_to_rest")


@pytest.mark.parametrize("name", needs.the_first([*NAMES[1:], NAMES[0]]))
def test_every_formula_that_is_pasted_is_right_to_rounding(name, tmp_path):
    found = derivation_of(name)
    drawn_robots = list(robots(found, len(CASES)))
    libraries = dict[bool, ctypes.CDLL]()
    for single in (False, True):
        (tmp_path / str(single)).mkdir()
        libraries[single] = compiled(found, tmp_path / str(single), single=single)
    of_numpy = by_numpy(found, [values for _, values in drawn_robots])
    for (case, values), numpy_numbers in zip(drawn_robots, of_numpy, strict=True):
        exact = exactly(found, values)
        assert all(may_have_no_value(each) for each in found.formulas if each.name not in exact), case
        forms = [("numpy", 2.0**-52, 2.0**-1022, numpy_numbers)]
        forms += (
            (f"c {single}", epsilon, least, by_c(found, libraries[single], values, single=single))
            for single, epsilon, least in ((False, 2.0**-52, 2.0**-1022), (True, 2.0**-23, 2.0**-126))
        )
        for form, epsilon, least, numbers in forms:
            for formula, each in exact.items():
                off = each.off(numbers[formula], epsilon, least)
                if off >= ULPS:  # a case of the formula may begin nearer than the inputs are known
                    beside = (exactly(found, moved)[formula] for moved in neighbours(found, values, epsilon))
                    off = min(neighbour.off(numbers[formula], epsilon, least) for neighbour in beside)
                assert off < ULPS, (case, form, formula, numbers[formula], float(each.value), float(off), values)


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_text_and_sympy_read_back_as_the_formulas(name):
    """They have the exact formulas, which are evaluated with as many digits as one likes."""
    found = derivation_of(name)
    space = dict[str, Any]()
    exec(found.show(None, "sympy"), space)
    equations = {equation.lhs.name: equation.rhs for equation in space["equations"]}
    texts = {line.partition(" = ")[0]: line.partition(" = ")[2].partition("  # ")[0]
             for line in found.show().splitlines() if " = " in line and not line.startswith("#")}  # fmt: skip
    symbols = {name: sp.Symbol(name) for formula in found.formulas for name in map(str, formula.value.free_symbols)}
    assert equations.keys() == texts.keys() == {each.name for each in found.formulas}
    for case, values in [drawn(found, 4)]:
        with mpmath.workdps(DIGITS):
            known = exact_of(found.model.name, found)(values)
            for each in (name for name in equations if known[name] is not None):
                for read in (equations[each], sp.sympify(texts[each], locals=symbols)):
                    off = abs(mp.mpmathify(_number(read)(known)) - known[each])
                    assert off <= mp.mpf(10) ** -40 * abs(known[each]), (case, each, read)


# ---- from a file to one's own code ----


@needs.cpp
@pytest.mark.parametrize(("language", "standard"), [("c", "c99"), ("c++", "c++11")])
def test_a_door_is_a_header_that_compiles_as_it_is(tmp_path, capsys, language, standard):
    """In two files of a program, with every warning an error, though it calls few of the functions."""
    assert cli.main(["model", "show", str(MODELS / "door.py"), "--as", "c"]) == 0
    (tmp_path / "door.h").write_text(capsys.readouterr().out, "utf-8")
    call = "door_phi_t(2.5, 8.0, -0.6, 6.0, 0.9, 0.85, 0.2, 0.1, 20.0, 1.0, 0.3)"
    (tmp_path / "other.x").write_text('#include "door.h"\nextern double other(void);\n'
                                      f"double other(void) {{ return {call}; }}\n", "utf-8")  # fmt: skip
    (tmp_path / "main.x").write_text('#include "door.h"\n#include "door.h"\n#include <stdio.h>\nextern double other(void);\n'
                                     f'int main(void) {{ printf("%.17g %.17g", {call}, other()); return 0; }}\n', "utf-8")  # fmt: skip
    compiler = "cc" if language == "c" else "c++"
    subprocess.run(
        [compiler, f"-std={standard}", *WARNINGS, "-x", language, "main.x", "other.x", "-o", "main", "-lm"],
        cwd=tmp_path, check=True,
    )  # fmt: skip
    said = subprocess.run(["./main"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()
    given = dict(zip(taken_by(door := derivation_of("tests/models/door.py"))["phi_t"],
                     ("2.5", "8", "-0.6", "6", "0.9", "0.85", "0.2", "0.1", "20", "1", "0.3"), strict=True))  # fmt: skip
    exact = float(door.value("phi_t", given))
    assert [float(each) for each in said] == pytest.approx([exact, exact], rel=1e-14)


def test_what_is_pasted_twice_compiles_together(tmp_path):
    """Kernels that two formulas come with are defined once."""
    found = derivation_of("hopper")
    (tmp_path / "both.h").write_text(found.show("x2_t", "c") + found.show("spring_work", "c"), "utf-8")
    (tmp_path / "both.c").write_text('#include "both.h"\n', "utf-8")
    subprocess.run(["cc", "-std=c99", *WARNINGS, "-c", "both.c"], cwd=tmp_path, check=True)


def test_the_other_forms_of_a_door_are_read_as_they_are():
    found = derivation_of("tests/models/door.py")
    objects = json.loads(found.show(form="json"))
    assert [each["name"] for each in objects] == [each.name for each in found.formulas]
    space, book = dict[str, Any](), json.loads(found.show(form="notebook"))
    for cell in book["cells"]:
        exec("".join(cell["source"]) if cell["cell_type"] == "code" else "", space)
    assert {each.group for each in found.formulas} <= space.keys()
