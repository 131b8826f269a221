"""Solves tasks by search: it goes back to the best episode so far, and tries every action there.

    python examples/best_first_search.py [NUMBER_OF_TASKS]

The search knows nothing but the reward. An episode is better the more key actions it has done, and
then the fewer steps it took. Going back to an episode takes less than a millisecond.
"""

import heapq
import itertools
import sys
import time
from typing import Any

import numpy as np

import er_gym
from er_gym.envs.actions import ACTIONS

MOST_TRIED = 5000
"""Steps after which the search gives a task up."""
Path = tuple[str, ...]


def solve(env: er_gym.EmbodiedEnv, task: er_gym.Task) -> tuple[Path, int]:
    """The actions that solve a task, empty if none were found, and the number of steps tried."""
    _, info = env.reset(options={"task": task})
    numbers, tried = itertools.count(), 0  # a number decides between equals, the older first
    frontier: list[Any] = [(0, 0, next(numbers), env.snapshot(), info["action_mask"], ())]
    seen = set()
    while frontier and tried < MOST_TRIED:
        _, steps, _, saved, legal, path = heapq.heappop(frontier)
        for action in np.flatnonzero(legal).tolist():
            env.restore(saved)
            _, _, terminated, truncated, info = env.step(action)
            tried += 1
            longer = (*path, str(ACTIONS[action]))
            if info["success"]:
                return longer, tried
            where = (env.agent_pose, info["held"], info["action_mask"].tobytes())
            if not (terminated or truncated) and info["action_success"] and where not in seen:
                seen.add(where)
                left, snapshot = info["key_actions_left"], env.snapshot()
                entry = (left, steps + 1, next(numbers), snapshot, info["action_mask"], longer)
                heapq.heappush(frontier, entry)
    return (), tried


if __name__ == "__main__":
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    env = er_gym.EmbodiedEnv(obs_mode="state")
    for task in er_gym.load_suite("mini").tasks[::11][:number]:
        began = time.perf_counter()
        path, tried = solve(env, task)
        print(f"{task.instruction}\n    {', '.join(path) or 'not solved'}")
        print(f"    {tried} steps tried in {time.perf_counter() - began:.1f} s")
