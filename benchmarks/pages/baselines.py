"""Make docs/baselines.md, the results of trained policies, from their run directories.

    python -m benchmarks.pages.baselines runs/rl/*

Plays every policy, and the searcher, the random agent and the oracle, on tasks of the types that
the policy was trained on: those of er-1k, in rooms that training has never seen, and as many of
each type from the suite that it was trained on. Episodes in ``--work`` are not played again.
"""

from __future__ import annotations

import json
import platform
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import click
import numpy as np
from rich.console import Console

from agents import NamedAgent, make_agent
from agents.rl.callbacks import read_curve
from agents.rl.config import TrainConfig, how_learnt, load_config
from agents.rl.policy_file import MODEL
from agents.rl.policy_observation import IMAGES
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.cli.progress import Progress
from benchmarks.harness.output import ROOT
from benchmarks.harness.samples import sample_of_types
from benchmarks.scoring.curves import draw_curves
from benchmarks.scoring.metrics import Score, score_episode, wilson
from benchmarks.scoring.scorers import CORRECTED
from er_gym import __version__
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.outcomes import Outcomes
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.runner import run
from er_gym.tables import Table, as_markdown
from er_gym.tasks import jsonl_format, load_suite
from er_gym.tasks.task import Task
from er_gym.tasks.types import GROUPS
from er_gym.writing import MARKDOWN_MARK, check_output, file_stem, write_output

UNSEEN = "er-1k"
_EACH = 91
"""As many tasks of a type as er-1k has."""
_SEED = 0
_SCRIPTED = ("random", "searcher", "oracle")


@dataclass(frozen=True)
class TrainedRun:
    """A run directory.

    Attributes: path: the directory. config: the configuration of the training.
    """

    path: Path
    config: TrainConfig

    @staticmethod
    def load(path: Path) -> TrainedRun:
        """Read it.

        Raises:
            ValueError: it is not a run directory, or its training is not complete.
        """
        if not (path / MODEL).exists():
            raise ValueError(f"{path} has no {MODEL}; give run directories of er-gym train-rl")
        trained = TrainedRun(path, load_config(path / "config.yaml"))
        if trained.steps < trained.config.total_steps:
            raise ValueError(
                f"{path} has {trained.steps:,} of {trained.config.total_steps:,} steps; "
                "run er-gym train-rl again to continue it"
            )
        return trained

    @property
    def name(self) -> str:
        """The configuration's name: the directory's name without the seed."""
        return re.sub(r"-\d+$", "", self.path.name)

    @cached_property
    def curve(self) -> list[dict[str, float]]:
        """The learning curve."""
        return read_curve(self.path)

    @property
    def steps(self) -> int:
        """The number of steps."""
        return int(self.curve[-1]["steps"]) if self.curve else 0

    @property
    def minutes(self) -> float:
        """The duration of the training."""
        return self.curve[-1]["seconds"] / 60


class Evaluator:
    """Plays tasks with agents, once each.

    Args:
        work: where the episodes are kept.
        workers: how many processes.
    """

    def __init__(self, work: Path, workers: int) -> None:
        self._work, self._workers = work, workers
        self._console = Console(stderr=True)

    def play(self, agent: str, tasks: Sequence[Task], where: str, name: str) -> list[Score]:
        """The scores of an agent under ``instances="explore"``."""
        manifest = Manifest(
            suite=where,
            suite_digest=jsonl_format.digest(tasks),
            suite_size=len(tasks),
            agent=agent,
            env={"instances": "explore", "obs_mode": make_agent(agent).obs_mode}
            | _picture_size(agent),
            seed=_SEED,
            er_gym=__version__,
        )
        with RunDirectory.locked(
            self._work / f"{file_stem(name)}-{where}", manifest
        ) as run_directory:
            return self._play(run_directory, tasks, where, name)

    def _play(
        self, run_directory: RunDirectory, tasks: Sequence[Task], where: str, name: str
    ) -> list[Score]:
        wanted = {task.id for task in tasks}
        before = Outcomes.of(each for each in run_directory.episodes() if each.task_id in wanted)
        progress = Progress(self._console, f"{where}, {name}", len(tasks), before)
        with progress:
            make, parallelism = (
                NamedAgent(run_directory.manifest.agent),
                Parallelism(self._workers),
            )
            run(run_directory, tasks, make, parallelism=parallelism, listeners=[progress])
        return [
            score_episode(episode, CORRECTED)
            for episode in run_directory.episodes()
            if episode.task_id in wanted
        ]


def _picture_size(agent: str) -> dict[str, int]:
    """A policy that sees pictures gets them in the size that it was trained with."""
    if not agent.startswith("rl:"):
        return {}
    options = load_config(Path(agent.removeprefix("rl:")) / "config.yaml").env
    sees = IMAGES.keys() & options.obs_mode.split("+")
    return {"width": options.width, "height": options.height} if sees else {}


def rates(scores: Sequence[Score]) -> dict[str, tuple[int, int]]:
    """Successes and episodes: of "all", and of each group that was played."""
    found = {"all": (sum(score.success for score in scores), len(scores))}
    for group in GROUPS:
        mine = [score.success for score in scores if score.group == group]
        if mine:
            found[group] = (sum(mine), len(mine))
    return found


