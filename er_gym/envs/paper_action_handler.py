"""The paper's protocol: what its evaluation program understands, allows and does.

The rules are those of Embodied-Reasoner's runner and agent (arXiv 2503.21696, ``evaluate/``). Its
odd rules are reproduced, too, so that results are comparable with the paper's table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.envs import feedback_words
from er_gym.envs.action_handler import EpisodeSetup, ExecutedAction, StepContext
from er_gym.envs.actions import INDEX, INDICES, NO_ACTION, Action, AnyAction, text_of
from er_gym.envs.legality import AvailableObjects, KnownTypes, navigable_within
from er_gym.envs.paper_approach import ObjectSnapshot, approach, current_snapshot, snapshot_of
from er_gym.envs.paper_skills import interact, move_forward, observe, start_again
from er_gym.envs.perception import Perception, type_mask
from er_gym.envs.skills import Outcome
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES, ObjectTable

NO_OBJECT = "No Suitable Object"
"""The object type of a reply that names something that the scene does not have."""
_PUT_IN = "put in"
_BARE = (verbs.OBSERVE, verbs.MOVE_FORWARD, verbs.END)
_SPOKEN = {
    **{verb: verb for verb in (verbs.INIT, verbs.NAVIGATE, verbs.PICKUP)},
    "put": verbs.PUT,
    **{verb: verb for verb in (verbs.TOGGLE, verbs.OPEN, verbs.CLOSE, *_BARE)},
}
"""The words that a reply may begin with, each with the verb that it means. The first match
counts."""
_NAMELESS = (*_BARE, "error")
_INTERACTIONS = (verbs.PICKUP, verbs.PUT, verbs.OPEN, verbs.CLOSE, verbs.TOGGLE)
_NOT_BARE = [INDEX[Action(verb)] for verb in verbs.BARE_VERBS if verb not in _BARE]
_SECOND_WHEN_HOLDING = frozenset({"84", "85"})
"""Identities of the paper's tasks that have two places of one type. There, ``navigate to`` that
type means the second target while the hand holds something."""


def parse_action_as_paper(action: AnyAction, objects: ObjectTable) -> tuple[Action | None, str]:
    """The action that the paper's runner reads in a text (None if it reads none), and the text.

    Case and leading spaces of the text matter for the verb. The object is the last word of the
    text, whatever the verb. The case of the object does not matter. A word that names no type in
    the scene stands for :data:`NO_OBJECT`. (The paper's runner then asks a model which type is
    closest in meaning. Here the agent has to do that.)

    Raises:
        gymnasium.error.InvalidAction: the value is not an action, its text or its index.
    """
    text = text_of(action)
    if text.startswith(NO_ACTION):
        return None, text
    if _PUT_IN in text:
        verb = verbs.PUT
    else:
        start = next((word for word in _SPOKEN if text.startswith(word)), None)
        if start is None:
            return None, text
        verb = _SPOKEN[start]
    if verb in (verbs.INIT, *_BARE) or text.startswith(_NAMELESS):
        return Action(verb), text
    word = text.split(" ")[-1].strip()
    there = {TYPES[kind] for kind in set(objects.kinds.tolist())}
    alike = (name for name in sorted(there) if name.lower() == word.lower())
    return Action(verb, word if word in there else next(alike, NO_OBJECT)), text


class PaperActionHandler:
    """The paper's rules by which actions are judged and carried out.

    - The agent may navigate to a type that has been clearly visible, or that the task lists.
    - The agent may interact with a type in any way while one of its objects is clearly visible, or
      is visible and of a type that lay in the receptacle last navigated to. The object in the hand
      counts too. AI2-THOR decides whether the state of the object and of the hand allows the
      action.
    - A type stands for the task's first target object of that type. If the task has none, it stands
      for the first object of the type in the scene, as that was when the episode began: the handler
      ignores that the object has been moved or switched on since.

    Args:
        setup: the episode's setup; its ``instances`` is ignored.
    """

    def __init__(self, setup: EpisodeSetup) -> None:
        self.navigated_to = ""
        self._setup, task = setup, setup.task
        self._inside = type_mask(np.array([], np.intp))  # types that lay in the last receptacle
        self._second = str(task.extra.get("identity")) in _SECOND_WHEN_HOLDING
        self._targets: dict[str, list[str]] = {}
        for object_id in task.target_objects:
            self._targets.setdefault(object_id.split("|")[0], []).append(object_id)
        self._first: dict[str, ObjectSnapshot] = {}
        if setup.resumed:
            return
        for entry in setup.controller.last_event.metadata["objects"]:
            if entry["objectType"] not in self._first:
                self._first[entry["objectType"]] = snapshot_of(entry)

    def available_objects(self, perception: Perception) -> AvailableObjects:
        """Clearly visible objects are navigable; these and the receptacle's are interactable."""
        table, visible = perception.objects, perception.visible
        away = np.hypot(
            table.centre[:, 0] - perception.pose.x, table.centre[:, 2] - perception.pose.z
        )
        plain = visible & (away < _within(table))
        inside = visible & self._inside[table.kinds]
        return AvailableObjects(
            objects=table,
            navigable=plain.nonzero()[0],
            interactable=(plain | inside).nonzero()[0],
            covered=np.array([], np.intp),  # AI2-THOR refuses a burner that a pan hides
        )

    def illegal_reason(self, action: Action, available: AvailableObjects, known: KnownTypes) -> str:
        """The agent navigates only to known types, and interacts only with types within reach."""
        name = action.object_type
        if action.verb in (verbs.INIT, *_BARE):
            return ""
        if action.verb == verbs.NAVIGATE:
            return "" if name in known else feedback_words.PAPER_PLACE(thing=name or "nothing")
        if name in available.in_reach:
            return ""
        return feedback_words.PAPER_REACH(action=f"{action.verb} {name or 'nothing'}")

    def legal(self, available: AvailableObjects, known: KnownTypes) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for the paper's interactions with all types within reach."""
        legal = known.legal.copy()
        legal[_NOT_BARE] = 0
        for verb in _INTERACTIONS:
            indices = INDICES[verb][available.interactable_types]
            legal[indices[indices >= 0]] = 1
        return legal

    def execute(self, action: Action, now: StepContext) -> ExecutedAction:
        """Carry out a legal action."""
        setup, controller = self._setup, self._setup.controller
        if action.verb == verbs.OBSERVE:
            return "", observe(controller)
        if action.verb == verbs.MOVE_FORWARD:
            return "", move_forward(controller, setup.task.related_objects)
        if action.verb == verbs.END:
            return "", Outcome(None, True)
        if action.verb == verbs.INIT:
            return "", start_again(controller, setup.start)
        target = self._choose(action, now.perception.objects)
        if target is None:
            return "", Outcome(None, False, feedback_words.NONE_SUCH(thing=action.object_type))
        if action.verb != verbs.NAVIGATE:
            return target.object_id, interact(controller, action.verb, target)
        aim = self._on_it(target)
        outcome = approach(controller, aim, setup.task.poses.get(aim.object_id))
        if outcome.success:
            self.navigated_to = target.object_id
            if aim.receptacle:
                types = (object_id.split("|")[0] for object_id in aim.contents)
                self._inside = type_mask(np.array([KIND_OF[t] for t in types if t in KIND_OF], int))
        return target.object_id, outcome

    def state(self) -> dict[str, Any]:
        """Where the agent went, and the objects as they were when the episode began."""
        return {
            "navigated_to": self.navigated_to,
            "inside": self._inside.nonzero()[0].tolist(),
            "first": [vars(snapshot) for snapshot in self._first.values()],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """See :meth:`state`."""
        self.navigated_to = state["navigated_to"]
        self._inside = type_mask(np.array(state["inside"], np.intp))
        snapshots = (ObjectSnapshot(**values) for values in state["first"])
        self._first = {snapshot.object_type: snapshot for snapshot in map(_with_tuples, snapshots)}

    def _choose(self, action: Action, objects: ObjectTable) -> ObjectSnapshot | None:
        """The object that a type stands for; None if the scene lacks the object of the task."""
        targets = self._targets.get(action.object_type)
        if targets is None:
            return self._first.get(action.object_type)
        second = self._second and action.verb == verbs.NAVIGATE and objects.held >= 0
        if second and len(targets) < 2:
            return None
        return current_snapshot(self._setup.controller, targets[1 if second else 0])

    def _on_it(self, target: ObjectSnapshot) -> ObjectSnapshot:
        """The object that the agent approaches when it navigates to ``target``.

        If ``target`` is a receptacle that does not open and holds some of the task's related
        objects, it is the first of these.
        """
        if target.receptacle and not target.openable:
            for object_id in self._setup.task.related_objects:
                if object_id in target.contents:
                    return current_snapshot(self._setup.controller, object_id) or target
        return target


def _with_tuples(snapshot: ObjectSnapshot) -> ObjectSnapshot:
    """Plain data has lists in their place."""
    x, y, z = snapshot.centre
    return replace(snapshot, centre=(x, y, z), contents=tuple(snapshot.contents))


_FLOOR = type_mask(np.array([KIND_OF[name] for name in verbs.NOWHERE]))


def _within(table: ObjectTable) -> NDArray[np.float64]:
    """(N,) the distance below which each object is clearly visible, metres; 0 for the floor."""
    found = table.derived.get("paper_within")
    if not isinstance(found, np.ndarray):
        found = navigable_within(table.volume, table.face)
        found[_FLOOR[table.kinds]] = 0.0
        table.derived["paper_within"] = found
    return found
