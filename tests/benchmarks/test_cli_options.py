"""Options that a command takes as one argument, and what the commands say of errors."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import click
import pytest
from click.testing import CliRunner

from benchmarks.cli.errors import INTERRUPTED, STOPPED, BadInput, entered, exit_code_of, needing
from benchmarks.cli.executor import ExecutorOptions
from benchmarks.cli.options import OptionGroup, option, seed_option, shared_option, with_options
from benchmarks.cli.vlm_options import VLMOptions
from er_gym.rollout.agent import CannotGoOn

taken: dict[str, Any] = {}


@dataclass(frozen=True)
class Wishes(OptionGroup):
    most_dollars: float | None = option(type=float, help="So much.")
    names: tuple[str, ...] = option("--name", multiple=True)
    quick: bool = option(is_flag=True)
    seed: int = shared_option(seed_option)


@click.command()
@click.option("--before")
@with_options(wishes=Wishes, vlm_options=VLMOptions)
@click.option("--after")
def command(**given: Any) -> None:
    """Take."""
    taken.update(given)


def call(*arguments: str) -> Wishes:
    result = CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found = taken["wishes"]
    assert isinstance(found, Wishes)
    return found


def test_a_command_gets_a_group_of_options_as_one_argument() -> None:
    assert call("--most-dollars", "0", "--name", "a", "--name", "b", "--quick", "--seed", "3") == (
        Wishes(0.0, ("a", "b"), True, 3)
    )
    assert taken["vlm_options"] == VLMOptions()
    assert set(taken) == {"before", "wishes", "vlm_options", "after"}


def test_a_group_says_which_options_were_given() -> None:
    assert call("--seed", "3").given == ["--seed"]
    assert Wishes().given == []
    assert Wishes(most_dollars=0.0, names=("a",), quick=True).given == [
        "--most-dollars",
        "--name",
        "--quick",
    ]
    assert VLMOptions(overrides=("a=b",), max_tokens=0).given == ["--set", "--max-tokens"]


def test_the_options_keep_the_order_of_the_fields() -> None:
    names = [option.name for option in command.params]
    assert names[:6] == ["before", "most_dollars", "names", "quick", "seed", "agent_config"]
    assert names[-2:] == ["max_minutes", "after"]


def test_options_of_a_cluster_go_on_to_other_commands() -> None:
    on_ray = ExecutorOptions(workers=3, executor="ray", ray_address="auto", shared_dir=True)
    assert on_ray.arguments() == [
        *("--executor", "ray"), *("--ray-address", "auto"), "--shared-dir",
    ]  # fmt: skip
    assert ExecutorOptions(workers=3).arguments() == []
    for wrong, told in (
        ({"worker_cpus": 0.0}, "--worker-cpus is for --executor ray"),
        ({"executor": "ray", "shared_dir": True}, "--shared-dir is for --ray-address"),
    ):
        with pytest.raises(BadInput, match=told):
            ExecutorOptions(**wrong)  # type: ignore[arg-type]


def test_a_missing_package_is_named_with_what_brings_it() -> None:
    told = "^juggling needs no_such_package, which is not installed: pip install 'er-gym\\[x\\]'$"
    with pytest.raises(BadInput, match=told), needing("juggling", "er-gym[x]"):
        importlib.import_module("no_such_package")


def test_a_module_of_our_own_is_no_package_to_install() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"er_gym\.no_such_module"), needing("x", "y"):
        importlib.import_module("er_gym.no_such_module")


def test_only_the_beginning_of_a_context_is_bad_input() -> None:
    ended = []

    @contextmanager
    def context(problem: str) -> Iterator[str]:
        if problem:
            raise ValueError(problem)
        try:
            yield "value"
        finally:
            ended.append(True)

    with pytest.raises(BadInput, match="cannot begin"), entered(lambda: context("cannot begin")):
        pass
    with pytest.raises(ValueError, match="later"), entered(lambda: context("")) as value:
        raise ValueError(f"{value}, later")
    assert ended == [True]


def test_why_a_command_ended_early_decides_its_exit_code() -> None:
    assert exit_code_of(KeyboardInterrupt()) == ("interrupted", INTERRUPTED)
    assert exit_code_of(CannotGoOn("no money")) == ("no money", STOPPED)
