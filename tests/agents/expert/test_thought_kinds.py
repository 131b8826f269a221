"""The table of transitions between thoughts."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random
from typing import Any

import pytest
import yaml
from expert_courses import TASKS

from agents.expert.thought_kinds import CHECKS, ThoughtKinds, load_thought_kinds

TABLE = load_thought_kinds()


def changed(**changes: Any) -> dict[str, Any]:
    """The default table as data, with some places changed: ``kinds__planning={...}``."""
    data = TABLE.model_dump(mode="json")
    for path, value in changes.items():
        *way, last = path.split("__")
        inner = data
        for name in way:
            inner = inner[name]
        inner[last] = value
    return data


BAD = {
    "sum": ({"kinds__planning": {"act": 0.5}}, "sum to 0.5; let them sum to 1"),
    "sum of an event": ({"events__begin": {"analysis": 0.5, "planning": 0.6}}, "sum to 1.1"),
    "no kind": ({"kinds__planning": {"dreaming": 1.0}}, "dreaming"),
    "unknown kind": ({"kinds__dreaming": {"act": 1.0}}, "dreaming"),
    "unknown event": ({"events__bored": {"planning": 1.0}}, "bored"),
    "an event begins with an act": ({"events__begin": {"act": 1.0}}, "begin"),
    "negative": ({"kinds__planning": {"act": 1.5, "reasoning": -0.5}}, "planning"),
    "not a number": ({"kinds__planning": {"act": "often"}}, "planning"),
    "few words": ({"limits__alone": {"analysis": 3}}, "limits"),
    "two checks": ({"checks__single": [0.5, 0.5]}, "single"),
    "unknown field": ({"moods": {}}, "moods"),
    "missing kind": (
        {"kinds": {"planning": {"act": 1.0}}},
        "only planning; give analysis, reasoning, reflection, verification, too",
    ),
    "missing event": ({"events": {"begin": {"analysis": 1.0}}}, "only begin; give earned, "),
    "missing limit": ({"limits__together": {"analysis": 100}}, "limits.together"),
    "missing company": ({"limits": {}}, "no rows; give alone, together, too"),
    "missing checks": ({"checks": {"single": [1, 0, 0]}}, "only single; give exposed to"),
    "checks": ({"checks__single": [0, 0, 0]}, "sum to 0; let them sum to 1"),
}


@pytest.mark.parametrize(("changes", "message"), BAD.values(), ids=BAD)
def test_a_bad_table_is_told_in_one_line(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    file = tmp_path / "table.yaml"
    file.write_text(yaml.safe_dump(changed(**changes)), encoding="utf-8")
    with pytest.raises(ValueError, match=r"table of transitions") as told:
        load_thought_kinds(str(file))
    assert "\n" not in str(told.value)
    assert message in str(told.value)


def test_what_is_drawn_approaches_the_table() -> None:
    random = Random(1)
    first: dict[str, Counter[str]] = {}
    after: dict[str, Counter[str]] = {}
    for event in TABLE.events:
        for _ in range(4000):
            drawn = TABLE.draw(event, random)
            assert 1 <= len(drawn) == len(set(drawn)) <= 4
            first.setdefault(event, Counter())[drawn[0]] += 1
            if event == "think and check":
                assert drawn == ("reasoning", "verification")
                continue
            for kind, then in zip(drawn, (*drawn[1:], "act"), strict=True):
                after.setdefault(kind, Counter())[then] += 1
    for event, shares in TABLE.events.items():
        for kind, share in shares.items():
            assert first[event][kind] / 4000 == pytest.approx(share, abs=0.03), (event, kind)
    for kind, nexts in TABLE.kinds.items():
        number = sum(after[kind].values())
        for then, share in nexts.items():
            assert after[kind][then] / number == pytest.approx(share, abs=0.03), (kind, then)


def test_the_limit_of_words_depends_on_the_company() -> None:
    assert TABLE.limits_of(("planning",)) == (150,)
    assert TABLE.limits_of(("analysis", "planning")) == (100, 100)


def test_how_tasks_end_is_drawn_by_their_kind() -> None:
    shares = {"single_search": (1, 0, 0), "pickup_and_put_in_closerep": (0, 1, 0)}
    table = ThoughtKinds.model_validate(
        changed(
            checks={
                "single": (1, 0, 0),
                "exposed to enclosed": (0, 1, 0),
                "transfer": (0, 0, 1),
                "ordered": (0.5, 0.5, 0),
            }
        )
    )
    random = Random(2)
    drawn = {task.type.name: table.draw_check(task, random) for task in TASKS}
    for name, share in shares.items():
        assert drawn[name] == CHECKS[share.index(1)]
    assert drawn["pickup_and_put"] == "think and check"
    ordered = next(task for task in TASKS if task.type.ordered)
    ends = Counter(table.draw_check(ordered, random) for _ in range(200))
    assert set(ends) == {"", "check"}
    assert ends["check"] == pytest.approx(100, abs=40)
