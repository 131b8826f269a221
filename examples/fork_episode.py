"""Saves an episode in the middle, goes back to it elsewhere, and goes on from there in two ways.

    python examples/fork_episode.py [FILE]

A snapshot holds the whole episode in some kilobytes: the task, the objects, the agent and what it
remembers. Any environment with the same arguments goes on from it, in this process or another.
"""

import sys
from pathlib import Path

import er_gym

file = Path(sys.argv[1] if len(sys.argv) > 1 else "episode.snapshot")
task = next(task for task in er_gym.load_suite("mini").tasks if task.type.name == "single_pickup")
right = [f"{action.verb} {action.object_type}".strip() for action in task.key_actions]

env = er_gym.EmbodiedEnv(obs_mode="text")
env.reset(seed=0, options={"task": task})
env.step(right[0])
print(f"{task.instruction}\n{right[0]}")

# Save the episode. Another process could open it.
file.write_bytes(env.snapshot())
env.close()
saved = er_gym.EmbodiedEnv(obs_mode="text")
saved.restore(file.read_bytes())

# Fork it: what is done in one environment changes nothing in the other.
(fork,) = saved.fork(1)
for branch, actions in ((saved, right[1:]), (fork, ["observe", "end"])):
    for action in actions:
        obs, reward, terminated, truncated, info = branch.step(action)
        print(f"    {action} -> reward {reward:g}")
    print(f"    success: {info['success']}\n")
    branch.close()
