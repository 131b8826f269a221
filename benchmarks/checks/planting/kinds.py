"""The kinds of small faults: what each makes of a node of the syntax tree.

A kind is a function from a node to the texts that take its place. A row of :data:`KINDS` is all
that a new kind needs.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Iterator, Mapping
from typing import Any

Replaced = tuple[ast.AST, str]
"""The node whose text is replaced, and the text."""

_TURNED: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.Gt: ast.Lt,
    ast.LtE: ast.GtE,
    ast.GtE: ast.LtE,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
_BOUNDARY: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
}
_ANY_ORDER = {"min", "max", "hypot", "union", "isclose", "gcd", "maximum", "minimum"}
"""Functions whose arguments may stand in any order."""
_DEFAULT_AT = {"get": 1, "pop": 1, "getattr": 2, "next": 1, "setdefault": 1, "getenv": 1}
"""Functions that take a default, and where it stands."""


def comparisons(node: ast.AST) -> Iterator[Replaced]:
    """``<`` becomes ``>``, ``==`` becomes ``!=``, ``in`` becomes ``not in``."""
    yield from _compared(node, _TURNED)


def conditions(node: ast.AST) -> Iterator[Replaced]:
    """A condition is negated; one of several is dropped; the filter of a comprehension is."""
    if isinstance(node, (ast.If, ast.While, ast.IfExp)):
        yield node.test, f"not ({ast.unparse(node.test)})"
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield node, ast.unparse(node.operand)
    if isinstance(node, ast.BoolOp):
        for index in range(len(node.values)):
            rest = node.values[:index] + node.values[index + 1 :]
            yield (
                node,
                ast.unparse(rest[0] if len(rest) == 1 else ast.BoolOp(op=node.op, values=rest)),
            )
    if isinstance(node, ast.comprehension):
        for each in node.ifs:
            yield each, "True"


def ands_and_ors(node: ast.AST) -> Iterator[Replaced]:
    """``and`` becomes ``or``, and the other way round."""
    if isinstance(node, ast.BoolOp):
        other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        yield node, ast.unparse(ast.BoolOp(op=other, values=node.values))


def off_by_one(node: ast.AST) -> Iterator[Replaced]:
    """A bound counts that did not, or a whole number within an expression is one more or less."""
    yield from _compared(node, _BOUNDARY)
    parts: list[ast.expr | None] = []
    if isinstance(node, ast.Subscript):
        parts = [node.slice]
    elif isinstance(node, ast.Slice):
        parts = [node.lower, node.upper, node.step]
    elif isinstance(node, ast.BinOp):
        parts = [node.left, node.right]
    elif isinstance(node, ast.Compare):
        parts = [node.left, *node.comparators]
    elif isinstance(node, ast.Call) and _called(node) in ("range", "islice", "enumerate", "round"):
        parts = [*node.args]
    elif isinstance(node, ast.AugAssign):
        parts = [node.value]
    for part in parts:
        if isinstance(part, ast.UnaryOp) and isinstance(part.op, ast.USub):
            part = part.operand
        if isinstance(part, ast.Constant) and type(part.value) is int:
            yield part, str(part.value + 1)
            if part.value > 0:
                yield part, str(part.value - 1)


def arguments(node: ast.AST) -> Iterator[Replaced]:
    """Two neighbouring arguments change places."""
    if not isinstance(node, ast.Call) or _called(node) in _ANY_ORDER:
        return
    for index, (one, two) in enumerate(zip(node.args, node.args[1:], strict=False)):
        if isinstance(one, ast.Starred) or isinstance(two, ast.Starred):
            continue
        if ast.dump(one) != ast.dump(two):
            swapped = copy.copy(node)
            swapped.args = [*node.args[:index], two, one, *node.args[index + 2 :]]
            yield node, ast.unparse(swapped)


def early_ends(node: ast.AST) -> Iterator[Replaced]:
    """A loop ends after its first round; a function that returns nothing, before its last
    statement; ``continue`` ends the loop."""
    if isinstance(node, (ast.For, ast.While)) and not isinstance(
        node.body[-1], (ast.Return, ast.Raise, ast.Break)
    ):
        last = node.body[-1]
        yield last, f"{{}}\n{' ' * last.col_offset}break"
    if isinstance(node, ast.Continue):
        yield node, "break"
    if isinstance(node, ast.FunctionDef) and not _gives(node):
        last = node.body[-1]
        if not isinstance(last, (ast.Pass, ast.Raise)) and not _is_text(last):
            yield last, f"return\n{' ' * last.col_offset}{{}}"


def defaults(node: ast.AST) -> Iterator[Replaced]:
    """A default or a named constant has another value."""
    if isinstance(node, ast.arguments):
        for value in (*node.defaults, *node.kw_defaults):
            yield from _other(value)
    if isinstance(node, ast.Call):
        at = _DEFAULT_AT.get(_called(node))
        if at is not None and len(node.args) > at:
            yield from _other(node.args[at])
    if isinstance(node, ast.ClassDef):
        for each in node.body:
            if isinstance(each, ast.AnnAssign):
                yield from _other(each.value)
    if isinstance(node, ast.Module):
        for each in node.body:
            if isinstance(each, (ast.Assign, ast.AnnAssign)) and each.value is not None:
                for part in ast.walk(each.value):
                    if isinstance(part, ast.Constant) and not isinstance(part.value, str):
                        yield from _other(part)


KINDS: Mapping[str, Callable[[ast.AST], Iterator[Replaced]]] = {
    "comparison": comparisons,
    "condition": conditions,
    "and/or": ands_and_ors,
    "off by one": off_by_one,
    "arguments": arguments,
    "early end": early_ends,
    "default": defaults,
}


def _compared(
    node: ast.AST, others: Mapping[type[ast.cmpop], type[ast.cmpop]]
) -> Iterator[Replaced]:
    if isinstance(node, ast.Compare):
        for index, op in enumerate(node.ops):
            if type(op) in others:
                ops = [*node.ops[:index], others[type(op)](), *node.ops[index + 1 :]]
                other = ast.Compare(left=node.left, ops=ops, comparators=node.comparators)
                yield node, ast.unparse(other)


def _called(node: ast.Call) -> str:
    """The last part of the name of what is called."""
    function: Any = node.func
    return str(getattr(function, "attr", "") or getattr(function, "id", ""))


def _gives(function: ast.FunctionDef) -> bool:
    """Whether a function returns a value; a generator does not."""
    return any(isinstance(each, ast.Return) and each.value for each in ast.walk(function))


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a docstring or ``...``."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _other(value: ast.expr | None) -> Iterator[Replaced]:
    if not isinstance(value, ast.Constant):
        return
    stated: object = value.value
    if isinstance(stated, bool):
        yield value, repr(not stated)
    elif isinstance(stated, int):
        yield value, repr(stated + 1)
    elif isinstance(stated, float):
        yield value, repr(stated * 2 or 1.0)
    elif isinstance(stated, str):
        yield value, repr("" if stated else "other")
