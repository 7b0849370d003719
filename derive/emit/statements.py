"""A function of the engine's C in Python: its signature and its statements."""

import re
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import Any

from pycparser import c_ast

from .layout import INT, REAL, UINT32, UINT64, Array, Pointer, Struct, attribute, plain
from .lines import WIDEST, docstring
from .values import ATOM, Value, Values, points_to_struct


class Body(Values):
    """One function."""

    def lines(self) -> Iterator[str]:
        self.renamed = self._renamed()
        parameters = []
        for name, kind in self.callee.parameters:
            own = self.name(name)
            pointed = isinstance(kind, (Pointer, Array))
            array = pointed and (self.learnt.knows("array", self.callee.name, name) or not points_to_struct(kind))
            self.scopes[0][name] = Value(kind, own, key=(self.callee.name, name), array=array)
            may_be_none = self.learnt.knows("none", self.callee.name, name)
            annotation = (
                self.module.annotation(kind) if not pointed
                else "Any" if array or may_be_none or not isinstance(kind, Pointer)
                else self.module.parameter_type(kind.to)
            )  # fmt: skip
            parameters.append(f"{own}: {annotation}")
        returns = self.callee.returns
        if isinstance(returns, Pointer):
            returned = returns.to.name if isinstance(returns.to, Struct) else "Any"
        else:
            returned = self.module.annotation(returns)
        yield f"def {self.callee.name}({', '.join(parameters)}) -> {returned}:"
        if said := self.module.said_above(self.node.coord):
            yield from docstring(said)
        self.statement(self.node.body)
        yield from self.out or ["    pass"]

    def _renamed(self) -> dict[str, str]:
        """Local names that would hide a function that is called here."""
        called = {each.name.name for each in _all(self.node.body, c_ast.FuncCall) if isinstance(each.name, c_ast.ID)}
        taken = {self.c.functions[name].name for name in called if name in self.c.functions}
        taken |= {each.name for each in self.c.functions.values() if each.name in ("observer",)}
        locals_ = {each.name for each in _all(self.node, c_ast.Decl) if each.name}
        return {
            name: f"{name}_"
            for name in locals_
            if attribute(name.removesuffix(f"_{self.module.suffix}")) in taken | {"Part", "div", "sqrt", "whole"}
        }

    # ---- statements ----

    @contextmanager
    def block(self) -> Iterator[None]:
        self.depth += 1
        self.scopes.append({})
        before = len(self.out)
        yield
        if not any(not line.strip().startswith("#") for line in self.out[before:]):
            self.put("pass")
        self.scopes.pop()
        self.depth -= 1

    def say(self, coord: Any) -> None:
        """The comment above a statement."""
        if coord is None or (coord.file, coord.line) in self.said:
            return
        self.said.add((coord.file, coord.line))
        text = self.module.said_above(coord)
        if text:
            for line in textwrap.wrap(" ".join(text.split()), WIDEST - 2 - 4 * self.depth):
                self.put(f"# {line}")

    def statement(self, node: Any, step: Any = None) -> None:
        if isinstance(node, c_ast.Compound):
            for each in node.block_items or ():
                self.statement(each, step)
            return
        self.say(node.coord)
        before = len(self.out)
        getattr(self, f"_do_{type(node).__name__}")(node, step)
        self._say_behind(node.coord, before)

    def _say_behind(self, coord: Any, before: int) -> None:
        """The comment behind the first line of a statement."""
        if coord is None or len(self.out) == before or (coord.file, -coord.line) in self.said:
            return
        text = plain(self.module.comments(coord).behind.get(coord.line, ""), self.module.suffix)
        if text:
            self.said.add((coord.file, -coord.line))
            self.out[before] += f"  # {' '.join(text.split())}"

    def _do_Decl(self, node: c_ast.Decl, step: Any) -> None:
        kind = self.c.type_of(node.type)
        if isinstance(kind, Array) and kind.count == 0:
            kind = Array(kind.of, len(node.init.exprs))
        own = self.name(node.name)
        key = (self.callee.name, node.name)
        const = "const" in _innermost(node.type).quals
        if self.learnt.knows("box", *key):
            value = self.stored(self.value(node.init), kind) if node.init is not None else self.module.default(kind)
            self.put(f"{own} = [{value}]")
            self.scopes[-1][node.name] = Value(kind, f"{own}[0]")
            return
        variable = Value(kind, own, key=key, path=((self.callee.name, node.name),))
        if isinstance(kind, Pointer):
            self._declare_pointer(node, kind, own, variable)
            return
        self.scopes[-1][node.name] = variable
        if node.init is None:
            if isinstance(kind, (Struct, Array)):
                pointers = isinstance(kind, Array) and isinstance(kind.of, Pointer)
                self.put(f"{own}{': Any' if pointers else ''} = {self.module.default(kind)}")
            return
        if isinstance(node.init, c_ast.UnaryOp) and node.init.op in ("p++", "p--"):
            place = self.value(node.init.expr)
            self.put(f"{own} = {place.text}")
            self.put(f"{place.text} {node.init.op[1]}= 1")
            return
        self.put(f"{own} = {self.initial(kind, node.init, const)}")

    def _declare_pointer(self, node: c_ast.Decl, kind: Pointer, own: str, variable: Value) -> None:
        """A pointer into an array, or to a number, is a name for what it points to; others are bound."""
        if node.init is None:
            self.scopes[-1][node.name] = variable
            return
        value = self.value(node.init)
        if isinstance(value.type, Array):  # an array by another name
            self.put(f"{own} = {value.text}")
            self.scopes[-1][node.name] = replace(variable, type=value.type, names=value.names)
            return
        if not points_to_struct(kind):
            if value.element is not None or value.scalar:
                self.scopes[-1][node.name] = value
                return
            self.put(f"{own} = {value.text}")
            self.scopes[-1][node.name] = replace(variable, array=True)
            return
        self.stays(value)
        object_ = self.object(value)
        self.put(f"{own} = {object_.text}")
        element = value.element
        if element is None and value.array:
            element = (value, self.whole(0))
        self.scopes[-1][node.name] = replace(variable, element=element, key=None) if element else variable

    def _do_DeclList(self, node: c_ast.DeclList, step: Any) -> None:
        for each in node.decls:
            self.statement(each)

    def _do_Assignment(self, node: c_ast.Assignment, step: Any) -> None:
        if isinstance(node.lvalue, c_ast.StructRef) and self._is_view(node):
            return
        place, op = self.value(node.lvalue), node.op
        kind = place.type
        value = self.value(node.rvalue)
        if isinstance(kind, Struct):
            self._assign_struct(node.lvalue, place, value)
            return
        if isinstance(kind, Pointer):
            self.stays(value)
            key = place.key or ("", "")
            if place.text.endswith("]"):  # a pointer in an array
                text = self.listed(value, False) if not points_to_struct(kind) else value.text
            elif isinstance(node.lvalue, c_ast.ID) and value.text != "None":
                text = self.object(value).text if points_to_struct(kind) else value.text
            else:
                text = self.pointer(value, kind, key)
            self.put(f"{place.text} = {text}")
            return
        if op == "=":
            if (text := self.stored(value, kind)) != place.text:
                self.put(f"{place.text} = {text}")
            return
        if op == "/=" or kind in (UINT32, UINT64):
            made = self.sum(place, op[:-1], value)
            self.put(f"{place.text} = {made.text}")
            return
        self.put(f"{place.text} {op} {value.text}")

    def _is_view(self, node: c_ast.Assignment) -> bool:
        """Put a struct into a union under one of its names."""
        base = self._quietly(node.lvalue.name)
        kind = base.type.to if isinstance(base.type, Pointer) else base.type
        if not (isinstance(kind, Struct) and kind.union):
            return False
        name = node.lvalue.field.name
        if not isinstance(kind.fields[name], Struct):
            return False
        first = next(kind.views())[0]
        method = "put" if name == first else f"put_{name}"
        base = self.value(node.lvalue.name)
        self.put(f"{self.object(base).within(ATOM)}.{method}({self.value(node.rvalue).text})")
        return True

    def _assign_struct(self, lvalue: Any, place: Value, value: Value) -> None:
        """Bind it to an object of its own where nothing points to the old one; else put the values there."""
        if isinstance(lvalue, c_ast.ID):
            free = not self.learnt.knows("pinned", self.callee.name, lvalue.name)
        else:
            free = isinstance(lvalue, c_ast.StructRef) and not self.learnt.knows("pinned", *place.path[-1])
        if free:
            self.put(f"{place.text} = {self.own(value)}")
        else:
            self.put(f"{place.within(ATOM)}.put({value.text})")

    def _do_UnaryOp(self, node: c_ast.UnaryOp, step: Any) -> None:
        self.put(f"{self.value(node.expr).text} {node.op[1]}= 1")

    def _do_FuncCall(self, node: c_ast.FuncCall, step: Any) -> None:
        self.put(self.value(node).text)

    def _do_Cast(self, node: c_ast.Cast, step: Any) -> None:
        if not isinstance(node.expr, c_ast.ID):
            self.put(self.value(node.expr).text)

    def _do_Return(self, node: c_ast.Return, step: Any) -> None:
        if node.expr is None:
            self.put("return")
            return
        value, returns = self.value(node.expr), self.callee.returns
        if isinstance(returns, Pointer):
            self.stays(value)
            self.put(f"return {self.object(value).text}")
        elif (
            isinstance(returns, Struct)
            and isinstance(node.expr, (c_ast.ID, c_ast.StructRef))
            and self._is_own(node.expr)
        ):
            self.put(f"return {value.text}")
        else:
            self.put(f"return {self.stored(value, returns)}")

    def _is_own(self, node: Any) -> bool:
        """Whether a place lies in a variable of the function itself."""
        while isinstance(node, c_ast.StructRef):
            if node.type == "->":
                return False
            node = node.name
        return isinstance(node, c_ast.ID) and node.name in self.variables

    @cached_property
    def variables(self) -> set[str]:
        """The names of the function's own."""
        return {each.name for each in _all(self.node.body, c_ast.Decl)}

    def _do_If(self, node: c_ast.If, step: Any, word: str = "if") -> None:
        condition = self.condition(self.value(node.cond))
        if condition.number is not None:
            chosen = node.iftrue if condition.number else node.iffalse
            if chosen is not None:
                self.statement(chosen, step)
            return
        self.put(f"{word} {condition.text}:")
        with self.block():
            self.statement(node.iftrue, step)
        if node.iffalse is None:
            return
        if isinstance(node.iffalse, c_ast.If):
            before = len(self.out)
            quiet = self._quietly(node.iffalse.cond)
            if self.condition(quiet).number is None and len(self.out) == before:
                self.say(node.iffalse.coord)
                self._do_If(node.iffalse, step, "elif")
                return
        self.put("else:")
        with self.block():
            self.statement(node.iffalse, step)

    def _do_While(self, node: c_ast.While, step: Any) -> None:
        self.put(f"while {self.condition(self.value(node.cond)).text}:")
        with self.block():
            self.statement(node.stmt, [])

    def _do_DoWhile(self, node: c_ast.DoWhile, step: Any) -> None:
        self.put("while True:")
        with self.block():
            self.statement(node.stmt, [])
            self.put(f"if {self.negated(self.condition(self.value(node.cond))).text}:")
            self.put("    break")

    def _do_For(self, node: c_ast.For, step: Any) -> None:
        self.scopes.append({})
        if not self._counted(node):
            if node.init is not None:
                self.statement(node.init)
            condition = self.condition(self.value(node.cond)) if node.cond is not None else self.boolean(True)
            self.put(f"while {condition.text}:")
            with self.block():
                self.statement(node.stmt, [node.next] if node.next is not None else [])
                if node.next is not None:
                    self.statement(node.next)
        self.scopes.pop()

    def _counted(self, node: c_ast.For) -> bool:
        """A loop in which a variable of its own counts up or down to a bound that stays."""
        if not (isinstance(node.init, c_ast.DeclList) and len(node.init.decls) == 1):
            return False
        variable = node.init.decls[0]
        by = _step_of(node.next, variable.name)
        changed = _changed_in(node.stmt)
        parts = list(_conjuncts(node.cond))
        bound = next((part for part in parts if _bounds(part, variable.name)), None)
        kind = self.c.type_of(variable.type)
        if by is None or bound is None or kind == REAL or variable.name in changed or _names_in(bound.right) & changed:
            return False
        first = self.value(variable.init)
        self.scopes[-1][variable.name] = Value(kind, self.name(variable.name))
        last = self.value(bound.right)
        beyond = {"<": 0, "<=": 1, ">": 0, ">=": -1}[bound.op]
        stop = self.sum(replace(last, type=INT), "+", self.whole(beyond))
        arguments = (
            stop.text
            if first.number == 0 and by == 1
            else f"{first.text}, {stop.text}" + (f", {by}" if by != 1 else "")
        )
        own, begins = self.name(variable.name), len(self.out)
        self.put(f"for {own} in range({arguments}):")
        with self.block():
            for part in parts:
                if part is not bound:
                    value = self.condition(self.value(part))
                    if value.number is not None and value.number:
                        continue
                    self.put(f"if {self.negated(value).text}:")
                    self.put("    break")
            self.statement(node.stmt, [])
        if not any(re.search(rf"\b{own}\b", line) for line in self.out[begins + 1 :]):
            self.out[begins] = self.out[begins].replace(f"for {own} ", "for _ ")
        return True

    def _do_Break(self, node: c_ast.Break, step: Any) -> None:
        self.put("break")

    def _do_Continue(self, node: c_ast.Continue, step: Any) -> None:
        for each in step or ():
            self.statement(each)
        self.put("continue")

    def _do_EmptyStatement(self, node: c_ast.EmptyStatement, step: Any) -> None:
        pass

    def _do_ExprList(self, node: c_ast.ExprList, step: Any) -> None:
        for each in node.exprs:
            self.statement(each)


