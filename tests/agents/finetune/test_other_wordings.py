"""Instructions told in other words: which, how often, and together with made-up ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from agents.finetune.launchers.sources import open_source
from agents.finetune.other_wordings import as_learnt, with_other_wording
from agents.finetune.samples import open_samples
from agents.finetune.settings import DataSettings
from agents.finetune.word_noise import with_word_noise
from er_gym.data.collection import Collection
from er_gym.tasks.wordings.instructions import further_instruction


def test_so_many_are_told_in_other_words(played: Collection) -> None:
    (like, *_) = played.trajectories()
    every = [like.model_copy(update={"id": f"t{number}"}) for number in range(400)]
    told = [with_other_wording(one, 0.25) for one in every]
    assert told == [with_other_wording(one, 0.25) for one in every]
    changed = [(one, now) for one, now in zip(every, told, strict=True) if one != now]
    assert 70 < len(changed) < 130
    for one, now in changed:
        assert now.instruction == further_instruction(one.name, one.id, one.scene)
        assert now.model_copy(update={"instruction": one.instruction}) == one
    assert with_other_wording(like, 0) is like
    assert all(with_other_wording(one, 1) != one for one in every[:20])


def test_what_cannot_be_told_stays(played: Collection) -> None:
    (like, *_) = played.trajectories()
    for change in ({"instruction": "把CD放到床上。"}, {"name": "Dance with the Mug."}):
        one = like.model_copy(update=change)
        assert with_other_wording(one, 1) == one


def test_other_words_come_first_and_made_up_ones_then(played: Collection) -> None:
    (like, *_) = played.trajectories()
    settings = DataSettings(other_wordings=1, word_noise=0.5)
    assert as_learnt(like, settings) == with_word_noise(with_other_wording(like, 1), 0.5)
    assert as_learnt(like, DataSettings()) is like


def test_they_are_for_collections(tmp_path: Path) -> None:
    file = tmp_path / "chats.json"
    file.write_text("[]")
    settings = DataSettings(other_wordings=0.1)
    for opened in (lambda: open_samples([file], settings), lambda: open_source(file, settings)):
        with pytest.raises(ValueError, match=r"no collection .* set data.other_wordings=0"):
            opened()


def test_what_is_learnt_and_what_is_printed_agree(played: Collection) -> None:
    plain = open_samples([played.path], DataSettings(dialect="text"))
    settings = DataSettings(dialect="text", other_wordings=0.5)
    told = open_samples([played.path], settings)
    assert told.digest != plain.digest
    printed = open_source(played.path, settings).chats()
    assert [chat.turns for chat in printed] == [chat.turns for chat in told.chats]
