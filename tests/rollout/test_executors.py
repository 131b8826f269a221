"""The common behaviour of all executors: events, attachments, agents that stop, bad input."""

from __future__ import annotations

import agents_by_hand as by_hand
import pytest

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import check_attachments
from er_gym.rollout.events import (
    EpisodeBegun,
    EpisodeEnded,
    Reply,
    RunBegun,
    RunEnded,
    StepDone,
    read_events,
)
from er_gym.rollout.executor import Parallelism, PlayedEpisode
from er_gym.rollout.play import play_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import EXECUTORS, RunSummary, Stopped, run
from er_gym.tasks.paper_format import read_tasks

EVERY = pytest.mark.parametrize("executor", sorted(EXECUTORS))


@pytest.fixture
def tasks(tasks_file):
    return read_tasks(tasks_file)[:3]


@pytest.fixture
def new(tmp_path, manifest):
    changed = {"agent": "by hand", "env": {"obs_mode": "text", "max_steps": 4}}
    return RunDirectory.create(tmp_path / "run", manifest.model_copy(update=changed))


def play(directory, tasks, make_agent, executor, listeners=()):
    size = Parallelism(workers=1, concurrency=1)
    return run(
        directory, tasks, make_agent, executor=executor, parallelism=size, listeners=listeners
    )


@EVERY
def test_the_events_of_a_run_and_of_its_continuation(new, tasks, executor):
    heard = []
    assert play(new, tasks[:1], by_hand.ending, executor, [heard.append]) == RunSummary(1, 0, ())
    first = list(read_events(new.path))
    assert [type(event) for event in first] == [
        RunBegun,
        EpisodeBegun,
        Reply,
        StepDone,
        EpisodeEnded,
        RunEnded,
    ]
    _, begun, reply, step, ended, _ = first
    assert (begun.task_id, begun.max_steps, begun.instruction) == ("paper-0", 4, "Take the Apple.")
    assert (reply.step, reply.model, reply.cost) == (1, "m", 0.01)
    record = new.episode("paper-0")
    assert (step.step, step.verb, step.thought) == (1, "end", "done")
    assert step.feedback == record.steps[1].feedback != ""
    assert (ended.steps, ended.end_reason, ended.error) == (1, "end", "")
    assert ended.side_effects == len(record.side_effects)
    assert heard == [first[0], *first[-2:]]  # steps and replies are in the stream only
    if executor == "processes":
        return  # what follows is the runner's, whatever executes it

    assert play(new, tasks[:2], by_hand.ending, executor) == RunSummary(1, 1, ())
    events = list(read_events(new.path))
    assert events[: len(first)] == first
    assert (events[len(first)].tasks, events[len(first)].done) == (2, 1)
    assert {event.task_id for event in events[len(first) + 1 : -1]} == {"paper-1"}


@EVERY
def test_an_agent_that_cannot_go_on_stops_the_run(new, tasks, executor):
    with pytest.raises(Stopped, match="the budget is spent") as stopped:
        play(new, tasks, by_hand.broke_at_last, executor)
    assert stopped.value.summary == RunSummary(2, 0, ())
    assert [each.task_id for each in new.episodes()] == ["paper-0", "paper-1"]
    last = list(read_events(new.path))[-1]
    assert (last.played, last.stopped) == (2, "the budget is spent")


def test_text_that_no_file_can_hold_is_escaped(new, tasks):
    events = []
    env = EmbodiedEnv((), obs_mode="text")
    crashed = play_episode(env, by_hand.Surrogate(), tasks[0], 0, emit=events.append)
    env.close()
    assert crashed.error.startswith(r"ValueError: \ud800 (")
    assert crashed.steps[1].thought == events[-1].thought == r"\ud800"
    new.write(crashed)
    assert list(new.episodes()) == [crashed]


def test_attachments_replace_those_of_the_same_task(new, episode):
    record = episode((), ("end",), task_id="paper-0")
    notes = new.path / "notes"
    for name in ("paper-0.old", "paper-0/2.txt", "paper-0.5.txt", "other.txt"):
        (notes / name).parent.mkdir(parents=True, exist_ok=True)
        (notes / name).write_bytes(b"earlier")
    new.write(record)
    files = {"notes/paper-0.txt": b"well", "notes/paper-0/1.txt": b"one"}
    played = PlayedEpisode.by(by_hand.Leaving(files), record)
    for _ in range(2):  # twice is harmless
        new.attach("paper-0", played.attachments, played.folders)
    left = {str(path.relative_to(notes)): path.read_bytes() for path in notes.rglob("*.*")}
    assert left == {
        "paper-0.txt": b"well",
        "paper-0/1.txt": b"one",
        "paper-0.5.txt": b"earlier",  # of the task "paper-0.5"
        "other.txt": b"earlier",
    }


def test_an_agent_that_fails_to_leave_its_files_costs_one_episode(episode):
    def fail():
        raise OSError("the files are gone")

    record = episode((), ("end",)).model_copy(update={"success": True, "end_reason": "end"})
    crashed = PlayedEpisode.by(by_hand.Leaving(fail), record).record
    assert crashed.error.startswith("OSError: the files are gone (")
    assert (crashed.success, crashed.end_reason) == (False, "")
    assert crashed.steps == record.steps


@pytest.mark.parametrize(
    ("path", "folders"),
    [
        ("episodes/paper-0.json", ("episodes",)),
        ("run.json/paper-0.txt", ("run.json",)),
        ("notes/other.txt", ("notes",)),
        ("notes/paper-0.5.txt", ("notes",)),
        ("notes/paper-0", ("notes",)),
        ("notes/paper-0/../../run.json", ("notes",)),
        ("../notes/paper-0.txt", ("notes",)),
        ("/notes/paper-0.txt", ("notes",)),
        ("notes/paper-0.txt", ()),
        ("a/b/paper-0.txt", ("a/b",)),
        ("../paper-0.txt", ("..",)),
    ],
)
def test_attachments_outside_the_agents_folders_are_refused(episode, path, folders):
    with pytest.raises(ValueError, match="is not allowed; give"):
        check_attachments({path: b""}, folders, "paper-0")
    record = episode((), ("end",), task_id="paper-0")
    played = PlayedEpisode.by(by_hand.Leaving({path: b""}, folders), record)
    assert "is not allowed" in played.record.error
    assert (dict(played.attachments), played.folders) == ({}, ())


def test_attachments_are_bytes():
    with pytest.raises(TypeError, match=r"'notes/t\.txt' is str; give bytes"):
        check_attachments({"notes/t.txt": "well"}, ("notes",), "t")


def test_an_unknown_executor_is_refused_before_anything_happens(new, tasks):
    with pytest.raises(ValueError, match="unknown executor 'cluster'; choose one of: processes, t"):
        play(new, tasks, by_hand.ending, "cluster")
    assert list(read_events(new.path)) == []


def test_an_agent_that_cannot_be_sent_to_processes_is_refused(new, tasks):
    with pytest.raises(ValueError, match=r"cannot be sent to worker processes.*executor='threads'"):
        play(new, tasks, lambda task, seed: by_hand.Ending(), "processes")
    assert list(new.episodes()) == []


@pytest.mark.parametrize("bad", [{"workers": 0}, {"concurrency": -1}, {"deadline": 0.0}])
def test_parallelism_out_of_range_is_refused(bad):
    (name,) = bad
    with pytest.raises(ValueError, match=f"{name} is .*; give"):
        Parallelism(**bad)
