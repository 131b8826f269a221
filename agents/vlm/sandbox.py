"""A sandboxed Jinja environment that also limits how much work a template does.

Jinja's own sandbox blocks access to Python internals. It does not stop
``{% for a in range(99999) %}{% for b in range(99999) %}`` or ``{{ "x" * 10 ** 10 }}``. Here every
loop, call, filter and operator is charged against a budget before it runs.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from functools import wraps
from itertools import chain
from typing import Any, cast

from jinja2 import nodes
from jinja2.sandbox import SandboxedEnvironment, SecurityError
from jinja2.utils import Namespace
from jinja2.visitor import NodeTransformer

BUDGET = 2_000_000
"""Characters that one rendering may process; a prompt has a few thousand."""
STEP = 1_000
"""The charge for a loop iteration, a call or an include: 2,000 of them use up the budget."""
_DEEPEST = 4
"""The deepest nesting of lists: nested lists that share parts can become arbitrarily long."""
_EACH, _MADE = "_each", "_made"
_STRINGS = (str, bytes)
_CONTAINERS = (list, tuple, dict, set)


class BoundedEnvironment(SandboxedEnvironment):
    """A sandboxed environment that stops a template once it has used up :data:`BUDGET`.

    Several threads may render a template; each calls :meth:`begin` first.

    Raises:
        SecurityError: while rendering, a template exceeds the budget or formats with widths.
        TemplateSyntaxError: while compiling, the template is invalid; ValueError: it has a
            recursive loop.
    """

    intercepted_binops = frozenset({"+", "*", "**", "%"})

    def __init__(self, **options: Any) -> None:
        super().__init__(**options, finalize=self._shown)
        self._bill = threading.local()
        filters: dict[str, Any] = dict(self.filters)
        self.filters = {name: self._paid(function) for name, function in filters.items()}
        self.filters[_EACH] = self._each
        self.filters[_MADE] = self._made
        tests: dict[str, Any] = dict(self.tests)
        self.tests = {name: self._paid(function) for name, function in tests.items()}
        self.filters["format"] = _no_format

    def begin(self) -> None:
        """Reset this thread's budget."""
        self._bill.left = BUDGET

    def pay(self, amount: int) -> None:
        """Charge this thread's budget; raises SecurityError if it is used up."""
        self._bill.left = getattr(self._bill, "left", BUDGET) - amount
        if self._bill.left < 0:
            raise SecurityError("the template does too much; make its loops and texts smaller")

    # -- Jinja's hooks ---------------------------------------------------------------------------

    def call(self, context: Any, function: Any, *args: Any, **kwargs: Any) -> Any:
        """Charge for a call, then do it."""
        if getattr(function, "__name__", "") in ("format", "format_map"):
            _no_format()
        self.pay(STEP + _product([getattr(function, "__self__", None)], args, kwargs.values()))
        return super().call(context, function, *args, **kwargs)

    def call_binop(self, context: Any, operator: str, left: Any, right: Any) -> Any:
        """Charge for ``left operator right``, then compute it."""
        if operator == "%" and isinstance(left, _STRINGS):
            _no_format()
        if operator == "**":
            self.pay(_bits(left) * max(1, int(abs(right))))
        elif operator == "*":
            self.pay(_bits(left) * _bits(right) if _numbers(left, right) else _product(left, right))
        elif operator == "+":
            self.pay(_length(left) + _length(right))
        return super().call_binop(context, operator, left, right)

    def _load_template(self, name: Any, globals: Any) -> Any:
        self.pay(STEP)
        return super()._load_template(name, globals)

    def _parse(self, source: str, name: str | None, filename: str | None) -> nodes.Template:
        return _Priced().visit(super()._parse(source, name, filename))

    # -- charges ---------------------------------------------------------------------------------

    def _paid(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap a filter or a test so that it is charged; attributes that Jinja sets are kept."""

        @wraps(function)
        def paid(*args: Any, **kwargs: Any) -> Any:
            self.pay(_product(args, kwargs.values()))
            result = function(*args, **kwargs)
            return [*self._counted(result)] if isinstance(result, Generator) else result

        return paid

    def _each(self, values: Iterable[Any]) -> Iterator[Any]:
        for value in values:
            self.pay(STEP)
            yield value

    def _counted(self, values: Iterable[Any]) -> Iterator[Any]:
        for value in values:
            self.pay(1)
            yield value

    def _made(self, value: Any) -> Any:
        self.pay(_length(value))
        return value

    def _shown(self, value: Any) -> Any:
        self.pay(_length(value))
        return value


class _Priced(NodeTransformer):
    """Rewrites loops, lists and joined texts so that they are charged."""

    def visit_For(self, node: nodes.For) -> nodes.Node:
        self.generic_visit(node)
        if node.recursive:
            raise ValueError(
                f"line {node.lineno}: not a valid template: recursive loops are not allowed"
            )
        node.iter = _filtered(cast(nodes.Expr, node.iter), _EACH)
        return node

    def visit_Tuple(self, node: nodes.Tuple) -> nodes.Node:
        self.generic_visit(node)
        return _filtered(node, _MADE) if node.ctx == "load" else node

    def visit_List(self, node: nodes.List | nodes.Dict) -> nodes.Node:
        self.generic_visit(node)
        return _filtered(node, _MADE)

    visit_Dict = visit_List

    def visit_Concat(self, node: nodes.Concat) -> nodes.Node:
        self.generic_visit(node)
        first, *others = (_filtered(part, "string") for part in node.nodes)
        joined: nodes.Expr = first
        for other in others:
            joined = nodes.Add(joined, other, lineno=node.lineno)
        return joined


def _filtered(node: nodes.Expr, name: str) -> nodes.Filter:
    return nodes.Filter(node, name, [], [], None, None, lineno=node.lineno)


def _product(*groups: Any) -> int:
    """An upper bound on the work of combining values: the product of their sizes."""
    total = 1
    for value in chain.from_iterable(map(_values, groups)):
        total *= max(1, _size(value))
        if total > BUDGET:
            break
    return total


def _values(group: Any) -> Iterable[Any]:
    return (group,) if isinstance(group, (*_STRINGS, range, int, float)) else group


def _size(value: Any) -> int:
    """The length of a text, the total length of a list's items, or a number's absolute value."""
    if isinstance(value, bool) or value is None:
        return 1
    if isinstance(value, (int, float)):
        return int(min(abs(value), BUDGET + 1)) if value == value else 1
    return _length(value)


def _length(value: Any, depth: int = 0) -> int:
    if isinstance(value, (*_STRINGS, range)):
        return len(value)
    if isinstance(value, Namespace) or (isinstance(value, _CONTAINERS) and depth == _DEEPEST):
        return BUDGET + 1
    total = 1
    if isinstance(value, _CONTAINERS):
        parts = chain(value, value.values()) if isinstance(value, dict) else value
        for part in parts:
            total += _length(part, depth + 1)
            if total > BUDGET:
                break
    return total


def _bits(value: Any) -> int:
    return value.bit_length() if isinstance(value, int) else 64


def _numbers(*values: Any) -> bool:
    return all(isinstance(value, (int, float)) for value in values)


def _no_format(*_: Any, **__: Any) -> Any:
    raise SecurityError("templates may not format texts with % or format; join them with ~")
