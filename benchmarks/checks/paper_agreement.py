"""Compares ``protocol="paper"`` with the paper's own evaluation program, in play and in scores.

    python -m benchmarks.checks.paper_agreement --theirs DIR --tasks-file FILE --poses FILE
        [--episodes 300] [--seed 0] [--json FILE]

DIR is the folder ``evaluate`` of a checkout of Embodied-Reasoner; its code is imported from there,
and er-gym contains none of it. Both sides play the same scripted replies on the embedded engine, in
the same process and without pictures; a reply that names nothing in the scene matches no object on
either side, since only a model could choose the closest in meaning. Printed are

- steps: of all steps that theirs took, the share before an episode's first difference. A step is
  its action, object, success, and what could be gone to and interacted with after it;
- scores: the share of episodes in which their program's five metrics of their trajectory are those
  of the ``paper`` scorer of our record, and of a record made of their trajectory;
- differences: in what the first one lies, and after which verb.

An episode that their program does not finish, or cannot score, is counted and left out.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import random
import shutil
import sys
import tempfile
import types
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
from PIL import Image

from benchmarks.harness.output import json_option, progress, write_figures
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import PAPER
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.paper_action_handler import NO_OBJECT
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import play_episode
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.tasks.paper_format import read_poses, read_tasks, with_every_pose
from er_gym.tasks.task import Task
from er_gym.tasks.verbs import PUT, canonical_verb
from er_gym.thor import OBJECT_TYPES, make_controller

METRICS = {
    "success": "success",
    "efficiency": "search_efficiency",
    "completeness": "completeness",
    "completeness_ordered": "ordered_completeness",
    "repeat_rate": "repeat_rate",
}
"""Their names and ours."""
_VERBS = ("navigate to", "pickup", "put", "put in", "toggle", "open", "close")
_NO_ACTIONS = ("dance", "Navigate to Fridge", "pick up Apple", "slice Bread", " observe", "")


def scripted(task: Task, types_there: Sequence[str], draw: random.Random) -> list[str]:
    """Replies for a task: its key actions in order, with some noise among them."""
    noise = draw.choice((0.0, 0.3, 0.6, 0.9))
    replies: list[str] = []
    for key in task.key_actions:
        while draw.random() < noise:
            # Four in a row end an episode.
            replies += [_noise(types_there, draw)] * draw.choice((*[1] * 20, 2, 3, 4))
        verb = draw.choice(("put", "put in")) if key.verb == PUT else key.verb
        if draw.random() < 0.9:
            replies.append(f"{verb} {key.actual_type}".strip())
    return replies


def _noise(types_there: Sequence[str], draw: random.Random) -> str:
    kind = draw.random()
    if kind < 0.25:
        return draw.choice(("observe", "move forward", "move forward", "move forward"))
    if kind < 0.6:
        return f"navigate to {draw.choice(types_there)}"
    if kind < 0.9:
        return f"{draw.choice(_VERBS)} {draw.choice(types_there)}"
    if kind < 0.95:
        return f"{draw.choice(_VERBS)} {draw.choice((*OBJECT_TYPES, 'Narnia'))}"
    return draw.choice(_NO_ACTIONS)


class ScriptedAgent:
    """An agent that gives scripted replies, then ``end``."""

    obs_mode = "text"

    def __init__(self, replies: Sequence[str]) -> None:
        self._replies = iter(replies)

    def reset(self, task: Task, obs: Any, info: Any) -> None:
        """Nothing to do."""

    def act(self, obs: Any, info: Any) -> Decision:
        """The next reply."""
        return Decision(next(self._replies, "end"))


# -- theirs ----------------------------------------------------------------------------------------


class PaperProgram:
    """The paper's program, imported from its folder, with scripted replies instead of a model.

    Args:
        folder: ``evaluate`` of a checkout.
        poses: the pose file that it reads.
    """

    def __init__(self, folder: Path, poses: Path) -> None:
        self._home = tempfile.mkdtemp(prefix="paper-")
        (Path(self._home) / "data").mkdir()
        shutil.copy(poses, Path(self._home) / "data" / "agent_positions.json")
        sys.path.insert(0, str(folder.resolve()))
        sys.modules.setdefault("tiktoken", types.ModuleType("tiktoken"))  # to count words with
        with contextlib.redirect_stdout(io.StringIO()):
            self._run = importlib.import_module("evaluate")
            self._shown = importlib.import_module("show_result")
            words = importlib.import_module("utils")
            agent = importlib.import_module("ai2thor_engine.baseAgent")
        vars(self._run).update(
            MODE="LOCAL", prepare_deploy_messages=lambda inputs: [], local_model=self._reply
        )
        vars(words)["match_item"] = _match
        vars(self._shown)["num_tokens_from_string"] = lambda text, model: 0
        agent.BaseAgent.save_frame = lambda agent, *_, **__: self._picture()
        self._controller = make_controller(
            headless=True, snapToGrid=False, scene="FloorPlan1", visibilityDistance=20,
            gridSize=0.1, width=800, height=450, fieldOfView=90,
        )  # fmt: skip
        self._controller.stop = lambda: None  # their runner stops it after each episode
        reset = self._controller.reset
        # One process has no platform to choose and no picture quality.
        self._controller.reset = lambda scene, platform=None, quality=None, **rest: reset(
            scene, **rest
        )
        self._replies: Iterator[str] = iter(())

    def types_in(self, scene: str) -> list[str]:
        """The object types of a scene."""
        event = self._controller.reset(scene)
        return sorted({entry["objectType"] for entry in event.metadata["objects"]})

    def play(self, task: dict[str, Any], replies: Sequence[str]) -> list[dict[str, Any]] | None:
        """Their trajectory; None if their program does not finish."""
        self._replies = iter(replies)
        here = os.getcwd()
        os.chdir(self._home)  # their program expects its pose file there
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                result = self._run.get_trajectory(self._controller, task, "scripted")
        finally:
            os.chdir(here)
        return result[0] if result else None

    def score(self, task: dict[str, Any], trajectory: list[dict[str, Any]]) -> dict[str, float]:
        """Their program's scores of a trajectory."""
        actions = task["task_metadata"]["actions"]
        keys = [f"{action['action']} {action['objectType']}".strip() for action in actions]
        with contextlib.redirect_stdout(io.StringIO()):
            found = self._shown.metric(task["tasktype"], task["taskname"], trajectory, keys)
        return {ours: found[theirs] for theirs, ours in METRICS.items()}

    def close(self) -> None:
        """Remove the files that it wrote."""
        shutil.rmtree(self._home, ignore_errors=True)

    def _reply(self, messages: Any, port: int) -> str:
        return f"<DecisionMaking>{next(self._replies, 'end')}</DecisionMaking>"

    def _picture(self) -> str:
        path = os.path.join(self._home, "picture.png")
        Image.new("RGB", (8, 8)).save(path)
        return path


