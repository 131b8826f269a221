"""Records as they are written."""

import sys

import pytest

from agents.vlm.record import RoundRecord, TrimmedRecord
from er_gym.rollout.events import EpisodeEnded
from er_gym.rollout.records import EpisodeRecord, StepRecord

ENDED = {
    "task_id": "t",
    "task_type": "single_search",
    "success": True,
    "end_reason": "end",
    "total_reward": 1.0,
    "seconds": 0.5,
}
STEP = StepRecord(verb="open", success=False)
EPISODE = EpisodeRecord(
    **ENDED,
    scene="FloorPlan1",
    instruction="Find the mug.",
    name="Find the mug.",
    key_actions=[],
    max_steps=20,
    agent="oracle",
    seed=1,
    steps=[STEP, STEP.model_copy(update={"by": "person", "causes": ["format"]})],
)
RECORDS = [
    pytest.param(EPISODE, {"sample": 2, "cause": "format", "gave_up": "why", "side_effects": []}),
    pytest.param(STEP, {"by": "person", "causes": ["format"], "fault": "open"}),
    pytest.param(
        EpisodeEnded(**ENDED, steps=3),
        {
            "replies": 2,
            "causes": {"format": 1},
            "unusable": {"format": 1},
            "ended": "x",
            "side_effects": 0,
        },
    ),
    pytest.param(
        RoundRecord(message=2),
        {"by": "person", "trimmed": TrimmedRecord(pictures=1, messages=0, why="too long")},
    ),
]


@pytest.mark.parametrize(("record", "added"), RECORDS)
def test_fields_that_came_later_are_left_out_where_they_have_their_default(record, added):
    assert not added.keys() & record.model_dump().keys()
    assert not [name for name in added if f'"{name}"' in record.model_dump_json()]
    told = record.model_copy(update=added)
    assert added.keys() <= told.model_dump().keys()
    assert type(record).model_validate_json(told.model_dump_json()) == told
    assert type(record).model_validate_json(record.model_dump_json()) == record


@pytest.mark.parametrize(("record", "added"), RECORDS)
def test_no_python_code_runs_while_a_record_is_written(record, added):
    """Ctrl-C is raised in Python code, and what pydantic calls it would turn into another error."""
    called, told = [], record.model_copy(update=added)

    def note(frame, event, argument):
        if event == "call":
            called.append(frame.f_code.co_name)

    sys.setprofile(note)
    try:
        record.model_dump_json(indent=1)
        told.model_dump_json(indent=1)
    finally:
        sys.setprofile(None)
    assert called == ["model_dump_json"] * 2
