"""The paper's figures, beside which statistics of collections are shown.

Sources: the paper *Embodied-Reasoner* (arXiv 2503.21696, version 2), its figure of transitions
between thoughts, and counts in the training file that its authors published (9,390 records).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from er_gym.data.trajectory import ThoughtKind
from er_gym.tasks import verbs

BEGIN, ACTION = "begin", "action"
"""Where an episode's thoughts begin, and what they lead to."""

THOUGHTS: Mapping[ThoughtKind, int] = {
    "analysis": 8_882,
    "reasoning": 26_434,
    "planning": 36_663,
    "reflection": 17_552,
    "verification": 2_131,
}
"""How many thoughts of each kind the paper counts."""

TRANSITIONS: Mapping[str, Mapping[str, float]] = {
    BEGIN: {"analysis": 100},
    "analysis": {"planning": 55, "reasoning": 45},
    "reasoning": {"planning": 75, ACTION: 19, "verification": 6},
    "planning": {ACTION: 100},
    "reflection": {ACTION: 60, "planning": 40},
    "verification": {ACTION: 100},
    ACTION: {"reasoning": 42, "reflection": 33, "planning": 22, "verification": 3},
}
"""What follows what, in % of each row: the paper's figure."""


@dataclass(frozen=True)
class PaperSet:
    """One of the paper's three training sets.

    Attributes:
        stage: 1 to 3.
        trajectories: how many it has.
        actions: the mean number of actions of a trajectory, ``end`` included.
        pictures: how many it has in all.
        most_pictures: the most of one trajectory.
    """

    stage: int
    trajectories: int
    actions: float
    pictures: int
    most_pictures: int


SETS = (
    PaperSet(1, 1_128, 4.11, 4_636, 11),
    PaperSet(2, 6_246, 7.33, 45_800, 26),
    PaperSet(3, 2_016, 8.63, 13_800, 29),
)
STAGE_OF_PART: Mapping[str, int] = {
    "imitation": 1,
    "exploration": 2,
    "anomalies": 3,
    "corrections": 3,
}
"""Which of the paper's sets a part of a collection stands for, by its name."""

TASK_TYPES: Mapping[str, int] = {
    "single_search": 2_529,
    "single_search_from_closerep": 297,
    "single_pickup": 2_324,
    "single_pickup_from_closerep": 190,
    "single_toggle": 1_067,
    "pickup_and_put": 943,
    "pickup_and_put_in_closerep": 803,
    "pickup_from_closerep_and_put": 154,
    "pickup_from_closerep_and_put_in_closerep": 127,
    "ordered_pickup_two_object_and_put": 956,
}
"""How many trajectories of each type of task the training file has."""

VERBS: Mapping[str, int] = {
    verbs.NAVIGATE: 29_171,
    verbs.PICKUP: 7_916,
    verbs.OPEN: 6_479,
    verbs.CLOSE: 4_788,
    verbs.PUT: 4_038,
    verbs.OBSERVE: 2_381,
    verbs.MOVE_FORWARD: 2_258,
    verbs.TOGGLE: 1_406,
    verbs.END: 9_390,
}
"""How many actions with each verb the training file has."""
