"""Measures the environment steps per second inside the PPO loop, and where the time goes.


    python -m benchmarks.perf.training [--config single_search --steps 200000]

The same run also measures PPO of Stable-Baselines3 on MiniGrid, with as many environments, the same
rollouts and updates, and its default network.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import click
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecMonitor

from agents.rl.callbacks import TorchThreads
from agents.rl.config import PPO, TrainConfig, config_file, load_config
from agents.rl.ppo import make
from agents.rl.train import make_vec_env, training_speedups


@dataclass
class Clock:
    """Adds up seconds by name."""

    spent: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        began = time.perf_counter()
        yield
        self.spent[name] += time.perf_counter() - began

    def around(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            with self(name):
                return call(*args, **kwargs)

        return timed


class Rates(BaseCallback):
    """Steps a second over each tenth of a run."""

    def __init__(self, total: int) -> None:
        super().__init__()
        self._part = total // 10
        self.rates: list[float] = []

    def _on_training_start(self) -> None:
        self._since, self._steps = time.perf_counter(), self.num_timesteps

    def _on_rollout_start(self) -> None:
        made = self.num_timesteps - self._steps
        if made >= self._part:
            now = time.perf_counter()
            self.rates.append(made / (now - self._since))
            self._since, self._steps = now, self.num_timesteps

    def _on_step(self) -> bool:
        return True


def measure(model: OnPolicyAlgorithm, env: VecEnv, steps: int, threads: int) -> tuple[Clock, Rates]:
    """Learn for some steps; returns the time of each part, and the rate of each tenth."""
    clock, rates = Clock(), Rates(steps)
    env.step = clock.around("environments", env.step)  # type: ignore[method-assign]
    choose = clock.around("choosing actions", model.policy.forward)
    model.policy.forward = choose  # type: ignore[method-assign]
    model.train = clock.around("learning", model.train)  # type: ignore[method-assign]
    with clock("all"):
        model.learn(steps, callback=CallbackList([rates, TorchThreads(threads)]))
    return clock, rates


def ours(config: TrainConfig, steps: int) -> tuple[Clock, Rates]:
    """MaskablePPO on an er-gym configuration."""
    assert isinstance(config.algorithm, PPO), config.algorithm.name
    env = make_vec_env(config, config.env, config.seed)
    try:
        return measure(make(config, config.algorithm, env), env, steps, config.threads)
    finally:
        env.close()


def minigrid(config: TrainConfig, steps: int) -> tuple[Clock, Rates]:
    """PPO on MiniGrid-DoorKey-8x8-v0, in one process, as fast as it goes."""
    import gymnasium
    import minigrid  # noqa: F401  (registers the environments)
    from minigrid.wrappers import FlatObsWrapper
    from stable_baselines3 import PPO as PlainPPO

    def one() -> Any:
        return FlatObsWrapper(gymnasium.make("MiniGrid-DoorKey-8x8-v0"))

    env = VecMonitor(DummyVecEnv([one] * config.vec.envs))
    settings = config.algorithm.model_dump(include={"n_steps", "batch_size", "n_epochs"})
    try:
        return measure(
            PlainPPO("MlpPolicy", env, device="cpu", **settings), env, steps, config.threads
        )
    finally:
        env.close()


def show(name: str, clock: Clock, rates: Rates, steps: int) -> None:
    spent = dict(clock.spent)
    whole = spent.pop("all")
    spent["the rest"] = whole - sum(spent.values())
    click.echo(f"{name}: {steps / whole:,.0f} steps/s; by tenths of the run:")
    click.echo("  " + ", ".join(f"{rate:,.0f}" for rate in rates.rates))
    for part, seconds in sorted(spent.items(), key=lambda item: -item[1]):
        click.echo(
            f"  {part:18} {100 * seconds / whole:5.1f} %  {1e6 * seconds / steps:6.0f} µs a step"
        )


@click.command()
@click.option("--config", default="single_search", show_default=True)
@click.option("--steps", default=200_000, show_default=True)
@click.option("--peer-steps", default=50_000, show_default=True)
@click.option("--set", "overrides", multiple=True, metavar="NAME=VALUE")
def main(config: str, steps: int, peer_steps: int, overrides: tuple[str, ...]) -> None:
    """Measure, and print."""
    asked = load_config(config_file(config), overrides)
    if not isinstance(asked.algorithm, PPO):
        raise click.BadParameter(
            f"{config} uses {asked.algorithm.name}; give a configuration of ppo"
        )
    with training_speedups():
        show(config, *ours(asked, steps), steps)
        show("PPO on MiniGrid", *minigrid(asked, peer_steps), peer_steps)


if __name__ == "__main__":
    main()
