"""Finds the fenced blocks of the pages, and the commands of the shell blocks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SHELL = ("sh", "bash", "shell", "console")
PYTHON = ("python", "py")
_FENCE = re.compile(r" {0,3}(`{3,}|~{3,})\s*([^\s`]*)")
_FILE = re.compile(r"# ([\w/]+/\w+\.py)\n")
_WHOLE = re.compile(r"^(for|while|until|if|case|#!)|<<", re.MULTILINE)
"""In a shell block that is one command, since its lines do not stand by themselves."""


@dataclass(frozen=True)
class Part:
    """What is run or read at once: a command of a shell block, or a whole block of another kind.

    Attributes:
        page: the page's path in the checkout, such as ``docs/tasks.md``.
        line: the number of its first line; of a whole block that of the fence.
        language: what the fence says, ``""`` for nothing.
        text: without the fence; a command's lines are joined.
    """

    page: str
    line: int
    language: str
    text: str

    @property
    def place(self) -> str:
        """Such as ``docs/tasks.md:42``."""
        return f"{self.page}:{self.line}"

    @property
    def file(self) -> str | None:
        """The file that a Python block is, as its first line says; None for a program."""
        named = _FILE.match(self.text) if self.language in PYTHON else None
        return named.group(1) if named else None


@dataclass(frozen=True)
class Block(Part):
    """A fenced block."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """Its commands, in order, or the block itself."""
        if self.language not in SHELL or _WHOLE.search(self.text):
            return (self,)
        return tuple(
            Part(self.page, self.line + offset, self.language, command)
            for offset, command in _commands(self.text)
        )


def pages(root: Path) -> tuple[Path, ...]:
    """The pages of a checkout that users read."""
    found = (root / "README.md", root / "CONTRIBUTING.md")
    others = (
        "docs/*.md",
        "docs/integrations/*.md",
        "configs/*/README.md",
        "er_gym/tasks/data/*.md",
    )
    return (*found, *(page for pattern in others for page in sorted(root.glob(pattern))))


def blocks(root: Path) -> tuple[Block, ...]:
    """All blocks of a checkout's pages, in the order in which a reader meets them.

    Raises:
        ValueError: a block does not end.
    """
    return tuple(
        block
        for page in pages(root)
        for block in _blocks(page.relative_to(root).as_posix(), page.read_text(encoding="utf-8"))
    )


def _blocks(page: str, text: str) -> Iterator[Block]:
    opened: tuple[int, str, str] | None = None
    lines: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        fence = _FENCE.match(line)
        if opened is None:
            if fence:
                opened, lines = (number, fence.group(1), fence.group(2)), []
        elif fence and fence.group(1).startswith(opened[1]) and not fence.group(2):
            if not opened[2].startswith("{"):  # what the documentation site reads
                yield Block(page, opened[0], opened[2], "\n".join([*lines, ""]))
            opened = None
        else:
            lines.append(line)
    if opened is not None:
        raise ValueError(f"{page}:{opened[0]}: the block does not end")


def _commands(text: str) -> Iterator[tuple[int, str]]:
    """The commands of a shell block, each with its line, from 1; continued lines are joined."""
    waiting: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.endswith("\\"):
            waiting.append(line[:-1].strip())
            continue
        command = " ".join([*waiting, line.strip()]).strip()
        if command and not command.startswith("#"):
            yield number - len(waiting), command
        waiting = []
