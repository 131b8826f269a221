"""Saves an episode in the middle, opens it again, and goes on from there in two ways.

    python examples/fork_episode.py [FILE]

A copy of an environment holds the task and the actions so far. It replays them, and goes on with
equal observations. pickle runs what is in a file, so open only files that you trust.
"""

import copy
import pickle
import sys
from pathlib import Path

import er_gym

file = Path(sys.argv[1] if len(sys.argv) > 1 else "episode.pickle")
task = next(task for task in er_gym.load_suite("mini").tasks if task.type.name == "single_pickup")
right = [f"{action.verb} {action.object_type}".strip() for action in task.key_actions]

env = er_gym.EmbodiedEnv(obs_mode="text")
env.reset(seed=0, options={"task": task})
env.step(right[0])
print(f"{task.instruction}\n{right[0]}")

# Save the episode. Another process could open it.
file.write_bytes(pickle.dumps(env))
env.close()
saved = pickle.loads(file.read_bytes())

# Fork it: what is done in one copy changes nothing in the other.
fork = copy.deepcopy(saved)
for branch, actions in ((saved, right[1:]), (fork, ["observe", "end"])):
    for action in actions:
        obs, reward, terminated, truncated, info = branch.step(action)
        print(f"    {action} -> reward {reward:g}")
    print(f"    success: {info['success']}\n")
    branch.close()
