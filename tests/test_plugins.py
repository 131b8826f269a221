"""Plugins of other packages, by dotted names and by entry points: one of each kind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from agents import make_agent
from agents.factory import AgentFactory
from agents.vlm.clients.registry import CLIENTS, is_model_agent, resolve_client
from agents.vlm.settings import AgentSettings
from er_gym import plugins
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.plugins import PluginError
from er_gym.tasks import load_suite
from er_gym.tasks.paraphrase import load_ask
from er_gym.tasks.suites import suite_registry

OUTSIDE = Path(__file__).parent / "outside"
ENTRY_POINTS = """\
[er_gym.agents]
impatient = household:Impatient
broken = household:Missing
[er_gym.model_clients]
echo = household:ECHO
[er_gym.observations]
hands = household:HANDS
[er_gym.suites]
two-tasks = household:two_tasks
[er_gym.paraphrasers]
counter = household:ask
[er_gym.verbs]
clean = household_verbs:CLEAN
"""


def installed(directory: Path, entry_points: str = ENTRY_POINTS) -> Path:
    """What an installer leaves of a package beside its modules."""
    info = directory / "household-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: household\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entry_points)
    return directory


@pytest.fixture
def _outside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(OUTSIDE))


@pytest.fixture
def _household(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(str(OUTSIDE))
    monkeypatch.syspath_prepend(str(installed(tmp_path)))
    plugins.entry_points.cache_clear()
    yield
    plugins.entry_points.cache_clear()


# -- one of each -----------------------------------------------------------------------------------


@pytest.mark.usefixtures("_household")
@pytest.mark.parametrize("name", ["impatient", "household:Impatient"])
def test_an_agent_plays(name: str) -> None:
    agent = make_agent(name, seed=7)
    env = EmbodiedEnv("mini", obs_mode=agent.obs_mode)
    obs, info = env.reset(seed=0)
    agent.reset(env.task, obs, info)
    decision = agent.act(obs, info)
    assert decision.thought == "I was made with the seed 7."
    assert env.step(decision.action)[2]
    env.close()


@pytest.mark.usefixtures("_household")
@pytest.mark.parametrize("name", ["echo:open Fridge", "household:ECHO:open Fridge"])
def test_a_model_client_replies(name: str, tmp_path: Path) -> None:
    assert is_model_agent(name)
    speaker = AgentFactory(name, AgentSettings(sees="text"), tmp_path)
    env = EmbodiedEnv("mini", obs_mode="text")
    obs, info = env.reset(seed=0)
    agent = speaker.agent(0)
    agent.reset(env.task, obs, info)
    assert str(agent.act(obs, info).action) == "open Fridge"
    assert "1 replies" in str(speaker.cost)
    speaker.close()
    env.close()


@pytest.mark.usefixtures("_household")
@pytest.mark.parametrize("name", ["hands", "household:HANDS"])
def test_an_observation_is_built(name: str) -> None:
    env = gymnasium.make("er_gym:ER-SinglePickup-v0", obs_mode=f"{name}+text")
    obs, _ = env.reset(seed=0)
    assert set(obs) == {name, "text"}
    assert np.array_equal(obs[name], [0.0])
    assert obs in env.observation_space
    env.close()


@pytest.mark.usefixtures("_household")
@pytest.mark.parametrize("name", ["two-tasks", "household:two_tasks"])
def test_a_suite_is_drawn_from(name: str) -> None:
    assert load_suite(name).tasks == load_suite("mini").tasks[:2]
    env = EmbodiedEnv(name, obs_mode="text")
    drawn = {env.reset(seed=seed)[1]["task_id"] for seed in range(8)}
    assert drawn == {task.id for task in load_suite("mini").tasks[:2]}
    env.close()


@pytest.mark.usefixtures("_household")
@pytest.mark.parametrize("name", ["counter", "household:ask"])
def test_a_paraphraser_is_asked(name: str) -> None:
    assert load_ask(name)("abc") == "3 characters."


def test_the_command_knows_them_and_so_do_its_workers(tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    paths = [Path(__file__).parents[1], OUTSIDE, installed(tmp_path / "site")]
    run = [sys.executable, "-m", "benchmarks.cli", "bench", "--out", str(tmp_path / "run")]
    done = subprocess.run(
        [*run, "--suite", "two-tasks", "--agent", "impatient", "--workers", "2"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    episodes = [json.loads(file.read_text()) for file in (tmp_path / "run/episodes").glob("*.json")]
    assert len(episodes) == 2
    assert {episode["steps"][-1]["verb"] for episode in episodes} == {"end"}


# -- what is said of wrong names -------------------------------------------------------------------


@pytest.mark.usefixtures("_household")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("sercher", r"unknown agent 'sercher' \(did you mean searcher\?\); choose one of: oracle, "
         r"random, searcher, spotter, mask-reader, instruction-blind, do-nothing, always-end, "
         r"repeat-last, takes-all, broken, impatient; package\.module:Name; rl:RUN .*; "
         r"openai:MODEL, "),
        ("", "unknown agent ''; choose one of"),
        ("household", "unknown agent 'household'"),
        ("household:", "unknown agent 'household:'"),
        ("opnai:gpt4", "unknown agent 'opnai:gpt4'.*oracle.*openai:MODEL.*Cannot import 'opnai' "),
        ("household:Impatien", r"has no 'Impatien' \(did you mean Impatient\?\)"),
        ("household:two_tasks", "makes Suite, which has no 'obs_mode'"),
        ("household:OUT", "has no 'OUT'"),
        ("household:Echo", r"cannot be made \(TypeError: .*model"),
        ("household_verbs:CLEAN", "give an agent's class"),
        ("broken", "agent 'broken' of the package household cannot be loaded from household:Miss"),
        ("opnai:gpt-4o", "unknown agent 'opnai:gpt-4o'"),
    ],
)  # fmt: skip
def test_a_wrong_agent(name: str, message: str) -> None:
    with pytest.raises(PluginError, match=message) as caught:
        make_agent(name)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("_household")
def test_other_wrong_names() -> None:
    with pytest.raises(PluginError, match=r"unknown suite 'mimi' \(did you mean mini\?\).*two-tas"):
        load_suite("mimi")
    with pytest.raises(PluginError, match="suite 'household:ECHO' is ModelClientSpec"):
        load_suite("household:ECHO")
    with pytest.raises(PluginError, match=r"'household:ask' cannot be made \(TypeError: .*missing"):
        load_suite("household:ask")
    with pytest.raises(PluginError, match=r"unknown suite 'er-1'.*er-1k"):
        EmbodiedEnv("er-1")
    with pytest.raises(
        ValueError,
        match=r"unknown obs_mode 'rgb\+hand'.*rgb, depth, .*state, .*text, .*hands",
    ):
        EmbodiedEnv(obs_mode="rgb+hand")
    with pytest.raises(PluginError, match="observation 'household:ECHO' is ModelClientSpec"):
        EmbodiedEnv(obs_mode="household:ECHO")
    with pytest.raises(PluginError, match="model client 'household:HANDS' is Observation"):
        resolve_client("household:HANDS:x")
    with pytest.raises(PluginError, match=r"unknown paraphraser 'me'.*counter; package"):
        load_ask("me")
    assert suite_registry().names()[-1] == "two-tasks"
    assert CLIENTS.names() == ("openai", "hf", "recorded", "echo")


def test_two_packages_may_not_share_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("one", "a:B"), ("other", "c:D")):
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[er_gym.agents]\nx = {value}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    plugins.entry_points.cache_clear()
    with pytest.raises(PluginError, match=r"declare 'x'.*(a:B|c:D).*(a:B|c:D).*uninstall"):
        make_agent("x")
    plugins.entry_points.cache_clear()


def test_a_module_in_the_working_directory_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here_only.py").write_text("from household import Impatient as Mine\n")
    monkeypatch.syspath_prepend(str(OUTSIDE))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    assert type(make_agent("here_only:Mine")).__name__ == "Impatient"


def test_what_asks_an_interpreter_imports_nothing_from_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """er-gym doctor, er-gym serve --dry-run and er-gym player install ask so."""
    from agents.vlm.serving import inspect_machine
    from benchmarks.cli.doctor_checks import _missing_for_client
    from er_gym.thor.hooks import hook_folders

    for name in ("json", "site", "ai2thor", "torch", "vllm"):
        (tmp_path / f"{name}.py").write_text("open('ran', 'w').close()")
    monkeypatch.chdir(tmp_path)
    assert "vllm" not in inspect_machine(sys.executable, {}).packages
    assert _missing_for_client().keys() == {"Linux64", "CloudRendering"}
    assert hook_folders(sys.executable)
    assert not (tmp_path / "ran").exists()
