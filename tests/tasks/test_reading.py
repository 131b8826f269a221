"""The reader of users' files: what it reads, and what it refuses in one line."""

from __future__ import annotations

import gzip
import os

import pytest

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.reading import (
    DEEPEST,
    LARGEST,
    MOST_VALUES,
    parse_json,
    parse_yaml,
    read_bytes,
    read_json_lines,
    read_text,
)

LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{after}: &{after} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, after in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGES = LAUGHS.replace("[x, x, x, x, x, x, x, x, x]", "{x: 1}").replace("[*", "{<<: [*")
MERGES = MERGES.replace("]\n", "]}\n")


def test_text_is_read_with_or_without_a_byte_order_mark(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfwords\xe2\x80\xa8more")
    assert read_text(tmp_path / "a") == "words\u2028more"


def test_a_device_a_pipe_a_directory_and_a_socket_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    for path, kind in (
        (tmp_path / "pipe", "a pipe"),
        (tmp_path / "link", "a device"),
        (tmp_path, "a directory"),
    ):
        with pytest.raises(TaskFileError, match=f"{kind}, not a file"):
            read_bytes(path)


def test_what_is_large_or_inflates_is_refused_before_it_fills_the_memory(tmp_path):
    with open(tmp_path / "hole", "wb") as file:
        file.truncate(LARGEST + 1)
    (tmp_path / "bomb.gz").write_bytes(gzip.compress(bytes(LARGEST + 1), 1))
    for name in ("hole", "bomb.gz"):
        with pytest.raises(TaskFileError, match="larger than er-gym reads"):
            read_bytes(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[" * 100_000, "nested too deeply"),
        ("[" * (DEEPEST + 1) + "]" * (DEEPEST + 1), "nested too deeply"),
        ("[" + "1," * MOST_VALUES + "1]", "too many values"),
        ("[NaN]", "NaN is not a JSON number"),
        ("[1e999]", "too large"),
        (f"[{'9' * 5000}]", "5000 digits"),
        ('["\\ud800"]', "lone surrogate"),
        ('["\0"]', "not JSON"),
    ],
)
def test_json_that_is_not_read(tmp_path, text, problem):
    with pytest.raises(TaskFileError, match=problem):
        parse_json(text, tmp_path / "a.json")


def test_json_within_the_bounds_is_read(tmp_path):
    nested = "[" * DEEPEST + "]" * DEEPEST
    assert str(parse_json(nested, tmp_path)) == nested
    assert parse_json('["\\ud83d\\ude00", 18446744073709551615]', tmp_path) == ["😀", 2**64 - 1]


def test_lines_end_with_newlines_alone_and_are_numbered(tmp_path):
    (tmp_path / "a.jsonl").write_text('"a\u2028b\u0085c"\r\n\n[2]\n')
    assert list(read_json_lines(tmp_path / "a.jsonl")) == [(1, "a\u2028b\u0085c"), (3, [2])]
    (tmp_path / "b.jsonl").write_bytes(b'1\n"\xe9"\n')
    with pytest.raises(TaskFileError, match="line 2, byte 1"):
        list(read_json_lines(tmp_path / "b.jsonl"))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (LAUGHS, "too many values"),
        (MERGES, "too many values"),
        ("a: &a [*a]", "itself"),
        ("[" * 60_000, "nested too deeply"),
        ("".join(" " * i + "- \n" for i in range(300)), "nested too deeply"),
        ("x" * 100_000, "too long"),
        ("a: " + "9" * 4000, "4000 digits"),
        ("a: !!int ''", "does not fit its tag"),
        ("a: 2001-99-99", "does not fit its tag"),
        ("a: !!python/name:os.system", "not YAML"),
        ('"\\ud800"', "surrogate"),
        ("a: \0", "not YAML"),
    ],
)
def test_yaml_that_is_not_read(text, problem):
    with pytest.raises(TaskFileError, match=problem) as error:
        parse_yaml(text, "a.yaml")
    assert len(str(error.value).splitlines()) == 1


def test_aliases_that_stand_for_little_are_read():
    assert parse_yaml("a: &a {x: 1}\nb: {<<: *a, y: 2}", "a.yaml")["b"] == {"x": 1, "y": 2}
