"""The blocks of the documentation run, or a table says why they do not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.checks.doc_blocks.__main__ import GIVEN, run_pages
from benchmarks.checks.doc_blocks.blocks import PYTHON, SHELL, Block, Part, blocks
from benchmarks.checks.doc_blocks.readers import READERS, reader
from benchmarks.checks.doc_blocks.run import environment, run
from benchmarks.checks.doc_blocks.table import NEVER, reason, stale
from benchmarks.checks.doc_blocks.warm import warm

WRITTEN = """
```python
print(undefined)
```

   ~~~sh
   true   # said by nobody
   ls \\
     nowhere
   ~~~

```sh
echo one > shared; export WHAT=two
er-gym --version > version; echo "$WHAT" >> shared
```

```python
print(open("shared").read(), open("version").read())
```

```yaml
a: [
```
"""


@pytest.fixture(scope="module")
def parts(repository: Path) -> tuple[Part, ...]:
    return tuple(part for block in blocks(repository) for part in block.parts)


def test_every_row_of_the_table_names_a_block(parts: tuple[Part, ...]) -> None:
    assert stale(parts) == []
    assert {*GIVEN} <= {part.page for part in parts}
    read = [part for part in parts if reader(part) is not None]
    assert len(read) == len(READERS)


def test_every_block_is_run_or_has_a_reason(parts: tuple[Part, ...]) -> None:
    known = (*SHELL, *PYTHON)
    unread = [
        part.place
        for part in parts
        if part.language not in known and reader(part) is None and not reason(part, of=(NEVER,))
    ]
    assert unread == []
    run_by_tests = Counter(part.language for part in parts if not reason(part))
    assert run_by_tests["python"] >= 5
    assert run_by_tests["sh"] >= 10


def test_the_light_blocks_run(tmp_path: Path) -> None:
    failed = [
        f"{each.place}: {each.problem}" for each in run_pages(tmp_path, light=True) if each.problem
    ]
    assert failed == [], "\n".join(failed)


# -- how blocks are found and run ----------------------------------------------------------------


@pytest.fixture
def page(tmp_path: Path) -> Callable[[str], tuple[Block, ...]]:
    def written(text: str) -> tuple[Block, ...]:
        (tmp_path / "README.md").write_text(text, encoding="utf-8")
        (tmp_path / "CONTRIBUTING.md").write_text("", encoding="utf-8")
        return blocks(tmp_path)

    return written


def test_commands_of_a_block(page: Callable[[str], tuple[Block, ...]]) -> None:
    (block,) = page("text\n\n```sh\n# a comment\n\none --a 1 \\\n    --b 2   # why\ntwo\n```\n")
    assert [(part.place, part.text) for part in block.parts] == [
        ("README.md:6", "one --a 1 --b 2   # why"),
        ("README.md:8", "two"),
    ]
    (loop,) = page("```sh\nfor a in 1; do\n  one\ndone\n```\n")
    assert [part.text for part in loop.parts] == ["for a in 1; do\n  one\ndone\n"]


def test_a_block_without_end(page: Callable[[str], tuple[Block, ...]]) -> None:
    with pytest.raises(ValueError, match=r"README\.md:3: the block does not end"):
        page("a\n\n```sh\ntrue\n")
    with pytest.raises(ValueError, match=r"README\.md:1: the block does not end"):
        page("````\n```\n")


def test_what_fails_is_told_with_its_place(
    page: Callable[[str], tuple[Block, ...]], tmp_path: Path
) -> None:
    found = page(WRITTEN)
    with warm(tmp_path / "bin", environment(tmp_path / "reader")) as started:
        work = tmp_path / "work"
        work.mkdir()
        ended = list(run(found, work, started, lambda part: "version" in part.text, 60))
        assert [(each.place, bool(each.problem)) for each in ended] == [
            ("README.md:2", True),
            ("README.md:8", True),
            ("README.md:12", False),
            ("README.md:21", True),
        ]
        assert "NameError: name 'undefined'" in ended[0].problem
        assert "nowhere" in ended[1].problem
        assert "nothing reads a block of yaml" in ended[3].problem
        *_, both, read, _ = run(found, work, started, lambda _: False, 60)
        assert (both.problem, read.problem) == ("", "")
        slow = page("```sh\nsleep 60\n```\n")
        (late,) = run(slow, work, started, lambda _: False, 0.2)
        assert "did not end" in late.problem


def test_a_row_that_is_there_twice_is_an_error() -> None:
    part = Part("README.md", 1, "sh", "make test")
    with pytest.raises(ValueError, match="several reasons: a; b"):
        reason(part, of=({"a": ("README.md: make",)}, {"b": ("README.md: make test",)}))
