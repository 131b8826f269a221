"""Made-up words in instructions: what is replaced, what stays, and where it ends up."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from agents.finetune.launchers.sources import open_source
from agents.finetune.samples import open_samples
from agents.finetune.settings import DataSettings
from agents.finetune.word_noise import with_word_noise
from benchmarks.cli.main import cli
from er_gym.data.collection import Collection
from er_gym.tasks.wordings.names import types_by_name


def test_some_words_are_made_up_and_names_stay(played: Collection) -> None:
    (like, *_) = played.trajectories()
    told = "First put the frying pan on the DiningTable, then take a CD to the bank card."
    names = {word for name in types_by_name() for word in name.split()}
    changed = total = 0
    for number in range(200):
        one = like.model_copy(update={"id": f"t{number}", "instruction": told})
        noisy = with_word_noise(one, 0.25)
        assert noisy == with_word_noise(one, 0.25)
        assert noisy.model_copy(update={"instruction": told}) == one
        assert re.sub(r"\w+", "", noisy.instruction) == re.sub(r"\w+", "", told)
        for before, now in zip(told.split(), noisy.instruction.split(), strict=True):
            word = before.strip(",.").lower()
            if word in names or len(word) == 1:
                assert now == before
            else:
                total += 1
                changed += now != before
                assert now == before or now.strip(",.").lower() not in names
                assert now[0].isupper() == before[0].isupper()
    assert 0.22 < changed / total < 0.28
    assert with_word_noise(like, 0) is like
    whole = with_word_noise(like.model_copy(update={"instruction": "take the Mug"}), 1)
    assert re.fullmatch(r"[a-z]+ [a-z]+ Mug", whole.instruction)
    assert not {"take", "the"} & {*whole.instruction.split()}
    chinese = like.model_copy(update={"instruction": "把CD放到床上。"})
    assert with_word_noise(chinese, 1) == chinese


def test_word_noise_is_for_collections(tmp_path: Path) -> None:
    """A conversation of a ShareGPT file does not say which of its words are the instruction."""
    file = tmp_path / "chats.json"
    file.write_text("[]")
    settings = DataSettings(word_noise=0.1)
    for opened in (lambda: open_samples([file], settings), lambda: open_source(file, settings)):
        with pytest.raises(
            ValueError, match=r"chats\.json is no collection .* set data.word_noise=0"
        ):
            opened()


def test_word_noise_leaves_frames_as_they_are(played: Collection, tmp_path: Path) -> None:
    """They have no instructions; so beside a collection they are welcome, and alone refused."""
    drawn = tmp_path / "frames"
    arguments = ["data", "frames", "--suite", "mini", "--scenes", "FloorPlan402", "--frames", "2"]
    size = ["--width", "96", "--height", "54", "--workers", "1", "--out", str(drawn)]
    result = CliRunner().invoke(cli, [*arguments, *size])
    assert result.exit_code == 0, result.output
    plain, noisy = (DataSettings(dialect="sight", word_noise=share) for share in (0.0, 0.5))
    with pytest.raises(ValueError, match=r"frames is no collection .* set data.word_noise=0"):
        open_samples([drawn], noisy)
    both = open_samples([drawn, played.path], noisy)
    assert both.chats[:2] == open_samples([drawn], plain).chats
    assert both.chats[2:] == open_samples([played.path], noisy).chats


def test_only_the_instruction_of_what_is_learnt_is_noisy(played: Collection) -> None:
    plain = open_samples([played.path], DataSettings(dialect="text"))
    settings = DataSettings(dialect="text", word_noise=0.5)
    noisy = open_samples([played.path], settings)
    assert noisy.digest != plain.digest
    instructions = {each.id: each.instruction for each in played.trajectories()}
    for before, now in zip(plain.chats, noisy.chats, strict=True):
        changed = [one for one, other in zip(before.turns, now.turns, strict=True) if one != other]
        assert [turn.role for turn in changed] in ([], ["user"])
        for turn in changed:
            assert instructions[before.id] in turn.text
    told = [chat.turns for chat in open_source(played.path, settings).chats()]
    assert told == [chat.turns for chat in noisy.chats]
