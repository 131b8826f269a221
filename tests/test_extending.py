"""The examples of docs/extending.md work as described."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.checks.doc_blocks.blocks import PYTHON, blocks

RUN_EACH = """
from agents import make_agent
from agents.vlm.settings import AgentSettings
from agents.factory import AgentFactory
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import load_suite
from er_gym.tasks.paraphrase import load_ask

import gymnasium
from er_gym.sim.render.shapes import SHAPES

tasks = gymnasium.make("Household-Open-v0", episode_source="generate", obs_mode="state")
tasks.reset(seed=0)
assert tasks.unwrapped.task.type.title == "Opening"
tasks.close()
seeing = EmbodiedEnv(obs_mode="household.nearest:NEAREST", width=60, height=40)
obs, info = seeing.reset(seed=0)
assert obs in seeing.observation_space and 0 < obs["household.nearest:NEAREST"][0] < 40
assert info["holding"] == ""
polished = seeing._controller.step("PolishObject", objectId="none").metadata
assert not polished["lastActionSuccess"] and "none" in polished["errorMessage"]
assert SHAPES["LavaLamp"].__module__ == "household.shapes"
seeing.close()

observations = "household.observations:HAND+text"
env = EmbodiedEnv("household.suites:searches", obs_mode=observations)
parrot = AgentFactory("household.clients:PARROT:observe", AgentSettings(sees="text")).agent(0)
for agent in (make_agent("household.agents:Tidy"), parrot):
    obs, info = env.reset(seed=0)
    assert obs in env.observation_space and env.task.type.search
    agent.reset(env.task, obs, info)
    print(agent.act(obs, info).action)
assert load_ask("household.models:ask")("?") == ""
"""


@pytest.fixture(scope="module")
def page(repository: Path) -> str:
    return (repository / "docs" / "extending.md").read_text()


def test_the_files_of_the_walk_throughs_work(page: str, repository: Path, tmp_path: Path) -> None:
    (tmp_path / "household").mkdir()
    files = {
        block.file: block.text
        for block in blocks(repository)
        if block.page == "docs/extending.md" and block.language in PYTHON
    }
    assert None not in files
    for name, text in files.items():
        (tmp_path / str(name)).write_text(text, encoding="utf-8")
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join((str(repository), str(tmp_path)))}
    rows = (
        "task_types=household.tasks:OPEN, verbs=household.verbs:CLEAN,"
        "actions=household.actions:polish,shapes=household.shapes:lava_lamp"
    )
    printed = []
    for words in (["-m", "household.play"], ["-c", RUN_EACH]):  # the first names its verb itself
        done = subprocess.run(
            [sys.executable, *words],
            env=variables if "-m" in words else {**variables, "ER_GYM_PLUGINS": rows},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        printed += done.stdout.splitlines()
    feedback, tidy, parrot = printed
    assert feedback in " ".join(page.split())
    assert (tidy, parrot) == ("end", "observe")


def test_the_groups_are_those_that_are_looked_into(page: str) -> None:
    from agents import AGENTS
    from agents.expert.writers.registry import WRITERS
    from agents.reinforce.advantages import ADVANTAGES
    from agents.reinforce.rewards import REWARDS as TURN_REWARDS
    from agents.rl.rewards import REWARDS
    from agents.vlm.clients.registry import CLIENTS
    from er_gym.data.exports import EXPORTS
    from er_gym.envs.observations import OBSERVATIONS
    from er_gym.plugins import TABLES, VARIABLE
    from er_gym.tasks.paraphrase import PARAPHRASERS
    from er_gym.tasks.suites import suite_registry

    own = (AGENTS, CLIENTS, EXPORTS, OBSERVATIONS, PARAPHRASERS, REWARDS, WRITERS)
    registries = (*own, ADVANTAGES, TURN_REWARDS, suite_registry())
    groups = {*(f"er_gym.{table}" for table in TABLES), *(each.group for each in registries)}
    for table in TABLES:
        assert f"`{VARIABLE}={table}=…` | `er_gym.{table}`" in page
    assert groups == set(re.findall(r"\| `(er_gym\.\w+)` \|", page))
