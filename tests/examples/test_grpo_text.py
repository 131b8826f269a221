"""The bridge to TRL: rollouts of a language model are played in real environments."""

from __future__ import annotations

import functools
import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from er_gym import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

SEARCH = "FloorPlan319-single_search-CellPhone"
GOOD, BAD = "navigate to Dresser", "observe"
"""Two first actions in it, after which "end" earns all of its reward, and nothing."""


@pytest.fixture(scope="module")
def example(repository: Path) -> ModuleType:
    pytest.importorskip("trl", reason="needs pip install 'er-gym[trl]'")
    file = repository / "examples" / "grpo_text.py"
    spec = importlib.util.spec_from_file_location("grpo_text", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def a_task(task_id: str) -> Task:
    return next(task for task in load_suite("mini").tasks if task.id == task_id)


def replay(task_id: str, actions: list[str]) -> tuple[list[str], float]:
    """What the environment by itself says to actions, the first observation first; the reward."""
    env = EmbodiedEnv("mini", obs_mode="text", instances="explore")
    observation, _ = env.reset(options={"task": task_id})
    texts, total, done = [observation["text"]], 0.0, False
    for action in actions:
        if done:
            texts.append("The episode is over.")
            continue
        observation, reward, terminated, truncated, _ = env.step(action)
        total += reward
        done = terminated or truncated
        texts.append(observation["text"] + ("\nThe episode is over." if done else ""))
    return texts, total


@pytest.mark.parametrize("kind", ["single_toggle", "ordered_pickup_two_object_and_put"])
def test_what_the_oracle_does_in_a_room_earns_what_it_earns_in_the_environment(
    example: ModuleType, kind: str
) -> None:
    task = next(task for task in load_suite("mini").tasks if task.type.name == kind)
    room = example.Room()
    env = EmbodiedEnv("mini", obs_mode="text", instances="explore")
    _, info = env.reset(options={"task": task})
    solver, done, actions = Solver(), False, []
    while not done:
        actions.append(str(solver.next(with_details(env, info))[0]))
        *_, terminated, truncated, info = env.step(actions[-1])
        done = terminated or truncated
    assert info["success"]

    for _ in range(2):  # TRL uses a room again
        texts = [room.reset(prompt="is not read", task_id=task.id)]
        assert (room.reward, room.done) == (0.0, False)
        texts += [room.act(action) for action in actions]
        assert (texts, room.reward) == replay(task.id, actions)
        assert room.done
        assert example.episode_reward([room], prompts=[], completions=[]) == [
            sum(key.reward for key in task.key_actions)
        ]


def test_a_room_answers_whatever_a_model_writes(example: ModuleType) -> None:
    room = example.Room()
    room.reset(task_id=SEARCH)
    assert "'open sesame' names no action" in room.act("open sesame")
    assert "'0' names no action" in room.act(0)  # and does not do the first of all actions
    assert room.act(["end"]).endswith("\nThe episode is over.")  # the third: it is cut off
    assert room.act(GOOD) == "The episode is over."
    assert room.reward == 0.0


def called(actions: list[str], answers: list[str]) -> list[dict[str, Any]]:
    """The messages of an assistant that does some actions, with the room's answers."""
    messages: list[dict[str, Any]] = []
    for action, answer in zip(actions, answers, strict=True):
        function = {"name": "act", "arguments": {"action": action}}
        call = {"type": "function", "function": function}
        messages.append({"role": "assistant", "content": "", "tool_calls": [call]})
        messages.append({"role": "tool", "name": "act", "content": answer})
    return [*messages, {"role": "assistant", "content": "Done."}]


class Taught:
    """A tiny model fitted to two transcripts, which part at the first action.

    It is kept in a folder, as one would be given a real one.
    """

    def __init__(self, example: ModuleType, folder: Path) -> None:
        import torch
        from trl.chat_template_utils import get_training_chat_template

        transcripts = []
        for actions in ([GOOD, "end"], [BAD, "end"]):
            (first, *answers), _ = replay(SEARCH, actions)
            prompt = {"role": "user", "content": example.PROMPT + first}
            transcripts.append([prompt, *called(actions, answers)])
        template = {
            "tools": [example.Room().act],
            "chat_template": get_training_chat_template(example.tiny_tokenizer([])),
        }
        texts = example.tiny_tokenizer([]).apply_chat_template(
            transcripts, tokenize=False, **template
        )
        tokenizer = example.tiny_tokenizer(texts)  # of whole words: short transcripts
        self.batch = tokenizer.apply_chat_template(
            transcripts,
            return_tensors="pt",
            return_dict=True,
            return_assistant_tokens_mask=True,
            padding=True,
            padding_side="right",
            **template,
        )
        torch.manual_seed(0)
        model = example.tiny_model(tokenizer)
        optimizer = torch.optim.Adam(model.parameters())
        schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 1e-2, 130, pct_start=0.1)
        for _ in range(130):
            optimizer.zero_grad()
            (-self.log_likelihood(model).mean() / 100).backward()
            torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimizer.step()
            schedule.step()
        assert self.log_likelihood(model).exp().min() > 0.25
        self.folder = str(folder)
        model.save_pretrained(folder)
        tokenizer.save_pretrained(folder)

    def log_likelihood(self, model: Any) -> Any:
        """(2,) of all that the assistant says, in each transcript; log(1/2) at best."""
        import torch

        ids = self.batch["input_ids"]  # padded on the right, where causal attention needs no mask
        logits = model(input_ids=ids).logits[:, :-1]
        each = torch.nn.functional.cross_entropy(
            logits.transpose(1, 2), ids[:, 1:], reduction="none"
        )
        return -(each * self.batch["assistant_masks"][:, 1:]).sum(1)

    def preference(self, model: Any) -> float:
        """By how much, as a logarithm, the good transcript is likelier than the bad one."""
        import torch

        with torch.no_grad():
            good, bad = self.log_likelihood(model).tolist()
        return float(good - bad)


