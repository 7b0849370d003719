"""Types of the engine's C as its declarations say them, and how memory of each looks in Python.

A struct is a class with slots, an array a list, a pointer to a struct the object itself. A union is one object under
the names of all its members: where they are flat, further names of its slots; else one member is kept, of objects, and
the names of the flat one are properties.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from pycparser import c_ast


@dataclass(frozen=True)
class Scalar:
    """A number, or what is called; `size` in bytes, of a real that of the precision."""

    name: str
    size: int = 4


REAL, INT, BOOL, VOID, CALLED = (
    Scalar("real", 0),
    Scalar("int"),
    Scalar("bool", 1),
    Scalar("void", 0),
    Scalar("called", 8),
)
UINT32, UINT64 = Scalar("uint32"), Scalar("uint64", 8)
NUMBERS = {
    "_Bool": BOOL, "void": VOID, "double": REAL, "float": REAL, "unsigned": UINT32, "unsigned int": UINT32,
    "unsigned long": UINT64, "int": INT, "short": Scalar("int", 2), "unsigned short": Scalar("int", 2),
    "char": Scalar("int", 1), "signed char": Scalar("int", 1), "unsigned char": Scalar("int", 1),
    "long": Scalar("int", 8),
}  # fmt: skip
WHOLE = {"size_t": Scalar("int", 8), "uintptr_t": Scalar("int", 8)}
"""Unsigned types of addresses and sizes, of which none wraps around."""


@dataclass(frozen=True)
class Array:
    of: "Type"
    count: int


@dataclass(frozen=True)
class Pointer:
    to: "Type"
    const: bool


@dataclass(eq=False)
class Struct:
    """A struct or union; its class in Python is `name`."""

    name: str
    union: bool = False
    fields: dict[str, "Type"] = field(default_factory=dict)
    meaning: str = ""
    said: dict[str, str] = field(default_factory=dict)

    @property
    def flat(self) -> bool:
        """Whether its members are numbers alone."""
        return not self.union and all(isinstance(each, Scalar) for each in self.fields.values())

    @property
    def kept(self) -> str:
        """Of a union: the member that is kept; "" if all are flat, so that its slots have their names."""
        return next((name for name, each in self.fields.items() if not is_flat(each)), "")

    def views(self) -> Iterator[tuple[str, "Struct"]]:
        """The flat structs that a union is."""
        yield from ((n, each) for n, each in self.fields.items() if isinstance(each, Struct) and each.flat)

    def slots(self) -> list[str]:
        """The names of the numbers of a flat union: those of its first struct, then, where it has more, by index."""
        names = list(next(self.views())[1].fields)
        most = max(each.count for each in self.fields.values() if isinstance(each, Array))
        return names + [f"of_{n}" for n in range(len(names), most)]


Type: TypeAlias = Scalar | Array | Pointer | Struct


def is_flat(kind: Type) -> bool:
    """Whether a member of a union is a flat struct, or an array of numbers."""
    return isinstance(kind, Struct) and kind.flat or isinstance(kind, Array) and isinstance(kind.of, Scalar)


def size_of(kind: Type, real: int) -> int:
    return _size_and_alignment(kind, real)[0]


def _size_and_alignment(kind: Type, real: int) -> tuple[int, int]:
    """In bytes, where a real takes `real` of them."""
    if isinstance(kind, Struct):
        end, widest = 0, 1
        for each in kind.fields.values():
            size, alignment = _size_and_alignment(each, real)
            begin = 0 if kind.union else -(-end // alignment) * alignment
            end, widest = max(end, begin + size), max(widest, alignment)
        return -(-end // widest) * widest, widest
    if isinstance(kind, Array):
        size, alignment = _size_and_alignment(kind.of, real)
        return size * kind.count, alignment
    size = 8 if isinstance(kind, Pointer) else kind.size or real
    return size, size


def offset_of(kind: Struct, name: str, real: int) -> int:
    """Where a member begins, in bytes."""
    end = 0
    for other, each in kind.fields.items():
        size, alignment = _size_and_alignment(each, real)
        begin = -(-end // alignment) * alignment
        if other == name:
            return begin
        end = begin + size
    raise KeyError(name)


def leaves(kind: Type, path: str) -> Iterator[str]:
    """The numbers of a member as Python reaches them."""
    if isinstance(kind, Struct):
        for name, each in kind.fields.items():
            yield from leaves(each, f"{path}.{attribute(name)}")
    elif isinstance(kind, Array):
        for n in range(kind.count):
            yield from leaves(kind.of, f"{path}[{n}]")
    else:
        yield path


RESERVED = frozenset(
    (
        "from",
        "in",
        "is",
        "pass",
        "lambda",
        "not",
        "and",
        "or",
        "del",
        "abs",
        "range",
        "int",
        "float",
        "real",
        "l",
        "self",
    )
)
"""Names of C that Python has another use for."""


def attribute(name: str) -> str:
    return f"{name}_" if name in RESERVED else name


def class_name(name: str) -> str:
    return "".join(part[0].upper() + part[1:] for part in name.removeprefix("hopform_").split("_") if part)


@dataclass(frozen=True)
class Callee:
    """A function: its name in Python, its parameters, what it returns."""

    name: str
    parameters: tuple[tuple[str, Type], ...]
    returns: Type


class Declarations:
    """What the declarations of a unit say; names are without the suffix of the precision."""

    def __init__(self, suffix: str, constants: dict[str, int]) -> None:
        self.suffix, self.constants = f"_{suffix}", constants
        self.types: dict[str, Type] = {}
        self.structs: dict[str, Struct] = {}
        self.enums: dict[str, int] = {}
        self.functions: dict[str, Callee] = {}

    def bare(self, name: str) -> str:
        return name.removesuffix(self.suffix)

    def number(self, node: c_ast.Node | None) -> int:
        """A constant expression."""
        if isinstance(node, c_ast.Constant):
            return int(node.value.rstrip("uUlL"), 0)
        if isinstance(node, c_ast.ID):
            return self.enums[node.name] if node.name in self.enums else self.constants[node.name]
        if isinstance(node, c_ast.UnaryOp) and node.op == "-":
            return -self.number(node.expr)
        if isinstance(node, c_ast.BinaryOp) and node.op in "+-*/":
            left, right = self.number(node.left), self.number(node.right)
            return {"+": left + right, "-": left - right, "*": left * right, "/": left // (right or 1)}[node.op]
        raise TypeError(f"no constant: {node}")

    def type_of(self, node: c_ast.Node, owner: str = "") -> Type:
        """The type that a declaration gives, or a name of a type; `owner` names what has no name of its own."""
        if isinstance(node, (c_ast.TypeDecl, c_ast.Typename, c_ast.Decl, c_ast.Typedef)):
            named = getattr(node, "declname", None) or getattr(node, "name", None) or owner
            return self.type_of(node.type, owner or str(named))
        if isinstance(node, c_ast.IdentifierType):
            name = " ".join(node.names)
            return WHOLE.get(name) or self.types.get(name) or NUMBERS[name]
        if isinstance(node, c_ast.PtrDecl):
            to = self.type_of(node.type, owner)
            return CALLED if to == CALLED else Pointer(to, "const" in getattr(node.type, "quals", ()))
        if isinstance(node, c_ast.FuncDecl):
            return CALLED
        if isinstance(node, c_ast.ArrayDecl):
            of = self.type_of(node.type, owner)
            return Array(of, self.number(node.dim) if node.dim is not None else 0)
        if isinstance(node, (c_ast.Struct, c_ast.Union)):
            return self._struct(node, owner)
        if isinstance(node, c_ast.Enum):
            value = -1
            for each in node.values.enumerators if node.values else ():
                value = self.number(each.value) if each.value else value + 1
                self.enums[each.name] = value
            return INT
        raise TypeError(f"no type: {node}")

    def _struct(self, node: c_ast.Struct | c_ast.Union, owner: str) -> Struct:
        key = self.bare(node.name or owner)
        made = self.structs.setdefault(key, Struct(class_name(key), isinstance(node, c_ast.Union)))
        for each in node.decls or ():
            made.fields[each.name] = self.type_of(each.type, f"{key}_{each.name}" if _is_own(each) else "")
        return made

    def function(self, declaration: c_ast.Decl, name: str) -> Callee:
        """The function that is declared, under its name in Python."""
        parameters = tuple(
            (each.name or "", self.type_of(each.type))
            for each in (declaration.type.args.params if declaration.type.args else ())
            if self.type_of(each.type) != VOID
        )
        made = Callee(name, parameters, self.type_of(declaration.type.type))
        self.functions[declaration.name] = made
        return made


def _is_own(declaration: c_ast.Decl) -> bool:
    """Whether a member has a struct of its own, which has no name."""
    kind = declaration.type
    while hasattr(kind, "type"):
        kind = kind.type
    return isinstance(kind, (c_ast.Struct, c_ast.Union))


def plain(text: str, suffix: str) -> str:
    """A comment of C in the names of Python."""
    text = re.sub(rf"\bhopform_(\w+?)(?:_{suffix})?\b", r"\1", text)
    text = re.sub(rf"\bHOPFORM_(\w+?)(?:_{suffix})?\b", r"\1", text)
    return re.sub(rf"\b(\w+)_{suffix}\b", r"\1", text).replace("NULL", "None")
