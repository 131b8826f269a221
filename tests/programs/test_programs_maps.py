"""Programs that draw a path on a map, and that put a room back by the names of its things."""

from __future__ import annotations

import json

import numpy as np
from PIL import Image

MAP = """
import json, sys
import numpy as np
from PIL import Image, ImageDraw
from ai2thor.controller import Controller

SIZE = 300
controller = Controller(
    scene="FloorPlan1", gridSize=0.25, width=SIZE, height=SIZE, renderInstanceSegmentation=True
)
camera = controller.step("GetMapViewCameraProperties").metadata["actionReturn"]
event = controller.step("AddThirdPartyCamera", skyboxColor="white", **camera)
assert event, event.metadata["errorMessage"]
fridge = next(o for o in event.metadata["objects"] if o["objectType"] == "Fridge")
places = controller.step("GetReachablePositions").metadata["actionReturn"]
thing = fridge["position"]
start = max(places, key=lambda p: abs(p["x"] - thing["x"]) + abs(p["z"] - thing["z"]))
path = controller.step("GetShortestPath", objectId=fridge["objectId"], position=start)
corners = path.metadata["actionReturn"]["corners"]
floor = next(o["objectId"] for o in event.metadata["objects"] if o["objectType"] == "Floor")
on_floor = event.third_party_instance_masks[0][floor]

def pixel(point):
    half, at = camera["orthographicSize"], camera["position"]
    return (
        (1 + (point["x"] - at["x"]) / half) * SIZE / 2,
        (1 - (point["z"] - at["z"]) / half) * SIZE / 2,
    )

line = [pixel(each) for each in corners]
picture = Image.fromarray(event.third_party_camera_frames[0][..., :3])
ImageDraw.Draw(picture).line(line, fill="red", width=3)
picture.save(sys.argv[1])
walked = [
    (a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t)
    for a, b in zip(line, line[1:]) for t in np.linspace(0, 1, 50)
]
end = corners[-1]
print(json.dumps({
    "corners": len(corners),
    "on the floor": float(np.mean([on_floor[int(y), int(x)] for x, y in walked])),
    "from the fridge": float(np.hypot(end["x"] - thing["x"], end["z"] - thing["z"])),
}))
controller.stop()
"""


def test_a_path_drawn_on_a_map_lies_on_the_floor(user, tmp_path):
    file = tmp_path / "map.png"
    code, out, err = user.try_to("-c", MAP, str(file))
    assert code == 0, err
    told = json.loads(out)
    assert told["corners"] >= 3  # around the table in the middle
    assert told["on the floor"] > 0.9
    assert told["from the fridge"] < 2.0
    red = (np.asarray(Image.open(file)) == (255, 0, 0)).all(axis=2)
    assert red.sum() > 100


REARRANGED = """
import json
from math import dist
from ai2thor.controller import Controller

def things(event):
    return {o["name"]: o for o in event.metadata["objects"] if o["pickupable"] or o["moveable"]}

def far(event, goal):
    now = things(event)
    return [n for n, o in goal.items()
            if dist(o["position"].values(), now[n]["position"].values()) > 0.01]

controller = Controller(scene="FloorPlan10", width=64, height=64)
goal = things(controller.last_event)
event = controller.step("InitialRandomSpawn", randomSeed=3, placeStationary=True)
moved = far(event, goal)
poses = [{"objectName": n, "position": o["position"], "rotation": o["rotation"]}
         for n, o in goal.items()]
event = controller.step("SetObjectPoses", objectPoses=poses, placeStationary=False)
assert event, event.metadata["errorMessage"]
print(json.dumps({"things": len(goal), "moved": len(moved), "left": far(event, goal)}))
controller.stop()
"""


def test_a_room_is_put_back_by_the_names_of_its_things(user):
    code, out, err = user.try_to("-c", REARRANGED)
    assert code == 0, err
    told = json.loads(out)
    assert told["moved"] > told["things"] / 2
    assert told["left"] == []