@pytest.fixture(scope="module")
def taught(example: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Taught:
    return Taught(example, tmp_path_factory.mktemp("taught"))


def test_rollouts_are_played_in_the_environment_and_its_reward_teaches(
    example: ModuleType, taught: Taught, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import torch

    rollouts: list[tuple[list[dict[str, Any]], float]] = []
    reward_of = example.episode_reward

    @functools.wraps(reward_of)
    def watched(completions: Any, environments: Any, **rest: Any) -> Any:
        rewards = reward_of(environments, **rest)
        rollouts.extend(zip(completions, rewards, strict=True))
        return rewards

    monkeypatch.setattr(example, "episode_reward", watched)
    trainer = example.make_trainer(
        taught.folder,
        None,
        [a_task(SEARCH)],
        output_dir=str(tmp_path),
        max_steps=4,
        per_device_train_batch_size=8,
        num_generations=8,
        max_completion_length=1024,
        max_tool_calling_iterations=4,
        learning_rate=3e-4,
        seed=0,
        disable_tqdm=True,
    )
    assert [tool.__name__ for tool in trainer.tools] == ["act"]
    before = taught.preference(trainer.model)
    weights = {name: weight.clone() for name, weight in trainer.model.named_parameters()}
    trainer.train()

    assert len(rollouts) == 4 * 8
    for messages, reward in rollouts:
        calls = [call["function"] for turn in messages for call in turn.get("tool_calls") or ()]
        answers = [turn["content"] for turn in messages if turn["role"] == "tool"]
        # What is sampled is a wrong call at times, which TRL answers with an error; and TRL leaves
        # the last unanswered when there were too many.
        played = [
            (str(call["arguments"]["action"]), answer)
            for call, answer in zip(calls, answers, strict=False)
            if not answer.startswith("{'error'")
        ]
        texts, earned = replay(SEARCH, [action for action, _ in played])
        assert ([answer for _, answer in played], reward) == (texts[1:], earned)
    assert {reward for _, reward in rollouts} >= {0.0, 2.0}

    steps = trainer.state.log_history[:4]
    assert [step["reward"] for step in steps] == pytest.approx(
        [sum(reward for _, reward in rollouts[k : k + 8]) / 8 for k in range(0, 32, 8)]
    )
    assert all(torch.tensor([step["loss"], step["grad_norm"]]).isfinite().all() for step in steps)
    assert any(
        not torch.equal(weight, weights[name]) for name, weight in trainer.model.named_parameters()
    )
    assert taught.preference(trainer.model) > before + 0.3


def test_a_model_in_a_folder_is_trained_and_saved(
    example: ModuleType, taught: Taught, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    example.main(["--model", taught.folder, "--steps=1", "--tokens=96", f"--out={tmp_path}"])
    assert "step 1: reward " in capsys.readouterr().out
    assert {"model.safetensors", "tokenizer.json"} <= {file.name for file in tmp_path.iterdir()}


def test_random_weights_earn_nothing_and_learn_nothing(
    example: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    model = example.tiny_model(range(1024))
    before = {name: weight.clone() for name, weight in model.state_dict().items()}
    monkeypatch.setattr(example, "tiny_model", lambda tokenizer: model)
    example.main(["--steps=2", f"--out={tmp_path}"])
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("step ")]
    assert len(said) == 2
    for line in said:
        assert "reward 0.00" in line
        assert line.endswith(", 0.0 calls a rollout")
    assert all(weight.equal(before[name]) for name, weight in model.state_dict().items())
