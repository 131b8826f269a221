"""Episodes that are saved as bytes and go on elsewhere, to the byte."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from er_gym import EmbodiedEnv
from er_gym.envs import snapshot as format
from er_gym.envs.actions import ACTIONS
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.info import with_details
from er_gym.envs.snapshot import SnapshotError, generator_of, generator_state, pack, unpack
from er_gym.envs.solver import Solver
from er_gym.tasks.suites import load_suite

MOST_BYTES = 20_000
PICTURES = {"obs_mode": "rgb+depth+instance+text", "width": 64, "height": 36}


def same(one: Any, other: Any) -> bool:
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    return bool(one == other)


def legal(env: EmbodiedEnv, random: np.random.Generator) -> int:
    return int(random.choice(np.flatnonzero(env.action_masks())))


@pytest.mark.parametrize(
    ("suite", "arguments"),
    [
        ("er-1k", {"obs_mode": "state+text", "faults": 0.4}),
        ("mini", PICTURES),
        ("mini", {"obs_mode": "state+text", "protocol": "paper"}),
        ("mini", {**PICTURES, "protocol": "paper", "annotate": True}),
        ("train", {"obs_mode": "state+objects", "instances": "explore"}),
    ],
)
def test_a_restored_episode_goes_on_to_the_byte(suite: str, arguments: dict[str, Any]) -> None:
    env, other = (EmbodiedEnv(suite, **arguments) for _ in range(2))
    random = np.random.default_rng(1)
    other.reset(seed=99)  # it is in another room
    steps = 0
    for seed in range(3):
        told: tuple[Any, ...] = env.reset(seed=seed)
        while True:
            saved = env.snapshot()
            assert len(saved) < MOST_BYTES
            again = other.restore(saved)
            assert same((told[0], told[-1]), again)
            assert same(dict(env.details), dict(other.details))
            assert other.snapshot() == saved
            if env._current("").end_reason:
                break
            draw = random.random()
            action: Any = "hm" if draw < 0.1 else "end" if draw < 0.15 else legal(env, random)
            told = env.step(action)
            assert same(told, other.step(action))
            steps += 1
    assert same(env.reset(), other.reset())  # both draw the same task
    assert steps > 8


def test_going_back_undoes_what_was_done() -> None:
    """Also what adds objects: the slices of a tomato."""
    env = EmbodiedEnv(obs_mode="state+text")
    task = next(
        t for t in load_suite("er-1k").tasks if any(k.verb == "slice" for k in t.key_actions)
    )
    env.reset(options={"task": task})
    saved, before = env.snapshot(), [dict(entry) for entry in env.objects]
    solver, told = Solver(), env.restore(saved)
    actions = []
    while not told[-1]["success"]:
        actions.append(solver.next(with_details(env, told[-1]))[0])
        told = env.step(actions[-1])
        if actions[-1].verb == "slice":
            sliced = env.snapshot()
            rest, after = len(actions), [dict(entry) for entry in env.objects]
    assert len(after) > len(before)
    env.restore(saved)
    assert [dict(entry) for entry in env.objects] == before
    env.restore(sliced)
    assert [dict(entry) for entry in env.objects] == after
    for action in actions[rest:]:
        told = env.step(action)
    assert told[-1]["success"]


def test_rooms_that_are_arranged_in_different_ways_are_told_apart() -> None:
    tasks = [task for task in load_suite("er-1k").tasks if task.arrangement.poses]
    first = tasks[0]
    other = next(
        task
        for task in tasks
        if task.scene == first.scene and task.arrangement.poses != first.arrangement.poses
    )
    env = EmbodiedEnv(obs_mode="state")
    env.reset(options={"task": first})
    saved, objects = env.snapshot(), [dict(entry) for entry in env.objects]
    env.reset(options={"task": other})
    assert [dict(entry) for entry in env.objects] != objects
    env.restore(saved)
    assert [dict(entry) for entry in env.objects] == objects


def test_the_papers_agent_knows_what_lay_in_the_receptacle() -> None:
    env, other = (EmbodiedEnv(obs_mode="text", protocol="paper") for _ in range(2))
    env.reset(seed=0)
    inside: set[int] = set()
    for name in env.details["navigable"]:
        env.step(f"navigate to {name}")
        saved = env.snapshot()
        other.restore(saved)
        assert other.snapshot() == saved
        assert other.details["interactable"] == env.details["interactable"]
        inside.update(unpack(saved)["episode"]["handler"]["inside"])
    assert inside


def test_another_process_goes_on(tmp_path: Path) -> None:
    env = EmbodiedEnv("er-1k", obs_mode="text")
    env.reset(seed=4)
    env.step("observe")
    (tmp_path / "saved").write_bytes(env.snapshot())
    program = f"""
