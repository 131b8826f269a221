"""Build the bundled suite ``mini``: generated tasks, each of which the oracle has solved.

``python -m benchmarks.build_mini`` writes er_gym/tasks/data/mini.jsonl anew, byte for byte the same
for a seed.
"""

from __future__ import annotations

import random
from pathlib import Path

import click
from rich.progress import track

from agents import make_agent
from benchmarks.play import play_episode
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import jsonl_format
from er_gym.tasks.generate import generate_tasks, select_balanced
from er_gym.tasks.task import Task
from er_gym.thor import SCENE_NAMES, accepts, make_controller

OUTPUT = Path(jsonl_format.__file__).parent / "data" / "mini.jsonl"


def candidates() -> dict[str, list[Task]]:
    """Every candidate task of every scene."""
    found = {}
    with make_controller(headless=True) as controller:
        for scene in track(SCENE_NAMES, "reading scenes"):
            objects = controller.reset(scene).metadata["objects"]
            found[scene] = list(generate_tasks(objects, scene, accepts))
    return found


@click.command(help=__doc__)
@click.option("--per-type", default=12, show_default=True, help="Tasks of each type.")
@click.option("--seed", default=0, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=OUTPUT, show_default=False)
def main(per_type: int, seed: int, out: Path) -> None:
    """Generate, verify, write."""
    env = EmbodiedEnv([], obs_mode="text")
    asked: list[Task] = []

    def solvable(task: Task) -> bool:
        asked.append(task)
        record = play_episode(env, make_agent("oracle"), task, seed)
        if not record.success:
            click.echo(f"not solved, left out: {task.id}: {record.steps[-1].feedback}")
        return record.success

    tasks = select_balanced(candidates(), per_type, random.Random(seed), solvable)
    out.parent.mkdir(parents=True, exist_ok=True)
    jsonl_format.write_tasks(out, tasks, seed=seed, generator="benchmarks.build_mini")
    click.echo(f"{len(tasks)} tasks of {len(asked)} tried: {out.name}")


if __name__ == "__main__":
    main()
