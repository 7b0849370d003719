"""The engine's C printed as Python, one module a precision, to the same bits.

What people wrote in C is printed from its syntax tree; what the derivation makes, from the derivation. A struct is an
object, a pointer to it the same object, a pointer to a number a list of one; see `layout`. Four functions are not
printed but written, in runtime/engine/python/memory.py and scalars_*.py: those that look at bits or at addresses.

Where C passes a pointer, whether an array or one object is meant, and which memory others may still point to, is learnt
from all of the text: it is printed again until nothing new is learnt.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pycparser import c_ast

from ..ir import Function, Program, Record
from .expressions import Expressions, argument_name, unpacked
from .layout import VOID, Array, Callee, Pointer, Struct, Type, attribute, is_flat, leaves, plain, size_of
from .lines import docstring, wrapped
from .parse import Unit, read
from .statements import Body
from .values import Learnt, Setting, is_whole

WRITTEN = ("real_of_bits", "bits_of_real", "overlap", "refuse")
"""Functions of the engine that are written by hand in Python, too."""
KERNELS = {
    "scalars": ("REAL_SIZE", "ZERO", "Real", "bits_of_real", "div", "real", "real_of_bits", "sqrt", "whole"),
    "memory": ("Part", "aliases", "overlap", "put_reals", "refuse"),
}
HEAD = '''\
"""The engine in {} precision: the search for events, energies, derivatives, flight and controller, one stance after
the other.

