"""What is measured of many environments is steps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.perf.vectors import Player

SHORT = {"obs_mode": "state", "episode_source": "mini", "task_type": None, "max_steps": 4}


@pytest.mark.parametrize("mode", ["", "vector_entry_point"])
def test_a_player_steps_on_after_an_episode(mode: str):
    player = Player(mode, 1, SHORT)
    taken = []
    for _ in range(8):
        player.play(1)
        taken.append(int(np.ravel(player._info["steps"])[0]))
    # Placing the agent is the first step; a turn is spent on beginning the next episode.
    assert taken.count(1) <= 4
    assert max(taken) > 1
