"""The ``paper`` scorer against a second writing of the paper's rules.

The second writing knows nothing of ours: it reads an episode as the dictionaries that the paper's
runner keeps in its ``result.json`` and works each rule out on its own.
"""

from __future__ import annotations

import json
import random
from functools import cache
from typing import Any

import pytest

from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import PAPER
from er_gym.rollout.records import EpisodeRecord, KeyActionRecord, StepRecord, record_episode
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.types import TASK_TYPES

TYPES = ("Pot", "Pen", "Pencil", "Lettuce", "Fridge", "CounterTop", "Bowl", "Egg", "Sink")
VERBS = (
    *("navigate to", "pickup", "put in", "put", "open", "close", "toggle", "slice"),
    *("observe", "move forward", "end", "error"),
)
ALONE = ("observe", "move forward", "end", "error", "init")
NAMES = (
    "spot the Lettuce",
    "Look for the Pencil in the room.",
    "OPEN the fridge, please",
    "put the Egg in the Bowl",
    "",
)


# -- the second writing ----------------------------------------------------------------------------


def in_their_words(episode: EpisodeRecord) -> dict[str, Any]:
    """An episode as a result of the paper's runner."""

    def spelled(key: KeyActionRecord) -> str:
        verb = key.spelled or {"put in": "put"}.get(key.verb, key.verb)
        return " ".join(filter(None, (verb, key.object_type)))

    return {
        "tasktype": episode.task_type,
        "taskname": episode.name,
        "key_actions": [spelled(key) for key in episode.key_actions],
        "trajectory": [
            {
                "action": step.verb,
                "object": step.object_type or None,
                "legal_objects": step.interactable,
                "success": int(step.success),
            }
            for step in episode.steps
        ],
    }


def their_figures(result: dict[str, Any]) -> dict[str, float]:
    """What the paper's program makes of a result, rule by rule."""
    trajectory, keys = result["trajectory"], result["key_actions"]
    search = result["tasktype"] == "single_search"
    free = {"init", "observe", "move forward", "navigate to", "error"}

    def name_of(entry: dict[str, Any], put: str | None = None) -> str:
        words = [put or entry["action"]] + (
            [entry["object"]] if entry["object"] is not None else []
        )
        return " ".join(words)

    done = [entry for entry in trajectory if entry["success"]]
    wanted, earned, answers = list(keys), [], 0
    looked_at = trajectory  # all of it, unless a search is answered by where the agent came from
    for place, entry in enumerate(done):
        if entry["action"] in free:
            continue
        if entry["action"] == "end":
            if not search:
                earned.append("end")
                continue
            within = any(
                kind.lower() in result["taskname"].lower() for kind in entry["legal_objects"]
            )
            before = done[place - 1] if place else None
            came_by = before is not None and _remembered(before, name_of) in keys
            answers += within or came_by
            if came_by and not within:
                looked_at = trajectory[
                    : 1 + next(i for i, e in enumerate(trajectory) if e is entry)
                ]
                break
        elif entry["object"] is not None:
            name = name_of(entry, "put" if entry["action"][:3] == "put" else None)
            if name in wanted:
                wanted.remove(name)
                earned.append(name)
    count = len(earned) + answers
    counted = [
        key
        for key in keys
        if "observe" not in key and "move forward" not in key and "navigate to" not in key
    ]
    navigated_to = [entry["object"] for entry in looked_at if entry["action"] == "navigate to"]
    share = count / len(counted) if counted else 0.0
    return {
        "success": share >= 1,
        "search_efficiency": (len(keys) + 1) / len(trajectory) if share >= 1 else 0.0,
        "completeness": share,
        "ordered_completeness": share
        if search or not counted
        else _in_common(tuple(earned), tuple(counted)) / len(counted),
        "repeat_rate": (len(navigated_to) - len({*navigated_to})) / len(navigated_to)
        if navigated_to
        else 0.0,
    }


def _remembered(entry: dict[str, Any], name_of: Any) -> str:
    """What is kept of the last successful step: a ``put in`` with an object is kept as ``put``."""
    puts = entry["action"].startswith("put") and entry["object"] is not None
    return str(name_of(entry, "put" if puts else None))


def _in_common(one: tuple[str, ...], other: tuple[str, ...]) -> int:
    @cache
    def best(i: int, j: int) -> int:
        if i == len(one) or j == len(other):
            return 0
        if one[i] == other[j]:
            return 1 + best(i + 1, j + 1)
        return max(best(i + 1, j), best(i, j + 1))

    return best(0, 0)


# -- episodes --------------------------------------------------------------------------------------


def random_step(draw: random.Random, verbs: tuple[str, ...] = VERBS) -> StepRecord:
    verb = draw.choice(verbs)
    return StepRecord(
        verb=verb,
        object_type="" if verb in ALONE else draw.choice((*TYPES, "No Suitable Object")),
        success=verb != "error" and draw.random() < 0.75,
        interactable=draw.sample(TYPES, draw.randrange(4)),
    )


