"""Expressions of the engine's C in Python."""

import operator
import re
from dataclasses import dataclass, replace
from typing import Any

from pycparser import c_ast

from .layout import (
    BOOL,
    CALLED,
    INT,
    REAL,
    UINT32,
    UINT64,
    VOID,
    Array,
    Callee,
    Declarations,
    Pointer,
    Scalar,
    Struct,
    Type,
    attribute,
    is_flat,
    offset_of,
    plain,
    size_of,
)
from .parse import Comments, Unit

# How tightly an operator binds in Python.
OR, AND, NOT, COMPARE, BIT_OR, BIT_XOR, BIT_AND, SHIFT, SUM, PRODUCT, SIGN, ATOM = range(1, 13)
CHOICE = 0
BINARY = {
    "||": OR, "&&": AND, "|": BIT_OR, "^": BIT_XOR, "&": BIT_AND, "<<": SHIFT, ">>": SHIFT, "+": SUM, "-": SUM,
    "*": PRODUCT, "/": PRODUCT, "%": PRODUCT,
} | dict.fromkeys(("<", ">", "<=", ">=", "==", "!="), COMPARE)  # fmt: skip


COMPARED = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge,
}  # fmt: skip


@dataclass(frozen=True)
class Value:
    """An expression: its type, its text, how tightly that binds, and what is known of it.

    number: of a constant. weak: of literals alone, which has no precision of its own. fresh: a struct that nothing else
    refers to. element: of a pointer or place, the array it lies in and its index there. names: of an array of a union,
    the attributes that its elements are. key: of a pointer that is stored, where. array: a pointer that is a list.
    scalar: a pointer to a number whose text is that number.
    """

    type: Type
    text: str
    binds: int = ATOM
    number: int | None = None
    weak: bool = False
    fresh: bool = False
    element: "tuple[Value, Value] | None" = None
    names: tuple[str, ...] = ()
    key: tuple[str, str] | None = None
    array: bool = False
    scalar: bool = False
    path: tuple[tuple[str, str], ...] = ()

    def within(self, binds: int) -> str:
        return self.text if self.binds >= binds else f"({self.text})"


NOTHING = Value(Pointer(VOID, True), "None", number=0)


class Learnt:
    """What is known of the whole text: pointers that are arrays, or may be None; numbers that are pointed to; structs
    that pointers stay on; parameters that are kept. Names are without a precision: what one teaches the other knows."""

    def __init__(self) -> None:
        of_written = (("overlap", "written"), ("overlap", "read"), ("refuse", "written"), ("refuse", "read"))
        self.facts: set[tuple[str, ...]] = {("array", *each) for each in of_written}
        self.count = 0

    def __call__(self, *fact: str) -> None:
        self.facts.add(_of_any_precision(fact))

    def knows(self, *fact: str) -> bool:
        return _of_any_precision(fact) in self.facts

    def something_new(self) -> bool:
        before, self.count = self.count, len(self.facts)
        return self.count > before


def _of_any_precision(fact: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name.removesuffix("_f32").removesuffix("_f64") for name in fact)


