"""What the validity page counts: leaks, rewards that were not earned, and two judges apart."""

from __future__ import annotations

from dataclasses import replace

from support import make_task

from benchmarks.checks.leaks import disagreements, shared, unearned
from benchmarks.pages.validity import Played, page
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.records import EpisodeRecord
from er_gym.tables import Table
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.task import Task

APPLE, KETTLE = "Apple|+00.00|+01.00|+02.00", "Kettle|+00.00|+01.00|+02.00"
MOVED = Arrangement("x", {"Apple_1": ObjectPose(1.0, 2.0, 3.0)})


def task(object_id: str = APPLE, room: int = 5, text: str = "Take it.", **fields: object) -> Task:
    made = make_task("single_pickup", ("pickup", object_id), instruction=text)
    return replace(made, scene=f"FloorPlan{room}", **fields)


def test_what_tests_share_with_training_is_counted() -> None:
    train = [task(), task(arrangement=MOVED), task(room=6, text="Take this.")]
    assert {*shared(train, [task(room=1, text="Other.")]).values()} == {0}
    for test, names in (
        (task(text="Other."), {"room", "room, arrangement and key actions"}),
        (
            task(arrangement=MOVED, text="Other."),
            {"room", "arrangement", "room, arrangement and key actions"},
        ),
        (
            task(room=6, text="Take this.", key_actions=()),
            {"room", "instruction, to the letter", "room and instruction"},
        ),
        (task(room=1), {"instruction, to the letter"}),
    ):
        assert {name for name, n in shared(train, [test]).items() if n} == names
    taught = shared([task(KETTLE)], [task(KETTLE, room=1, text="Other.")])
    assert taught["object kept for evaluation that training is about"] == 1


def test_a_reward_without_a_key_action_is_found(episode) -> None:  # type: ignore[no-untyped-def]
    keys = ("pickup Egg", "put in Bowl", "end")
    record: EpisodeRecord = episode(keys, keys)
    steps = [step.model_copy(update={"reward": 1.0}) for step in record.steps[1:]]
    steps = [record.steps[0], *steps]
    earned = record.model_copy(update={"steps": steps, "total_reward": 3.0, "success": True})
    assert [*unearned(earned)] == []
    assert [*disagreements(earned)] == []
    twice = [*steps[:2], *steps[1:]]  # the egg is picked up once more
    (words,) = unearned(earned.model_copy(update={"steps": twice}))
    assert words == "step 2 earns 1, and as many key actions are left"
    assert [*unearned(earned.model_copy(update={"total_reward": 4.0}))] == ["it earns 4 of 3"]
    failed = earned.model_copy(update={"success": False})
    assert [*unearned(failed)] == ["it earns all of the reward without success"]
    assert [*disagreements(failed)] == ["success is False live, True by the scorer"]
    poorer = earned.model_copy(update={"total_reward": 2.0})
    assert [*disagreements(poorer)] == ["the reward is 2 live, 3 by the scorer"]


def test_the_page_has_a_row_for_each(episode) -> None:  # type: ignore[no-untyped-def]
    score = score_episode(episode(("end",), ("end",)), CORRECTED)
    played = [
        Played("mini", "oracle", "target", [score]),
        Played("er-1k", "takes-all", "explore", [score], ["t: why"], []),
    ]
    naming = Table("Named", ("Suite", "Exactly"), (("mini", "131"),), 1)
    leaks = Table("Shared", ("What", "er-1k"), (("room", "7"),), 1)
    text = page(played, 1, naming, leaks, "The last chapter.\n")
    assert "| mini | 131 |" in text
    assert text.endswith("## What success depends on besides the task\n\nThe last chapter.\n")
    assert "| mini | 1 of 132 | 100.0 | 20.7 to 100.0 | - | 100.0 |" in text
    assert "| room | 7 |" in text
    assert "| er-1k | takes-all | explore | 1 | 1 | 0 |" in text
    assert "| takes-all | 100.0 | 20.7 to 100.0 | - | - | - | 100.0 | - |" in text
