"""``er-gym replay``: play an episode again up to a step, and go on from there in another way."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import FILE, force_option
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.rollout.records import EpisodeRecord


@click.command()
@click.argument("episode", type=FILE)
@click.option(
    "--step",
    type=click.IntRange(min=0),
    help="Stop after this step; 0 is the placing of the agent.  [default: the last]",
)
@click.option(
    "--then",
    "actions",
    multiple=True,
    metavar="ACTION",
    help='Then do this, such as "open Fridge"; may be repeated.',
)
@click.option("--picture", type=FILE, help="Write what the agent sees at the end to this file.")
@click.option(
    "--snapshot", type=FILE, help="Write the episode at the end to this file, for env.restore."
)
@force_option
def replay(
    episode: Path, step: int | None, actions: tuple[str, ...], picture: Path | None,
    snapshot: Path | None, force: bool,
) -> None:  # fmt: skip
    """Play an episode of a run again, and try something else.

    EPISODE is a file in the folder episodes of a run directory. Its actions are repeated up to a
    step, and what is asked for with --then is done in place of the rest.
    """
    import numpy as np

    from benchmarks.monitor.world import CannotReplay, environment_of, task_of
    from er_gym.rollout.run_directory import EPISODES, RunDirectory
    from er_gym.writing import check_output, write_output, write_picture

    if episode.parent.name != EPISODES:
        raise BadInput(f"{episode}: give a file in the folder {EPISODES} of a run directory")
    with bad_input():
        run = RunDirectory.open(episode.parent.parent)
    try:
        record = run.episode_in(episode.name)
    except ValueError as error:
        raise BadInput(f"{episode}: {error}") from None
    last = sum(not one.appended for one in record.steps) - 1
    if step is not None and step > last:
        raise BadInput(f"--step {step}: the episode has the steps 0 to {last}")
    with bad_input():
        for file in (picture, snapshot):
            if file is not None:
                check_output(file, force=force)
    try:
        task, env = task_of(run.manifest, record), environment_of(run.manifest)
    except CannotReplay as error:
        raise BadInput(f"{episode} cannot be played again: {error}") from None
    obs, info = env.reset(seed=record.seed, options={"task": task})
    echo(f"{record.task_id}: {task.instruction}")
    obs, info = _repeat(env, record, last if step is None else step, obs, info)
    for action in actions:
        if info["end_reason"]:
            echo(f"The episode is over ({info['end_reason']}), so {action!r} is not done.")
            break
        obs, reward, _, _, info = env.step(action)
        echo(f"then: {action}: {info['feedback']} Reward {reward:g}.")
    echo(f"\n{obs['text']}")
    if info["end_reason"]:
        echo(f"success: {'yes' if info['success'] else 'no'} ({info['end_reason']})")
    with bad_input():
        if picture is not None:
            from PIL import Image

            write_picture(picture, Image.fromarray(np.asarray(env.render())), force=force)
        if snapshot is not None:
            write_output(snapshot, env.snapshot(), force=force)
    env.close()


def _repeat(
    env: EmbodiedEnv, record: EpisodeRecord, step: int, obs: Any, info: Any
) -> tuple[Any, Any]:
    """Repeat the actions of a record up to a step; the last observation and ``info``.

    Raises:
        BadInput: a step comes out otherwise than it is recorded.
    """
    from benchmarks.monitor.world import action_in

    for number, one in enumerate(record.steps[1 : step + 1], 1):
        try:
            obs, _, _, _, info = env.step(action_in(one.verb, one.object_type))
        except ValueError as error:
            raise BadInput(
                f"step {number} of {record.task_id} cannot be repeated: {error}"
            ) from None
        said = one.text or f"{one.verb} {one.object_type}".rstrip()
        echo(f"{number}: {said}: {info['feedback']}")
        if bool(info["action_success"]) != one.success:
            raise BadInput(
                f"step {number} of {record.task_id} comes out otherwise than it is recorded: it "
                f"was {'done' if one.success else 'not done'}"
            )
    return obs, info
