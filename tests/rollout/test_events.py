"""The event stream: its lines, the lines that readers skip, and its listeners."""

from __future__ import annotations

import json
import threading

import pytest

from er_gym.rollout.events import (
    EVENTS,
    Cost,
    EpisodeBegun,
    EpisodeEnded,
    EventLog,
    Reply,
    RunBegun,
    RunEnded,
    StepDone,
    parse_events,
    read_events,
)

GOLDEN = r"""
{"time":1.5,"kind":"run_begun","format":"er-gym/events/1","suite":"mini","agent":"random","tasks":3,"done":1}
{"time":1.5,"kind":"episode_begun","task_id":"t","task_type":"single_search","scene":"FloorPlan1","instruction":"Find it.","max_steps":22}
{"time":1.5,"kind":"reply","task_id":"t","step":1,"model":"m","seconds":0.5,"prompt_tokens":7,"completion_tokens":2,"cost":0.01,"cached":true}
{"time":1.5,"kind":"step","task_id":"t","step":1,"verb":"open","object_type":"Fridge","success":true,"reward":-0.5,"thought":"hm","feedback":"Done: open Fridge."}
{"time":1.5,"kind":"episode_ended","task_id":"t","task_type":"single_search","success":false,"end_reason":"","total_reward":-0.5,"steps":1,"seconds":2.0,"error":"ValueError: no"}
{"time":1.5,"kind":"cost","requests":4,"tokens":1000,"cost":0.25,"estimated":true}
{"time":1.5,"kind":"run_ended","played":2,"crashed":1,"stopped":"KeyboardInterrupt: "}
""".strip()  # noqa: E501
EVENTS_OF_EACH_KIND = (
    RunBegun(time=1.5, suite="mini", agent="random", tasks=3, done=1),
    EpisodeBegun(
        time=1.5,
        task_id="t",
        task_type="single_search",
        scene="FloorPlan1",
        instruction="Find it.",
        max_steps=22,
    ),
    Reply(
        time=1.5,
        task_id="t",
        step=1,
        model="m",
        seconds=0.5,
        prompt_tokens=7,
        completion_tokens=2,
        cost=0.01,
        cached=True,
    ),
    StepDone(
        time=1.5,
        task_id="t",
        step=1,
        verb="open",
        object_type="Fridge",
        success=True,
        reward=-0.5,
        thought="hm",
        feedback="Done: open Fridge.",
    ),
    EpisodeEnded(
        time=1.5,
        task_id="t",
        task_type="single_search",
        success=False,
        end_reason="",
        total_reward=-0.5,
        steps=1,
        seconds=2.0,
        error="ValueError: no",
    ),
    Cost(time=1.5, requests=4, tokens=1000, cost=0.25, estimated=True),
    RunEnded(time=1.5, played=2, crashed=1, stopped="KeyboardInterrupt: "),
)


def log(folder, *events, listeners=()):
    stream = EventLog(folder, listeners)
    for event in events:
        stream(event)
    stream.close()


def test_the_lines_of_the_stream(tmp_path):
    """A change of these lines that an older reader would misread takes a new format."""
    log(tmp_path, *EVENTS_OF_EACH_KIND)
    assert (tmp_path / EVENTS).read_text() == GOLDEN + "\n"
    assert tuple(read_events(tmp_path)) == EVENTS_OF_EACH_KIND


def test_a_stream_of_an_older_version_tells_less(tmp_path):
    """It says no feedback and counts no side effects, which is not to count none of them."""
    step, ended = EVENTS_OF_EACH_KIND[3], EVENTS_OF_EACH_KIND[4]
    older = GOLDEN.splitlines()[3].replace(',"feedback":"Done: open Fridge."', "").encode()
    assert list(parse_events([older])) == [step.model_copy(update={"feedback": ""})]
    log(tmp_path, ended, tidy := ended.model_copy(update={"side_effects": 0}))
    assert [each.side_effects for each in read_events(tmp_path)] == [None, 0]
    assert tidy.model_dump_json()[:-1] == ended.model_dump_json()[:-1] + ',"side_effects":0'


def test_no_stream_has_no_events(tmp_path):
    assert list(read_events(tmp_path)) == []


def test_half_a_line_is_skipped_and_ended_by_the_next_process(tmp_path):
    whole = GOLDEN.splitlines()
    (tmp_path / EVENTS).write_text(whole[0] + "\n" + whole[3][:40])
    assert tuple(read_events(tmp_path)) == EVENTS_OF_EACH_KIND[:1]
    log(tmp_path, EVENTS_OF_EACH_KIND[6])
    assert tuple(read_events(tmp_path)) == (EVENTS_OF_EACH_KIND[0], EVENTS_OF_EACH_KIND[6])


def test_unknown_kinds_are_skipped_and_unknown_fields_ignored(tmp_path):
    later = json.loads(GOLDEN.splitlines()[3]) | {"heart_rate": 90}
    lines = ['{"time": 1.0, "kind": "nap"}', "[]", "nonsense", "", json.dumps(later)]
    assert list(parse_events(line.encode() for line in lines)) == [EVENTS_OF_EACH_KIND[3]]


def test_another_format_is_refused(tmp_path):
    line = GOLDEN.splitlines()[0].replace("events/1", "events/2")
    (tmp_path / EVENTS).write_text(line + "\n" + GOLDEN)
    with pytest.raises(ValueError, match=r"'er-gym/events/2', not 'er-gym/events/1'; read it with"):
        list(read_events(tmp_path))


def test_listeners_hear_each_event_once_in_order(tmp_path):
    one, two = [], []
    log(tmp_path, *EVENTS_OF_EACH_KIND, listeners=[one.append, two.append])
    assert tuple(one) == tuple(two) == EVENTS_OF_EACH_KIND


def test_a_closed_stream_still_calls_listeners(tmp_path):
    heard = []
    stream = EventLog(tmp_path, [heard.append])
    stream.close()
    stream(EVENTS_OF_EACH_KIND[0])
    assert heard == [EVENTS_OF_EACH_KIND[0]]
    assert (tmp_path / EVENTS).read_bytes() == b""


def test_lines_of_several_writers_do_not_mix(tmp_path):
    event = EVENTS_OF_EACH_KIND[3].model_copy(update={"thought": "x" * 10_000})
    threads = [threading.Thread(target=log, args=(tmp_path, *[event] * 50)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert list(read_events(tmp_path)) == [event] * 200


@pytest.mark.parametrize("hard", [True, False])
def test_a_link_is_not_written_to(tmp_path, hard):
    other = tmp_path / "other"
    other.write_text("theirs")
    (tmp_path / EVENTS).hardlink_to(other) if hard else (tmp_path / EVENTS).symlink_to(other)
    with pytest.raises(ValueError, match="is a link, or not a regular file"):
        EventLog(tmp_path)
    assert other.read_text() == "theirs"
