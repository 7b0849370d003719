"""Formulas as one pastes them: text, LaTeX, sympy, JSON, NumPy or C.

Text and LaTeX show a formula in the names of others. Sympy, NumPy and C have all that it reads: a list of equations, or
a function of parameters and inputs whose lines are the formulas in the order in which they are needed.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import sympy as sp
from sympy.codegen.ast import float32, float64, real
from sympy.printing.c import C99CodePrinter
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.str import StrPrinter

from ..ir import Quantity
from ..maths.formulas import GROUPS, Formula
from ..model.names import in_c as name_in_c
from . import texts

Formulas = Sequence[Formula]
VALUE: Callable[[Formula], sp.Expr] = attrgetter("value")
IN_CODE: Callable[[Formula], sp.Expr] = attrgetter("in_code")
"""What a formula is, and what is computed of it."""


@dataclass(frozen=True)
class Library:
    """All formulas of a model and what they take, by name; `prefix` is that of functions in C."""

    title: str
    prefix: str
    formulas: Mapping[str, Formula]
    inputs: Mapping[str, Quantity]

    def needed(self, formulas: Iterable[Formula], value_of: Callable[[Formula], sp.Expr] = VALUE) -> list[Formula]:
        """Formulas behind those that they read, in their values or in code."""
        order = dict[str, Formula]()

        def visit(formula: Formula) -> None:
            if formula.name not in order:
                for symbol in sorted(value_of(formula).free_symbols, key=str):
                    if symbol.name in self.formulas:
                        visit(self.formulas[symbol.name])
                order[formula.name] = formula

        for formula in formulas:
            visit(formula)
        return list(order.values())

    def taken(self, needed: Formulas, value_of: Callable[[Formula], sp.Expr] = VALUE) -> list[Quantity]:
        """The parameters and inputs that formulas take, in the order of `inputs`."""
        names = {symbol.name for formula in needed for symbol in value_of(formula).free_symbols}
        return [quantity for name, quantity in self.inputs.items() if name in names]

    @property
    def glyphs(self) -> dict[sp.Symbol, str]:
        quantities = (*self.inputs.values(), *(formula.quantity for formula in self.formulas.values()))
        glyphs = {quantity.symbol: quantity.glyph for quantity in quantities}
        return glyphs | {sp.Symbol(symbol.name): glyph for symbol, glyph in glyphs.items()}


def numbered(formula: Formula) -> str:
    """The equations of the paper, unit and meaning of a formula."""
    numbers = ", ".join(f"({number})" for number in formula.numbers)
    return f"{numbers} [{formula.quantity.unit}] {formula.quantity.meaning}".strip()


def described(quantity: Quantity) -> str:
    """Name, unit and meaning of what a formula takes."""
    return f"{quantity.name} [{quantity.unit}] {quantity.meaning}"


def text(_: Library, formulas: Formulas) -> str:
    """A line each, under the names of their groups where there are several."""
    return _by_group(
        formulas, lambda each: f"{each.name} = {sp.sstr(each.value)}  # {texts.line(numbered(each))}", "# {}"
    )


def latex(library: Library, formulas: Formulas) -> str:
    """A line of LaTeX each, in glyphs, under a comment."""
    return _by_group(
        formulas, lambda each: f"% {each.name}: {texts.line(numbered(each))}\n{in_latex(library, each)}", "%% {}"
    )


def in_latex(library: Library, formula: Formula) -> str:
    """A formula as LaTeX, in glyphs; an integral in it stands in brackets."""
    glyphs = {
        symbol: rf"\left({glyph}\right)" if glyph.startswith((r"\int", r"\iint")) else glyph
        for symbol, glyph in library.glyphs.items()
    }
    value = sp.latex(formula.value, symbol_names=glyphs)
    return f"{formula.quantity.glyph} = {value}"


def _by_group(formulas: Formulas, spelled: Callable[[Formula], str], heading: str) -> str:
    several, group, lines = len({formula.group for formula in formulas}) > 1, "", list[str]()
    for formula in formulas:
        if several and formula.group != group:
            group = formula.group
            lines += [*([""] if lines else []), heading.format(GROUPS[group])]
        lines.append(spelled(formula))
    return "\n".join(lines) + "\n"


def in_sympy(library: Library, formulas: Formulas) -> str:
    """Symbols, and a list of equations, each behind those that it reads."""
    needed = library.needed(formulas)
    return "\n".join((*_declared(library, needed), "", *_equations("equations", needed))) + "\n"


class _Sympy(StrPrinter):
    """What Python reads back as the same expression: 1/3 would be a float."""

    def _print_Rational(self, expr: Any) -> str:
        return f"Rational({expr.p}, {expr.q})"


def _in_sympy(value: sp.Expr) -> str:
    return str(_Sympy().doprint(value))


def _declared(library: Library, needed: Formulas) -> Iterator[str]:
    """The lines that import functions of sympy and make symbols."""
    spelled = " ".join(_in_sympy(each.value) for each in needed)
    functions = sorted({"Eq", "symbols", *re.findall(r"\b([A-Za-z]\w*)\(", spelled)})
    yield f"from sympy import {', '.join(functions)}"
    yield ""
    quantities = [*library.taken(needed), *(each.quantity for each in needed)]
    names = list(dict.fromkeys(quantity.name for quantity in quantities))
    for n in range(0, len(names), 10):
        part = names[n : n + 10]
        yield f'{", ".join(part)} = symbols("{" ".join(part)}")'


def _equations(name: str, formulas: Formulas) -> Iterator[str]:
    yield f"{name} = ["
    for formula in formulas:
        yield f"    Eq({formula.name}, {_in_sympy(formula.value)}, evaluate=False),  # {texts.line(numbered(formula))}"
    yield "]"


def in_json(library: Library, formulas: Formulas) -> str:
    """A list of objects with a formula's name, group, numbers, unit, meaning, what it takes, and its text and LaTeX."""
    objects = [
        {
            "name": each.name, "group": each.group, "equations": list(each.numbers), "unit": each.quantity.unit,
            "meaning": each.quantity.meaning, "glyph": each.quantity.glyph, "text": sp.sstr(each.value),
            "latex": in_latex(library, each), "takes": sorted(symbol.name for symbol in each.value.free_symbols),
        }
        for each in formulas
    ]  # fmt: skip
    return json.dumps(objects, indent=2, ensure_ascii=False) + "\n"


