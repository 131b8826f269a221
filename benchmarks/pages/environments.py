"""docs/environments: a page for each environment id, made from the registry and from runs.

    python -m benchmarks.pages.environments runs/oracle runs/searcher …

Each page shows an episode of the oracle in pictures, the spaces, the rewards, and how often the
agents of the given runs of ``er-1k`` succeed in this type of task.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import gymnasium
import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from agents import make_agent
from benchmarks.cli.errors import bad_input
from benchmarks.harness.output import ROOT
from benchmarks.harness.samples import sheet
from benchmarks.scoring.metrics import Score, score_episode, wilson
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.observations import OBSERVATIONS
from er_gym.rollout.play import play_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tables import Table
from er_gym.tasks import Task, load_suite
from er_gym.tasks.types import TASK_TYPES, TaskType
from er_gym.tasks.verbs import BARE_VERBS, OBJECT_VERBS
from er_gym.writing import MARKDOWN_MARK, write_output, write_picture

PAGES = ROOT / "docs" / "environments"
_SIDE, _COLUMNS = 230, 5
_SHOWN_INSTRUCTIONS = 3
_OWN_SUITES = ("mini", "er-1k", "er-val", "train")
_FIGURES_OF = "er-1k"


@dataclass(frozen=True)
class Played:
    """A run of ``er-1k``.

    Attributes:
        agent: its name, and what it is told of instances.
        scores: of its episodes.
    """

    agent: str
    scores: Sequence[Score]

    @staticmethod
    def load(path: Path) -> Played:
        """Read a run directory.

        Raises:
            ValueError: it is not one of ``er-1k`` as it is now.
        """
        found = RunDirectory.open(path)
        manifest = found.manifest
        if manifest.suite_digest != load_suite(_FIGURES_OF).digest:
            raise ValueError(f"{path} is not a run of today's {_FIGURES_OF}; give one of those")
        instances = manifest.env.get("instances", "target")
        scores = [score_episode(episode, CORRECTED) for episode in found.episodes()]
        return Played(f"{manifest.agent} ({instances})", scores)


class Pictures(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Keeps the picture of each step with the action that led to it."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self.shown: list[tuple[str, NDArray[np.uint8]]] = []

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        obs, info = self.env.reset(**options)
        self.shown = [("start", obs["rgb"])]
        return obs, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        found = self.env.step(action)
        self.shown.append((f"{len(self.shown)}  {found[4]['action']}", found[0]["rgb"]))
        return found


def _example(row: TaskType) -> Task:
    """A task of ``mini`` of about the usual length: the median."""
    tasks = [task for task in load_suite("mini").tasks if task.type is row]
    return sorted(tasks, key=lambda task: (len(task.key_actions), task.id))[len(tasks) // 2]


def _draw_episode(row: TaskType, task: Task, picture: Path) -> None:
    """Play a task with the oracle, and write the picture of it."""
    env = Pictures(gymnasium.make(row.env_id, obs_mode="rgb+text", width=_SIDE, height=_SIDE))
    play_episode(env, make_agent("oracle"), task, 0)
    env.close()
    columns = min(_COLUMNS, len(env.shown))
    write_picture(picture, sheet(env.shown, columns), force=True)


def _rows_of_figures(runs: Iterable[Played], row: TaskType) -> Table:
    rows = []
    for run in runs:
        mine = [score.success for score in run.scores if score.task_type == row.name]
        if not mine:
            continue
        rate = wilson(sum(mine), len(mine))
        rows.append(
            (run.agent, str(len(mine)), f"{100 * rate.mean:.1f}",
             f"{100 * (rate.low or 0):.1f} to {100 * (rate.high or 0):.1f}")
        )  # fmt: skip
    return Table("Success, in %", ("Agent", "n", "Success", "95 %"), tuple(rows), text_columns=1)


def _shown(space: gymnasium.Space[Any]) -> str:
    """A space in code; its characters are not listed."""
    return f"`{re.sub(r', charset=.*?~', '', str(space), flags=re.DOTALL)}`"


def _page(row: TaskType, task: Task, runs: Sequence[Played]) -> str:
    told = [each.instruction for each in load_suite("er-1k").tasks if each.type is row][
        :: max(1, 91 // _SHOWN_INSTRUCTIONS)
    ][:_SHOWN_INSTRUCTIONS]
    env = gymnasium.make(row.env_id)
    space, seen = env.action_space, env.observation_space
    env.close()
    facts = [
        ("Made by", f'`gymnasium.make("{row.env_id}")`'),
        ("Task type", f"`{row.name}`"),
        ("Group", row.group),
        ("Action space", _shown(space)),
        ("Observation space", _shown(seen)),
        ("Step limit", f"{row.max_steps}; placing the agent counts as the first step"),
        ("Order of key actions", "as listed" if row.ordered else "any"),
        ("Import", "`import er_gym`"),
    ]
    counts = [
        (f"`{name}`", str(sum(each.type is row for each in load_suite(name).tasks)))
        for name in _OWN_SUITES
    ]
    earned = [
        (f"{each.verb} {each.object_type}".rstrip(), f"{each.reward:g}")
        for each in task.key_actions
    ]
    return f"""# {row.env_id}