Printed from the engine's C, to the same bits. Functions take and return what those of the C library do: a status, and
what they write goes into objects and lists that the caller gives, a number into a list of one.
"""

from typing import Any

'''


def engines(texts: Mapping[str, str], program: Program, suffixes: Iterable[str]) -> Iterator[tuple[str, str]]:
    """The module of each precision by its suffix, from the texts of the C library by their paths."""
    learnt = Learnt()
    for suffix in suffixes:
        unit, text = read(texts, suffix), ""
        while not text or learnt.something_new():
            text = _Module(unit, program, suffix, learnt).text()
        yield suffix, text


class _Module(Setting):
    """The module of a precision."""

    def __init__(self, unit: Unit, program: Program, suffix: str, learnt: Learnt) -> None:
        super().__init__(unit, suffix, learnt)
        self.formulas = {function.name: function for function in program.functions}
        self.out: list[str] = []
        self.taken = self._names()

    def _names(self) -> dict[str, str]:
        """The names of functions in Python: without the prefix, and the file's with it where two are the same."""
        names, taken = {}, set(self.formulas)
        for each in self.unit.tree.ext:
            if isinstance(each, c_ast.FuncDef):
                bare = each.decl.name.removesuffix(f"_{self.suffix}")
                name = bare.removeprefix("hopform_")
                if name in taken or (bare == name and self._is_public(name)):
                    name += f"_in_{each.coord.file.rpartition('/')[2].partition('_')[0]}"
                taken.add(name)
                names[each.decl.name] = name
        return names

    def _is_public(self, name: str) -> bool:
        public = f"hopform_{name}_{self.suffix}"
        return any(isinstance(each, c_ast.FuncDef) and each.decl.name == public for each in self.unit.tree.ext)

    # ---- text ----

    def text(self) -> str:
        for each in self.unit.tree.ext:
            self._external(each)
        used = {name for line in self.out for name in re.findall(r"\b(?:[a-z_]\w*(?=\()|[A-Z]\w*)", line)}
        body = "\n".join(self.out)
        kernels = [
            f"from .{module}{f'_{self.suffix}' if module == 'scalars' else ''} import "
            + ", ".join(name for name in names if name in used)
            for module, names in KERNELS.items()
        ]
        constants = [
            f"{self.constant(name)} = {self._constant_text(text)}{f'  # {meaning}' if meaning else ''}"
            for name, (text, meaning) in self.unit.constants.items()
            if self.constant(name) in used
        ]
        constants += [
            f"{self.enumerator(name)} = {number}"
            for name, number in self.c.enums.items()
            if self.enumerator(name) in used
        ]
        wide = "\n".join(line for text in body.split("\n") for line in wrapped(text))
        of = {"f32": "single", "f64": "double"}[self.suffix]
        return (
            HEAD.format(of)
            + "\n".join((*(line for each in sorted(kernels) for line in wrapped(each)), "", *constants, wide))
            + "\n"
        )

    def _constant_text(self, text: str) -> str:
        text = text.strip("()")
        if is_whole(text):
            return text.rstrip("uU")
        return f"real({text.rstrip('f')})" if self.single else text

    def _external(self, each: c_ast.Node) -> None:
        if isinstance(each, c_ast.Typedef):
            self.c.types[each.name] = kind = self.c.type_of(each.type, self.c.bare(each.name))
            self._class(kind, each)
        elif isinstance(each, c_ast.FuncDef):
            callee = self.c.function(each.decl, self.taken[each.decl.name])
            if callee.name not in WRITTEN:
                self.out += ["", "", *Body(self, callee, each).lines()]
        elif isinstance(each.type, c_ast.FuncDecl):
            name = each.name.removeprefix("hopform_").removesuffix(f"_{self.suffix}")
            made = self.c.function(each, self.taken.get(each.name, name))
            if name in self.formulas and name not in self.printed:
                self.printed.add(name)
                self.out += ["", "", *self._formula(self.formulas[name], made)]
        elif isinstance(each.type, (c_ast.Struct, c_ast.Enum)):
            self._class(self.c.type_of(each.type), each)
        else:
            self._global(each)

    def _global(self, each: c_ast.Decl) -> None:
        kind = self.c.type_of(each.type)
        if isinstance(kind, Array) and kind.count == 0:
            kind = Array(kind.of, len(each.init.exprs))
        self.globals[each.name] = kind
        printer = Body(self, Callee("", (), VOID), None)
        value = printer.initial(kind, each.init, True)
        said = " ".join(self.said_above(each.coord).split())
        self.out += ["", *([f"# {said}"] if said else []), f"{self.global_name(each.name)} = {value}"]

    # ---- classes ----

    def _class(self, kind: Type, node: Any) -> None:
        if not isinstance(kind, Struct) or kind.name in self.printed or not kind.fields:
            return
        self.printed.add(kind.name)
        inner = node.type.type if isinstance(node, c_ast.Typedef) else node.type
        kind.meaning = self.said_above(inner.coord) or self.said_above(node.coord)
        for each in inner.decls or ():
            behind = self.comments(each.coord).behind.get(each.coord.line, "")
            kind.said[each.name] = plain(behind, self.suffix)
            own = kind.fields[each.name]
            if isinstance(own, Struct) and own.name not in self.printed and not kind.union:
                own.meaning = kind.said[each.name]
                self.printed.add(own.name)
                self.out += ["", "", *self._union(own)] if own.union else ["", "", *self._struct(own)]
        self.out += ["", "", *(self._union(kind) if kind.union else self._struct(kind))]

    def _struct(self, kind: Struct) -> Iterator[str]:
        yield f"class {kind.name}:"
        yield from docstring(kind.meaning or kind.name)
        names = [attribute(name) for name in kind.fields]
        yield f"    __slots__ = ({_quoted(names)})"
        yield f"    SIZE = {size_of(kind, 4 if self.single else 8)}"
        parts = [attribute(name) for name, each in kind.fields.items() if isinstance(each, (Struct, Array))]
        yield f"    PARTS: tuple[str, ...] = ({_quoted(parts)})"
        yield ""
        yield from self._init(kind)
        yield ""
        yield f'    def copy(self) -> "{kind.name}":'
        copies = ", ".join(_copied(f"self.{attribute(name)}", each) for name, each in kind.fields.items())
        yield f"        return {kind.name}({copies})"
        yield ""
        yield f'    def put(self, other: "{kind.name}") -> None:'
        for name, each in kind.fields.items():
            here, there = f"self.{attribute(name)}", f"other.{attribute(name)}"
            if isinstance(each, Struct):
                yield f"        {here}.put({there})"
            elif isinstance(each, Array) and isinstance(each.of, Struct):
                yield f"        for mine, its in zip({here}, {there}, strict=True):"
                yield "            mine.put(its)"
            else:
                yield f"        {here}{'[:]' if isinstance(each, Array) else ''} = {_copied(there, each)}"

    def _init(self, kind: Struct) -> Iterator[str]:
        """Numbers and pointers are parameters with defaults; what has parts is made where it is not given."""
        parameters, body = [], []
        for name, each in kind.fields.items():
            own = attribute(name)
            if isinstance(each, (Struct, Array)):
                is_list = isinstance(each, Array)
                parameters.append(
                    f"{own}: Any = None" if is_list else f'{own}: "{self.annotation(each)} | None" = None'
                )
                kept = f"self.{own}{': Any' if is_list else ''}"
                body.append(f"        {kept} = {self.default(each)} if {own} is None else {own}")
            else:
                parameters.append(f"{own}: {self.annotation(each)} = {self.default(each)}")
                body.append(f"        self.{own} = {own}")
            if kind.said.get(name):
                body[-1] += f"  # {kind.said[name]}"
        yield f"    def __init__(self, {', '.join(parameters)}) -> None:"
        yield from body

    def _union(self, kind: Struct) -> Iterator[str]:
        for n, (_, view) in enumerate(kind.views()):
            if n or kind.kept:  # else the union is one of these
                self.learnt("view", view.name)
        return self._flat_union(kind) if not kind.kept else self._deep_union(kind)

    def _flat_union(self, kind: Struct) -> Iterator[str]:
        """Numbers under several names, and by index."""
        views, slots = list(kind.views()), kind.slots()
        first = views[0][1]
        more = slots[len(first.fields) :]
        yield f"class {kind.name}({first.name}):"
        yield from docstring(kind.meaning or kind.name)
        yield f"    __slots__ = ({_quoted(more)})"
        yield f"    SIZE = {size_of(kind, 4 if self.single else 8)}"
        for _, view in views[1:]:
            yield from (f"    {attribute(name)}: Real" for name in view.fields)
        yield ""
        parameters = ", ".join(f"{attribute(name)}: Real = {self.literal('0.0')}" for name in slots)
        yield f"    def __init__(self, {parameters}) -> None:"
        yield from (f"        self.{attribute(name)} = {attribute(name)}" for name in slots)
        yield ""
        yield f'    def copy(self) -> "{kind.name}":'
        yield f"        return {kind.name}({', '.join(f'self.{attribute(name)}' for name in slots)})"
        for name, view in views[1:]:
            yield ""
            yield f"    def put_{name}(self, other: Any) -> None:"
            for own, its in zip(slots, view.fields, strict=False):
                yield f"        self.{attribute(own)} = other.{attribute(its)}"
        yield ""
        yield "    def __getitem__(self, index: Any) -> Any:"
        yield f"        return ({', '.join(f'self.{attribute(name)}' for name in slots)})[index]"
        yield ""
        yield "    def __setitem__(self, index: int, value: Real) -> None:"
        yield f"        setattr(self, ({_quoted(map(attribute, slots))})[index], value)"
        other = ", ".join(
            f'{attribute(its)}="{attribute(own)}"'
            for _, view in views[1:]
            for own, its in zip(slots, view.fields, strict=False)
        )
        if other:
            yield from ("", "", f"aliases({kind.name}, {other})")

    def _deep_union(self, kind: Struct) -> Iterator[str]:
        """One member as it is; others of objects by the same objects, flat ones by properties."""
        kept = kind.fields[kind.kept]
        parts = kept.fields if isinstance(kept, Struct) else {kind.kept: kept}
        others = {n: e for n, e in kind.fields.items() if not is_flat(e) and n != kind.kept}
        _, view = next(kind.views())
        paths = [path for name, each in parts.items() for path in leaves(each, f"self.{attribute(name)}")]
        yield f"class {kind.name}:"
        yield from docstring(kind.meaning or kind.name)
        yield f"    __slots__ = ({_quoted(map(attribute, (*parts, *others)))})"
        yield f"    SIZE = {size_of(kind, 4 if self.single else 8)}"
        yield f"    PARTS: tuple[str, ...] = ({_quoted(map(attribute, parts))})"
        yield ""
        yield "    def __init__(self) -> None:"
        for name, each in parts.items():
            yield f"        self.{attribute(name)} = {self._made(each)}"
        for name, each in others.items():
            assert isinstance(each, Array)
            objects = list(dict.fromkeys(path.rpartition(".")[0] for path in paths))[: each.count]
            yield f"        self.{attribute(name)} = [{', '.join(objects)}]"
        yield ""
        yield f'    def copy(self) -> "{kind.name}":'
        yield f"        made = {kind.name}()"
        yield from (f"        made{path.removeprefix('self')} = {path}" for path in paths)
        yield "        return made"
        yield ""
        yield "    def put(self, other: Any) -> None:"
        for path, name in zip(paths, view.fields, strict=True):
            yield f"        {path} = other.{attribute(name)}"
        if others:  # by its names the flat one is read, too
            for path, name in zip(paths, view.fields, strict=True):
                yield from ("", "    @property", f"    def {attribute(name)}(self) -> Real:", f"        return {path}")

    def _made(self, kind: Type) -> str:
        """Memory of a type, also of arrays in arrays."""
        return self.default(kind)

    # ---- formulas ----

    def _formula(self, function: Function, callee: Callee) -> Iterator[str]:
        spelled = Expressions("sqrt", "abs", "" if self.single else "div")
        kinds = dict(callee.parameters)
        takes = ", ".join(
            f"{each.name}: Real"
            if not isinstance(each, Record)
            else f"{argument_name(each)}: {self.formula_type(kinds, argument_name(each))}"
            for each in function.takes
        )
        returns = function.returns.name if isinstance(function.returns, Record) else "Real"
        yield f"def {function.name}({takes}) -> {returns}:"
        yield from docstring(function.meaning)
        for name, pairs in unpacked(function, 5):
            members = ", ".join(f"{name}.{attribute(member)}" for _, member in pairs)
            yield f"    {', '.join(str(symbol) for symbol, _ in pairs)} = {members}"
        for step in function.steps:
            value = spelled(step.value)
            value = value if step.value.free_symbols else self.literal(value)
            yield f"    {step.symbol} = {value}  # {step.source}"
        values = ", ".join(map(str, function.returns.symbols))
        yield f"    return {returns}({values})" if isinstance(function.returns, Record) else f"    return {values}"

    def formula_type(self, kinds: Mapping[str, Type], name: str) -> str:
        kind = kinds.get(name)
        return self.parameter_type(kind.to) if isinstance(kind, Pointer) else "Any"


def _quoted(names: Iterable[str]) -> str:
    """The elements of a tuple of texts."""
    return " ".join(f'"{name}",' for name in names)


def _copied(text: str, kind: Type) -> str:
    if isinstance(kind, Struct):
        return f"{text}.copy()"
    if isinstance(kind, Array):
        return (
            f"[{_copied('each', kind.of)} for each in {text}]" if isinstance(kind.of, (Struct, Array)) else f"{text}[:]"
        )
    return text