def in_numpy(library: Library, formulas: Formulas) -> str:
    """A function each, of numbers or of arrays that are broadcast."""
    functions = ("\n".join(_numpy_function(library, each)) for each in formulas)
    return "\n\n\n".join(("import numpy as np", *functions)) + "\n"


class _Numpy(NumPyPrinter):
    _module = "np"

    def _print_Piecewise(self, expr: Any) -> str:
        *others, (value, _) = expr.args
        spelled = self._print(value)
        for part, condition in reversed(others):
            spelled = f"np.where({self._print(condition)}, {self._print(part)}, {spelled})"
        return str(spelled)


def _numpy_function(library: Library, formula: Formula) -> Iterator[str]:
    *before, last = library.needed([formula], IN_CODE)
    taken = library.taken([*before, last], IN_CODE)
    names = ", ".join(quantity.name for quantity in taken)
    yield f"def {formula.name}({names}):"
    yield f'    r"""{texts.raw_docstring(numbered(formula))}.'
    yield ""
    yield from (f"    {texts.raw_docstring(described(quantity))}" for quantity in taken)
    yield '    """'
    if taken:
        tuple_of = names if len(taken) > 1 else f"{names},"
        yield f"    {tuple_of} = (1.0 * np.asarray(value) for value in ({tuple_of}))"
    printer = _Numpy()
    yield '    with np.errstate(all="ignore"):  # of the cases of a formula, all are computed'
    yield from (
        f"        {each.name} = {_in_numpy(printer, each.in_code)}  # {texts.line(numbered(each))}" for each in before
    )
    yield f"        return {_in_numpy(printer, last.in_code)}"


