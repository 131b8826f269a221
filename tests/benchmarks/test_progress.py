"""The lines of a run's progress say what its end says."""

from __future__ import annotations

import io

import pytest

from benchmarks.cli.progress import Progress
from benchmarks.terminal import terminal
from er_gym.rollout.events import Cost, EpisodeEnded, RunEnded


def ended(number: int, success: bool = True, error: str = "") -> EpisodeEnded:
    return EpisodeEnded(
        task_id=f"task-{number}",
        task_type="single_search",
        success=success,
        end_reason="" if error else "end",
        total_reward=0.0,
        steps=3,
        seconds=0.1,
        error=error,
    )


def cost(replies: int) -> Cost:
    return Cost(requests=replies, tokens=612 * replies, cost=0.0)


def lines(total: int, *events: EpisodeEnded | Cost | RunEnded) -> list[str]:
    """What is printed before the next event, a text for each event."""
    console = terminal(width=200)
    console.file = io.StringIO()
    said = []
    with Progress(console, "run", total) as progress:
        for event in events:
            before = len(console.file.getvalue())
            progress(event)
            said.append(console.file.getvalue()[before:])
    assert "".join(said) == console.file.getvalue()
    return said


OVER = RunEnded(played=2, crashed=0)


def test_the_last_line_has_the_cost_that_the_end_has():
    said = lines(2, ended(1), cost(3), ended(2), cost(6), OVER)
    assert "2/2" in said[3]
    assert str(cost(6)) in said[3]
    assert "".join(said).count("2/2") == 1


def test_a_later_line_has_the_cost_of_its_own_episode():
    said = lines(3, ended(1), cost(3), ended(2), cost(5), ended(3), cost(6), OVER)
    (line,) = [each for each in said if "2/3" in each]
    assert str(cost(5)) in line


@pytest.mark.parametrize("total", [1, 2])
def test_a_run_that_costs_nothing_has_all_its_lines(total):
    said = lines(total, *map(ended, range(total)), OVER)
    assert "".join(said).count("episodes,") == total
    assert f"{total}/{total} episodes, 100.0 % success" in said[-1]


def test_while_all_have_crashed_none_is_played():
    refused = [ended(number, False, "CannotGoOn: refused") for number in range(2)]
    said = "".join(lines(12, *refused, RunEnded(played=2, crashed=2, stopped="refused")))
    assert "0/12 episodes, 2 crashed" in said
    assert "success" not in said
    said = "".join(lines(2, *refused, OVER))
    assert "2/2 episodes, 0.0 % success" in said


def test_crashes_beside_other_episodes_are_failures():
    said = "".join(lines(10, ended(1), ended(2, False, "OSError: x")))
    assert "2/10 episodes, 50.0 % success" in said
