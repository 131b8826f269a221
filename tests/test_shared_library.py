"""C sources that the machine's compiler makes a library of, once, and machines without one."""

from __future__ import annotations

from pathlib import Path

import pytest

from er_gym import shared_library
from er_gym.shared_library import compiled, compiler

needs_compiler = pytest.mark.skipif(compiler() is None, reason="this machine has no C compiler")


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A C source, and a cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "sum.c"
    path.write_text("int sum(int a, int b) { return a + b; }\n")
    return path


def never(*args: object, **options: object) -> None:
    raise AssertionError("compiled again")


@needs_compiler
def test_a_source_is_compiled_once(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = compiled(source)
    assert library is not None
    assert library.sum(2, 3) == 5
    monkeypatch.setattr(shared_library.subprocess, "run", never)
    library = compiled(source)
    assert library is not None
    assert library.sum(2, 3) == 5
    source.write_text("int sum(int a, int b) { return a - b; }\n")
    with pytest.raises(AssertionError, match="compiled again"):
        compiled(source)


@needs_compiler
def test_what_suits_one_processor_is_compiled_again_for_another(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for exact in (True, False):
        assert compiled(source, exact=exact) is not None
    monkeypatch.setattr(shared_library, "_processor", lambda: "another")
    monkeypatch.setattr(shared_library.subprocess, "run", never)
    assert compiled(source) is not None
    with pytest.raises(AssertionError, match="compiled again"):
        compiled(source, exact=False)


@needs_compiler
def test_no_cache_is_needed(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(source))  # a file
    library = compiled(source)
    assert library is not None
    assert library.sum(2, 3) == 5


@needs_compiler
def test_a_library_that_was_damaged_is_made_again(source: Path, tmp_path: Path) -> None:
    compiled(source)
    (kept,) = (tmp_path / "cache").rglob("sum.so")
    kept.write_bytes(kept.read_bytes()[:-1] + b"?")
    library = compiled(source)
    assert library is not None
    assert library.sum(2, 3) == 5


def test_without_a_compiler_there_is_none(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(source.parent))
    assert compiled(source) is None


@pytest.mark.parametrize("script", ["exit 1", "exit 0", "kill -9 $$"])
def test_a_compiler_that_fails_is_done_without(
    source: Path, monkeypatch: pytest.MonkeyPatch, script: str
) -> None:
    program = source.with_name("cc")
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setattr(shared_library, "compiler", lambda: str(program))
    assert compiled(source) is None


def test_what_the_system_does_not_load_is_done_without(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shared_library, "_compile", lambda path, flags: b"not a library")
    assert compiled(source) is None
