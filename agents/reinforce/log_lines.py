"""What the log says of episodes: a line for each, and means over those of an update."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any

from agents.reinforce.episodes import Episode
from agents.reinforce.rewards import rewards_of
from agents.reinforce.settings import ReinforceSettings


def lines_of(
    episodes: Sequence[Episode], settings: ReinforceSettings, update: int
) -> list[dict[str, Any]]:
    """A line for the log of each."""
    return [line_of(e, rewards_of(e.record, settings.rewards), update) for e in episodes]


def line_of(
    episode: Episode, rewards: Mapping[str, Sequence[float]], update: int
) -> dict[str, Any]:
    """A line for the log, with what each reward gave to the turns, (turns,)."""
    record = episode.record
    return {
        "update": update,
        "task": record.task_id,
        "start": episode.start,
        "sample": record.sample,
        "type": record.task_type,
        "success": record.success,
        "ended": record.end_reason or "cut short",  # by play.turns
        "turns": len(episode.turns),
        "tokens": sum(len(turn.said) for turn in episode.turns),
        "rewards": {name: round(sum(each), 6) for name, each in rewards.items()},
    }


def means_of(lines: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Means over the episodes of an update."""
    if not lines:
        return {"success": 0.0, "reward": 0.0}
    ended = Counter(each["ended"] for each in lines)
    return {
        "success": fmean(each["success"] for each in lines),
        "reward": fmean(sum(each["rewards"].values()) for each in lines),
        **{
            f"reward/{name}": fmean(each["rewards"][name] for each in lines)
            for name in lines[0]["rewards"]
        },
        **{f"ended/{name}": count / len(lines) for name, count in sorted(ended.items())},
        "turns": fmean(each["turns"] for each in lines),
        "tokens_said": fmean(each["tokens"] for each in lines),
    }
