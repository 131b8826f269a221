"""The supervisor stops a run whose server refuses requests, and reports waits."""

from __future__ import annotations

import time

import pytest

from agents.vlm.chat import ModelError
from agents.vlm.clients import supervisor as module
from agents.vlm.clients.supervisor import RequestSupervisor, ServerEvent, duration
from er_gym.rollout.agent import CannotGoOn


@pytest.fixture
def supervisor() -> RequestSupervisor:
    made = RequestSupervisor()
    made.show = lambda server_event: None
    return made


def test_three_requests_given_up_in_a_row_stop_the_run(supervisor: RequestSupervisor) -> None:
    kinds = [type(supervisor.request(0).gave_up("503")) for _ in range(3)]
    assert kinds == [ModelError, ModelError, CannotGoOn]
    assert type(supervisor.request(0).gave_up("503")) is ModelError  # the count starts again


def test_a_reply_between_them_does_not(supervisor: RequestSupervisor) -> None:
    for _ in range(9):
        assert type(supervisor.request(0).gave_up("503")) is ModelError
        supervisor.request(0).answered()


def test_one_request_is_enough_where_others_fail_too_and_nobody_has_a_reply(
    supervisor: RequestSupervisor,
) -> None:
    first, second, third = (supervisor.request(seed) for seed in range(3))
    for request in (first, second, third):
        request.retry("503", 0.0, of=6)
    error = first.gave_up("503")
    assert str(error).startswith("the server has refused 3 requests in a row, the last with: 503;")
    # The others end with it, and do not count as failures.
    assert isinstance(second.gave_up("late"), CannotGoOn)
    with pytest.raises(CannotGoOn, match="refused 3 requests"):
        third.wait(60)


def test_a_server_that_fails_often_is_not_dead(supervisor: RequestSupervisor) -> None:
    unlucky, *others = (supervisor.request(seed) for seed in range(4))
    unlucky.retry("503", 0.0, of=6)
    supervisor.request(9).answered()
    for request in others:
        request.retry("503", 0.0, of=6)
    assert type(unlucky.gave_up("503")) is ModelError


def test_minutes_end_a_wait() -> None:
    began = time.monotonic()
    supervisor = RequestSupervisor(max_minutes=0.2 / 60)
    request = supervisor.request(0)
    with pytest.raises(CannotGoOn, match="minutes are over; run the same command again"):
        request.wait(60)
    assert 0.1 < time.monotonic() - began < 5
    assert supervisor.over


def test_a_spent_budget_ends_waits_and_not_answers(supervisor: RequestSupervisor) -> None:
    request = supervisor.request(0)
    supervisor.stop("the budget is spent", waits_for_answers=True)
    assert request.left(answering=True) > 0
    with pytest.raises(CannotGoOn, match="the budget is spent"):
        request.wait(60)
    assert supervisor.request(0).left() > 0  # one that begins afterwards asks the ledger itself


def test_one_of_those_who_wait_says_so(
    supervisor: RequestSupervisor, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[ServerEvent] = []
    supervisor.show = shown.append
    requests = [supervisor.request(seed) for seed in range(3)]
    monkeypatch.setattr(supervisor, "_last_news", time.monotonic() - supervisor._quiet)
    for request in requests:
        request.attempt, request.of = 1, 6
        request.still_waiting("no answer for 15 s", 15.0)
    assert [str(server_event) for server_event in shown] == ["no answer for 15 s (try 1 of 6)"]


def test_who_does_not_listen_harms_nobody(supervisor: RequestSupervisor) -> None:
    def closed(server_event: ServerEvent) -> None:
        raise BrokenPipeError

    supervisor.show = closed
    supervisor.request(0).retry("503", 0.0, of=6)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.51, "0.5 s"), (90, "90 s"), (300, "5 min"), (86_400, "24 h"), (float("inf"), "for ever")],
)
def test_durations(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_a_wait_is_never_too_long_for_a_thread(supervisor: RequestSupervisor) -> None:
    request = supervisor.request(0)
    assert module._LONGEST_WAIT < 1e6
    supervisor.close()
    with pytest.raises(ModelError, match="closed"):
        request.wait(float("inf"))
