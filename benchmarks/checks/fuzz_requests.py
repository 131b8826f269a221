"""Random requests to the engine: those of a normal program, and many that are wrong.

A valid request is drawn first, parameter by parameter from the table :data:`SANE`, so that many of
them succeed. One in four is then changed by :data:`MUTATIONS`, mostly with a value of
:data:`EXTREMES`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from random import Random
from types import NoneType
from typing import Any, get_args, get_origin

from er_gym.houses.generate import generate_house
from er_gym.sim.actions.many import ObjectStates
from er_gym.sim.actions.refused import REFUSED
from er_gym.sim.actions.registry import ACTIONS, EXEMPT, Parameter, parameters_of
from er_gym.sim.actions.state_change import LIQUIDS
from er_gym.sim.initial_state import USED_UP

Request = dict[str, Any]


def _reset(*, sceneName: str) -> None:
    """The one action that the engine handles outside of its registry."""


WAYS: dict[str, list[Mapping[str, Parameter]]] = {
    **{name: [way.parameters for way in ways] for name, ways in ACTIONS.items()},
    "Reset": [parameters_of(_reset)],
}
"""Every action, with the parameters of each way to call it."""
PARAMETERS = {
    name: {key: p for way in ways for key, p in way.items()} for name, ways in WAYS.items()
}
"""Every action, with the parameters of all ways to call it."""
NAMES = [
    # A filter removes the metadata that the checks need.
    *(name for name in PARAMETERS if name not in ("SetObjectFilter", "SetObjectFilterForType")),
    # Without these parameters most actions would be refused.
    *3 * ("PickupObject", "OpenObject", "TeleportFull", "GetInteractablePoses"),
]
ODD_NAMES: tuple[Any, ...] = (
    *REFUSED, *("Fly", "openobject", "OpenObject ", "", "step", "__init__", "Öffne|☃", "\ud800"),
    *("a\nb", "MoveAhead" * 500, None, 0, -1, 2.5, float("nan"), True, [], ["Pass"], {}, b"Pass"),
)  # fmt: skip
"""Values that are not an action's name."""
EXTREMES: tuple[Any, ...] = (
    *(float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 1e-320, -1e-320, 0, -0.0, -1, 0.5),
    *(10**30, -(10**30), 10**400, -(10**400), True, False, None),
    *("", "nan", "-inf", "1e400", "1", "0x10", "true", "Äpfel|☃", "\ud800", "a\nb\r\n", "x" * 5000),
    *("Apple|+00.00|+00.00|+00.00", "FloorPlan1", b"", b"Pass", b"\xff", [], [None], [[]], [-1]),
    *([float("nan")], ["x"] * 1000, {}, {"x": float("nan")}, {"x": 1e308, "y": -1e308, "z": 0}),
    *({"x": 0.5, "z": "far"}, {"objectType": "Apple", "count": 10**30}, {"": {"": []}}),
)  # fmt: skip
"""Values that are out of range, of another type, or nearly valid."""
_ODD_PARAMETERS = (
    *("velocity", "objectID", "self", "world", "model_config", "", "a\nb", "\ud800", "ü"),
    "x" * 5000,
)
_MUTATION_RATE = 0.25
_FOLLOW_UP_RATE = 0.4
"""The probability that the last answer decides the next action."""
_OPTIONAL_RATE = 0.5
"""The probability that an optional parameter is given."""
_BY_ID_RATE = 0.8
"""The probability that an object is named by its id, not by a point of the picture."""
_PICTURE_RATE = 0.03
"""The probability that pictures are requested; they take most of the time."""
_ANY_OBJECT_RATE = 0.15
"""The probability that an object is drawn from all, not only from those that suit the action."""


