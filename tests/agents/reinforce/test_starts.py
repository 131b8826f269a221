"""Where groups begin: right after an action that was refused, each time in the same state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from zlib import crc32

import pytest
from played import played

from agents.reinforce.episodes import Episode
from agents.reinforce.player import Job
from agents.reinforce.settings import PlaySettings
from agents.reinforce.starts import after_refusals, insists, turns_after_refusals
from er_gym.rollout.records import StepRecord


def episode(*legal: bool, appended: bool = False) -> Episode:
    """One in which these actions were possible."""
    return played([StepRecord(verb="open", success=each) for each in legal], appended=appended)


@pytest.mark.parametrize(
    ("legal", "turns"),
    [
        ((), []),
        ((True, True), []),
        ((False, True, True), [1]),
        ((True, False, False, True), [2, 3]),
        ((True, False), []),  # nothing was said after it
    ],
)
def test_the_turns_after_a_refusal(legal: tuple[bool, ...], turns: list[int]) -> None:
    assert turns_after_refusals(episode(*legal).record) == turns
    assert turns_after_refusals(episode(*legal, appended=True).record) == turns


def test_it_insists_where_it_names_the_same_type_again() -> None:
    told = [("open", "Drawer", True), ("open", "Drawer", False), ("navigate to", "Drawer", True)]
    told += [("pickup", "Cup", False), ("move forward", "", False), ("rotate left", "", True)]
    steps = [StepRecord(verb=verb, object_type=name, success=ok) for verb, name, ok in told]
    record = played(steps).record
    assert turns_after_refusals(record) == [2, 4, 5]
    assert insists(record) == [True, False, False]


def test_only_episodes_from_the_same_state_are_compared() -> None:
    one = episode(True)
    assert one.group == replace(one).group
    assert one.group != replace(one, start=2).group


def test_a_group_goes_on_from_one_state() -> None:
    legal = {"a": (False, True, False, True), "b": (True, True)}

    def play(jobs: Sequence[Job], *, forks: bool) -> list[tuple[Job, Episode, Any]]:
        assert forks
        return [
            (
                job,
                episode(*legal[job.task.id]),
                SimpleNamespace(
                    forks=[f"{job.task.id}{turn}" for turn in range(4)],
                    snapshots=[f"{job.task.id}{turn}".encode() for turn in range(4)],
                ),
            )
            for job in jobs
        ]

    def groups(places: int, number: int) -> list[int]:
        """The turns before which groups begin."""
        tasks: Any = [cast(Any, SimpleNamespace(id=name)) for name in legal]
        sampler: Any = SimpleNamespace(play=play)
        how = PlaySettings(group=3, starts="refusal", places=places, turns=5)
        whole, jobs = after_refusals(
            sampler, tasks, how, lambda key: crc32(f"{number}/{key}".encode())
        )
        assert [len(each.turns) for each in whole] == [4, 2]
        assert len({job.key for job in jobs}) == len({job.seed for job in jobs}) == len(jobs)
        starts = [job.start for job in jobs[::3]]
        for at, start in enumerate(starts):
            group = jobs[3 * at : 3 * at + 3]
            assert [(job.task.id, job.sample, job.start, job.turns) for job in group] == [
                ("a", sample, start, 5) for sample in (1, 2, 3)
            ]
            [(agent, snapshot)] = {(str(job.agent), job.snapshot) for job in group}
            assert agent == f"a{start}"
            assert snapshot == agent.encode()
        return starts

    assert {each for number in range(20) for each in groups(1, number)} == {1, 3}
    assert sorted(groups(2, 0)) == sorted(groups(9, 0)) == [1, 3]
