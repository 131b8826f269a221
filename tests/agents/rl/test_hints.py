"""Hints: what would have shown a thing, against forks of the episode; and the loss by hand."""

from __future__ import annotations

from math import exp, log
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from pydantic import ValidationError
from untrained_policy import write_untrained_run

from agents.rl.anchored import surprise
from agents.rl.callbacks import read_curve
from agents.rl.config import EnvConfig
from agents.rl.envs import make_env
from agents.rl.guidance import Hints
from agents.rl.hints import SHOWS, HintFinder
from agents.rl.subtask_memory import SubtaskMemory
from agents.rl.train import train
from er_gym.envs.actions import ACTIONS
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES

OPTIONS = EnvConfig(
    episodes="mini", types=("single_pickup_from_closerep",), subtasks=True, faults=0.1
)
LOOKS = {verbs.NAVIGATE, verbs.OPEN, verbs.CLOSE, verbs.OBSERVE, verbs.MOVE_FORWARD}


def test_the_actions_are_those_that_show_the_thing() -> None:
    plain: Any = make_env(OPTIONS)
    hinted: Any = make_env(OPTIONS, hints=Hints(after=2, share=1.0))
    random = np.random.default_rng(0)
    told = checked = 0
    for env in (plain, hinted):
        env.reset(seed=6)
    for _ in range(6):
        plain.reset()
        _, info = hinted.reset()
        for _ in range(8):
            mask = hinted.action_masks()
            legal = plain.action_masks()
            assert np.array_equal(mask > 0, legal > 0)
            assert np.array_equal(info["action_mask"], mask)
            memory = plain.policy_observation.subtasks
            thing = KIND_OF[memory.progress.at().sought] if memory.progress.at() else None
            if memory.since >= 2 and thing is not None and not seen(thing, info):
                for action in np.flatnonzero(legal).tolist():
                    [fork] = plain.unwrapped.fork(1)
                    shows = ACTIONS[action].verb in LOOKS and seen(thing, fork.step(action)[4])
                    assert mask[action] == (SHOWS if shows else 1)
                    told += shows
                    checked += 1
            else:
                assert mask.max() == 1
            action = int(random.choice([n for n in np.flatnonzero(legal) if n > 2]))
            outcomes = [env.step(action) for env in (plain, hinted)]
            # The trying has changed nothing.
            assert np.array_equal(outcomes[0][0]["state"], outcomes[1][0]["state"])
            assert outcomes[0][1] == outcomes[1][1]
            info = outcomes[1][4]
            if outcomes[0][2] or outcomes[0][3]:
                break
    assert checked > 150
    assert told > 2
    plain.close()
    hinted.close()


def seen(kind: int, info: Any) -> bool:
    return bool(info["navigable_mask"][kind] or info["interactable_mask"][kind])


def test_in_which_states_it_is_tried() -> None:
    finder = HintFinder(Hints(after=3, share=0.5), SimpleNamespace())  # type: ignore[arg-type]
    memory = SubtaskMemory("Put the Mug in the Microwave.")
    nothing = np.zeros(len(TYPES), np.int8)
    info = {"navigable_mask": nothing, "interactable_mask": nothing, "end_reason": ""}
    memory.since = 3
    assert finder.wanted(memory, info, 0.4) == KIND_OF["Mug"]
    assert finder.wanted(memory, info, 0.5) is None
    assert finder.wanted(memory, info | {"end_reason": "step limit"}, 0.4) is None
    mugs = nothing.copy()
    mugs[KIND_OF["Mug"]] = 1
    for mask in ("navigable_mask", "interactable_mask"):
        assert finder.wanted(memory, info | {mask: mugs}, 0.4) is None
    memory.since = 2
    assert finder.wanted(memory, info, 0.4) is None
    memory.since, memory.progress.number = 3, 1  # it holds the mug, and looks for the microwave
    assert finder.wanted(memory, info | {"navigable_mask": mugs}, 0.4) == KIND_OF["Microwave"]
    memory.progress.number = 2
    assert finder.wanted(memory, info, 0.4) is None


def test_the_loss_is_that_of_the_actions_that_show_it() -> None:
    logits = torch.tensor([[0.0, 1.0, 2.0, 3.0]] * 3, requires_grad=True)
    told = torch.tensor([[1, SHOWS, 0, SHOWS], [1, 1, 1, 1], [0, SHOWS, 0, 0]])
    missed = surprise(logits, told)
    rate = (exp(1) + exp(3)) / (1 + exp(1) + exp(3))
    assert missed.tolist() == pytest.approx([-log(rate), 0.0, 0.0], abs=1e-6)
    missed.sum().backward()
    assert logits.grad is not None
    assert logits.grad[0, 0] > 0 > logits.grad[0, 1]  # away from what does not show it
    assert logits.grad[0, 2] == 0
    assert logits.grad[1:].abs().max() < 1e-6


def test_hints_are_for_a_policy_that_searches(make_config: Any) -> None:
    with pytest.raises(ValidationError, match="give start, too"):
        make_config(env={"subtasks": True}, hints={"weight": 1.0})
    with pytest.raises(ValidationError, match=r"give env\.subtasks=true, too"):
        make_config(hints={"weight": 1.0}, start={"policy": "zoo:all"})


def test_hints_come_with_the_rollout_and_count_in_the_loss(
    make_config: Any, tmp_path: Path
) -> None:
    env = OPTIONS.model_copy(update={"faults": 0.0, "ends_when_done": True}).model_dump()
    write_untrained_run(make_config(env=env), tmp_path / "start")
    config = make_config(
        env=env,
        start={"policy": str(tmp_path / "start"), "value_steps": 0, "kl": 0.0},
        long_searches={"share": 0.5, "after": 3},
        hints={"weight": 5.0, "after": 2, "share": 1.0},
        algorithm={"name": "ppo", "n_steps": 32, "batch_size": 128},
        total_steps=256,
    )
    model: Any = train(config, tmp_path / "run")
    [row] = [row for row in read_curve(tmp_path / "run") if "train/hints" in row]
    assert row["train/hints"] > 0.02
    assert row["train/hint_loss"] > 0
    [batch] = model.rollout_buffer.get()
    losses = []
    for weight in (0.0, 5.0):
        model._hints = Hints(weight=weight)
        loss, figures = model._loss(0.2, 0.0, batch)
        losses.append(loss.item())
    told = (batch.action_masks == SHOWS).any(dim=1)
    assert figures["hints"] == pytest.approx(told.float().mean().item())
    assert figures["hint_loss"] > 0
    more = 5.0 * figures["hints"] * figures["hint_loss"]
    assert losses[1] - losses[0] == pytest.approx(more, rel=1e-4)