@dataclass
class Room:
    """The knowledge from which requests are drawn.

    Attributes:
        random: the only source of chance.
        scenes: which ones ``Reset`` may ask for.
        metadata: of the last event.
        positions: where the agent can stand in this scene.
        gone: ids of objects that no longer exist in this scene.
        agents: the most that ``Initialize`` may ask for.
        there: how many there are.
    """

    random: Random
    scenes: Sequence[str]
    metadata: Mapping[str, Any]
    positions: Sequence[dict[str, float]]
    gone: Sequence[str] = field(default=())
    agents: int = 1
    there: int = 1

    @property
    def objects(self) -> list[dict[str, Any]]:
        objects: list[dict[str, Any]] = self.metadata["objects"]
        return objects

    @property
    def poses(self) -> list[dict[str, Any]]:
        """The poses that the last action returned, if it asked for poses."""
        asked = self.metadata["lastAction"] == "GetInteractablePoses"
        return (self.metadata["actionReturn"] or []) if asked else []


Draw = Callable[[Room], Any]


# -- sane values -----------------------------------------------------------------------------------


def _among(*values: Any) -> Draw:
    return lambda room: room.random.choice(values)


def _between(low: float, high: float) -> Draw:
    return lambda room: room.random.uniform(low, high)


def _some(draw: Draw, most: int) -> Draw:
    return lambda room: [draw(room) for _ in range(room.random.randint(0, most))]


def _object(has: str = "", lacks: str = "") -> Draw:
    """The id of an object: usually with some properties and without others, often visible."""

    def draw(room: Room) -> str:
        suited = [e for e in room.objects if (not has or e[has]) and not (lacks and e[lacks])]
        seen = [entry for entry in suited if entry["visible"]]
        anyhow = room.random.random() < _ANY_OBJECT_RATE
        chosen: str = room.random.choice(
            room.objects if anyhow else seen or suited or room.objects
        )["objectId"]
        return chosen

    return draw


def _used_up(room: Room) -> str:
    """The id of an object that can be used up; AI2-THOR's metadata do not say which can."""
    suited = [e for e in room.objects if e["objectType"] in USED_UP] or room.objects
    return str(room.random.choice(suited)["objectId"])


def _object_type(room: Room) -> str:
    return str(room.random.choice(room.objects)["objectType"])


def _position(room: Room) -> dict[str, float]:
    """A place on the floor, sometimes beside it."""
    position = dict(room.random.choice(room.positions))
    if room.random.random() < _ANY_OBJECT_RATE:
        position["x"] += room.random.gauss(0.0, 0.5)
    return position


def draw_house(room: Room) -> Request:
    """A house of one to three rooms."""
    return deepcopy(generate_house(room.random.randrange(12), room.random.randint(1, 3)))


def _coordinate(axis: str) -> Draw:
    return lambda room: _position(room)[axis]


def _middle(room: Room) -> dict[str, float]:
    """A place above the centre of an object."""
    centre = dict(room.random.choice(room.objects)["axisAlignedBoundingBox"]["center"])
    return {**centre, "y": centre["y"] + room.random.uniform(0.0, 0.5)}


def _rotation(room: Room) -> dict[str, float]:
    return {"x": 0.0, "y": 15.0 * room.random.randrange(-24, 48), "z": 0.0}


def _pose(room: Room) -> Request:
    """A pose from the last answer to a question for poses, else any place on the floor."""
    pose = dict(room.random.choice(room.poses)) if room.poses else {}
    if not pose:
        return {"position": _position(room), "rotation": _rotation(room), "horizon": 30.0}
    pose["position"] = {axis: pose.pop(axis) for axis in "xyz"}
    return {**pose, "rotation": {"x": 0.0, "y": pose["rotation"], "z": 0.0}}


def _camera(room: Room) -> int:
    return room.random.randrange(max(1, len(room.metadata["thirdPartyCameras"])))


def _arrangement(room: Room) -> list[Request]:
    """Poses for movable objects: the present ones with a few changes; sometimes one is missing or
    twice.
    """
    random = room.random
    loose = [entry for entry in room.objects if entry["pickupable"] or entry["moveable"]]
    if random.random() < _ANY_OBJECT_RATE:
        loose = random.choices(loose, k=random.randint(0, len(loose))) if loose else []
    poses = [
        {
            "objectName": entry["name"],
            "position": dict(entry["position"]),
            "rotation": dict(entry["rotation"]),
        }
        for entry in loose
    ]
    for pose in random.sample(poses, min(len(poses), 3)):
        pose["position"] = dict(random.choice(room.objects)["axisAlignedBoundingBox"]["center"])
        pose["rotation"] = _rotation(room)
    return poses