def _in_numpy(printer: NumPyPrinter, value: sp.Expr) -> str:
    return str(printer.doprint(value)).replace("numpy.", "np.")


def in_c(library: Library, formulas: Formulas, *, single: bool = False) -> str:
    """A function of C99 each, in double or in single precision."""
    functions = ("\n".join(_c_function(library, each, single)) for each in formulas)
    return "\n\n".join(("#include <math.h>", *functions)).replace(texts.BROKEN, "") + "\n"


class _C(C99CodePrinter):
    """What a formula takes as C spells it, whole powers of a symbol as products, and conditions on one line."""

    taken: Mapping[str, str]

    def _print_Symbol(self, expr: Any) -> str:
        return self.taken.get(expr.name) or str(super()._print_Symbol(expr))

    def _print_Pow(self, expr: Any) -> str:
        if expr.exp in (2, 3) and expr.base.is_Symbol:
            return "*".join([self._print(expr.base)] * int(expr.exp)).join("()")
        return str(super()._print_Pow(expr))


def _c_function(library: Library, formula: Formula, single: bool) -> Iterator[str]:
    *before, last = library.needed([formula], IN_CODE)
    taken = library.taken([*before, last], IN_CODE)
    kind = "float" if single else "double"
    names = {quantity.name: name_in_c(quantity.name) for quantity in taken}
    printer = _C({"type_aliases": {real: float32 if single else float64}, "math_macros": {}})
    printer.taken = names
    yield f"/* {texts.comment_of_c(numbered(formula))}"
    yield from (f" * {texts.comment_of_c(described(quantity))}" for quantity in taken)
    yield " */"
    arguments = ", ".join(f"{kind} {name}" for name in names.values())
    yield f"static {kind} {library.prefix}_{formula.name}({arguments or 'void'})"
    yield "{"
    for step in before:
        yield f"    const {kind} {step.name} = {_one_line(printer.doprint(step.in_code))}; /* {texts.comment_of_c(numbered(step))} */"
    yield f"    return {_one_line(printer.doprint(last.in_code))};"
    yield "}"


def _one_line(code: str) -> str:
    return " ".join(code.split()).replace("( ", "(").replace(" )", ")")


def notebook(library: Library, formulas: Formulas) -> str:
    """A Jupyter notebook: the formulas group by group, in LaTeX and as equations of sympy."""
    needed = library.needed(formulas)
    cells = [_cell("markdown", f"# {texts.cell(library.title)}\n\nEach group is a list of equations of sympy.")]
    cells.append(_cell("code", "\n".join(_declared(library, needed))))
    for group, meaning in GROUPS.items():
        members = [each for each in needed if each.group == group]
        if members:
            shown = "\n\n".join(
                f"{texts.cell(numbered(each))}\n\n$${texts.math_on_page(in_latex(library, each))}$$" for each in members
            )
            cells.append(_cell("markdown", f"## {meaning}\n\n{shown}"))
            cells.append(_cell("code", "\n".join((*_equations(group, members), group))))
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def _cell(kind: str, source: str) -> dict[str, Any]:
    cell: dict[str, Any] = {"cell_type": kind, "metadata": {}, "source": source.splitlines(keepends=True)}
    return cell | ({"execution_count": None, "outputs": []} if kind == "code" else {})


FORMS: dict[str, Callable[[Library, Formulas], str]] = {
    "text": text, "latex": latex, "sympy": in_sympy, "json": in_json, "numpy": in_numpy, "c": in_c,
    "notebook": notebook,
}  # fmt: skip
"""How formulas are spelled, by the name of the form."""