class Setting:
    """A unit, the precision it is in, and how its names, its types and its memory look in Python."""

    def __init__(self, unit: Unit, suffix: str, learnt: Learnt) -> None:
        self.unit, self.suffix, self.learnt = unit, suffix, learnt
        self.single = suffix == "f32"
        numbers = {name: int(text.strip("()uU"), 0) for name, (text, _) in unit.constants.items() if is_whole(text)}
        self.c = Declarations(suffix, numbers)
        self.globals: dict[str, Type] = {}
        self.printed: set[str] = set()

    def constant(self, name: str) -> str:
        return name.removeprefix("HOPFORM_").removesuffix(f"_{self.suffix}")

    def enumerator(self, name: str) -> str:
        """The name of an enumerator; a constant of the public header comes before it."""
        own = self.constant(name)
        return f"{own}_HERE" if f"HOPFORM_{own}" in self.unit.constants else own

    def comments(self, coord: Any) -> Comments:
        return self.unit.comments.get(coord.file) or Comments()

    def said_above(self, coord: Any) -> str:
        return plain(self.comments(coord).above.get(coord.line, ""), self.suffix)

    def global_name(self, name: str) -> str:
        return name.removeprefix("hopform_").removesuffix(f"_{self.suffix}").upper()

    def default(self, kind: Type) -> str:
        """What memory of a type holds before anything is put there."""
        if isinstance(kind, Struct):
            return f"{kind.name}()"
        if isinstance(kind, Array):
            if isinstance(kind.of, (Struct, Array)):
                return f"[{self.default(kind.of)} for _ in range({kind.count})]"
            return f"[{self.default(kind.of)}] * {kind.count}"
        if isinstance(kind, Pointer):
            return "None"
        return {"real": self.literal("0.0"), "bool": "False", "called": "None"}.get(kind.name, "0")

    def literal(self, text: str) -> str:
        if not self.single:
            return text
        return "ZERO" if text == "0.0" else f"real({text})"

    def annotation(self, kind: Type) -> str:
        if isinstance(kind, Scalar):
            return {"real": "Real", "bool": "bool", "void": "None", "called": "Any"}.get(kind.name, "int")
        return kind.name if isinstance(kind, Struct) else "Any"

    def parameter_type(self, kind: Type) -> str:
        """Of an object that is pointed to: Any for what a union is under another name. A class that comes later in the
        module is named in quotes.
        """
        if not isinstance(kind, Struct) or self.learnt.knows("view", kind.name):
            return "Any"
        return kind.name if kind.name in self.printed else f'"{kind.name}"'


