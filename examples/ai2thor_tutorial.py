"""A plain AI2-THOR script: look around a kitchen, fetch an apple, put it into the fridge.

    python examples/ai2thor_tutorial.py            # on er-gym's engine
    python examples/ai2thor_tutorial.py --unity    # on AI2-THOR's own build

Only the choice of the engine uses er-gym.
"""

import argparse
from math import hypot

from ai2thor.controller import Controller


def make_controller(unity):
    """The official controller, on either engine."""
    settings = {
        "scene": "FloorPlan1",
        "width": 400,
        "height": 300,
        "gridSize": 0.25,
        "visibilityDistance": 1.5,
        "renderDepthImage": True,
        "renderInstanceSegmentation": True,
    }
    if unity:
        return Controller(**settings)
    import er_gym

    return Controller(local_executable_path=er_gym.thor_executable(), x_display=":0", **settings)


def find(event, object_type):
    """The first object of a type."""
    return next(o for o in event.metadata["objects"] if o["objectType"] == object_type)


def go_to(controller, thing):
    """Stand at the nearest position from which an object is interactable."""
    event = controller.step(
        action="GetInteractablePoses",
        objectId=thing["objectId"],
        standings=[True],
        rotations=[0, 90, 180, 270],
    )
    poses = event.metadata["actionReturn"]
    at = thing["position"]
    nearest = min(poses, key=lambda pose: hypot(pose["x"] - at["x"], pose["z"] - at["z"]))
    controller.step(action="TeleportFull", **nearest, raise_for_failure=True)


def main():
    """Play, and print what happens."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--unity", action="store_true", help="AI2-THOR's own build")
    controller = make_controller(parser.parse_args().unity)

    event = controller.reset(scene="FloorPlan1")
    print(f"{event.metadata['sceneName']}: {len(event.metadata['objects'])} objects")

    event = controller.step(action="GetReachablePositions")
    print(f"the agent can stand at {len(event.metadata['actionReturn'])} positions")

    for action in ("MoveAhead", "RotateRight", "MoveAhead", "LookDown"):
        event = controller.step(action=action)
        print(f"{action}: {'done' if event else event.metadata['errorMessage']}")

    apple = find(event, "Apple")
    go_to(controller, apple)
    event = controller.step("Pass")
    pixels = int(event.instance_masks[apple["objectId"]].sum())
    depth = event.depth_frame[event.instance_masks[apple["objectId"]]].mean()
    print(f"the apple: {pixels} pixels, {depth:.2f} m away")
    controller.step(action="PickupObject", objectId=apple["objectId"], raise_for_failure=True)

    fridge = find(event, "Fridge")
    go_to(controller, fridge)
    for action in ("OpenObject", "PutObject", "CloseObject"):
        event = controller.step(action=action, objectId=fridge["objectId"], raise_for_failure=True)
    apple = find(event, "Apple")
    print(f"the apple is in {apple['parentReceptacles']}, {apple['temperature'].lower()}")
    controller.stop()


if __name__ == "__main__":
    main()
