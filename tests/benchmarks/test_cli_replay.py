"""``er-gym replay``: an episode of a run is repeated, and goes on in another way."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from PIL import Image

from benchmarks.cli.main import cli
from er_gym import EmbodiedEnv
from er_gym.tasks.suites import load_suite


@pytest.fixture(scope="module")
def episode(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of the oracle's episode of a task that holds something."""
    task = next(t for t in load_suite("mini").tasks if t.type.name == "single_pickup_from_closerep")
    run = tmp_path_factory.mktemp("runs") / "one"
    asked = [
        "bench",
        "--suite",
        "mini",
        "--task-ids",
        task.id,
        "--agent",
        "oracle",
        "--out",
        str(run),
    ]
    result = CliRunner().invoke(cli, asked)
    assert result.exit_code == 0, result.output
    (file,) = (run / "episodes").glob("*.json")
    return file


def replay(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(cli, ["replay", *map(str, arguments)])
    return result.exit_code, result.output


def test_the_whole_episode_is_repeated(episode: Path) -> None:
    code, said = replay(episode)
    assert code == 0, said
    steps = json.loads(episode.read_text())["steps"]
    assert len(re.findall(r"^\d+: .*: Done: ", said, re.MULTILINE)) == len(steps) - 1
    assert said.endswith("success: yes (end)\n")


def test_it_goes_on_in_another_way(episode: Path, tmp_path: Path) -> None:
    picture, saved = tmp_path / "seen.png", tmp_path / "saved"
    code, said = replay(
        episode, "--step", 1, "--then", "end", "--then", "observe", "--picture", picture,
        "--snapshot", saved,
    )  # fmt: skip
    assert code == 0, said
    assert "then: end: Done: end. Reward 0." in said
    assert "The episode is over (end), so 'observe' is not done." in said
    assert said.endswith("success: no (end)\n")
    assert Image.open(picture).size == (800, 450)
    env = EmbodiedEnv(obs_mode="text")
    obs, info = env.restore(saved.read_bytes())
    assert info["end_reason"] == "end"
    assert str(obs["text"]) in said


def test_what_cannot_be_repeated_is_said_in_a_line(episode: Path, tmp_path: Path) -> None:
    code, said = replay(episode, "--step", 99)
    assert code == 2
    assert re.search(r"--step 99: the episode has the steps 0 to \d+$", said.strip())
    code, said = replay(episode.parent.parent / "run.json")
    assert (code, "give a file in the folder episodes of a run directory" in said) == (2, True)
    record = json.loads(episode.read_text())
    record["steps"][1]["success"] = False
    episode.write_text(json.dumps(record))
    code, said = replay(episode)
    assert code == 2
    assert "comes out otherwise than it is recorded: it was not done" in said
    episode.write_text("{}")
    code, said = replay(episode)
    assert code == 2
    assert f"{episode}: broken" in said
