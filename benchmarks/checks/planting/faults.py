"""All small faults that can be planted in a file, and a seeded choice of them."""

from __future__ import annotations

import ast
import difflib
import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.checks.planting.kinds import KINDS

_TALKS = {"debug", "info", "warning", "warn", "error", "exception", "echo", "print", "cast"}
"""Functions whose arguments are messages or types."""
_ABOUT_OBJECTS = {"__repr__", "__str__"}
_PROMISES = {"strict", "repr", "compare", "kw_only", "slots"}
"""Keywords that only check, or only show."""


@dataclass(frozen=True)
class Fault:
    """A small fault.

    Attributes:
        id: tells the fault from others. It does not depend on the line, so it stays when other
            parts of the file change.
        file: the source, relative to the checkout.
        kind: a key of :data:`benchmarks.checks.planting.kinds.KINDS`.
        where: the function, with its classes.
        lines: those of the statement's head: a test that runs one of them reaches the fault.
        start, end: the bytes of the source that are replaced.
        before, after: the text there, and what takes its place.
        at_import: whether the statement runs when the file is imported.
    """

    id: str
    file: str
    kind: str
    where: str
    lines: tuple[int, ...]
    start: int
    end: int
    before: str
    after: str
    at_import: bool

    def planted(self, source: bytes) -> bytes:
        """The source with the fault."""
        return source[: self.start] + self.after.encode() + source[self.end :]

    def diff(self, source: bytes) -> str:
        """What the fault changes, as a unified diff."""
        old, new = (text.decode().splitlines() for text in (source, self.planted(source)))
        return "\n".join(
            difflib.unified_diff(old, new, self.file, f"{self.file} with {self.id}", "", "", 2, "")
        )

    def __str__(self) -> str:
        place = f"{self.file}:{self.lines[0]} {self.where}"
        before, after = (" ".join(text.split()) for text in (self.before, self.after))
        return f"{self.id}  {place}  {self.kind}: {before[:70]} -> {after[:70]}"


def faults_of(root: Path, package: str) -> list[Fault]:
    """Every fault that can be planted in a package."""
    return [
        fault
        for path in sorted((root / package).rglob("*.py"))
        for fault in _faults(path.read_bytes(), path.relative_to(root).as_posix())
    ]


def chosen(root: Path, faults: Sequence[Fault], count: int, seed: int) -> list[Fault]:
    """A seeded choice: of each kind in turn.

    A change of the code changes few of the faults: each has a rank of its own.
    """

    def rank(fault: Fault) -> str:
        return _hash(f"{seed} {fault.id}")

    of_kind = {
        kind: iter(sorted((each for each in faults if each.kind == kind), key=rank))
        for kind in KINDS
    }
    found: list[Fault] = []
    while of_kind and len(found) < count:
        for kind in [*of_kind]:
            one = next((each for each in of_kind[kind] if _differs(root, each)), None)
            if one is None:
                del of_kind[kind]
            elif len(found) < count:
                found.append(one)
    return found


def _faults(source: bytes, file: str) -> Iterator[Fault]:
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    seen: Counter[tuple[str, ...]] = Counter()
    for node, where, statement in _nodes(ast.parse(source), "", None):
        for kind, replacements in KINDS.items():
            for replaced, text in replacements(node):
                assert isinstance(replaced, (ast.expr, ast.stmt))
                start = starts[replaced.lineno - 1] + replaced.col_offset
                end = starts[(replaced.end_lineno or 0) - 1] + (replaced.end_col_offset or 0)
                before = source[start:end].decode()
                if isinstance(replaced, ast.stmt):
                    one = (where, kind, before.partition("\n")[0], text)
                    after = text.replace("{}", before)
                else:
                    after = f"({text})" if "\n" in before or " " in text else text
                    one = (where, kind, before, after)
                head = _head(replaced if isinstance(replaced, ast.stmt) else statement or replaced)
                seen[one] += 1
                code = _hash("\n".join((file, *one, str(seen[one]))))[:6]
                yield Fault(
                    f"{Path(file).stem}-{code}",
                    file,
                    kind,
                    where,
                    head,
                    start,
                    end,
                    before,
                    after,
                    at_import="def " not in where,
                )


def _nodes(
    node: ast.AST, where: str, statement: ast.stmt | None
) -> Iterator[tuple[ast.AST, str, ast.stmt | None]]:
    """The nodes in which faults count, each with its function and its statement.

    Left out: what only says or shows something, and what only checks for readers and type checkers.
    """
    if _says_or_checks(node):
        return
    if isinstance(node, ast.stmt):
        statement = node
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        where = f"{where}def {node.name} "
    elif isinstance(node, ast.ClassDef):
        where = f"{where}{node.name}."
    yield node, where, statement
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _nodes(child, where, statement)


def _says_or_checks(node: ast.AST) -> bool:
    if isinstance(node, ast.FunctionDef):
        return node.name in _ABOUT_OBJECTS
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in ast.unparse(node.test)
    if isinstance(node, ast.Call):
        return _name(node.func) in _TALKS
    if isinstance(node, ast.keyword):
        return node.arg in _PROMISES
    return isinstance(node, (ast.Assert, ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom))


def _head(node: ast.AST) -> tuple[int, ...]:
    """The lines of a statement without those of its body."""
    assert isinstance(node, (ast.expr, ast.stmt))
    body = getattr(node, "body", None)
    last = body[0].lineno - 1 if isinstance(body, list) and body else node.end_lineno
    return tuple(range(node.lineno, max(last or 0, node.lineno) + 1))


def _differs(root: Path, fault: Fault) -> bool:
    """Whether the file with the fault is a program, and another one."""
    source = (root / fault.file).read_bytes()
    try:
        return ast.dump(ast.parse(fault.planted(source))) != ast.dump(ast.parse(source))
    except SyntaxError:
        return False


def _name(function: ast.expr) -> str:
    return getattr(function, "attr", "") or getattr(function, "id", "")


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
