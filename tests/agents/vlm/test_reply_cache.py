"""The reply cache on disk: hits and misses, several processes, and damage."""

from __future__ import annotations

import os
import re
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from support import lines_until_killed

pytest.importorskip("diskcache", reason="needs pip install 'er-gym[vlm]'")

import diskcache

from agents.vlm.chat import Message, ModelError, Picture, Reply, Usage
from agents.vlm.clients.reply_cache import ReplyCache, key_of
from er_gym.rollout.agent import CannotGoOn

HELLO = (Message("user", ("hello", Picture(b"one", "image/jpeg", 28, 28))),)


class Counting:
    """Numbers its replies; fails first with the errors that it is given."""

    def __init__(self, identity: str = "counting", errors: Sequence[Exception] = ()) -> None:
        self.identity = identity
        self.asked = 0
        self.closed = False
        self._errors = list(errors)
        self._lock = threading.Lock()

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        with self._lock:
            self.asked += 1
            if self._errors:
                raise self._errors.pop(0)
            return Reply(
                f"reply {self.asked} “é”",
                reasoning="so",
                call='{"action": "end"}',
                usage=Usage(10, 2, 3, 1),
                cost=0.5,
                finish="length",
                model="m",
                seconds=3.0,
            )

    def close(self) -> None:
        self.closed = True


Make = Callable[..., ReplyCache]


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Make]:
    """Opens the replies of the test's directory around a client."""
    made = []

    def kept(client: Counting) -> ReplyCache:
        made.append(ReplyCache(client, tmp_path / "run" / "replies"))
        return made[-1]

    yield kept
    for each in made:
        each.close()


def test_a_repeated_request_is_answered_from_the_cache(make: Make) -> None:
    client = Counting()
    first = make(client).reply(HELLO, seed=1)
    assert (first.from_cache, first.cost) == (False, 0.5)
    again = make(client).reply(HELLO, seed=1)  # as after a restart
    assert client.asked == 1
    assert (again.from_cache, again.cost) == (True, 0.5)
    assert again.seconds < first.seconds
    for field in ("text", "reasoning", "call", "usage", "finish", "model"):
        assert getattr(again, field) == getattr(first, field)


@pytest.mark.parametrize(
    "other",
    [
        (Message("user", ("hello!", HELLO[0].parts[1])),),
        (Message("user", ("hello", Picture(b"two", "image/jpeg", 28, 28))),),
        (Message("user", ("hello", Picture(b"one", "image/png", 28, 28))),),
        (Message("user", tuple(reversed(HELLO[0].parts))),),
        (Message("system", HELLO[0].parts),),
        (Message("user", HELLO[0].parts, reasoning="so"),),
        (Message("user", ("hello",)), Message("user", HELLO[0].parts[1:])),
    ],
)
def test_another_conversation_is_another_question(other: tuple[Message, ...]) -> None:
    assert key_of("m", other, 0) != key_of("m", HELLO, 0)


def test_another_episode_or_client_is_asked(make: Make) -> None:
    client, other = Counting(), Counting(identity="other")
    kept = make(client)
    assert not kept.reply(HELLO, seed=1).from_cache
    assert not kept.reply(HELLO, seed=2).from_cache
    assert not make(other).reply(HELLO, seed=1).from_cache
    assert (client.asked, other.asked) == (2, 1)


@pytest.mark.parametrize("error", [ModelError("no"), CannotGoOn("never")])
def test_errors_are_not_kept(make: Make, error: Exception) -> None:
    kept = make(Counting(errors=[error]))
    with pytest.raises(type(error)):
        kept.reply(HELLO, seed=1)
    assert not kept.reply(HELLO, seed=1).from_cache
    assert kept.reply(HELLO, seed=1).from_cache


def test_many_threads(make: Make) -> None:
    client = Counting()
    kept = make(client)
    with ThreadPoolExecutor(8) as pool:
        first = list(pool.map(lambda seed: kept.reply(HELLO, seed), range(100)))
        again = list(pool.map(lambda seed: kept.reply(HELLO, seed), range(100)))
    assert client.asked == 100
    assert all(reply.from_cache for reply in again)
    assert [reply.text for reply in first] == [reply.text for reply in again]