def _match(description: str, objects: Sequence[str], *_: Any) -> str | None:
    """The type that a name matches without a model: the type of that name, in any case."""
    if description.startswith(("observe", "move forward")):
        return None
    name = description.split(" ")[-1].lower()
    return next((kind for kind in sorted(set(objects)) if kind.lower() == name), NO_OBJECT)


# -- the comparison --------------------------------------------------------------------------------


@dataclass
class PaperAgreement:
    """The counts.

    Attributes: episodes: that both sides finished; unfinished: that theirs did not. alike: the
        finished ones without any difference. steps, equal: that theirs took, and those before an
        episode's first difference. scored, equal_scores: episodes that their program could score,
        and those with our scores. equal_rescored: those in which our scorer agrees on their own
        trajectory. differences: in what the first one lies, and after which verb.
    """

    episodes: int = 0
    unfinished: int = 0
    alike: int = 0
    steps: int = 0
    equal: int = 0
    scored: int = 0
    equal_scores: int = 0
    equal_rescored: int = 0
    differences: Counter[str] = field(default_factory=Counter)

    def add(self, theirs: list[dict[str, Any]], ours: EpisodeRecord) -> None:
        """Count an episode's steps."""
        self.episodes += 1
        self.steps += len(theirs)
        for number, (one, other) in enumerate(zip(theirs, ours.steps, strict=False)):
            differs = next(_differing(one, other), "")
            if differs:
                self.differences[f"{differs} after {other.verb}"] += 1
                self.equal += number
                return
        self.equal += min(len(theirs), len(ours.steps))
        if len(theirs) != len(ours.steps):
            self.differences["number of steps"] += 1
        else:
            self.alike += 1