class Values:
    """The expressions of one function."""

    def __init__(self, module: Setting, callee: Callee, node: Any) -> None:
        self.module, self.callee, self.node, self.c, self.learnt = module, callee, node, module.c, module.learnt
        self.out: list[str] = []
        self.depth = 1
        self.scopes: list[dict[str, Value]] = [{}]
        self.temporaries = 0
        self.renamed: dict[str, str] = {}
        self.said: set[tuple[str, int]] = set()

    def name(self, name: str) -> str:
        return self.renamed.get(name) or attribute(name.removesuffix(f"_{self.module.suffix}"))

    def put(self, line: str) -> None:
        self.out.append("    " * self.depth + line)

    def temporary(self) -> str:
        self.temporaries += 1
        return f"before_{self.temporaries}"

    def find(self, name: str) -> Value | None:
        return next((scope[name] for scope in reversed(self.scopes) if name in scope), None)

    def real(self, value: Value) -> Value:
        """A value as a real number of the precision."""
        if value.type == REAL:
            return Value(REAL, self.module.literal(value.text)) if value.weak and self.module.single else value
        if value.number is not None:
            return self.real(Value(REAL, f"{value.number}.0", ATOM if value.number >= 0 else SIGN, weak=True))
        return Value(REAL, f"{'real' if self.module.single else 'float'}({value.text})")

    def condition(self, value: Value) -> Value:
        if value.type == BOOL:
            return value
        if value.number is not None:
            return self.boolean(bool(value.number))
        if isinstance(value.type, (Pointer, Array)) or value.type == CALLED:
            return self.compare(value, "!=", NOTHING)
        return Value(BOOL, f"{value.within(COMPARE + 1)} != 0", COMPARE)

    def boolean(self, truth: bool) -> Value:
        return Value(BOOL, str(truth), number=int(truth))

    def whole(self, number: int) -> Value:
        return Value(INT, str(number), ATOM if number >= 0 else SIGN, number=number)

    def stored(self, value: Value, kind: Type) -> str:
        """A value as what a variable or member of a type is bound to: a struct as one of its own."""
        if kind == REAL:
            return self.real(value).text
        if kind == BOOL:
            return self.condition(value).text
        if isinstance(kind, Struct):
            return self.own(value)
        if isinstance(kind, Scalar) and kind != CALLED and value.type == BOOL:
            return f"int({value.text})"
        return value.text

    def own(self, value: Value) -> str:
        if value.fresh:
            return value.text
        return f"{value.within(ATOM)}.copy()"

    def value(self, node: Any) -> Value:
        return getattr(self, f"_{type(node).__name__}")(node)

    def _Constant(self, node: c_ast.Constant) -> Value:
        if node.type in ("double", "float"):
            text = node.value.rstrip("fF")
            return Value(REAL, text, weak=True)
        text = node.value.rstrip("uUlL")
        unsigned = "u" in node.value.lower() and not node.value.lower().startswith("0x")
        return Value(UINT32 if unsigned else INT, text, number=int(text, 0))

    def _ID(self, node: c_ast.ID) -> Value:
        name = node.name
        if name in ("true", "false"):
            return self.boolean(name == "true")
        if name == "NULL":
            return NOTHING
        if (found := self.find(name)) is not None:
            return found
        if name in self.c.enums:
            return replace(self.whole(self.c.enums[name]), text=self.module.enumerator(name), binds=ATOM)
        if name in self.module.unit.constants:
            text, _ = self.module.unit.constants[name]
            own = self.module.constant(name)
            if is_whole(text):
                unsigned = "u" in text and not text.startswith("0x")
                return Value(UINT32 if unsigned else INT, own)
            return Value(REAL, own)
        if name in self.module.globals:
            return Value(self.module.globals[name], self.module.global_name(name))
        if name in self.c.functions:
            return Value(CALLED, self.c.functions[name].name)
        raise KeyError(f"{name} at {node.coord}")

    def _StructRef(self, node: c_ast.StructRef) -> Value:
        base = self.value(node.name)
        if node.type == "->":
            base = self.object(base)
        kind = base.type.to if isinstance(base.type, Pointer) else base.type
        assert isinstance(kind, Struct), f"{node.coord}"
        name = node.field.name
        member = kind.fields[name]
        path = (*base.path, (kind.name, name))
        if kind.union:
            return self._view(kind, name, member, base, path)
        text = f"{base.within(ATOM)}.{attribute(name)}"
        array = isinstance(member, Pointer) and (
            not points_to_struct(member) or self.learnt.knows("array", kind.name, name)
        )
        return Value(member, text, key=(kind.name, name), array=array, path=path)

    def _view(self, kind: Struct, name: str, member: Type, base: Value, path: Any) -> Value:
        """A member of a union, which is the same object, but for what a deep one keeps beside others."""
        if not kind.kept:
            names = tuple(map(attribute, kind.slots())) if isinstance(member, Array) else ()
            return Value(member, base.text, base.binds, names=names, path=path)
        if is_flat(member) or (name == kind.kept and isinstance(member, Struct)):
            return Value(member, base.text, base.binds, path=path)
        return Value(member, f"{base.within(ATOM)}.{attribute(name)}", path=path)

    def _ArrayRef(self, node: c_ast.ArrayRef) -> Value:
        return self.at(self.value(node.name), self.value(node.subscript))

    def at(self, base: Value, index: Value) -> Value:
        """What lies at an index of an array, or behind a pointer."""
        kind = base.type
        assert isinstance(kind, (Array, Pointer))
        of = kind.of if isinstance(kind, Array) else kind.to
        if isinstance(kind, Pointer) and base.element is not None:
            array, first = base.element
            return self.at(array, self.sum(first, "+", index))
        if isinstance(kind, Pointer) and not base.array:
            if base.scalar and index.number == 0:
                return Value(of, base.text, base.binds)
            if base.key and index.number != 0:
                self.learnt("array", *base.key)
            if index.number == 0 and not base.key:
                return Value(of, base.text, base.binds, path=base.path)
            if isinstance(of, Struct) and index.number == 0:
                return Value(of, base.text, base.binds)
        if base.names and index.number is not None:
            return Value(of, f"{base.within(ATOM)}.{base.names[index.number]}", element=(base, index))
        text = f"{base.within(ATOM)}[{index.text}]"
        path = (*base.path, ("", "[]"))
        if isinstance(of, Pointer):
            return Value(of, text, array=not points_to_struct(of), path=path)
        return Value(of, text, element=(replace(base, element=None), index), path=path)

    def _UnaryOp(self, node: c_ast.UnaryOp) -> Value:
        if node.op == "&":
            return self.address(node.expr)
        if node.op == "*":
            pointer = self.value(node.expr)
            if isinstance(pointer.type, Pointer) and isinstance(pointer.type.to, Struct) and not pointer.array:
                return Value(pointer.type.to, pointer.text, pointer.binds)
            return self.at(pointer, self.whole(0))
        if node.op == "sizeof":
            return self._size(node.expr)
        if node.op in ("p++", "p--"):
            place, name = self.value(node.expr), self.temporary()
            self.put(f"{name} = {place.text}")
            self.put(f"{place.text} {node.op[1]}= 1")
            return Value(place.type, name)
        value = self.value(node.expr)
        if node.op == "!":
            value = self.condition(value)
            return self.negated(value)
        if node.op == "-":
            if value.number is not None:
                return self.whole(-value.number)
            kind = INT if value.type == BOOL else value.type
            return Value(kind, f"-{value.within(SIGN)}", SIGN, weak=value.weak)
        raise TypeError(f"{node.op} at {node.coord}")

    def negated(self, value: Value) -> Value:
        if value.number is not None:
            return self.boolean(not value.number)
        if value.binds == NOT:
            return Value(BOOL, value.text.removeprefix("not "), COMPARE)
        if value.binds == COMPARE and " == " in value.text:
            return Value(BOOL, value.text.replace(" == ", " != "), COMPARE)
        return Value(BOOL, f"not {value.within(NOT)}", NOT)

    def _size(self, node: Any) -> Value:
        real = 4 if self.module.single else 8
        kind = self.c.type_of(node) if isinstance(node, c_ast.Typename) else self._quietly(node).type
        if isinstance(kind, Struct):
            return Value(INT, f"{kind.name}.SIZE")
        if kind == REAL:
            return Value(INT, "REAL_SIZE")
        if isinstance(kind, Array) and kind.of == REAL:
            return Value(INT, f"{kind.count} * REAL_SIZE", PRODUCT)
        return self.whole(size_of(kind, real))

    def _quietly(self, node: Any) -> Value:
        """A value that is not evaluated."""
        before = self.out
        self.out = []
        try:
            return self.value(node)
        finally:
            self.out = before

    def address(self, node: Any) -> Value:
        """A pointer to a place: the object of a struct; of a number, the place itself, part of an array or not."""
        place = self.value(node)
        kind = Pointer(place.type, False)
        if isinstance(place.type, Struct):
            return Value(kind, place.text, place.binds, element=place.element, path=place.path)
        if isinstance(place.type, Array):
            return replace(place, type=Pointer(place.type.of, False), array=True)
        boxed = node.name if isinstance(node, c_ast.ID) else ""
        return Value(
            kind, place.text, place.binds, element=place.element, scalar=True, key=("&", boxed) if boxed else None
        )

    def object(self, pointer: Value) -> Value:
        """The object that a pointer to a struct points to."""
        if isinstance(pointer.type, Array):
            return self.at(pointer, self.whole(0))
        if pointer.array:
            return Value(pointer.type, f"{pointer.within(ATOM)}[0]", path=pointer.path)
        return pointer

    def listed(self, pointer: Value, const: bool) -> str:
        """A pointer as an array: a list, a part of one, or a list of what it points to."""
        if pointer.number == 0 and pointer.text == "None":
            return "None"
        if isinstance(pointer.type, Array):
            return pointer.text
        if pointer.element is not None:
            array, first = pointer.element
            if first.number == 0:
                return array.text
            return self.part(array, first, const)
        if pointer.scalar:
            if pointer.key and not const:
                self.learnt("box", self.callee.name, pointer.key[1])
                return pointer.text.removesuffix("[0]")
            if pointer.text.endswith("[0]"):
                return pointer.text.removesuffix("[0]")
            if not const:
                raise TypeError(f"a pointer to {pointer.text} in {self.callee.name}")
            return f"[{pointer.text}]"
        if pointer.array or not points_to_struct(pointer.type):
            return pointer.text
        if pointer.key and pointer.key[0] != "&":
            self.learnt("array", *pointer.key)
        return f"[{pointer.text}]"

    def part(self, array: Value, first: Value, const: bool) -> str:
        """An array from an index on: the same memory, but for a small one that is only read."""
        small = isinstance(array.type, Array) or (isinstance(array.type, Pointer) and array.type.const)
        if const and small:
            return f"{array.within(ATOM)}[{first.text}:]"
        return f"Part({array.text}, {first.text})"

    def pointer(self, value: Value, kind: Type, key: tuple[str, str]) -> str:
        """A pointer for a parameter or member: of an array, a list; else the object."""
        if value.text == "None" and value.number == 0:
            self.learnt("none", *key)
            return "None"
        if isinstance(kind, Array):
            return self.listed(value, False)
        assert isinstance(kind, Pointer)
        if value.key and self.learnt.knows("none", *value.key):
            pass
        if not points_to_struct(kind) and kind.to != VOID or self.learnt.knows("array", *key):
            return self.listed(value, kind.const)
        if kind.to == VOID:
            return self.listed(value, True) if value.scalar else value.text
        return self.object(value).text

    # ---- operators ----

    def _BinaryOp(self, node: c_ast.BinaryOp) -> Value:
        op = node.op
        left = self.value(node.left)
        if op in ("&&", "||"):
            left = self.condition(left)
            if left.number is not None and bool(left.number) == (op == "||"):
                return left
            before = len(self.out)
            right = self.condition(self.value(node.right))
            if len(self.out) > before:
                raise TypeError(f"a side effect behind {op} at {node.coord}")
            if left.number is not None:
                return right
            if right.number is not None:
                return left if bool(right.number) == (op == "&&") else right
            word = "and" if op == "&&" else "or"
            return Value(BOOL, f"{left.within(BINARY[op])} {word} {right.within(BINARY[op])}", BINARY[op])
        right = self.value(node.right)
        if op in ("==", "!=", "<", ">", "<=", ">="):
            return self.compare(left, op, right)
        if isinstance(left.type, (Pointer, Array)):
            return self.moved(left, self.sum(self.whole(0), op, right))
        return self.sum(left, op, right)

    def compare(self, left: Value, op: str, right: Value) -> Value:
        for one, other in ((left, right), (right, left)):
            if other.text == "None" and other.number == 0:
                if one.key:
                    self.learnt("none", *one.key)
                return Value(BOOL, f"{one.within(COMPARE + 1)} is{' not' if op == '!=' else ''} None", COMPARE)
        if isinstance(left.type, Pointer):
            return Value(
                BOOL,
                f"{left.within(COMPARE + 1)} is{' not' if op == '!=' else ''} {right.within(COMPARE + 1)}",
                COMPARE,
            )
        if left.number is not None and right.number is not None:
            return self.boolean(COMPARED[op](left.number, right.number))
        return Value(BOOL, f"{left.within(COMPARE + 1)} {op} {right.within(COMPARE + 1)}", COMPARE)

    def moved(self, pointer: Value, by: Value) -> Value:
        """A pointer into an array, further on."""
        if isinstance(pointer.type, Array):
            return Value(Pointer(pointer.type.of, False), pointer.text, element=(pointer, by), array=True)
        if pointer.element is not None:
            array, first = pointer.element
            index = self.sum(first, "+", by)
            return replace(self.at(array, index), type=pointer.type)
        if pointer.key:
            self.learnt("array", *pointer.key)
        return Value(pointer.type, pointer.text, element=(pointer, by), array=True)

    def sum(self, left: Value, op: str, right: Value) -> Value:
        """Two numbers and an operator between them."""
        binds = BINARY[op]
        if left.number is not None and right.number is not None and REAL not in (left.type, right.type):
            a, b = left.number, right.number
            if op in "+-*":
                return self.whole({"+": a + b, "-": a - b, "*": a * b}[op])
        if REAL not in (left.type, right.type):
            if op == "*" and 0 in (left.number, right.number):
                return self.whole(0)
            if op in ("+", "*") and left.number == (op == "*"):
                return right
            if op in ("+", "-") and right.number == 0 or op == "*" and right.number == 1:
                return left
            if op == "+" and right.number is not None and right.number < 0:
                return self.sum(left, "-", self.whole(-right.number))
        real = REAL in (left.type, right.type)
        if op == "/":
            if not real:
                return Value(left.type, f"{left.within(binds)} // {right.within(binds + 1)}", binds)
            if not self.module.single and not right.weak:
                return Value(REAL, f"div({left.text}, {right.text})")
        kind: Type = (
            REAL
            if real
            else UINT64
            if UINT64 in (left.type, right.type)
            else UINT32
            if UINT32 in (left.type, right.type)
            else INT
        )
        if not real and op in "&|" and left.type == right.type == BOOL:
            kind = BOOL
        elif not real:
            left, right = (
                replace(v, text=f"int({v.text})", binds=ATOM) if v.type == BOOL else v for v in (left, right)
            )
        text = f"{left.within(binds)} {op} {right.within(binds + 1)}"
        weak = left.weak and right.weak
        if kind in (UINT32, UINT64) and op in ("*", "+", "-", "<<"):
            return Value(kind, f"({text}) & {'0xFFFFFFFF' if kind == UINT32 else '0xFFFFFFFFFFFFFFFF'}", BIT_AND)
        return Value(kind, text, binds, weak=weak)

    def _TernaryOp(self, node: c_ast.TernaryOp) -> Value:
        condition = self.condition(self.value(node.cond))
        if condition.number is not None:
            return self.value(node.iftrue if condition.number else node.iffalse)
        a, b = self.value(node.iftrue), self.value(node.iffalse)
        kind = a.type if a.text != "None" else b.type
        if isinstance(kind, (Pointer, Array)):
            scalars = not (isinstance(kind, Pointer) and points_to_struct(kind))
            if scalars:
                text = f"{self.listed(a, True)} if {condition.within(CHOICE + 1)} else {self.listed(b, True)}"
                return Value(Pointer(kind.of if isinstance(kind, Array) else kind.to, True), text, CHOICE, array=True)
            return Value(kind, f"{a.within(OR)} if {condition.within(OR)} else {b.within(CHOICE)}", CHOICE)
        if isinstance(kind, Struct):
            return Value(kind, f"{self.own(a)} if {condition.within(OR)} else {self.own(b)}", CHOICE, fresh=True)
        if REAL in (a.type, b.type):
            if not (a.weak and b.weak):
                a, b = self.real(a), self.real(b)
            return Value(
                REAL,
                f"{a.within(OR)} if {condition.within(OR)} else {b.within(CHOICE)}",
                CHOICE,
                weak=a.weak and b.weak,
            )
        kind = BOOL if a.type == b.type == BOOL else INT if BOOL in (a.type, b.type) else a.type
        return Value(kind, f"{a.within(OR)} if {condition.within(OR)} else {b.within(CHOICE)}", CHOICE)

    def _Cast(self, node: c_ast.Cast) -> Value:
        kind, value = self.c.type_of(node.to_type), self.value(node.expr)
        if isinstance(kind, Pointer) or kind == VOID:
            return replace(value, type=kind) if isinstance(kind, Pointer) else value
        if kind == REAL:
            return self.real(value)
        if value.type == REAL:
            return Value(kind, f"whole({value.text})")
        if kind in (UINT32, UINT64) and value.type != kind and value.number is None:
            return Value(
                kind, f"{value.within(BIT_AND)} & {'0xFFFFFFFF' if kind == UINT32 else '0xFFFFFFFFFFFFFFFF'}", BIT_AND
            )
        return replace(value, type=kind)

    def _FuncCall(self, node: c_ast.FuncCall) -> Value:
        given = node.args.exprs if node.args else []
        name = node.name.name if isinstance(node.name, c_ast.ID) else ""
        bare = name.removesuffix("f")
        if bare in ("sqrt", "fabs"):
            value = self.value(given[0])
            return Value(REAL, f"{'sqrt' if bare == 'sqrt' else 'abs'}({self.real(value).text})")
        if name == "offsetof":
            kind = self.c.type_of(given[0])
            assert isinstance(kind, Struct)
            return self.whole(offset_of(kind, given[1].name, 4 if self.module.single else 8))
        if name == "memcpy":
            return self._memcpy(*given)
        callee = self.c.functions.get(name)
        if callee is None:
            callee = next(each for each in self.c.functions.values() if each.name == "carry_variation")
            called = self.value(node.name).text
        else:
            called = callee.name
        arguments = []
        for argument, (parameter, kind) in zip(given, callee.parameters, strict=True):
            value, key = self.value(argument), (callee.name, parameter)
            if key == ("array", "first") and value.key and self.value(given[1]).number != 1:
                self.learnt("array", *value.key)
            if isinstance(kind, (Pointer, Array)):
                arguments.append(self.pointer(value, kind, key))
                if value.key and self.learnt.knows("none", *key):
                    pass
                if self.learnt.knows("kept", *key):
                    self.stays(value)
                if self.learnt.knows("none", *key) and value.key and value.key[0] != "&":
                    pass
            else:
                arguments.append(self.stored(value, kind))
        text = f"{called}({', '.join(arguments)})"
        return Value(callee.returns, text, fresh=True)

    def _memcpy(self, to: Any, source: Any, size: Any) -> Value:
        into, what = self.value(to), self.value(source)
        if isinstance(what.type, Pointer) and what.type.to == VOID:
            return Value(VOID, f"put_reals({into.text}, {what.text}, {self.value(size).text})")
        assert isinstance(into.type, (Array, Pointer))
        if isinstance(into.type, Array):
            count = into.type.count
            first = 0
            if what.element is not None and what.element[1].number is not None:
                (what, by) = what.element
                first = by.number or 0
            return Value(VOID, f"{into.text}[:] = {what.text}[{first or ''}:{first + count}]")
        return Value(VOID, f"{into.text}[:] = {what.text}")

    # ---- initialisers ----

    def initial(self, kind: Type, node: Any, const: bool = False, key: tuple[str, str] = ("", "")) -> str:
        """What an initialiser puts into memory of a type."""
        if not isinstance(node, c_ast.InitList):
            value = self.value(node)
            if isinstance(kind, Pointer):
                self.stays(value)
                return self.pointer(value, kind, key)
            return self.stored(value, kind)
        if _is_zero(node) and not (const and isinstance(kind, Array) and isinstance(kind.of, Scalar)):
            return self.module.default(kind)
        if isinstance(kind, Struct) and kind.union:
            name, first = next(iter(kind.fields.items()))
            assert isinstance(first, Struct)
            parts = [
                self.initial(of, each) for of, each in zip(first.fields.values(), node.exprs[0].exprs, strict=False)
            ]
            return f"{kind.name}({', '.join(parts)})"
        if isinstance(kind, Struct):
            parts = [
                self.initial(of, each, key=(kind.name, name))
                for (name, of), each in zip(kind.fields.items(), node.exprs, strict=False)
            ]
            return f"{kind.name}({', '.join(parts)})"
        assert isinstance(kind, Array)
        parts = [self.initial(kind.of, each) for each in node.exprs]
        left = kind.count - len(parts)
        parts += [self.module.default(kind.of)] * max(left, 0)
        if const and isinstance(kind.of, Scalar):
            return f"({', '.join(parts)}{',' if len(parts) == 1 else ''})"
        return f"[{', '.join(parts)}]"

    def stays(self, pointer: Value) -> None:
        """A pointer is put somewhere: what it points to is not bound to another object from now on."""
        if pointer.key and pointer.key[0] == self.callee.name:
            self.learnt("kept", *pointer.key)
        for owner, name in pointer.path:
            self.learnt("pinned", owner, name)


def points_to_struct(kind: Type) -> bool:
    return isinstance(kind, Pointer) and isinstance(kind.to, Struct)


def is_whole(text: str) -> bool:
    return re.fullmatch(r"\(?-?(\d+|0x[0-9a-f]+)[uU]?\)?", text) is not None


def _is_zero(node: c_ast.InitList) -> bool:
    return all(
        _is_zero(each)
        if isinstance(each, c_ast.InitList)
        else isinstance(each, c_ast.Constant) and float(each.value.rstrip("fuUlL")) == 0.0
        for each in node.exprs
    )