def test_nothing_is_dropped_to_save_room(make: Make, tmp_path: Path) -> None:
    with diskcache.Cache(str(tmp_path / "run" / "replies"), size_limit=1):
        kept = make(Counting())
        for _ in range(2):
            replies = [kept.reply(HELLO, seed) for seed in range(50)]
        assert all(reply.from_cache for reply in replies)


def test_closing_closes_the_client(make: Make) -> None:
    client = Counting()
    make(client).close()
    assert client.closed


# -- processes -----------------------------------------------------------------------------------

PROGRAM = """
import itertools, sys
from pathlib import Path
from agents.vlm.chat import Message, Reply
from agents.vlm.clients.reply_cache import ReplyCache

class Saying:
    identity = "counting"
    def reply(self, messages, seed):
        return Reply(f"from the process: {seed}" + 50_000 * (seed % 2) * "x")

kept = ReplyCache(Saying(), Path(sys.argv[1]))
for seed in itertools.count():
    kept.reply((Message("user", ("hello",)),), seed)
    print(seed, flush=True)
"""


def test_a_killed_process_leaves_what_it_kept(make: Make, tmp_path: Path) -> None:
    directory = tmp_path / "run" / "replies"
    mine = make(Counting())  # open at the same time
    seen = list(map(int, lines_until_killed(PROGRAM, directory, 40)))
    question = (Message("user", ("hello",)),)
    for client in (mine, make(Counting())):
        replies = [client.reply(question, seed) for seed in seen]
        assert all(reply.from_cache for reply in replies)
        assert all(reply.text.startswith("from the process: ") for reply in replies)
    assert not mine.reply(question, seed=10**6).from_cache
    assert mine.reply(question, seed=10**6).from_cache


# -- damage --------------------------------------------------------------------------------------


def _garbage(file: Path) -> None:
    file.write_bytes(4096 * b"\xff" + file.read_bytes()[4096:])


def _cut(file: Path) -> None:
    os.truncate(file, file.stat().st_size // 2)


def _holes(file: Path) -> None:
    content = file.read_bytes()
    third = len(content) // 3
    file.write_bytes(content[:third] + third * b"\xff" + content[2 * third :])


@pytest.mark.parametrize("damage", [_garbage, _cut, _holes])
def test_a_damaged_file_is_set_aside(
    make: Make, tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    client = Counting()
    kept = make(client)
    for seed in range(300):
        kept.reply(HELLO, seed)
    kept.close()
    directory = tmp_path / "run" / "replies"
    damage(directory / diskcache.core.DBNAME)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", ResourceWarning)  # of what other tests have left open
        kept = make(client)
        for seed in range(300):
            assert kept.reply(HELLO, seed).text.startswith("reply ")
    assert [re.sub(r"\(.*?\)", "()", str(each.message)) for each in warned] == [
        f"{directory} is damaged (); it was moved to {directory}.damaged-1"
    ]
    assert (tmp_path / "run" / "replies.damaged-1").is_dir()
    asked = client.asked
    kept.reply(HELLO, seed=299)
    assert client.asked == asked  # cached again


@pytest.mark.parametrize("damage", [_cut, Path.unlink])
def test_a_damaged_value_is_asked_again(
    make: Make, tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    class Verbose(Counting):
        def reply(self, messages: Sequence[Message], seed: int) -> Reply:
            return Reply(super().reply(messages, seed).text + 2_000_000 * "x")

    kept = make(Verbose())
    kept.reply(HELLO, seed=0)
    (value,) = (tmp_path / "run" / "replies").rglob("*.val")
    damage(value)
    assert not kept.reply(HELLO, seed=0).from_cache
    assert kept.reply(HELLO, seed=0).text.startswith("reply 2")


class Bomb:
    """Makes a directory when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self.path),)


def test_nothing_is_unpickled(make: Make, tmp_path: Path) -> None:
    key = key_of("counting", HELLO, 0)
    with diskcache.Cache(str(tmp_path / "run" / "replies")) as cache:
        cache.set(key, Bomb(tmp_path / "boom"))
        kept = make(Counting())
        assert not kept.reply(HELLO, seed=0).from_cache
        assert not (tmp_path / "boom").exists()
    assert kept.reply(HELLO, seed=0).from_cache


def test_a_directory_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "replies").write_text("")
    with pytest.raises(ValueError, match=r"replies cannot be cached in .*choose another --out"):
        ReplyCache(Counting(), tmp_path / "replies")
