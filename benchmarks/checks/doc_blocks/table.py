"""Which parts of the pages are not run, and why.

A row names a page and words with which a part of it begins. What no row names is run by the tests
and by ``python -m benchmarks.checks.doc_blocks``. A row that names nothing is an error.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from benchmarks.checks.doc_blocks.blocks import Part

_FILES = (
    *("tasks", "verbs", "actions", "shapes", "agents", "clients"),
    *("observations", "nearest", "suites", "models"),
)
NEVER: Mapping[str, tuple[str, ...]] = {
    "installs packages, or changes this Python's": (
        "README.md: make bench",
        "docs/install.md: pip uninstall",
        "README.md: er-gym player install",
        "README.md: er-gym player uninstall",
        "docs/agents.md: pip install",
        "docs/cluster.md: pip install",
        "docs/finetuning.md: pip install",
        "docs/finetuning.md: sudo apt install",
        "docs/ladder.md: pip install",
        "docs/learning.md: pip install",
        "docs/integrations/mcp.md: python3 -m venv",
        "docs/integrations/mcp.md: pip install",
        "docs/integrations/openenv.md: python3 -m venv",
        "docs/integrations/openenv.md: pip install",
        "docs/integrations/minari.md: pip install",
        "docs/integrations/ms-swift.md: python3 -m venv",
        "docs/integrations/nemo-gym.md: python3.12 -m venv",
        "docs/integrations/rllib.md: python3 -m venv",
        "docs/integrations/skyrl-gym.md: pip install",
        "docs/integrations/trl.md: pip install",
        "docs/integrations/verifiers.md: python3 -m venv",
        "docs/integrations/verl.md: python3 -m venv",
        "docs/reinforcement.md: pip install",
        "docs/player.md: er-gym player install",
        "docs/player.md: er-gym player uninstall",
        "docs/serving.md: python3 -m venv",
        "docs/start.md: python3 -m venv",
        "docs/start.md: pip install",
        "docs/serving.md: llm/bin/pip",
        "docs/serving.md: cp llm/lib",
    ),
    "is what runs the tests, or lints": (
        "README.md: make test",
        "CONTRIBUTING.md: make test",
        "CONTRIBUTING.md: make",
        "CONTRIBUTING.md: .ci/run",
        "CONTRIBUTING.md: .venv/bin/ruff",
    ),
    "asks a model on a server": (
        "README.md: er-gym bench --suite er-1k --agent openai:",
        "docs/commands.md: er-gym bench --suite er-1k --agent openai:",
        "docs/agents.md: export OPENAI_API_KEY",
        "docs/agents.md: er-gym bench --suite mini --agent openai:",
        "docs/agents.md: er-gym bench --suite er-1k --agent openai:",
        "docs/agents.md: er-gym bench --protocol paper",
        "docs/data.md: er-gym collect --suite train --limit 100 --out data/y",
        "docs/data.md: er-gym data verify data/y",
        "docs/faults.md: er-gym bench --suite mini --agent openai:",
        "docs/serving.md: er-gym bench --suite er-1k --agent openai:",
        "docs/serving.md: er-gym bench --suite mini --limit 20 --agent openai:",
        "docs/serving.md: er-gym inspect",
        "docs/serving.md: LOCAL_API_KEY=none er-gym inspect",
        "docs/serving.md: inspect ",
    ),
    "needs a model that is not here": (
        "README.md: er-gym finetune",
        "docs/commands.md: er-gym serve",
        "docs/agents.md: er-gym bench --suite mini --agent hf:",
        "docs/agents.md: er-gym bench --suite er-1k --agent hf:",
        "docs/data.md: er-gym bench --suite train --agent hf:",
        "docs/finetuning.md: er-gym finetune",
        "docs/finetuning.md: er-gym bench",
        "docs/finetuning.md: LD_PRELOAD",
        "docs/finetuning.md: accelerate launch",
        "docs/reinforcement.md: accelerate launch",
        "docs/ladder.md: python -m benchmarks.vision_probe",
        "docs/serving.md: er-gym serve",
        "docs/serving.md: import time, xllamacpp",
    ),
    "needs the paper's program or its task files": (
        "docs/agents.md: python -m benchmarks.checks.paper_agreement",
        "docs/tasks.md: python -m benchmarks.checks.key_actions",
        "docs/tasks.md: git clone",
        "docs/tasks.md: cp embodied_reasoner",
        "docs/tasks.md: er-gym tasks verify test_809.json",
        "docs/tasks.md: er-gym tasks convert test_809.json",
        "docs/tasks.md: er-gym bench --tasks-file",
    ),
    "needs OpenEnv, which the tests' own environment cannot have": (
        "docs/integrations/openenv.md: er-gym openenv --hub-folder",
        "docs/integrations/openenv.md: from er_gym.integrations.openenv",
    ),
    "needs a trainer that has an environment of its own": (
        "docs/integrations/ms-swift.md: # rows.py",
        "docs/integrations/ms-swift.md: swift",
        "docs/integrations/nemo-gym.md: # resources_servers",
        "docs/integrations/nemo-gym.md: # rows.py",
        "docs/integrations/skyrl-gym.md: # play_skyrl.py",
        "docs/integrations/verifiers.md: # er_gym_house.py",
        "docs/integrations/verifiers.md: export PATH",
        "docs/integrations/verifiers.md: vf-eval",
        "docs/integrations/verl-agent.md: # in make_envs",
        "docs/integrations/verl.md: # rows.py",
    ),
    "needs a GPU": ("docs/serving.md: CUDA_VISIBLE_DEVICES",),
    "needs Unity's build": (
        "docs/fidelity.md: er-gym unity collect",
        "docs/fidelity.md: er-gym unity compare",
    ),
    "needs a container engine": ("docs/start.md: docker",),
    "needs a cluster": (
        "docs/cluster.md: er-gym",
        "docs/cluster.md: ray start",
        "docs/cluster.md: #!/bin/bash",
        "docs/finetuning-clusters.md: scp",
    ),
    "serves until it is ended": (
        "README.md: er-gym ui",
        "docs/commands.md: er-gym ui",
        "docs/integrations/openenv.md: er-gym openenv --port",
        "docs/monitor.md: er-gym ui runs/ data/",
        "docs/monitor.md: er-gym ui --play",
        "docs/serving.md: er-gym match-server",
        "docs/serving.md: curl",
    ),
    "trains or plays for many minutes": (
        "README.md: er-gym ladder",
        "README.md: er-gym reinforce",
        "docs/baselines.md: er-gym train-rl",
        "docs/data.md: er-gym data frames",
        "docs/data.md: er-gym new-model",
        "docs/data.md: er-gym finetune",
        "docs/finetuning.md: er-gym collect",
        "docs/ladder.md: er-gym ladder",
        "docs/integrations/rllib.md: # train_rllib.py",
        "docs/integrations/trl.md: # train",
        "docs/ladder.md: er-gym ablate",
        "docs/models.md: er-gym",
        "docs/reinforcement.md: er-gym",
        "docs/reinforcement.md: OMP_NUM_THREADS",
        "docs/reinforcement.md: python -m benchmarks.pages.reinforcement",
        "docs/zoo.md: er-gym train-rl",
        "er_gym/tasks/data/train.md: er-gym tasks generate",
    ),
    "names something of the reader's own": (
        "docs/commands.md: er-gym replay",
        "docs/data.md: er-gym data show",
        "docs/ladder.md: er-gym new-model --from-gguf",
    ),
    "changes the models that come with er-gym": ("docs/zoo.md: er-gym zoo add",),
    "shows files, or what is printed; nothing reads it": (
        "docs/agents.md: run.json",
        "docs/agents.md: MODEL at",
        "docs/data.md: data/x/collection.json",
        "docs/integrations/nemo-gym.md: # er_gym.yaml",
        "docs/integrations/vagen.md: env_registry:",
        "docs/integrations/verl.md: # agent.yaml",
        "docs/integrations/verl.md: data.train_files",
        'docs/integrations/mcp.md: {"mcpServers"',
        "configs/dialects/README.md: user",
    ),
}
"""By reason, what is never run, as ``PAGE: WORDS``."""

SLOW: Mapping[str, tuple[str, ...]] = {
    "starts worker processes": (
        "README.md: er-gym bench --suite mini",
        "docs/commands.md: er-gym bench --suite mini",
        "docs/start.md: er-gym bench --suite mini",
        "docs/commands.md: er-gym bench --tasks-file",
        "README.md: er-gym report",  # on those
        "docs/commands.md: er-gym report",  # on those
        "docs/commands.md: er-gym submit",
        "docs/commands.md: er-gym leaderboard check",
        "docs/start.md: er-gym report",  # on those
        "docs/commands.md: er-gym tasks generate",
        "docs/extending.md: er-gym tasks generate",
        "docs/extending.md: er-gym bench",
        "docs/extending.md: ER_GYM_PLUGINS=verbs",
        "docs/faults.md: er-gym bench --suite mini --agent searcher",
        "docs/faults.md: for rate",
        "docs/leaderboard.md: er-gym bench",
        "docs/leaderboard.md: er-gym submit",  # on that
        "docs/leaderboard.md: er-gym leaderboard check",
        "docs/leaderboard.md: er-gym leaderboard build",
        "docs/tasks.md: er-gym tasks verify er-1k",
        "docs/tasks.md: er-gym tasks generate",
        "docs/zoo.md: er-gym bench",
        "er_gym/tasks/data/er-1k.md: er-gym tasks generate",
        "er_gym/tasks/data/er-val.md: er-gym tasks generate",
        "er_gym/tasks/data/houses-1k.md: er-gym tasks generate",
        "er_gym/tasks/data/mini.md: er-gym tasks generate",
    ),
    "takes more than a few seconds": (
        "README.md: er-gym doctor",
        "docs/commands.md: er-gym doctor",
        "docs/player.md: er-gym doctor",
        "docs/monitor.md: er-gym ui --export",
        "docs/monitor.md: er-gym ui --video",
        "docs/tasks.md: er-gym tasks stats",
        "docs/zoo.md: import gymnasium",  # its model is loaded with torch
    ),
    "trains for two minutes, or plays what was trained": (
        "README.md: er-gym train-rl",
        "docs/commands.md: er-gym train-rl",
        "docs/commands.md: er-gym bench --suite er-1k --types single_search --agent rl:",
        "docs/learning.md: er-gym",
    ),
    "plays through a plug, as tests/integrations do": (
        "docs/integrations/mcp.md: import asyncio",
        "docs/integrations/minari.md: # record.py",
        "docs/integrations/vagen.md: # play_vagen.py",
        "docs/integrations/verl-agent.md: # play_manager.py",
    ),
    "is a file, which tests/test_extending.py imports with the others": (
        *(f"docs/extending.md: # household/{name}.py" for name in _FILES),
    ),
    "makes a collection, or reads one": (
        "README.md: er-gym collect",
        "docs/commands.md: er-gym collect",
        "docs/commands.md: er-gym data",
        "docs/data.md: er-gym collect --suite train --limit 100 --out data/x",
        "docs/data.md: er-gym collect --select",
        "docs/data.md: er-gym collect --correct",
        "docs/data.md: er-gym data stats",
        "docs/data.md: er-gym data verify data/x",
        "docs/data.md: er-gym data export",
        "docs/data-formats.md: er-gym",
        "docs/data-formats.md: import os",
        "docs/finetuning-clusters.md: er-gym finetune",
        "docs/ladder.md: er-gym data frames",
    ),
}
"""By reason, what takes more than a few seconds: the tests leave it to this check."""


def reason(part: Part, *, of: Sequence[Mapping[str, tuple[str, ...]]] = (NEVER, SLOW)) -> str:
    """Why a part is not run, or ``""``.

    Args:
        part: the part.
        of: the tables that are looked into.

    Raises:
        ValueError: several rows name it.
    """
    found = [
        why for table in of for why, rows in table.items() if any(_names(row, part) for row in rows)
    ]
    if len(found) > 1:
        raise ValueError(f"{part.place} is in the table for several reasons: {'; '.join(found)}")
    return found[0] if found else ""


def stale(parts: Iterable[Part]) -> list[str]:
    """The rows that name no part."""
    every = tuple(parts)
    rows = [row for table in (NEVER, SLOW) for each in table.values() for row in each]
    return [row for row in rows if not any(_names(row, part) for part in every)]


def _names(row: str, part: Part) -> bool:
    page, _, words = row.partition(": ")
    return part.page == page and part.text.startswith(words)
