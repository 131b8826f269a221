"""Plays with verbs that were added, in a process of its own, and prints what it saw, as JSON.

Arguments: the directory to write into.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.vlm.clients.decision_schema import REQUEST_FIELDS
from agents.vlm.parsing import parse as read
from agents.vlm.templates import directory_of, load_templates
from er_gym.envs.actions import ACTIONS, INDEX, parse
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import jsonl_format
from er_gym.tasks.arrangement import Arrangement
from er_gym.tasks.describe import describe
from er_gym.tasks.generate import generator_for
from er_gym.tasks.generate.recipes import read_recipes, recipe_rules
from er_gym.thor import make_controller

out = Path(sys.argv[1])
seen: dict[str, Any] = {"actions": [str(action) for action in ACTIONS]}

# -- what models say, and what they are told
DECISIONS = (
    "clean Mug", "wipe the Mug", "wipe_off(Mug)", "wipe the Mug off", "scrub Mug", "把马克杯擦干净",
    "duck", '{"action": "clean", "object": "Mug"}',
)  # fmt: skip
parsed = [read(f"<DecisionMaking>{said}</DecisionMaking>") for said in DECISIONS]
seen["parsed"] = {
    said: [each.verb, each.name] for said, each in zip(DECISIONS, parsed, strict=True)
}
tool = REQUEST_FIELDS["tools"]["tools"][0]["function"]["parameters"]["properties"]
seen["enum"] = tool["action"]["enum"]
for language in ("en", "zh"):
    templates = load_templates(directory_of("default", language))
    seen[f"meanings {language}"] = {row.form: row.meaning for row in templates.actions}
    seen[f"digest {language}"] = templates.digest

# -- by hand
env = EmbodiedEnv(obs_mode="state+text")
env.reset(seed=0, options={"scene": "FloorPlan1"})
seen["played"] = []
SCRIPT = (
    "duck", "navigate to CounterTop", "observe", "navigate to Mug", "clean mug", "fill mug",
    "fill mug", "pickup mug", "clean floor",
)  # fmt: skip
for said in SCRIPT:
    obs, _, _, _, info = env.step(said)
    assert env.observation_space.contains(obs)
    legal = [str(ACTIONS[k]) for k in np.flatnonzero(info["action_mask"])]
    seen["played"].append([info["action"], info["action_success"], info["feedback"], legal])
env.close()

# -- a task that is generated, written, read and solved
(out / "recipes.yaml").write_text("""\
- name: clean_up
  roles: {dish: [Bowl, Mug], sponge: [DishSponge], place: furniture, food: [Apple, Bread]}
  steps: [do clean: [dish, sponge], do fill: [dish], put: [food, place]]
""")
with make_controller("embedded", scene="FloorPlan1", headless=True) as controller:
    recipes = read_recipes(out / "recipes.yaml")
    generator = replace(generator_for(controller, "FloorPlan1", 0), rules=recipe_rules(recipes))
    task = next(iter(generator.tasks()))
assert task.arrangement.dirty
assert task.arrangement == replace(Arrangement(), dirty=task.arrangement.dirty)
jsonl_format.write_tasks(out / "tasks.jsonl", [task])
env = EmbodiedEnv(str(out / "tasks.jsonl"), obs_mode="state")
obs, info = env.reset(seed=0)
assert env.task == task
solver, over, earned = Solver(), False, []
while not over:
    action, _ = solver.next(with_details(env, info))
    assert info["action_mask"][INDEX[action]], action
    obs, reward, ended, cut, info = env.step(str(action))
    earned.append([str(parse(str(action))), reward])
    over = ended or cut
seen["solved"] = info["success"]
seen["earned"] = earned
seen["description"] = describe(task)
env.close()
print(json.dumps(seen))
