"""Directories that pages follow while they grow."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from benchmarks.monitor.directories import Directory
from benchmarks.monitor.followed import Followed


class Counter:
    def __init__(self, directory: Directory) -> None:
        self.directory, self.reads = directory, 0

    def read(self) -> None:
        self.reads += 1


def directory(name: str) -> Directory:
    return Directory(name, "run", Path("/") / name, name)


def test_a_directory_is_read_again_whenever_it_is_used() -> None:
    followed = Followed(Counter)
    for reads in (1, 2, 3):
        with followed.use(directory("a")) as counter:
            assert counter.reads == reads
            assert counter.directory == directory("a")


def test_only_the_directories_that_were_used_last_are_kept() -> None:
    followed = Followed(Counter, most=2)
    for name in ("a", "b", "a", "c"):
        with followed.use(directory(name)):
            pass
    kept = {}
    for name in ("a", "c", "b"):  # asked for last, since that drops another
        with followed.use(directory(name)) as counter:
            kept[name] = counter.reads
    assert kept == {"a": 3, "c": 2, "b": 1}


def test_one_thread_at_a_time_uses_a_directory_and_others_go_on() -> None:
    followed = Followed(Counter)
    began, ended = threading.Event(), threading.Event()

    def use(name: str) -> None:
        began.set()
        with followed.use(directory(name)):
            ended.set()

    with followed.use(directory("a")):
        same = threading.Thread(target=use, args=("a",), daemon=True)
        same.start()
        assert began.wait(60)
        other = threading.Thread(target=followed.use(directory("b")).__enter__, daemon=True)
        other.start()
        other.join(60)
        assert not other.is_alive(), "another directory does not wait"
        assert not ended.wait(0.2), "the same directory does"
    same.join(60)
    assert ended.is_set()


def test_a_directory_is_let_go_when_its_page_fails() -> None:
    followed = Followed(Counter)
    with pytest.raises(ValueError, match="a page"), followed.use(directory("a")):
        raise ValueError("a page")
    with followed.use(directory("a")) as counter:
        assert counter.reads == 2
