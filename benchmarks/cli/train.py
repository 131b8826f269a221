"""``er-gym train-rl``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from benchmarks.cli.errors import INTERRUPTED, bad_input, needing, print_problem
from benchmarks.cli.options import FOLDER, MOST_SEED, overrides_option
from benchmarks.terminal import echo


@click.command(name="train-rl")
@click.option(
    "--config",
    required=True,
    metavar="FILE",
    help="The training run: a YAML file, or the name of one that comes with er-gym.",
)
@overrides_option("total_steps=20000 or env.types=[single_search]")
@click.option(
    "--reward",
    metavar="NAME",
    help="A wrapper that changes the reward in training: package.module:Name, or an entry point.  "
    "[default: the configuration's]",
)
@click.option("--seed", type=click.IntRange(0, MOST_SEED), help="[default: the configuration's]")
@click.option("--out", type=FOLDER, help="The run directory.  [default: runs/rl/CONFIG-SEED]")
def train_rl(
    config: str,
    overrides: tuple[str, ...],
    reward: str | None,
    seed: int | None,
    out: Path | None,
) -> int:
    """Train a policy by reinforcement learning; needs the extra rl.

    The same command again continues from the last checkpoint. `er-gym bench --agent rl:RUN` plays a
    suite with the trained policy.
    """
    from agents.rl.config import config_file, load_config
    from er_gym.activity import begin_import

    with bad_input():
        file = config_file(config)
        chosen = () if reward is None else (f"env.reward={reward}",)
        more = {} if seed is None else {"seed": seed}
        wanted = load_config(file, (*overrides, *chosen), more)
    run = out or Path("runs") / "rl" / f"{file.stem}-{wanted.seed}"
    begin_import("PyTorch and Stable-Baselines3", "torch", "stable_baselines3", "sb3_contrib")
    with needing("training", "er-gym[rl]"):
        from agents.rl import train as training
    try:
        with bad_input():
            model = training.train(wanted, run, show_progress=True)
    except (RuntimeError, EOFError, MemoryError) as error:
        raise click.ClickException(f"{error}; what has been learnt is in {run}") from error
    except KeyboardInterrupt:
        kept = run.exists()
        left = f"what has been learnt is in {run}, the same command continues" if kept else ""
        print_problem(
            f"interrupted; {left or 'nothing had been learnt, and nothing is left behind'}"
        )
        return INTERRUPTED
    _say_result(run, model, wanted.env.types)
    return 0


def _say_result(run: Path, model: Any, types: Sequence[str]) -> None:
    from agents.rl.callbacks import read_curve

    echo(f"{model.num_timesteps:,} steps: {run}")
    looked = [line for line in read_curve(run) if "eval/success_rate" in line]
    if looked:
        rate = looked[-1]["eval/success_rate"]
        echo(f"success on the episodes of evaluation: {100 * rate:.1f} %")
    learnt = f"--types {shlex.quote(','.join(types))} " if types else ""
    echo(f"er-gym bench --suite mini {learnt}--instances explore --agent rl:{run}")
