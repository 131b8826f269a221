from __future__ import annotations

import pytest

from er_gym.rollout.cluster.warm_queue import WarmQueue


def queue(jobs):
    return WarmQueue(jobs, affinity_key=lambda job: job[0])


def test_a_worker_gets_jobs_of_its_room_in_their_order():
    ours = queue(["a1", "b1", "a2", "b2", "a3"])
    assert ours.take(2, "a") == ("a", ["a1", "a2"])
    assert ours.take(9, "a") == ("a", ["a3"])
    assert ours.take(1, "a") == ("b", ["b1"])
    assert len(ours) == 1


def test_a_new_room_is_one_that_nobody_has_warm_else_the_fullest():
    ours = queue(["a1", "b1", "b2", "b3", "c1", "c2"])
    assert ours.take(1, None, others=["a"]) == ("b", ["b1"])
    assert ours.take(1, None, others=["a", "b", "c"])[0] in ("b", "c")
    full = queue(["a1", "b1", "b2"])
    assert full.take(1, None, others=["a", "b"]) == ("b", ["b1"])


def test_what_was_put_first_is_next_and_alone():
    ours = queue(["a1", "a2"])
    ours.put_first("b9")
    assert ours.has_first
    assert ours.take(5, "a") == ("b", ["b9"])
    assert not ours.has_first
    assert ours.take(5, "a") == ("a", ["a1", "a2"])
    with pytest.raises(IndexError, match="no more jobs"):
        ours.take(1, "a")