def random_key(draw: random.Random) -> KeyActionRecord:
    verb = draw.choice(VERBS[:7])
    odd = "put in" if verb == "put in" and draw.random() < 0.2 else ""
    return KeyActionRecord(
        verb="put in" if verb == "put" else verb,
        object_type=draw.choice((*TYPES, "")),
        spelled=odd,
    )


def random_episode(seed: int) -> EpisodeRecord:
    """A task of any type and steps that do some of it, at random: the end early, late or never,
    replies without an action, the same again, interactions before ``end``."""
    draw = random.Random(seed)
    keys = [random_key(draw) for _ in range(draw.randrange(1, 6))]
    if draw.random() < 0.8:
        keys.append(KeyActionRecord(verb="end"))
    steps = [StepRecord(verb="init", success=True)]
    for key in draw.sample(keys, len(keys)) if draw.random() < 0.3 else keys:
        steps += [random_step(draw) for _ in range(draw.randrange(3))]
        if draw.random() < 0.8:
            interactable = draw.sample(TYPES, draw.randrange(4))
            steps += [
                StepRecord(
                    verb=key.verb,
                    object_type=key.object_type,
                    success=draw.random() < 0.9,
                    interactable=interactable,
                )
            ] * draw.choice((1, 1, 1, 2))
    if draw.random() < 0.3:
        steps.append(random_step(draw, ("end",)).model_copy(update={"appended": True}))
    return EpisodeRecord(
        task_id=f"random-{seed}",
        task_type=draw.choice(("single_search", *(kind.name for kind in TASK_TYPES))),
        scene="FloorPlan1",
        instruction="",
        name=draw.choice(NAMES),
        key_actions=keys,
        max_steps=22,
        agent="random",
        seed=seed,
        steps=steps,
        success=False,
        end_reason="end",
        total_reward=0.0,
        seconds=0.0,
    )


def assert_equal(episode: EpisodeRecord) -> bool:
    """Our figures and theirs, bit for bit; whether the episode was a success."""
    theirs, ours = their_figures(in_their_words(episode)), score_episode(episode, PAPER)
    assert {name: getattr(ours, name) for name in theirs} == theirs, episode.model_dump_json()
    return ours.success


@pytest.mark.parametrize("first", range(0, 5000, 1000))
def test_random_episodes_score_as_the_paper_scores_them(first):
    successes = sum(assert_equal(random_episode(seed)) for seed in range(first, first + 1000))
    assert 50 < successes < 950  # both outcomes were compared


def step(verb: str, object_type: str = "", *, success: bool = True, near: tuple[str, ...] = ()):
    return StepRecord(verb=verb, object_type=object_type, success=success, interactable=list(near))


ODD = {
    "nothing but init": [],
    "end alone": [step("end")],
    "two ends": [step("end", near=("Pot",)), step("end", near=("Pot",))],
    "an end that failed": [step("navigate to", "CounterTop"), step("end", success=False)],
    "a step after the end": [step("end"), step("navigate to", "CounterTop"), step("end")],
    "an interaction before the end": [
        step("navigate to", "CounterTop"),
        step("open", "Fridge"),
        step("end"),
    ],
    "an interaction that is a key action before the end": [step("pickup", "Egg"), step("end")],
    "a put as the last step": [step("put in", "Bowl"), step("end")],
    "a put without an object": [step("put in"), step("end")],
    "unknown replies": [step("error", success=False)] * 3 + [step("end")],
    "the same navigation again": [step("navigate to", "CounterTop")] * 4,
    "navigations to nothing": [step("navigate to", "No Suitable Object", success=False)] * 2,
}


@pytest.mark.parametrize("kind", [kind.name for kind in TASK_TYPES])
@pytest.mark.parametrize("steps", ODD.values(), ids=ODD)
def test_odd_episodes_score_as_the_paper_scores_them(episode, kind, steps):
    keys = ("navigate to CounterTop", "pickup Egg", "put in Bowl", "put in", "end")
    for name in NAMES:
        assert_equal(episode(keys, tuple(steps), task_type=kind, name=name))
        assert_equal(episode(keys[:1], tuple(steps), task_type=kind, name=name))


def test_a_task_files_spelling_reaches_the_scorer(tmp_path, paper_tasks):
    actions = paper_tasks[0]["task_metadata"]["actions"]
    put = {**actions[1], "action": "put in"}
    actions[1:2] = [{**put, "action": "put"}, put]
    path = tmp_path / "tasks.json"
    path.write_text(json.dumps(paper_tasks[:1]))
    record = record_episode(read_tasks(path)[0], agent="nobody", seed=0)
    assert in_their_words(record)["key_actions"] == [
        "navigate to CounterTop",
        "put Apple",
        "put in Apple",
        "end",
    ]


def test_a_record_of_before_loads_and_scores(episode):
    made = episode(("pickup Egg", "end"), ("pickup Egg", "end"))
    old = made.model_dump()
    for record in old["key_actions"]:
        del record["spelled"]
    for record in old["steps"]:
        del record["appended"]
    assert EpisodeRecord.model_validate(old) == made