def _object_states(room: Room) -> Request:
    """A state for all objects of a type."""
    has = room.random.choice(("toggleable", "openable", "breakable", "dirtyable", "cookable"))
    flags = [name for name, about in ObjectStates.model_fields.items() if about.annotation is bool]
    value = room.random.random() < 0.5
    return {
        "objectType": _object_type(room),
        "stateChange": has,
        **dict.fromkeys(flags, value),
    }


def _vector(size: float) -> Draw:
    """Three numbers, each at most so large."""
    return lambda room: {axis: room.random.uniform(-size, size) for axis in "xyz"}


OBJECT_CONDITIONS = {
    "PickupObject": ("pickupable", "isPickedUp"),
    "PutObject": ("receptacle", "isPickedUp"),
    "OpenObject": ("openable", "isOpen"),
    "CloseObject": ("isOpen",),
    "ToggleObjectOn": ("toggleable", "isToggled"),
    "ToggleObjectOff": ("isToggled",),
    "SliceObject": ("sliceable", "isPickedUp"),
    "BreakObject": ("breakable", "isBroken"),
    "CookObject": ("cookable", "isCooked"),
    "DirtyObject": ("dirtyable", "isDirty"),
    "CleanObject": ("isDirty",),
    "FillObjectWithLiquid": ("canFillWithLiquid", "isFilledWithLiquid"),
    "EmptyLiquidFromObject": ("isFilledWithLiquid",),
}
"""The properties that an object must have for an action, and those that it must not have yet."""
_HANDS = ("MoveHand", "MoveHeld", "RotateHand", "RotateHeld")
HAND_ACTIONS = tuple(name for name in ACTIONS if name.startswith(_HANDS))
"""Actions that move or turn the hand, which must hold something."""
PICTURE_POINT_ACTIONS = (
    *(*OBJECT_CONDITIONS, "UseUpObject", "GetObjectInFrame", "GetCoordinateFromRaycast"),
    *("DirectionalPush", "PushObject", "PullObject", "TouchThenApplyForce"),
)
"""Actions whose object can also be given by a point of the picture."""
SANE: dict[str, Draw] = {
    **{f"{action}.objectId": _object(*suits) for action, suits in OBJECT_CONDITIONS.items()},
    "UseUpObject.objectId": _used_up,
    **{
        f"{action}.objectId": _object("pickupable")
        for action in ("PlaceObjectAtPoint", "TeleportObject", "DirectionalPush", "PushObject")
    },
    "GetSpawnCoordinatesAboveReceptacle.objectId": _object("receptacle"),
    "DisableAllObjectsOfType.objectId": _object_type,
    "PlaceObjectAtPoint.position": _middle,
    "TeleportObject.position": _middle,
    "objectType": _object_type,
    "objectIds": _some(_object(), 3),
    "pushAngle": _between(-360.0, 360.0),
    "PushObject.moveMagnitude": _between(0.0, 300.0),
    "DirectionalPush.moveMagnitude": _between(0.0, 300.0),
    "objectId": _object(),
    "objectId0": _object(),
    "objectId1": _object(),
    "SetObjectStates.SetObjectStates": _object_states,
    "origin": _middle,
    "destination": _middle,
    "direction": _vector(1.0),
    **{
        f"{action}.{parameter}": _between(-0.2, 0.2)
        for action in HAND_ACTIONS
        if action.startswith("Move")
        for parameter in ("x", "y", "z", "right", "up", "ahead", "moveMagnitude")
        if parameter in PARAMETERS[action]
    },
    **{
        f"{action}.{parameter}": _among(-90.0, -30.0, 0.0, 30.0, 90.0, 180.0)
        for action in HAND_ACTIONS
        if action.startswith("Rotate")
        for parameter in ("x", "y", "z", "pitch", "yaw", "roll")
        if parameter in PARAMETERS[action]
    },
    "RotateHeldObject.rotation": _vector(180.0),
    "sceneName": lambda room: room.random.choice(room.scenes),
    "house": draw_house,
    "forceAction": _among(False, True, True),
    "position": _position,
    "positions": _some(_position, 5),
    "rotation": _rotation,
    "rotations": _some(_among(0.0, 45.0, 90.0, 180.0, -90.0, 720.0), 4),
    "horizon": _among(-30.0, 0.0, 30.0, 60.0),
    "horizons": _some(_among(-30.0, 0.0, 30.0, 60.0), 3),
    "x": _coordinate("x"),
    "y": _coordinate("y"),
    "z": _coordinate("z"),
    "ChangeResolution.x": lambda room: room.random.randint(1, 40),
    "ChangeResolution.y": lambda room: room.random.randint(1, 40),
    **{f"{action}.{axis}": _between(0.0, 1.0) for action in PICTURE_POINT_ACTIONS for axis in "xy"},
    "degrees": _among(1.0, 15.0, 30.0, 45.0, 90.0, -90.0, 360.0),
    "moveMagnitude": _among(0.0, 0.1, 0.25, 0.25, 0.5, 1.0),
    "ThrowObject.moveMagnitude": _between(0.0, 300.0),
    "openness": _among(0.1, 0.5, 1.0),
    "fillLiquid": _among(*LIQUIDS),
    "gridSize": _among(0.1, 0.25, 0.25, 0.25, 0.5),
    "fieldOfView": _between(30.0, 120.0),
    "visibilityDistance": _among(1.0, 1.5, 1.5, 3.0, 20.0),
    "rotateStepDegrees": _among(45.0, 90.0, 90.0, 90.0),
    "agentCount": lambda room: room.random.choice(range(1, room.agents + 1)),
    "maxDistance": _among(0.5, 1.5, 5.0),
    "maxAgentsDistance": _among(-1.0, 0.5, 3.0),
    "maxStepCount": _among(1, 100, 10000),
    "OpenObject.moveMagnitude": _among(0.0, 0.5, 1.0),
    "orthographicSize": lambda room: None,
    "agentMode": _among("default"),
    "timeScale": _among(1.0, 2.0),
    "maxPoses": _among(1, 3, 20),
    "numPlacementAttempts": _among(1, 5),
    "excludedReceptacles": _some(_object_type, 3),
    "excludedObjectIds": _some(_object(), 3),
    "numDuplicatesOfType": _some(_object_type, 0),
    "allowFloor": _among(False),
    "allowMoveable": _among(False),
    "orthographic": _among(False),
    "thirdPartyCameraId": _camera,
    "objectPoses": _arrangement,
}
"""How a parameter is drawn, by its name, or by the action and its name; others are drawn by type.
"""


