"""Uses a task type, a shape and an action that were added, and prints what it saw, as JSON.

Arguments: the directory to write into.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import gymnasium
import household_tasks  # before er_gym, which looks for what is added

import er_gym
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.sim.actions import ACTIONS
from er_gym.sim.render.shapes import SHAPES
from er_gym.sim.render.view import draw
from er_gym.tasks import jsonl_format
from er_gym.tasks.generate import generated_types
from er_gym.tasks.types import BY_NAME

out = Path(sys.argv[1])
seen: dict[str, Any] = {
    "types": list(BY_NAME),
    "generated": [kind.name for kind in generated_types()],
    "again": household_tasks.register(household_tasks.OPEN) is household_tasks.OPEN,
    "actions": list(ACTIONS),
    "shapes": list(SHAPES),
}

# -- a task of the type is generated, written, read and solved
live = gymnasium.make("Household-Open-v0", episode_source="generate", obs_mode="state")
_, info = live.reset(seed=0, options={"scene": "FloorPlan1"})
jsonl_format.write_tasks(out / "tasks.jsonl", [live.unwrapped.task])
live.close()
env = er_gym.EmbodiedEnv(str(out / "tasks.jsonl"), task_type="single_open", obs_mode="state")
_, info = env.reset(seed=0)
seen["instruction"] = info["instruction"]
solver, over = Solver(), False
while not over:
    _, _, ended, cut, info = env.step(str(solver.next(with_details(env, info))[0]))
    over = ended or cut
seen["solved"] = info["success"]
env.close()

# -- the action is done, and refuses what does not fit
controller = er_gym.make_controller(scene="FloorPlan1", width=300, height=300)
mug = next(o for o in controller.last_event.metadata["objects"] if o["objectType"] == "Mug")
poses = controller.step("GetInteractablePoses", objectId=mug["objectId"]).metadata["actionReturn"]
pose = {name: poses[0][name] for name in ("rotation", "horizon", "standing")}
position = {axis: poses[0][axis] for axis in "xyz"}
controller.step("TeleportFull", position=position, **pose)
controller.step("DirtyObject", objectId=mug["objectId"])
event = controller.step("PolishObject", objectId=mug["objectId"], shine=2)
now = next(o for o in event.metadata["objects"] if o["objectType"] == "Mug")
seen["polished"] = [event.metadata["actionReturn"], now["isDirty"]]
event = controller.step("PolishObject", objectId=mug["objectId"], shine=-1)
seen["refused"] = event.metadata["errorMessage"]
try:
    controller.step("PolishObject", objectID=mug["objectId"])
except ValueError as error:
    seen["invalid"] = str(error)

# -- an object of the made-up type is drawn
world = controller.server.engine.world
row = world.object_ids.index(mug["objectId"])
before = draw(world).rgb.copy()
drawn = {}
for kind in ("LavaLamp", "NoSuchThing"):
    world.types[row] = kind
    world.set_state(row, "isDirty", not world.state(row, "isDirty"))  # so that it is drawn anew
    drawn[kind] = draw(world).rgb.copy()
seen["differ"] = [
    int((before != drawn["LavaLamp"]).any(axis=2).sum()),
    int((drawn["NoSuchThing"] != drawn["LavaLamp"]).any(axis=2).sum()),
]
controller.stop()
print(json.dumps(seen))