{row.title}. The agent is told, for example:

{chr(10).join(f"- {each}" for each in told)}

![An episode of {row.env_id}](../images/environments/{row.env_id}.jpg)

The oracle in a task of `mini`, told "{task.instruction}"
Under each picture stands the action before it.

{Table("", ("", ""), tuple(facts), text_columns=2).markdown().strip()}

[The table of all environments](index.md) says what the actions, observations and `info` are.

## Reward

Each key action earns its reward once; `end` earns its own if the task is done.
In the episode above:

{Table("", ("Key action", "Reward"), tuple(earned), text_columns=1).markdown().strip()}

## Suites

{Table("", ("Suite", "Tasks of this type"), tuple(counts), text_columns=1).markdown().strip()}

## Figures

Success in the tasks of this type in `{_FIGURES_OF}`, in %, with Wilson's interval. *target* means
that a type name stands for the task's own object where it can, *explore* that the environment does
not use what it knows of the task.

{_rows_of_figures(runs, row).markdown().strip()}
"""


def _index() -> str:
    rows = [
        (f"[{row.env_id}]({row.env_id}.md)", row.title, row.group, str(row.max_steps))
        for row in TASK_TYPES
    ]
    verbs = [(f"`{verb}`", "-") for verb in BARE_VERBS] + [
        (f"`{verb}`", "an object type") for verb in OBJECT_VERBS
    ]
    seen = [
        (f"`{name}`", _shown(OBSERVATIONS.get(name).space(300, 300)))
        for name in OBSERVATIONS.names()
    ]
    toctree = "\n".join(row.env_id for row in TASK_TYPES)
    return f"""# Environments

```{{toctree}}
:hidden:

{toctree}
```

`import er_gym` registers these ids. They differ in the tasks that they draw; all else is
`er_gym.EmbodiedEnv`, whose arguments `gymnasium.make` takes.

{Table("", ("Id", "Task", "Group", "Step limit"), tuple(rows), text_columns=3).markdown().strip()}

## Actions

`Discrete`: an action is a verb, with an object type where the verb takes one, and the same in every
room. `step` takes its number, or its text.

{Table("", ("Verb", "With"), tuple(verbs), text_columns=2).markdown().strip()}

## Observations

`obs_mode` chooses them, joined with `+`. Pictures are 300 by 300 pixels in this table.

{Table("", ("Name", "Space"), tuple(seen), text_columns=2).markdown().strip()}
"""


@click.command()
@click.argument("runs", nargs=-1, type=click.Path(path_type=Path, exists=True))
def main(runs: tuple[Path, ...]) -> None:
    """Write docs/environments and its pictures."""
    with bad_input():
        played = [Played.load(path) for path in runs]
    images = ROOT / "docs" / "images" / "environments"
    images.mkdir(parents=True, exist_ok=True)
    PAGES.mkdir(exist_ok=True)
    for row in track(TASK_TYPES, "pages"):
        task = _example(row)
        _draw_episode(row, task, images / f"{row.env_id}.jpg")
        page = _page(row, task, played)
        write_output(PAGES / f"{row.env_id}.md", MARKDOWN_MARK + page, force=True)
    write_output(PAGES / "index.md", MARKDOWN_MARK + _index(), force=True)
    click.echo(f"{PAGES}, {images}")


if __name__ == "__main__":
    main()