def _of_type(room: Room, kind: Any) -> Any:
    """A random value of a parameter's type."""
    random, inner = room.random, [part for part in get_args(kind) if part is not NoneType]
    if get_origin(kind) is list:
        return [_of_type(room, inner[0]) for _ in range(random.randint(0, 3))]
    if inner:  # a union of types
        return _of_type(room, random.choice(inner))
    simple = {bool: random.random() < 0.5, int: random.randint(0, 3), float: random.random() * 2}
    return simple.get(kind, "word")


def _sane(room: Room, name: str) -> Request:
    """An action with valid parameters."""
    request: Request = {"action": name, "renderImage": False}
    if name in ("Teleport", "TeleportFull") and (room.poses or room.random.random() < 0.5):
        return {**request, **_pose(room)}
    ways, chance = WAYS[name], room.random.random
    way = ways[0] if chance() < _BY_ID_RATE else room.random.choice(ways)
    for parameter, about in way.items():
        if about.required or chance() < (
            _BY_ID_RATE if parameter == "objectId" else _OPTIONAL_RATE
        ):
            draw = SANE.get(f"{name}.{parameter}") or SANE.get(parameter)
            request[parameter] = draw(room) if draw else _of_type(room, about.annotation)
    return request


# -- mutations -------------------------------------------------------------------------------------