def _differing(theirs: dict[str, Any], ours: StepRecord) -> Iterator[str]:
    if canonical_verb(theirs["action"]) != ours.verb:
        yield "action"
    if theirs["action"] not in ("error", "init") and (theirs["object"] or "") != ours.object_type:
        yield "object"
    if bool(theirs["success"]) != ours.success:
        yield "success"
    # Their runner has None or nothing after a failed walk and after the last of four.
    if theirs["legal_objects"] and {*theirs["legal_objects"]} != {*ours.interactable}:
        yield "the interactable objects"
    if theirs["legal_locations"] and {*theirs["legal_locations"]} != {*ours.navigable}:
        yield "the navigable objects"


def as_record(ours: EpisodeRecord, theirs: list[dict[str, Any]]) -> EpisodeRecord:
    """Their trajectory as a record of ours."""
    steps = [
        StepRecord(
            verb=canonical_verb(entry["action"]),
            object_type=entry["object"] or "",
            success=bool(entry["success"]),
            interactable=entry["legal_objects"] or [],
        )
        for entry in theirs
    ]
    return ours.model_copy(update={"steps": steps})


def compare(
    theirs: PaperProgram, records: Sequence[dict[str, Any]], tasks: Sequence[Task], episodes: int,
    seed: int,
) -> PaperAgreement:  # fmt: skip
    """Play and count; ``records``: the same tasks as their file has them."""
    env = EmbodiedEnv((), obs_mode="state", protocol=PAPER.name)
    found, kinds = PaperAgreement(), dict[str, list[str]]()
    for number in progress(range(episodes), "episodes"):
        draw = random.Random(f"{seed}/{number}")
        place = (number * 7919 + seed) % len(tasks)
        task, record = tasks[place], records[place]
        there = kinds.setdefault(task.scene, []) or theirs.types_in(task.scene)
        kinds[task.scene] = there
        replies = scripted(task, there, draw)
        trajectory = theirs.play(record, replies)
        if trajectory is None:
            found.unfinished += 1
            continue
        ours = play_episode(env, ScriptedAgent(replies), task, seed)
        if ours.error:
            raise RuntimeError(f"{task.id}: {ours.error}")
        found.add(trajectory, ours)
        try:
            scores = theirs.score(record, trajectory)
        except (TypeError, ZeroDivisionError):
            continue
        found.scored += 1
        found.equal_scores += _scores(ours) == scores
        found.equal_rescored += _scores(as_record(ours, trajectory)) == scores
    env.close()
    return found


def _scores(episode: EpisodeRecord) -> dict[str, float]:
    scored = score_episode(episode, PAPER)
    return {name: getattr(scored, name) for name in METRICS.values()}


_file = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.command()
@click.option(
    "--theirs", required=True, type=click.Path(exists=True, file_okay=False, path_type=Path)
)
@click.option("--tasks-file", required=True, type=_file)
@click.option("--poses", required=True, type=_file)
@click.option("--episodes", default=300, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=0, show_default=True)
@json_option
def main(
    theirs: Path, tasks_file: Path, poses: Path, episodes: int, seed: int, file: Path | None
) -> None:
    """Compare, and print the results."""
    records = json.loads(tasks_file.read_text(encoding="utf-8"))
    tasks = with_every_pose(read_tasks(tasks_file), read_poses(poses))
    program = PaperProgram(theirs, poses)
    try:
        found = compare(program, records, tasks, episodes, seed)
    finally:
        program.close()
    steps = f"{found.equal} of {found.steps} ({found.equal / max(1, found.steps):.1%})"
    print(f"episodes: {found.episodes}, {found.unfinished} more that theirs did not finish")
    print(f"steps equal before the first difference: {steps}; {found.alike} episodes all alike")
    print(f"scores equal: {found.equal_scores} of {found.scored}")
    print(f"our scorer on their trajectories: {found.equal_rescored} of {found.scored}")
    for kind, count in found.differences.most_common():
        print(f"  {count:4} {kind}")
    write_figures(file, vars(found))


if __name__ == "__main__":
    main()