def _innermost(node: Any) -> Any:
    while not isinstance(node, c_ast.TypeDecl):
        node = node.type
    return node


def _all(node: Any, kind: Any) -> Iterator[Any]:
    """All nodes of a kind in a tree, in no order."""
    left = [node]
    while left:
        node = left.pop()
        if isinstance(node, kind):
            yield node
        left.extend(node)


def _changed_in(node: Any) -> set[str]:
    """Variables and members that a statement assigns."""
    changed = set()
    for each in _all(node, (c_ast.Assignment, c_ast.UnaryOp)):
        place = (
            each.lvalue if isinstance(each, c_ast.Assignment) else each.expr if each.op in ("p++", "p--", "&") else None
        )
        if isinstance(place, c_ast.ID):
            changed.add(place.name)
        elif isinstance(place, c_ast.StructRef) and not (isinstance(each, c_ast.UnaryOp) and each.op == "&"):
            changed.add(place.field.name)
    return changed


def _names_in(node: Any) -> set[str]:
    return {each.name for each in _all(node, c_ast.ID)}


def _conjuncts(node: Any) -> Iterator[Any]:
    if isinstance(node, c_ast.BinaryOp) and node.op == "&&":
        yield from _conjuncts(node.left)
        yield from _conjuncts(node.right)
    elif node is not None:
        yield node


def _bounds(node: Any, name: str) -> bool:
    return (
        isinstance(node, c_ast.BinaryOp)
        and node.op in ("<", "<=", ">", ">=")
        and isinstance(node.left, c_ast.ID)
        and node.left.name == name
    )


def _step_of(node: Any, name: str) -> int | None:
    """By how much a loop's variable changes each time."""
    if isinstance(node, c_ast.UnaryOp) and isinstance(node.expr, c_ast.ID) and node.expr.name == name:
        return {"p++": 1, "p--": -1}.get(node.op)
    if isinstance(node, c_ast.Assignment) and node.op == "+=" and isinstance(node.rvalue, c_ast.Constant):
        return int(node.rvalue.value) if isinstance(node.lvalue, c_ast.ID) and node.lvalue.name == name else None
    return None
