"""Causes that records name are counted, and told with what to do."""

from __future__ import annotations

from episodes_by_hand import make_episode, make_step

from agents.vlm.settings import AgentSettings
from er_gym.rollout.causes import CAUSES, CUT, CauseCount, causes_in, count_causes
from er_gym.rollout.records import EpisodeRecord, StepRecord

KEYS = ("pickup Egg", "end")


def said(text: str, *causes: str) -> StepRecord:
    return make_step(text).model_copy(update={"causes": list(causes)})


def counted(*episodes: EpisodeRecord) -> list[CauseCount]:
    return count_causes(map(causes_in, episodes))


def test_a_good_run_has_no_causes() -> None:
    assert counted(make_episode(KEYS, KEYS)) == []


def test_causes_are_counted_by_reply_and_by_episode() -> None:
    first = make_episode(KEYS, (said("error", CUT), said("pickup Egg", CUT, "mine"), "end"))
    by_a_person = said("end", CUT).model_copy(update={"by": "person"})
    ended = {"cause": "context", "gave_up": "400, too long"}
    second = make_episode(KEYS, ("pickup Egg", by_a_person)).model_copy(update=ended)
    unnamed = make_episode(KEYS, ()).model_copy(update={"gave_up": "no"})
    assert counted(first, second, unnamed) == [
        CauseCount("cut", 2, 4, "replies", 1, 1),
        CauseCount("context", 1, 3, "episodes", 1),
        CauseCount("request", 1, 3, "episodes", 1),
        CauseCount("mine", 1, 4, "replies", 1),
    ]


def test_a_line_says_how_many_what_it_means_and_what_to_do() -> None:
    count = CauseCount("cut", 2, 4, "replies", 1, 1)
    line = (
        "2 of 4 replies were cut at the most tokens of a reply (in 1 episodes, 1 of them named no "
        "action): raise sampling.max_tokens, or have the model think less (reasoning.effort)"
    )
    assert count.sentence() == line
    assert (
        count.sentence({"sampling": {"max_tokens": 64}}) == f"{line}; now: sampling.max_tokens=64"
    )
    assert CauseCount("mine", 1, 4, "episodes", 1).sentence() == (
        "1 of 4 episodes have the cause 'mine'"
    )


def test_the_settings_that_causes_name_exist() -> None:
    known = AgentSettings().model_dump()
    for cause in CAUSES.values():
        for path in cause.settings:
            group, _, name = path.partition(".")
            assert group in known
            assert not name or name in known[group], path
