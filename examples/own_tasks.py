"""A task file of your own: write two tasks, read the file, and let the oracle play them.

    python examples/own_tasks.py [FILE]
    er-gym bench --tasks-file FILE --agent oracle

The second line plays the file on the command line. docs/tasks.md has the rules of success.
"""

import sys

import er_gym
from agents import make_agent
from er_gym.tasks import KeyAction, suite_from_file, task_type
from er_gym.tasks.goal import Condition
from er_gym.tasks.jsonl_format import write_tasks

TASKS = [
    er_gym.Task(
        id="lamp",
        type=task_type("single_toggle"),  # the types: er-gym envs
        scene="FloorPlan301",
        instruction="Would you flip the switch of the desk lamp?",
        # What must be done, each worth a reward of 1. Any object of the type counts.
        key_actions=(
            KeyAction("navigate to", object_type="DeskLamp"),
            KeyAction("toggle", object_type="DeskLamp"),
            KeyAction("end"),
        ),
    ),
    er_gym.Task(
        id="cold-apple",
        type=task_type("pickup_and_put_in_closerep"),
        scene="FloorPlan1",
        instruction="Put the apple into the fridge.",
        key_actions=(
            KeyAction("navigate to", object_type="Apple"),
            KeyAction("pickup", object_type="Apple"),
            KeyAction("navigate to", object_type="Fridge"),
            KeyAction("open", object_type="Fridge"),
            KeyAction("put in", object_type="Fridge"),
            KeyAction("end"),
        ),
        navigable_objects=("Apple", "Fridge"),  # the agent may go there before it has seen them
        goal=(Condition("Apple", inside="Fridge"),),  # what must be true at the end
    ),
]

path = sys.argv[1] if len(sys.argv) > 1 else "own_tasks.jsonl"
write_tasks(path, TASKS, force=False)  # replaces no other kind of file
suite = suite_from_file(path)
agent = make_agent("oracle")
env = er_gym.EmbodiedEnv(path, obs_mode=agent.obs_mode)
for task in suite.tasks:
    episode = er_gym.play_episode(env, agent, task, seed=0)
    print(f"{task.id}: {task.instruction} {episode.total_reward:g} of {task.total_reward:g} points")
    for step in episode.predicted:
        print(f"    {step.text} -> {step.feedback}")
env.close()
