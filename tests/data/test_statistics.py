"""Statistics of collections, counted once more by hand."""

from __future__ import annotations

import json
import tracemalloc
from collections import Counter
from pathlib import Path

import pytest
from played_collection import make_collection

from er_gym.data.collection import Collection
from er_gym.data.paper_figures import (
    SETS,
    STAGE_OF_PART,
    TASK_TYPES,
    THOUGHTS,
    TRANSITIONS,
    VERBS,
)
from er_gym.data.statistics import mean_and_most, statistics
from er_gym.data.trajectory import THOUGHT_KINDS, Cost, ThoughtRecord, Trajectory
from er_gym.data.words import count_words, sentences
from er_gym.tasks import verbs
from er_gym.tasks.types import BY_NAME


@pytest.fixture(scope="module")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Collection:
    return make_collection(tmp_path_factory.mktemp("data") / "x", width=32, height=18)


def test_counts(collection: Collection) -> None:
    found, every = statistics(collection), list(collection.trajectories())
    turns = [turn for one in every for turn in one.turns]
    thoughts = [thought for turn in turns for thought in turn.thoughts]
    assert found.trajectories == len(every) == 7
    assert found.succeeded == sum(one.success for one in every)
    assert found.thoughts == Counter(thought.kind for thought in thoughts)
    assert found.verbs == Counter(turn.verb for turn in turns)
    assert found.task_types == Counter(one.task_type for one in every)
    assert found.words["analysis"] == sum(
        len(thought.text.split()) for thought in thoughts if thought.kind == "analysis"
    )
    anomalies = found.parts["anomalies"]
    assert anomalies.faults == Counter(turn.fault for turn in turns if turn.fault)
    assert anomalies.kinds == {"anomaly": 3}
    assert mean_and_most(anomalies.actions) == (
        sum(one.actions for one in every if one.part == "anomalies") / 3,
        max(one.actions for one in every),
    )
    assert mean_and_most({}) == (0.0, 0)
    texts = Counter(thought.text for thought in thoughts)
    assert (found.most_used, found.most_used_count) == texts.most_common(1)[0]
    assert found.distinct_thoughts == len(texts)
    said = [sentence for thought in thoughts for sentence in sentences(thought.text)]
    assert (found.sentences, found.distinct_sentences) == (len(said), len(set(said)))


def test_transitions(collection: Collection) -> None:
    found, every = statistics(collection), list(collection.trajectories())
    shares = found.transition_shares()
    assert shares["begin"] == {"analysis": 100}
    assert shares["analysis"] == {"planning": 100}
    assert shares["verification"] == {"action": 100}
    # Each thought and each action but the last of a trajectory is followed by something.
    number = sum(row.total() for row in found.transitions.values())
    assert number == found.all_thoughts + found.turns
    assert found.transitions["action"]["verification"] == len(every)


def test_what_models_wrote_and_cost(collection: Collection, tmp_path: Path) -> None:
    first = next(collection.trajectories())
    refused = ThoughtRecord(kind="planning", text="Go.", refused=["unseen", "side"])
    model = ThoughtRecord(kind="planning", text="Go.", writer="openai:m", refused=["side"])
    turn = first.turns[0].model_copy(update={"thoughts": [refused, model], "train": False})
    cost = Cost(requests=5, prompt_tokens=70, completion_tokens=6, usd=0.25)
    changed = first.model_copy(update={"turns": [turn], "cost": cost, "language": "zh"})
    made = Collection.create(tmp_path / "y", collection.manifest)
    made.write([changed, changed.model_copy(update={"id": "another"})])
    found = statistics(made)
    assert found.refused == {"unseen": 2, "side": 4}
    assert found.replaced == 2
    assert found.writers == {"grounded": 2, "openai:m": 2}
    assert (found.requests, found.prompt_tokens, found.completion_tokens) == (10, 140, 12)
    assert (found.usd, found.trained_turns, found.turns) == (0.5, 0, 2)
    assert (found.most_used, found.most_used_count) == ("Go.", 4)


def test_they_are_json(collection: Collection) -> None:
    told = json.loads(json.dumps(statistics(collection).as_dict()))
    assert told["format"] == "er-gym/data-statistics/1"
    assert sum(told["parts"]["imitation"]["actions"].values()) == 4
    assert told["transition_shares"]["begin"] == {"analysis": 100}


def test_memory_does_not_grow_with_the_collection(collection: Collection, tmp_path: Path) -> None:
    """Five times as many trajectories, whose texts all differ, need hardly more: the texts of one
    copy alone are a tenth of the memory."""

    def peak(copies: int) -> int:
        made = Collection.create(tmp_path / str(copies), collection.manifest)
        made.write(renamed(one, n) for n in range(copies) for one in collection.trajectories())
        tracemalloc.start()
        statistics(made)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    def renamed(one: Trajectory, number: int) -> Trajectory:
        turns = [
            turn.model_copy(
                update={
                    "thoughts": [
                        each.model_copy(update={"text": f"{number} {index}. {each.text * 40}"})
                        for each in turn.thoughts
                    ]
                }
            )
            for index, turn in enumerate(one.turns)
        ]
        return one.model_copy(update={"turns": turns, "id": f"{one.id}-{number}"})

    statistics(collection)  # what is made once, such as tables, does not count
    assert peak(10) < 1.3 * peak(2)


def test_words_and_sentences() -> None:
    assert count_words("I can't see well-known things, 3 of them.") == 8
    assert count_words("我先看看四周。") == 3
    assert count_words("") == 0
    assert sentences("One. Two!  (Three?) Four") == ["One.", "Two!", "(Three?)", "Four"]
    assert sentences("“One.” Two 3.5 m.") == ["“One.”", "Two 3.5 m."]
    assert sentences("我先看看。前面有杯子！好") == ["我先看看。", "前面有杯子！", "好"]


def test_the_papers_figures_add_up() -> None:
    assert sum(TASK_TYPES.values()) == sum(one.trajectories for one in SETS) == 9_390
    assert [one.stage for one in SETS] == sorted({*STAGE_OF_PART.values()}) == [1, 2, 3]
    assert sum(one.pictures for one in SETS) == 64_236  # the paper's text says 64K
    assert TASK_TYPES.keys() <= BY_NAME.keys()
    assert VERBS.keys() <= {*verbs.BARE_VERBS, *verbs.OBJECT_VERBS}
    assert sum(VERBS.values()) - VERBS[verbs.END] == 58_437
    assert all(sum(row.values()) == 100 for row in TRANSITIONS.values())
    assert tuple(THOUGHTS) == THOUGHT_KINDS
    mean = sum(one.actions * one.trajectories for one in SETS) / 9_390
    assert mean == pytest.approx(7.22, abs=0.01)
