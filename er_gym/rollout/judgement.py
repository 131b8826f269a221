"""The verdict of the environment's judge on an episode, from its record alone."""

from __future__ import annotations

from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.judge import Criteria, Progress, progress_by_step, replay
from er_gym.tasks.task import KeyAction
from er_gym.tasks.types import task_type
from er_gym.tasks.verbs import canonical_verb


def judged(episode: EpisodeRecord) -> Progress:
    """The verdict of the environment's judge on an episode, from its record alone.

    A record can lack the search targets (:func:`lacks_search_targets`). Whether the agent could
    interact with them at ``end`` then follows from what the environment said, whose rule for that
    has not changed.
    """
    return replay(_criteria(episode), episode.steps, goal_holds=_goal_holds(episode))


def judged_by_step(episode: EpisodeRecord) -> list[Progress]:
    """How far the episode had come after each of its steps, as :func:`judged` counts."""
    return [*progress_by_step(_criteria(episode), episode.steps, goal_holds=_goal_holds(episode))]


def _criteria(episode: EpisodeRecord) -> Criteria:
    kind = task_type(episode.task_type)
    return Criteria(
        key_actions=tuple(
            KeyAction(canonical_verb(key.verb), key.object_id, key.object_type, reward=key.reward)
            for key in episode.key_actions
        ),
        ordered=kind.ordered,
        named=frozenset(key.object_id for key in episode.key_actions if key.exact),
        targets=frozenset(episode.search_targets or ()),
    )


def _goal_holds(episode: EpisodeRecord) -> bool:
    found = episode.success if lacks_search_targets(episode) else True
    return found and not episode.goal_unmet


def lacks_search_targets(episode: EpisodeRecord) -> bool:
    """Whether the episode is a search with an old record, which lacks the search targets."""
    return episode.search_targets is None and task_type(episode.task_type).search