def _extreme(room: Room) -> Any:
    return deepcopy(room.random.choice(EXTREMES))


def _another_value(room: Room, request: Request) -> None:
    """Give one of the parameters an extreme value, whether it was given or not."""
    name = request.get("action")
    taken = PARAMETERS.get(name) if isinstance(name, str) else None
    names = list(taken) if taken else sorted(_arguments(request))
    if names:
        request[room.random.choice(names)] = _extreme(room)


def _no_such_thing(room: Room, request: Request) -> None:
    """Use the ids of objects that no longer exist, or an object of another action."""
    ids = [*room.gone[-20:], "Apple|+00.00|+00.00|+00.00", "", room.metadata["sceneName"]]
    request["objectId"] = room.random.choice(ids)


def _missing(room: Room, request: Request) -> None:
    names = sorted(request)
    if names:
        del request[room.random.choice(names)]


def _one_too_many(room: Room, request: Request) -> None:
    request[room.random.choice(_ODD_PARAMETERS)] = _extreme(room)


def _for_any_action(room: Room, request: Request) -> None:
    request[room.random.choice(sorted(EXEMPT - {"action"}))] = _extreme(room)


def _another_action(room: Room, request: Request) -> None:
    """Use an invalid name, or the parameters of one action for another."""
    request["action"] = deepcopy(room.random.choice(room.random.choice((ODD_NAMES, NAMES))))


def _inside(room: Room, request: Request) -> None:
    """Change a list or a vector: remove an axis, or add a wrong member."""
    holders = list(_holders([request[name] for name in sorted(_arguments(request))]))
    if not holders:
        return _another_value(room, request)
    holder: Any = room.random.choice(holders)
    keys: list[Any] = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
    if not keys or room.random.random() < 0.2:
        holder.clear()
    elif room.random.random() < 0.4:
        del holder[room.random.choice(keys)]
    else:
        holder[room.random.choice(keys)] = _extreme(room)
    return None


def _arguments(request: Request) -> set[str]:
    return {name for name in request if name != "action"}


def _holders(values: Sequence[Any]) -> Iterator[dict[str, Any] | list[Any]]:
    """Every list and dictionary among these values or nested in them."""
    for value in values:
        if isinstance(value, (dict, list)):
            yield value
            yield from _holders(list(value.values()) if isinstance(value, dict) else value)


MUTATIONS: tuple[Callable[[Room, Request], None], ...] = (
    *3 * (_another_value,),
    *2 * (_inside,),
    *(_no_such_thing, _missing, _one_too_many, _for_any_action, _another_action),
)


_WITH_A_FULL_HAND = (
    *3 * HAND_ACTIONS,
    *16 * ("PutObject",),
    *4 * ("DropHandObject", "DropHeldObject", "ThrowObject", "PlaceHeldObject"),
)


def _next(room: Room) -> Sequence[str]:
    """Actions that a program might do now."""
    if room.poses:
        return ("TeleportFull",)
    if room.metadata["inventoryObjects"]:
        return _WITH_A_FULL_HAND
    if any(entry["isFilledWithLiquid"] for entry in room.objects):
        return ("EmptyLiquidFromObject", *NAMES)
    return NAMES


def valid_request(room: Room) -> Request:
    """The next request of a normal program, which asks for no picture."""
    random = room.random
    return _sane(room, random.choice(_next(room) if random.random() < _FOLLOW_UP_RATE else NAMES))


def draw_request(room: Room) -> Request:
    """The next request; it shares nothing with the metadata or with another request."""
    random, request = room.random, valid_request(room)
    if room.there > 1:
        request["agentId"] = random.randrange(room.there)
    if random.random() < _PICTURE_RATE:
        request["renderImage"] = True
        for flag in ("renderInstanceSegmentation", "renderSemanticSegmentation"):
            request[flag] = random.random() < 0.5
    if random.random() < _MUTATION_RATE:
        for _ in range(random.choice((1, 1, 2))):
            random.choice(MUTATIONS)(room, request)
    return request
