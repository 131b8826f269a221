"""Starts a training run from its configuration, or continues it from its last checkpoint.

A run directory holds ``config.yaml`` (the whole configuration), ``model.npz`` (the last checkpoint,
always complete, see :mod:`agents.rl.model_file`), ``curve.jsonl`` (the logged values with steps and
seconds) and ``tensorboard/``. Running the same command again continues the run; once all steps are
done, it does nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from sb3_contrib import MaskablePPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList, ProgressBarCallback
from stable_baselines3.common.logger import KVWriter, Logger
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv, VecMonitor
from torch.distributions import Distribution

from agents.configs import dump
from agents.rl import dqn, ppo
from agents.rl.anchored import AnchoredPPO, starting_network
from agents.rl.callbacks import (
    CURVE,
    Checkpoints,
    Curriculum,
    CurveWriter,
    HeldOutEvaluation,
    SuccessByType,
    TensorBoardWriter,
    TorchThreads,
    TrackerWriter,
    evaluated_at,
    read_curve,
)
from agents.rl.config import EnvConfig, Evaluation, TrainConfig, load_config
from agents.rl.envs import evaluation_config, make_env
from agents.rl.model_file import placeholder_env, restore, restore_logged_values, save
from agents.rl.near_goal import check_tasks
from agents.rl.near_goal_callback import NearGoalCurriculum
from agents.rl.policy_file import CONFIG, LEARNERS, MODEL
from agents.rl.policy_observation import PolicyObservation
from agents.rl.vec_env import WorkerVecEnv
from agents.rl.warm_start import WARM_START, warm_start
from er_gym.activity import begin
from er_gym.envs.actions import ACTIONS
from er_gym.resumable import FolderKind
from er_gym.writing import YAML_MARK, write_atomic

TENSORBOARD = "tensorboard"
_EVALUATION_SEED = 10_000
"""All evaluations of all runs use the same episodes."""


ALGORITHMS: Mapping[str, Callable[..., BaseAlgorithm]] = {
    "ppo": ppo.make,
    "dqn": dqn.make,
    "qrdqn": dqn.make,
}
"""Makes the learner of an algorithm from the configuration, that of the algorithm and the
environments."""


TRAINING = FolderKind(
    noun="run",
    command="er-gym train-rl",
    manifest=CONFIG,
    model=TrainConfig,
    parts=(CURVE, WARM_START, TENSORBOARD, MODEL),
    holds_something=lambda run: (run / MODEL).exists(),
    shared=True,
    compared=lambda there, here: (_compared(there), _compared(here)),
    load=load_config,
    text=lambda config: YAML_MARK + dump(config),
)


def _compared(config: TrainConfig) -> dict[str, Any]:
    """All but the number of steps, which may grow."""
    return config.model_dump(mode="json", exclude={"total_steps"})


def train(
    config: TrainConfig,
    run: Path,
    *,
    show_progress: bool = False,
    more: tuple[BaseCallback, ...] = (),
) -> BaseAlgorithm:
    """Train until ``config.total_steps`` steps are done, and return the learner.

    Args:
        config: the configuration of the run.
        run: the run directory.
        show_progress: whether to show a progress bar.
        more: additional callbacks.

    Raises:
        FolderConflict: the directory holds a run of another configuration.
        Locked: another process trains in the directory.
        KeyboardInterrupt: Ctrl-C; the learner is saved first.
    """
    with TRAINING.locked(run, config):
        write_atomic(run / CONFIG, TRAINING.text(config))  # with the number of steps of now
        return _train(config, run, show_progress, more)


def _train(
    config: TrainConfig,
    run: Path,
    show_progress: bool,
    more: tuple[BaseCallback, ...],
) -> BaseAlgorithm:
    begin("reading the last checkpoint")
    model = load_last_checkpoint(run)
    steps = 0 if model is None else model.num_timesteps
    before = evaluated_at(run, steps)
    evaluated = config.evaluation is None or before >= steps  # else it was killed meanwhile
    if model is not None and steps >= config.total_steps and evaluated:
        return model
    start = None
    if config.start is not None and model is None:
        begin(f"reading {config.start.policy}")
        start = starting_network(config, config.start)
    if config.near_goal is not None:
        check_tasks(config)
    make_learner = ALGORITHMS[config.algorithm.name]
    # A continued run plays different episodes than at its start.
    seed = int(np.random.SeedSequence([config.seed, steps]).generate_state(1)[0])
    begin(f"starting {config.vec.envs} environments in {config.vec.workers} workers")
    near = 0.0 if config.near_goal is None else config.near_goal.share
    env = make_vec_env(config, config.env, seed, near)
    checkpoints = Checkpoints(run, config.checkpoint_every)
    callbacks = [checkpoints, TorchThreads(config.threads), SuccessByType(), *more]
    held_out = None
    try:
        if config.evaluation is not None:
            begin("starting the environments of evaluation")
            held_out = _held_out(config, config.evaluation, before)
            callbacks.append(held_out)
        if config.curriculum:
            curriculum = Curriculum(config.curriculum, config.env.types)
            curriculum.set_types(env, steps)
            callbacks.append(curriculum)
        if config.near_goal is not None:
            near_goal = NearGoalCurriculum(config.near_goal)
            near_goal.begin(env, model)
            callbacks.append(near_goal)
        if show_progress:
            callbacks.append(ProgressBarCallback())
        begin("making the network")
        # Its clock runs during the warm start, too.
        logger = _logger(config, run, None if model is None else steps)
        if model is None:
            model = make_learner(config, config.algorithm, env)
            if config.warm_start is not None:
                assert isinstance(model, MaskablePPO)  # as the configuration has checked
                begin(f"cloning {config.warm_start.teacher}")
                with training_speedups():
                    warm_start(model, config, config.warm_start, run, seed, show_progress)
                logger.dump(0)  # a line with its duration
                save(model, run)
            if start is not None:
                assert isinstance(model, AnchoredPPO)  # as the configuration has checked
                model.begin_from(start)
            env.seed(seed)
        else:
            model.set_env(env)
            set_random_seed(seed)
        model.set_logger(logger)
        if (run / MODEL).exists():
            restore_logged_values(run / MODEL, model)
        begin("loading the rooms")
        try:
            with training_speedups():
                model.learn(
                    max(config.total_steps - steps, 0),
                    callback=CallbackList(callbacks),
                    reset_num_timesteps=False,
                )
        finally:
            if checkpoints.steps:
                checkpoints.save()
        if held_out is not None:
            begin("evaluating")
            held_out.evaluate()
        model.logger.close()
    finally:
        begin("ending the workers")
        env.close()
        if held_out is not None:
            held_out.eval_env.close()
    return model


@contextmanager
def training_speedups() -> Iterator[None]:
    """Flush denormal numbers to 0 and skip the validation of distributions within the context."""
    # Adam's moments of weights without gradient, such as those of types in no training room, decay
    # to denormal numbers, which makes every operation a hundred times slower.
    torch.set_flush_denormal(True)
    Distribution.set_default_validate_args(False)
    try:
        yield
    finally:
        torch.set_flush_denormal(False)
        Distribution.set_default_validate_args(__debug__)


def _held_out(config: TrainConfig, asked: Evaluation, before: int) -> HeldOutEvaluation:
    env = make_vec_env(config, evaluation_config(config.env, asked.episodes), _EVALUATION_SEED)
    return HeldOutEvaluation(env, asked.every, asked.count, _EVALUATION_SEED, before)


def load_last_checkpoint(run: Path) -> BaseAlgorithm | None:
    """Load the learner of a run's last checkpoint, None if there is none yet.

    Raises:
        ValueError: the file cannot be read or belongs to another learner.
    """
    if not (run / MODEL).exists():
        return None
    config = load_config(run / CONFIG)
    make_learner = ALGORITHMS[config.algorithm.name]
    space = PolicyObservation(config.env, LEARNERS[config.algorithm.name].needs_mask).space
    env = placeholder_env(space, len(ACTIONS), config.vec.envs)
    model = make_learner(config, config.algorithm, env)
    restore(run / MODEL, model)
    return model


def make_vec_env(config: TrainConfig, options: EnvConfig, seed: int, near: float = 0.0) -> VecEnv:
    """Make ``config.vec.envs`` environments in worker processes with consecutive seeds.

    Each process plays in its share of the rooms, and starts the share ``near`` of its episodes near
    their goals.
    """
    needs_mask = LEARNERS[config.algorithm.name].needs_mask
    make = partial(make_env, options, config.algorithm.gamma, needs_mask, near=near)
    env = VecMonitor(WorkerVecEnv([make] * config.vec.envs, config.vec.workers))
    env.seed(seed)
    return env


def _logger(config: TrainConfig, run: Path, steps: int | None) -> Logger:
    """What is logged, rewound to the checkpoint of ``steps`` from which the run goes on."""
    writers: list[KVWriter] = [CurveWriter(run, steps)]
    if config.tensorboard:
        writers.append(TensorBoardWriter(run / TENSORBOARD, steps))
    if config.wandb:
        writers.append(_wandb_writer(config, run))
    return Logger(str(run), writers)


def _wandb_writer(config: TrainConfig, run: Path) -> TrackerWriter:
    """Start Weights & Biases; ``curve.jsonl`` has been rewound to the checkpoint."""
    try:
        import wandb
    except ImportError:
        raise ValueError(
            "wandb is not installed; pip install wandb, or leave 'wandb' empty in the configuration"
        ) from None
    started = wandb.init(
        project=config.wandb,
        name=run.name,
        id=run.name,
        resume="allow",
        dir=run,
        config=config.model_dump(mode="json"),
    )

    def send(values: dict[str, float], steps: int) -> None:
        started.log(values, step=steps)

    return TrackerWriter(send, started.step, read_curve(run))
