"""Formulas as one pastes them: text, LaTeX, sympy, JSON, NumPy or C.

Text and LaTeX show a formula in the names of others. Sympy, NumPy and C have all that it reads: a list of equations, or
a function of parameters and inputs whose lines are the formulas in the order in which they are needed.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import attrgetter
from typing import Any

import sympy as sp
from sympy.codegen.ast import float32, float64, real
from sympy.core.function import AppliedUndef
from sympy.printing.c import C99CodePrinter
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.str import StrPrinter

from ..ir import Quantity
from ..maths.formulas import GROUPS, Formula
from ..maths.kernels import RESULTS, called
from ..model.names import in_c as name_in_c
from ..model.precisions import F32, F64
from . import pasting, texts

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

    def whole(self, formulas: Formulas) -> list[Formula]:
        """The formulas in parameters, inputs, start and time, each behind the definitions that it reads: of what is too
        long to be put in, or reads another definition.
        """
        wanted, put_in, whole = {each.name for each in formulas}, dict[str, sp.Expr](), dict[str, Formula]()
        for each in self.needed(formulas):
            symbols = {symbol: put_in[symbol.name] for symbol in each.value.free_symbols if symbol.name in put_in}
            unfolded = replace(each, value=each.value.xreplace(symbols))
            reads = {symbol.name for symbol in unfolded.value.free_symbols}
            is_long = not unfolded.value.is_Symbol and (reads & whole.keys() or unfolded.value.count_ops() > SHORT)
            if each.name in wanted or is_long:
                whole[each.name] = unfolded
            else:
                put_in[each.name] = unfolded.value
        return list(whole.values())

    def taken(self, needed: Formulas, value_of: Callable[[Formula], sp.Expr] = VALUE) -> list[Quantity]:
        """The parameters and inputs that formulas take, in the order of `inputs`."""
        names = {symbol.name for formula in needed for symbol in value_of(formula).free_symbols}
        return [quantity for name, quantity in self.inputs.items() if name in names]

    @property
    def glyphs(self) -> dict[sp.Symbol, str]:
        quantities = (*self.inputs.values(), *(formula.quantity for formula in self.formulas.values()))
        glyphs = {quantity.symbol: quantity.glyph for quantity in quantities}
        return glyphs | {sp.Symbol(symbol.name): glyph for symbol, glyph in glyphs.items()}


SHORT = 12
"""Operations of what is put in where it is read, at most."""


def numbered(formula: Formula) -> str:
    """The equations of the paper, unit and meaning of a formula."""
    numbers = ", ".join(f"({number})" for number in formula.numbers)
    return f"{numbers} [{formula.quantity.unit}] {formula.quantity.meaning}".strip()


def described(quantity: Quantity) -> str:
    """Name, unit and meaning of what a formula takes."""
    return f"{quantity.name} [{quantity.unit}] {quantity.meaning}"


def text(_: Library, formulas: Formulas) -> str:
    """A line each, under the names of their groups where there are several, each in one piece."""
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
    groups = [group for group, _ in groupby(formula.group for formula in formulas)]
    several, group, lines = 1 < len(groups) == len(set(groups)), "", list[str]()
    for formula in formulas:
        if several and formula.group != group:
            group = formula.group
            lines += [*([""] if lines else []), heading.format(GROUPS[group])]
        lines.append(spelled(formula))
    return "\n".join(lines) + "\n"


def in_sympy(library: Library, formulas: Formulas, *, whole: bool = False) -> str:
    """Symbols, and a list of equations, each behind those that it reads."""
    needed = formulas if whole else library.needed(formulas)
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


# ---- the kernels that formulas call ----


def _calls(value: sp.Expr) -> list[sp.Expr]:
    """The calls of kernels in what code computes, in one order."""
    return sorted(value.atoms(AppliedUndef), key=str)


def _kernels(library: Library, formulas: Formulas) -> set[str]:
    return {called(call)[0] for each in library.needed(formulas, IN_CODE) for call in _calls(each.in_code)}


class _Results(dict[tuple[str, tuple[sp.Expr, ...]], str]):
    """The variables that have the results of a kernel, by its name and arguments."""

    def __init__(self, taken: Iterable[str]) -> None:
        self.taken = set(taken)

    def declared(self, value: sp.Expr) -> Iterator[tuple[str, sp.Expr]]:
        """The variables that come with an expression, each with the call that it is the results of."""
        for call in _calls(value):
            kernel, _ = called(call)
            if RESULTS[kernel] and (kernel, call.args) not in self:
                variable = kernel.removesuffix("_at").removesuffix("_cubic")
                while variable in self.taken:
                    variable += "_"
                self.taken.add(variable)
                self[kernel, call.args] = variable
                yield variable, call


def in_numpy(library: Library, formulas: Formulas) -> str:
    """A function each, of numbers or of arrays that are broadcast, behind the kernels that they call."""
    functions = ("\n".join(_numpy_function(library, each)) for each in formulas)
    return "\n\n\n".join(("import numpy as np", *pasting.in_numpy(_kernels(library, formulas)), *functions)) + "\n"


class _Numpy(NumPyPrinter):
    _module = "np"
    results: _Results

    def _print_AppliedUndef(self, expr: sp.Expr) -> str:
        kernel, result = called(expr)
        if not result:
            return f"_{kernel}({', '.join(map(self._print, expr.args))})"
        return f"{self.results[kernel, expr.args]}[{RESULTS[kernel].index(result)}]"

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
    printer.results = _Results((*(quantity.name for quantity in taken), *(each.name for each in (*before, last))))
    yield '    with np.errstate(all="ignore"):  # of the cases of a formula, all are computed'
    for each in (*before, last):
        for variable, call in printer.results.declared(each.in_code):
            yield f"        {variable} = _{called(call)[0]}({', '.join(_in_numpy(printer, value) for value in call.args)})"
        code = _in_numpy(printer, each.in_code)
        yield (
            f"        return {code}"
            if each is last
            else f"        {each.name} = {code}  # {texts.line(numbered(each))}"
        )


def _in_numpy(printer: NumPyPrinter, value: sp.Expr) -> str:
    return str(printer.doprint(value)).replace("numpy.", "np.")


def in_c(library: Library, formulas: Formulas, *, single: bool = False) -> str:
    """A header of C99 and C++ with a function each, behind the kernels that they call, in double or single precision."""
    kernels = pasting.in_c(_kernels(library, formulas), name_in_c(library.prefix), F32 if single else F64)
    functions = ("\n".join(_c_function(library, each, single)) for each in formulas)
    guard = _guard(library, formulas)
    lines = (f"#ifndef {guard}\n#define {guard}", "#include <math.h>", *kernels, *functions, f"#endif /* {guard} */")
    return "\n\n".join(lines).replace(texts.BROKEN, "") + "\n"


def _guard(library: Library, formulas: Formulas) -> str:
    """The macro that says that a compiler has had these formulas."""
    groups = {each.group for each in formulas}
    what = formulas[0].name if len(formulas) == 1 else min(groups) if len(groups) == 1 else "formulas"
    return f"{name_in_c(f'{library.prefix}_{what}').upper()}_H"


class _C(C99CodePrinter):
    """What a formula takes as C spells it, whole powers of a symbol as products, and conditions on one line."""

    taken: Mapping[str, str]
    results: _Results
    prefix: str

    def _print_Symbol(self, expr: Any) -> str:
        return self.taken.get(expr.name) or str(super()._print_Symbol(expr))

    def _print_AppliedUndef(self, expr: sp.Expr) -> str:
        kernel, result = called(expr)
        if result:
            return f"{self.results[kernel, expr.args]}.{result}"
        return f"{self.prefix}_{kernel}({', '.join(map(self._print, expr.args))})"

    def _print_Pow(self, expr: Any) -> str:
        if expr.exp in (2, 3) and expr.base.is_Symbol:
            return "*".join([self._print(expr.base)] * int(expr.exp)).join("()")
        return str(super()._print_Pow(expr))


def _c_function(library: Library, formula: Formula, single: bool) -> Iterator[str]:
    *before, last = library.needed([formula], IN_CODE)
    taken = library.taken([*before, last], IN_CODE)
    kind, prefix = "float" if single else "double", name_in_c(library.prefix)
    names = {name: name_in_c(name) for name in (*(each.name for each in taken), *(each.name for each in before))}
    printer = _C({"type_aliases": {real: float32 if single else float64}, "math_macros": {}})
    printer.taken, printer.results, printer.prefix = names, _Results(names.values()), prefix
    yield f"/* {texts.comment_of_c(numbered(formula))}"
    yield from (f" * {texts.comment_of_c(described(quantity))}" for quantity in taken)
    yield " */"
    arguments = ", ".join(f"{kind} {names[quantity.name]}" for quantity in taken)
    yield f"static inline {kind} {name_in_c(f'{library.prefix}_{formula.name}')}({arguments or 'void'})"
    yield "{"
    for step in (*before, last):
        for variable, call in printer.results.declared(step.in_code):
            kernel, values = called(call)[0], ", ".join(map(printer.doprint, call.args))
            yield f"    const {prefix}_{_TYPES[kernel]} {variable} = {prefix}_{kernel}({_one_line(values)});"
        code, comment = _one_line(printer.doprint(step.in_code)), texts.comment_of_c(numbered(step))
        yield (
            f"    return {code};" if step is last else f"    const {kind} {names[step.name]} = {code}; /* {comment} */"
        )
    yield "}"


_TYPES = {"factor_cubic": "factors", "decay_at": "decay", "pair_at": "pair", "response_at": "response"}
"""Of the results of kernels in C."""


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
CODE = ("numpy", "c", "notebook")
"""Forms that have all that a formula reads, and take nothing else."""


def spelled(library: Library, formulas: Formulas, form: str, *, single: bool = False, whole: bool = False) -> str:
    """Formulas in a form. whole: in parameters, inputs, start and time alone, behind definitions of what is long."""
    if form == "c":
        return in_c(library, formulas, single=single)
    if whole and form not in CODE:
        unfolded = library.whole(formulas)
        return in_sympy(library, unfolded, whole=True) if form == "sympy" else FORMS[form](library, unfolded)
    return FORMS[form](library, formulas)