from collections.abc import Iterator
from pathlib import Path
from er_gym import EmbodiedEnv
env = EmbodiedEnv((), obs_mode="text")
obs, _ = env.restore(Path({str(tmp_path / "saved")!r}).read_bytes())
print(obs["text"])
print(env.step({str(ACTIONS[legal(env, np.random.default_rng(0))])!r})[0]["text"])
"""
    said = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    told = env.restore(env.snapshot())[0]["text"]
    then = env.step(legal(env, np.random.default_rng(0)))[0]["text"]
    assert said.stdout == f"{told}\n{then}\n"


def test_forks_are_independent() -> None:
    env = EmbodiedEnv(obs_mode="state")
    env.reset(seed=3)
    env.step("observe")
    before = env.snapshot()
    one, other = env.fork(2)
    random = np.random.default_rng(0)
    for _ in range(4):
        one.step(legal(one, random))
    assert env.snapshot() == other.snapshot() == before
    assert one.snapshot() != before
    for n in (0, -1, 1.5, "two"):
        with pytest.raises(ValueError, match="n is"):
            env.fork(n)  # type: ignore[arg-type]


def test_a_member_of_a_vector_goes_back() -> None:
    vector = gymnasium.make_vec("ER-SinglePickup-v0", num_envs=3, obs_mode="state")
    vector.reset(seed=0)
    one = vector.envs[1].unwrapped  # type: ignore[attr-defined]
    saved = one.snapshot()
    first = vector.step(["observe", "move forward", "observe"])
    vector.step(["move forward", "observe", "observe"])
    one.restore(saved)
    again = vector.step(["observe", "move forward", "observe"])
    assert np.array_equal(first[0]["state"][1], again[0]["state"][1])
    assert np.array_equal(first[-1]["action_mask"][1], again[-1]["action_mask"][1])


def test_what_is_no_snapshot_is_refused_and_nothing_is_lost() -> None:
    env = EmbodiedEnv(obs_mode="state")
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before snapshot\(\)"):
        env.snapshot()
    env.reset(seed=1)
    saved = env.snapshot()
    damaged = bytearray(saved)
    damaged[-1] ^= 1
    for wrong, why in (
        (b"", "no snapshot"),
        (b"er-gym", "no snapshot"),
        (saved[:-1], "damaged"),
        (bytes(damaged), "damaged"),
        (saved.replace(b"episode/1", b"episode/2"), "version 2, and this er-gym reads 1"),
        ("text", "not str"),
        (None, "not NoneType"),
    ):
        with pytest.raises(SnapshotError, match=why):
            env.restore(wrong)  # type: ignore[arg-type]
    assert env.snapshot() == saved
    env.close()
    env.restore(saved)  # opens it again, as reset does
    assert env.snapshot() == saved


@pytest.mark.parametrize(
    ("other", "why"),
    [
        ({"protocol": "paper"}, "another protocol: 'paper', and this one has 'default'"),
        ({"instances": "explore"}, "another instances"),
        ({"max_steps": 9}, "another max_steps: 9, and this one has None"),
        ({"grid_size": 0.25}, "another grid_size"),
        ({"field_of_view": 60.0}, "another field_of_view"),
        ({"visibility_distance": 1.5}, "another visibility_distance"),
        ({"width": 300, "height": 300}, "another width / height"),
    ],
)
def test_an_environment_with_other_rules_refuses(other: dict[str, Any], why: str) -> None:
    env, made = EmbodiedEnv(obs_mode="state"), EmbodiedEnv(obs_mode="state", **other)
    made.reset(seed=0)
    env.reset(seed=1)
    before = env.snapshot()
    with pytest.raises(SnapshotError, match=why):
        env.restore(made.snapshot())
    assert env.snapshot() == before


def test_what_is_observed_and_subtracted_may_differ() -> None:
    env = EmbodiedEnv(obs_mode="state", step_penalty=0.1)
    env.reset(seed=0)
    drawing = EmbodiedEnv(obs_mode="rgb", width=80, height=45, render_mode="rgb_array")
    obs, _ = drawing.restore(env.snapshot())
    assert obs["rgb"].shape == (45, 80, 3)
    assert np.array_equal(drawing.render(), obs["rgb"])


def test_unity_has_no_snapshots() -> None:
    env = EmbodiedEnv(obs_mode="text")
    env.reset(seed=0)
    env._backend = "unity"  # there is no Unity here
    for save in (env.snapshot, lambda: env.fork(1)):
        with pytest.raises(gymnasium.error.Error, match=r"'unity' cannot be copied or saved"):
            save()


def test_a_snapshot_is_no_bomb(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(format, "_LARGEST", 1000)
    with pytest.raises(SnapshotError, match="larger than 1000 bytes"):
        unpack(pack({"zeros": bytes(5000)}))
    assert unpack(pack({"zeros": bytes(500), "odd": "\ud83d"})) == {
        "zeros": bytes(500),
        "odd": "\ud83d",
    }


def test_a_generator_goes_on() -> None:
    random = np.random.default_rng(2**100)
    random.integers(10, dtype=np.int32)  # leaves half a number
    again = generator_of(generator_state(random))
    assert again.integers(2**62, size=5).tolist() == random.integers(2**62, size=5).tolist()
    with pytest.raises(ValueError, match="MT19937 cannot be saved"):
        generator_state(np.random.Generator(np.random.MT19937(0)))


def mutations(value: Any, depth: int) -> Iterator[Any]:
    """Plain data with one part of it left out or of another type, for the parts of some levels."""
    if isinstance(value, dict) and depth:
        for key, inner in value.items():
            yield {name: one for name, one in value.items() if name != key}
            yield from ({**value, key: other} for other in mutations(inner, depth - 1))
    elif isinstance(value, list) and depth:
        yield value[1:]
        for index, inner in enumerate(value[:3]):
            for other in mutations(inner, depth - 1):
                yield [*value[:index], other, *value[index + 1 :]]
    odd: tuple[Any, ...] = (None, "odd", -(2**40), [[]])
    yield from (other for other in odd if other != value)


def test_content_that_no_episode_writes_is_refused_in_words() -> None:
    env = EmbodiedEnv(obs_mode="state", faults=0.4)
    env.reset(seed=1)
    saved = unpack(env.snapshot())
    refused = 0
    for crafted in mutations(saved, 4):
        try:
            env.restore(pack(crafted))
        except SnapshotError:
            refused += 1
    assert refused > 100
    env.restore(pack(saved))
    env.close()
