"""Drafts of replies: what they guess, and that replies are the same without them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
from support import one_torch_thread

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

from local_clients import LONG, Models, conversations, edited, settings, watched

from agents.vlm.clients.compiled_attention import has_kernel
from agents.vlm.clients.draft_tokens import DraftTokens
from agents.vlm.clients.local import LocalClient, Spoken
from agents.vlm.clients.packed_rows import PackedRow
from agents.vlm.clients.padded_batch import EncodedPrompt
from agents.vlm.settings import Sampling

REPLY = [5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


def drafts(*replies: list[int]) -> DraftTokens:
    table = DraftTokens()
    for reply in replies:
        table.learn(reply)
    return table


def test_what_was_said_twice_is_guessed() -> None:
    assert drafts(REPLY).after([], 99) == []
    table = drafts(REPLY, REPLY)
    assert table.after([], 99) == REPLY[:8]  # no longer than that
    assert table.after([], 3) == REPLY[:3]
    assert table.after(REPLY[:6], 99) == REPLY[6:14]
    assert table.after(REPLY, 99) == []  # nothing goes beyond an end
    assert table.after([], 0) == table.after([], -1) == []


def test_the_last_four_tokens_decide() -> None:
    table = drafts(REPLY, REPLY)
    assert table.after([1, 2, 3, *REPLY[:4]], 2) == REPLY[4:6]
    assert table.after([1, *REPLY[1:4]], 2) == []  # which begins otherwise
    assert table.after(REPLY[:3], 2) == REPLY[3:5]  # a reply's beginning is one of them
    assert table.after([1, *REPLY[:3]], 2) == []


def test_what_follows_now_this_now_that_is_not_guessed() -> None:
    other = [*REPLY[:6], 99]
    assert drafts(*[REPLY, other] * 5).after([], 99) == REPLY[:6]
    assert drafts(REPLY, REPLY, REPLY, REPLY, other).after([], 99) == REPLY[:8]
    assert drafts(*[REPLY] * 9, other, other).after([], 99) == REPLY[:6]
    assert drafts(*[REPLY] * 9, *[other] * 4).after([], 99) == other


def test_a_full_table_begins_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("agents.vlm.clients.draft_tokens._MOST", 20)
    table = drafts(REPLY, REPLY)
    assert table.after([], 1) == REPLY[:1]
    table.learn(list(range(100, 120)))
    assert table.after([], 1) == []
    for _ in range(2):
        table.learn(REPLY)
    assert table.after([], 1) == REPLY[:1]


def test_a_draft_leaves_room_for_the_token_after_it() -> None:
    prompt = EncodedPrompt(
        ids=[1, 2], pictures=[], grids=None, new_pixels=None, new_pictures=0, seed=0,
        thinking=False, name="", kept=None, reused=0,
    )  # fmt: skip
    row, table = PackedRow(prompt, Sampling(max_tokens=12)), drafts(REPLY, REPLY)
    row.guess(table)
    assert row.new == [1, 2, *REPLY[:8]]
    row.go_on(REPLY[:9], [])
    assert (row.said, row.done, row.new) == (REPLY[:9], 10, REPLY[8:9])
    row.guess(table)
    assert row.new == REPLY[8:11]
    row.go_on([REPLY[9], 99, 98], [])  # the second was guessed wrongly
    assert (row.said, row.done, row.new) == ([*REPLY[:10], 99], 12, [99])


@pytest.mark.skipif(not has_kernel(), reason="this machine has no C compiler")
@pytest.mark.parametrize("temperature", [0.0, 0.3])
@pytest.mark.parametrize("family", ["qwen2", "qwen2_5_vl"])
def test_replies_are_the_same_without_drafts(
    models: Models, tmp_path: Path, family: str, temperature: float
) -> None:
    """With conversations that were held before, most of which is guessed, and with new ones."""
    path = edited(
        models,
        tmp_path / "model",
        lambda folder: (folder / "generation_config.json").unlink(),  # it penalises repetition
        family,
    )
    how = settings(
        family,
        sampling={"max_tokens": 40, "temperature": temperature},
        local={"batch": 4, "wait": LONG},
    )
    talks = conversations(family)

    def said(drafting: bool, end: int = -1) -> tuple[list[list[Spoken]], list[int]]:
        """What was said in each round, and how many steps its conversations took."""
        rounds, steps = [], []
        with closing(LocalClient(str(path), how, scored=True)) as client:
            assert client._packed is not None
            assert client._packed._drafts is not None
            if not drafting:
                client._packed._drafts = None
            client._end_tokens = client._end_tokens | {end}
            sizes: list[int] = []
            watched(client, sizes.append)
            # The same three times, others, and one alone, whose beginning is then guessed too.
            for chosen, seed in (*[(talks, 0)] * 3, (talks, 50), *[(talks[2:3], 1)] * 3):
                before = len(sizes)
                with ThreadPoolExecutor(len(chosen)) as pool:
                    asked = [
                        pool.submit(client.spoken, talk, seed + number)
                        for number, talk in enumerate(chosen)
                    ]
                    rounds.append([each.result(LONG) for each in asked])
                steps.append(sum(sizes[before:]))
        return rounds, steps

    (whole, *_), _ = said(False)
    for end in (-1, whole[0].said[20], whole[1].said[-1]):  # none, and two that are often said
        (quick, few), (plain, many) = said(True, end), said(False, end)
        for some, others in zip(quick, plain, strict=True):
            for one, other in zip(some, others, strict=True):
                assert one.said == other.said
                assert end not in one.said[:-1]
                assert one.scores == pytest.approx(other.scores, abs=1e-4)
        assert many == [sum(len(one.said) for one in some) for some in plain]
        assert few[2] < many[2] / 2
        assert few[6] < many[6] / 2
