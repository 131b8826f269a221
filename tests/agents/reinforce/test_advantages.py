"""Advantages against hand computation."""

from __future__ import annotations

import pytest

from agents.reinforce.advantages import ADVANTAGES, returns, spread, widest
from agents.reinforce.episodes import ScoredEpisode
from agents.reinforce.settings import AdvantageSettings


def episode(
    *rewards: float, anchors: str = "", values: tuple[float | None, ...] = ()
) -> ScoredEpisode:
    return ScoredEpisode(rewards, tuple(anchors) or ("?",) * len(rewards), rewards[-1] > 0, values)


GROUP = (episode(0, 1), episode(0), episode(0, 0, 0), episode(2))  # they earn 1, 0, 0 and 2
DEVIATION = 0.6875**0.5
"""Of 1, 0, 0, 2 about their mean 0.75: (0.0625 + 0.5625 + 0.5625 + 1.5625) / 4."""


@pytest.mark.parametrize(
    ("row", "each"),
    [
        ("mean", (0.25, -0.75, -0.75, 1.25)),
        ("grpo", tuple(one / DEVIATION for one in (0.25, -0.75, -0.75, 1.25))),
        # less the mean of the others: 2/3, 1, 1 and 1/3
        ("rloo", (1 / 3, -1, -1, 5 / 3)),
        ("successes", (1, 0, 0, 1)),
    ],
)
def test_episodes_are_compared(row: str, each: tuple[float, ...]) -> None:
    found = ADVANTAGES.get(row).of(GROUP, AdvantageSettings())
    assert [len(one) for one in found] == [2, 1, 3, 1]
    for one, expected in zip(found, each, strict=True):
        assert one == pytest.approx([expected] * len(one))


def test_equal_episodes_have_no_advantage() -> None:
    equal = (episode(1), episode(0.5, 0.5))
    for row in ("grpo", "mean", "rloo"):
        assert ADVANTAGES.get(row).of(equal, AdvantageSettings()) == [[0.0], [0.0, 0.0]]
    assert spread(equal) == 0.0
    assert spread(GROUP) == 2.0


def test_the_episodes_that_differ_most_are_learnt() -> None:
    group = tuple(episode(each) for each in (1, 0, 1, 1, 0.9, 1))
    assert sorted(group[place].total for place in widest(group, 2)) == [0, 1]
    assert sorted(group[place].total for place in widest(group, 3)) == [0, 1, 1]
    assert widest(GROUP, 3) == [1, 2, 3]  # 0, 0 and 2 rather than 0, 1 and 2
    assert widest(GROUP, 9) == [0, 1, 2, 3]


def test_steps_of_the_same_anchor_are_compared() -> None:
    """Both begin at a; the first comes to b and back to a, the second goes to c."""
    group = (episode(0, 0, 1, anchors="aba"), episode(0, 0, anchors="ac"))
    settings = AdvantageSettings(discount=0.5, step_weight=2.0)
    # from each turn on: 0.25, 0.5, 1 and 0, 0; at a on average (0.25 + 1 + 0) / 3
    at_a = 1.25 / 3
    first, second = ADVANTAGES.get("gigpo").of(group, settings)
    assert first == pytest.approx(
        [0.5 + 2 * (0.25 - at_a), 0.5 + 2 * (0.5 - 0.5), 0.5 + 2 * (1 - at_a)]
    )
    assert second == pytest.approx([-0.5 + 2 * (0 - at_a), -0.5 + 2 * 0.0])


def test_steps_are_worth_what_continuing_says() -> None:
    settings = AdvantageSettings(discount=1.0)
    every = episode(0, 0.25, 1, values=(0.5, 0.75, 0.25))
    second = episode(0, 0.25, 1, values=(0.5, None, 0.25))
    found = ADVANTAGES.get("branches").of((every, second), settings)
    assert found[0] == pytest.approx([0.25, 0.25 + 0.25 - 0.75, 1 - 0.25])
    assert found[1] == pytest.approx([0.25 + 0.25 - 0.5] * 2 + [0.75])
    halved = ADVANTAGES.get("branches").of((second,), AdvantageSettings(discount=0.5))
    assert halved[0][0] == pytest.approx(0.5 * 0.25 + 0.25 * 0.25 - 0.5)


def test_returns_are_discounted() -> None:
    assert returns([1, 0, 4], 0.5) == [2.0, 2.0, 4.0]
