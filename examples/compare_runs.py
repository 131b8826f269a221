"""Compares two runs of the same tasks: success with 95 % intervals, and the paired difference.

    python examples/compare_runs.py                   # plays with the random agent and the searcher
    python examples/compare_runs.py runs/a runs/b     # compares two runs of er-gym bench

er-gym report runs/a runs/b prints many more figures.
"""

import sys
from pathlib import Path

import er_gym
from agents import make_agent
from benchmarks.scoring.metrics import score_episode, success_rate
from benchmarks.scoring.paired import paired_difference
from benchmarks.scoring.report import load_run
from benchmarks.scoring.scorers import CORRECTED

TASKS = er_gym.load_suite("mini").tasks[::6]


def scores_of(run):
    """The scores of a run directory's episodes; or plays the tasks with an agent of this name."""
    if Path(run).is_dir():
        return load_run(Path(run)).scores[CORRECTED.name]
    agent = make_agent(run, seed=0)
    # "explore": the name of a type means the nearest object, not the one that the task wants.
    env = er_gym.EmbodiedEnv(obs_mode=agent.obs_mode, instances="explore")
    episodes = [er_gym.play_episode(env, agent, task, seed=0) for task in TASKS]
    env.close()
    return [score_episode(episode, CORRECTED) for episode in episodes]


def in_words(estimate):
    """A mean in % with its interval."""
    return f"{estimate.mean:.1%} ({estimate.low:.1%} to {estimate.high:.1%})"


runs = sys.argv[1:] or ["random", "searcher"]
if len(runs) != 2:
    sys.exit(__doc__)
before, after = map(scores_of, runs)
for run, scores in zip(runs, (before, after), strict=True):
    rate = success_rate([score.task_id for score in scores], [score.success for score in scores])
    print(f"{run}: {in_words(rate)} of {len(scores)} episodes")

# Pairing by task takes out how hard each task is. If the interval leaves out 0, one run is better.
print(f"difference: {in_words(paired_difference(before, after))}")