def _percent(runs: Sequence[Mapping[str, tuple[int, int]]], part: str) -> str:
    """The mean over seeds and their range; for one seed, Wilson's interval."""
    pairs = [each[part] for each in runs if part in each]
    if not pairs:
        return ""
    shares = [100 * successes / n for successes, n in pairs]
    if len(pairs) > 1:
        return f"{np.mean(shares):.1f} ({min(shares):.1f} to {max(shares):.1f})"
    estimate = wilson(*pairs[0])
    return f"{shares[0]:.1f} ({100 * (estimate.low or 0):.1f} to {100 * (estimate.high or 0):.1f})"


def machine() -> str:
    """The processor's name and the number of cores."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    names = re.findall(r"^model name\s*: (.*)$", text, re.MULTILINE) or [platform.processor()]
    return f"{len(names)} cores of an {names[0]}"


@click.command()
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--work", type=click.Path(path_type=Path), default=Path("runs/baselines"))
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True)
@click.option("--each", type=click.IntRange(min=1), default=_EACH, help="Tasks of a type.")
@click.option("--out", type=click.Path(path_type=Path), default=ROOT / "docs" / "baselines.md")
@force_option
def main(
    runs: tuple[Path, ...],
    work: Path,
    workers: int,
    each: int,
    out: Path,
    force: bool,
) -> None:
    """Write docs/baselines.md and its pictures."""
    families: defaultdict[str, list[TrainedRun]] = defaultdict(list)
    for path in runs:
        trained = TrainedRun.load(path)
        families[trained.name].append(trained)
    with bad_input():
        check_output(out, force=force)
    evaluator = Evaluator(work, workers)
    unseen = load_suite(UNSEEN).tasks
    parts = []
    for name, members in families.items():
        config = members[0].config
        tasks = {
            "training": sample_of_types(
                load_suite(config.env.episodes).tasks, config.env.types, each
            ),
            "unseen": sample_of_types(unseen, config.env.types, each),
        }
        results = {
            where: {
                "trained": [
                    rates(evaluator.play(f"rl:{member.path}", of, where, member.path.name))
                    for member in members
                ]
            }
            | {
                agent: [rates(evaluator.play(agent, of, where, f"{name}-{agent}"))]
                for agent in _SCRIPTED
            }
            for where, of in tasks.items()
        }
        told = {"format": "er-gym/baselines/1", "results": results}
        write_output(work / f"{name}.json", json.dumps(told))
        parts.append(_section(name, members, results))
    with bad_input():
        pictures = draw_curves(families, out.parent / "images", force=force)
        write_output(out, MARKDOWN_MARK + _page(parts, pictures), force=force)
    click.echo(f"{out}, {', '.join(str(picture) for picture in pictures)}")


Results = Mapping[str, Mapping[str, Sequence[Mapping[str, tuple[int, int]]]]]


def _section(name: str, members: Sequence[TrainedRun], results: Results) -> str:
    config = members[0].config
    minutes = [each.minutes for each in members]
    groups = [group for group in GROUPS if group in results["unseen"]["trained"][0]]
    rows = [
        (
            name if agent == "trained" else agent,
            _percent(results["training"][agent], "all"),
            _percent(results["unseen"][agent], "all"),
            *(_percent(results["unseen"][agent], group) for group in groups),
        )
        for agent in ("trained", *_SCRIPTED)
    ]
    head = ("Agent", "Training rooms", "Unseen rooms", *(f"{group}, unseen" for group in groups))
    lines = [
        f"## {name}",
        "",
        f"{how_learnt(config, members[0].steps)}; "
        f"{_span(minutes)} minutes; seeds {', '.join(str(each.config.seed) for each in members)}. "
        f"Types: {', '.join(config.env.types) or 'all'}.",
        "",
        as_markdown([Table("Success, in %", head, tuple(rows), text_columns=1)]),
    ]
    n = results["unseen"]["trained"][0]["all"][1], results["training"]["trained"][0]["all"][1]
    lines += [
        f"{n[1]} tasks in training rooms, {n[0]} in unseen ones. "
        "These commands train the policies:",
        "",
        "```sh",
        *(f"er-gym train-rl --config {name} --seed {each.config.seed}" for each in members),
        "```",
        "",
    ]
    return "\n".join(lines)


def _span(values: Sequence[float]) -> str:
    low, high = round(min(values), 1), round(max(values), 1)
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _page(parts: Sequence[str], pictures: Sequence[Path]) -> str:
    shown = "\n\n".join(f"![{picture.stem}](images/{picture.name})" for picture in pictures)
    tables = "\n".join(parts)
    return f"""# Baselines

This page shows what policies learn on the embedded engine, beside agents that do not learn.
`python -m benchmarks.pages.baselines` makes it from run directories. All episodes use
`instances="explore"`, where the environment does not look at the task to choose which object a type
name means, and the corrected scorer. Each policy is the one at the end of training; none was chosen
by its evaluations. It plays its most probable action. Success is in %: the mean over seeds, with
the lowest and the highest; for a single run, Wilson's 95 % interval. The rooms of the unseen tasks
(`er-1k`) are the paper's twelve test rooms, and training uses none of them. Some of their tasks are
about object types that training never names. Training tasks are a sample of those that the policy
was trained on.

Times are from the start of training to its end, evaluations included, on {machine()}.

{shown}

{tables}"""


if __name__ == "__main__":
    main()
