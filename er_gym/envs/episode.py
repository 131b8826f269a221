"""One episode: its state, and what each action does to it.

:class:`~er_gym.envs.embodied_env.EmbodiedEnv` draws the task and owns the controller. An
:class:`Episode` places the agent, judges and carries out actions, and builds observations, ``info``
and rewards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from typing import Any, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from er_gym.envs import feedback_words, skills
from er_gym.envs.action_handler import ActionHandler, EpisodeSetup, StepContext
from er_gym.envs.actions import Action, AnyAction
from er_gym.envs.asked_goal import goal_row
from er_gym.envs.faults import FaultPlan, FaultyActionHandler
from er_gym.envs.feedback import failed
from er_gym.envs.info import REPEATED, Details, Info, LegalActions
from er_gym.envs.legality import KnownTypes
from er_gym.envs.memory import MAX_REPEATS, Memory
from er_gym.envs.observations import Observation, Situation, text_of
from er_gym.envs.perception import Perception
from er_gym.envs.protocol import EpisodeProtocol
from er_gym.tasks import verbs
from er_gym.tasks.arrangement import set_up_scene
from er_gym.tasks.goal import Condition, unmet_conditions
from er_gym.tasks.judge import Criteria, Progress
from er_gym.tasks.side_effects import side_effects
from er_gym.tasks.task import AgentPose, Task
from er_gym.thor import ObjectTable
from er_gym.thor.objects import ENTRY_KEYS

MAX_UNKNOWN = 3
"""This many replies in a row that name no known action end the episode."""
_CUT_OFF = frozenset({"step limit", "no known action"})
"""The reasons for which an episode ends although the agent did not end it."""
_LONGEST_QUOTE = 200
"""An answer quotes at most this many characters of a text that names no action."""

ResetResult: TypeAlias = tuple[dict[str, Any], dict[str, Any]]
"""Observation and info, as ``gymnasium.Env.reset`` returns them."""
StepResult: TypeAlias = tuple[dict[str, Any], float, bool, bool, dict[str, Any]]
"""What ``gymnasium.Env.step`` returns."""


@dataclass(frozen=True)
class EpisodeSettings:
    """What all episodes of an environment share; the values have been checked.

    Attributes:
        protocol: the rules.
        observations: the builders, by name.
        instances: which object a type name stands for, see :mod:`er_gym.envs.object_selection`.
        grid_size: metres.
        max_steps: the step limit; None for each task's own.
        step_penalty, illegal_penalty: subtracted from the reward for each step, and for each
            illegal action.
        annotate: whether pictures have the object types written into them.
    """

    protocol: EpisodeProtocol
    observations: Mapping[str, Observation]
    instances: str
    grid_size: float
    max_steps: int | None
    step_penalty: float
    illegal_penalty: float
    annotate: bool


class _Telling(NamedTuple):
    """What an action led to, as the last observation and ``info`` tell it."""

    action: Action | None
    text: str
    success: bool
    object_id: str
    feedback: str
    error_message: str
    views: Mapping[str, Perception]
    appended: bool


class Episode:
    """An episode of one task; :meth:`begin` it, then :meth:`step` until it has an ``end_reason``.

    Args:
        settings: the environment's settings.
        task: what is asked.
        controller: a controller in any scene; the episode resets it to the task's scene.
        backend: the name of the controller's backend.
        faults: which actions go wrong; None for none.
        replies: after this many calls of :meth:`step` the episode is cut; None for no such limit.

    Attributes:
        task: what is asked.
        faults: which actions go wrong; None for none.
        perception: what the agent perceived last.
        end_reason: why the episode is over, ``""`` while it is not.
    """

    perception: Perception
    _situation: Situation

    def __init__(
        self,
        settings: EpisodeSettings,
        task: Task,
        controller: Any,
        backend: str,
        faults: FaultPlan | None = None,
        replies: int | None = None,
    ) -> None:
        self.task = task
        self.end_reason = ""
        self.faults = faults
        self._settings, self._protocol = settings, settings.protocol
        self._controller, self._backend = controller, backend
        self._faulty: FaultyActionHandler | None = None
        self._fault = ""
        self._progress = Progress.start(Criteria.of(task))
        self._known = KnownTypes(task.navigable_objects)
        self._steps = 1
        self._step_limit = settings.max_steps or task.max_steps
        self._replies_left = replies
        self._unknown_replies = 0
        self._goal_unmet: tuple[Condition, ...] = ()
        self._room_before: ObjectTable | None = None  # None in an episode that was taken up
        self._side_effects: tuple[str, ...] | None = None  # None until somebody has asked

    def begin(self) -> ResetResult:
        """Arrange the scene and place the agent."""
        task, controller = self.task, self._controller
        bounds = set_up_scene(controller, task.scene, task.arrangement).metadata["sceneBounds"]
        floor = self._floor()
        pose = self._protocol.start(bounds, floor)
        self._memory = Memory(pose, goal_row(task.instruction))
        self._make_handler(pose)
        placed = skills.place(controller, pose)
        self._perceive(placed)
        self._room_before = self.perception.objects
        return self._told(None, "", placed.success, "", feedback_words.BEGUN(), placed.error, {})

    def _floor(self) -> skills.Reachable:
        key = (self._backend, self.task.scene, self._settings.grid_size)
        return skills.reachable(self._controller, key)

    def _make_handler(self, start: AgentPose, *, resumed: bool = False) -> None:
        settings = self._settings
        setup = EpisodeSetup(
            self.task,
            self._controller,
            self._floor(),
            start,
            settings.grid_size,
            settings.instances,
            resumed,
        )
        self._handler: ActionHandler = self._protocol.action_handler(setup)
        if self.faults is not None:
            self._handler = self._faulty = self.faults.handler(self._handler, self._known)

    def state(self) -> dict[str, Any]:
        """The episode now as plain data: all but the task, and with the embedded engine's world."""
        told = self._telling
        return {
            "world": self._controller.world_state(),
            "memory": self._memory.state(),
            "known": self._known.types.nonzero()[0].tolist(),
            "handler": self._handler.state(),
            "faults": self.faults and self.faults.state(),
            "done": self._progress.numbers_done,
            "ended": [self._progress.ended, self._progress.success],
            "unmet": [self.task.goal.index(each) for each in self._goal_unmet],
            "counts": [self._steps, self._replies_left, self._unknown_replies],
            "end_reason": self.end_reason,
            "fault": self._fault,
            "action": told.action and [told.action.verb, told.action.object_type],
            "told": [told.text, told.success, told.object_id, told.feedback, told.appended],
            "error_message": told.error_message,
            "views": {name: list(astuple(view.pose)) for name, view in told.views.items()},
        }

    def resume(self, state: Mapping[str, Any]) -> ResetResult:
        """Take up an episode of the task where :meth:`state` left it, in place of :meth:`begin`.

        The controller's scene is arranged for the task; what has been done in it does not matter.

        Returns:
            The observation and ``info`` of the step that was the last.
        """
        controller, world = self._controller, state["world"]
        self._memory = Memory.of_state(state["memory"], self.task.instruction)
        self._make_handler(self._memory.start, resumed=True)
        self._known.add(np.array(state["known"], np.intp))
        self._handler.restore(state["handler"])
        self._progress = Progress.at(self._progress.criteria, state["done"], *state["ended"])
        self._goal_unmet = tuple(self.task.goal[k] for k in state["unmet"])
        self._steps, self._replies_left, self._unknown_replies = state["counts"]
        self.end_reason, self._fault = state["end_reason"], state["fault"]
        controller.restore_world(world)
        views = {
            name: skills.look_from(controller, AgentPose(*pose))
            for name, pose in state["views"].items()
        }
        if views:
            controller.restore_world(world)
        self.perception = skills.look(controller)
        self._available = self._handler.available_objects(self.perception)
        action = None if state["action"] is None else Action(*state["action"])
        text, success, object_id, feedback, appended = state["told"]
        error = state.get("error_message", "")  # older snapshots lack it
        return self._told(action, text, success, object_id, feedback, error, views, appended)

    @property
    def max_steps(self) -> int:
        """The step limit. A limit on replies lowers it with each reply that costs no step."""
        if self._replies_left is None:
            return self._step_limit
        return min(self._step_limit, self._steps + self._replies_left)

    def parse_action(self, action: AnyAction) -> tuple[Action | None, str]:
        """The action that a reply means (None if it names no action), and its text.

        Raises:
            gymnasium.error.InvalidAction: the reply is not an action; nothing has changed.
        """
        return self._protocol.parse_action(action, self.perception.objects)

    def action_mask(self) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for each action that is legal now."""
        return self._handler.legal(self._available, self._known)

    def all_objects(self) -> Sequence[Mapping[str, Any]]:
        """AI2-THOR's metadata of all objects, as they are now."""
        return self._controller.last_event.metadata["objects"]  # type: ignore[no-any-return]

    def unmet_now(self) -> tuple[Condition, ...]:
        """The conditions of the task's goal that do not hold now."""
        return unmet_conditions(self.task.goal, self._objects_of_goal(), self._available.in_reach)

    def step(self, understood: Action | None, text: str) -> StepResult:
        """Do an action that :meth:`parse_action` returned."""
        self._fault = ""
        if self._replies_left is not None:
            self._replies_left -= 1
        if understood is None:
            return self._not_understood(text)
        self._unknown_replies = 0
        if understood == self._memory.last and self._memory.repeats >= MAX_REPEATS:
            self.end_reason = REPEATED
            times = self._memory.repeats + 1
            feedback = feedback_words.REPEATED(action=understood, times=times)
            said = self._protocol.repeated or understood
            return self._reply(said, text, False, "", feedback, 0.0)
        self._steps += understood.verb != verbs.END or self._protocol.end_is_step
        refused = self._handler.illegal_reason(understood, self._available, self._known)
        if refused:
            object_id, outcome = "", skills.Outcome(None, False, refused)
        else:
            object_id, outcome = self._handler.execute(
                understood, StepContext(self.perception, self._available, self._progress.left)
            )
            self._fault = "" if self._faulty is None else self._faulty.fault
        self._memory.act(understood, outcome.success)
        self._perceive(outcome)
        reward = self._judge(understood, outcome, object_id) - self._settings.step_penalty
        if refused:
            reward -= self._settings.illegal_penalty
        if understood.verb == verbs.END:
            self.end_reason = "end"
        elif self._steps >= self._step_limit or self._replies_left == 0:
            self.end_reason = "step limit"
        feedback = refused or _feedback(understood, outcome)
        return self._reply(
            *(understood, text, outcome.success, object_id, feedback, reward),
            views=outcome.views,
            error_message=outcome.error,
        )

    def _perceive(self, outcome: skills.Outcome) -> None:
        """Remember what the agent perceives after a step, and in the views of an ``observe``."""
        for perception in (*outcome.views.values(), outcome.perception):
            if perception is not None:
                self.perception = perception
                self._available = self._handler.available_objects(perception)
                self._known.add(perception.objects.kinds[self._available.navigable])
                self._memory.look(perception, self._navigated_to_kind)

    @property
    def _navigated_to_kind(self) -> int | None:
        """The type of the object last navigated to, None if that object is gone."""
        objects = self.perception.objects
        row = objects.row.get(self._handler.navigated_to)
        return None if row is None else int(objects.kinds[row])

    def _judge(self, action: Action, outcome: skills.Outcome, object_id: str) -> float:
        """The reward that an action earned, by the rules of :mod:`er_gym.tasks.judge`."""
        if not outcome.success:
            return 0.0
        if action.verb == verbs.END and self.task.goal:
            self._goal_unmet = self.unmet_now()
        self._progress, reward = self._progress.after(
            action.verb,
            action.object_type,
            object_id,
            # Only "end" asks for these names, and listing them takes time.
            in_reach=self._available.in_reach if action.verb == verbs.END else (),
            goal_holds=not self._goal_unmet,
        )
        return reward

    def _changed_unasked(self) -> tuple[str, ...]:
        """The side effects of an episode that is over; worked out once."""
        if self._side_effects is None:
            if self._room_before is None:
                self._room_before = self._room_arranged()
            self._side_effects = side_effects(self.task, self._room_before, self.perception.objects)
        return self._side_effects

    def _room_arranged(self) -> ObjectTable:
        """The room as the task arranges it; the controller's world is afterwards as it was."""
        controller = self._controller
        world, headless = controller.world_state(), controller.headless
        controller.headless = True  # nothing of this is to be drawn
        try:
            set_up_scene(controller, self.task.scene, self.task.arrangement)
            return skills.look(controller).objects
        finally:
            controller.restore_world(world)
            controller.headless = headless

    def _objects_of_goal(self) -> Sequence[Mapping[str, Any]]:
        """Metadata of the objects that the goal is about.

        The metadata of all objects takes longer than the rest of a step, so it is made only for a
        goal that needs more than :data:`~er_gym.thor.objects.ENTRY_KEYS`.
        """
        goal = self.task.goal
        if all(name in ENTRY_KEYS for condition in goal for name, _ in condition.state):
            return self.perception.objects.entries({condition.object_type for condition in goal})
        return self.all_objects()

    def _not_understood(self, text: str) -> StepResult:
        self._unknown_replies += 1
        if self._protocol.unknown_breaks_runs:
            self._memory.forget_last()
        if self._unknown_replies >= MAX_UNKNOWN:
            self.end_reason = "no known action"
        elif self._replies_left == 0:
            self.end_reason = "step limit"
        quoted = text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}..."
        feedback = feedback_words.NO_ACTION(
            quoted=repr(quoted),
            alone=", ".join(verbs.BARE_VERBS),
            others=", ".join(verbs.OBJECT_VERBS),
        )
        return self._reply(None, text, False, "", feedback, 0.0)

    # -- observations, info, rewards -------------------------------------------------------------

    def _reply(
        self,
        action: Action | None,
        text: str,
        success: bool,
        object_id: str,
        feedback: str,
        reward: float,
        views: Mapping[str, Perception] | None = None,
        error_message: str = "",
    ) -> StepResult:
        truncated = self.end_reason == "step limit"
        terminated = bool(self.end_reason) and not truncated
        appended = self._protocol.appends_end and self.end_reason in _CUT_OFF
        if appended:
            reward += self._judge(Action(verbs.END), skills.Outcome(None, True), "")
        obs, info = self._told(
            action, text, success, object_id, feedback, error_message, views or {}, appended
        )
        return obs, reward, terminated, truncated, info

    def picture(self, perception: Perception) -> NDArray[np.uint8] | None:
        """The frame, annotated with object types if the environment asks for it."""
        return perception.annotated if self._settings.annotate else perception.frame

    def _told(
        self,
        action: Action | None,
        text: str,
        success: bool,
        object_id: str,
        feedback: str,
        error_message: str,
        views: Mapping[str, Perception],
        appended: bool = False,
    ) -> ResetResult:
        """The observation and ``info`` after ``reset`` or a step."""
        self._telling = _Telling(
            action, text, success, object_id, feedback, error_message, views, appended
        )
        perception, available, progress = self.perception, self._available, self._progress
        situation = self._situation = Situation(
            perception=perception,
            available=available,
            memory=self._memory,
            known=self._known,
            instruction=self.task.instruction,
            feedback=feedback,
            at=self._navigated_to_kind,
            success=success,
            steps=self._steps,
            max_steps=self.max_steps,
            annotate=self._settings.annotate,
            understood=action is not None or success,
            views=views,
        )
        info: Info = {
            "task_id": self.task.id,
            "task_type": self.task.type.name,
            "instruction": self.task.instruction,
            "action": "" if action is None else str(action),
            "verb": "" if action is None else action.verb,
            "object_type": "" if action is None else action.object_type,
            "action_text": text,
            "action_success": success,
            "object_id": object_id,
            "feedback": feedback,
            "error_message": error_message,
            "held": perception.held_name,
            "visible_mask": perception.visible_types.astype(np.int8),
            "navigable_mask": self._known.types.astype(np.int8),
            "interactable_mask": available.interactable_types.astype(np.int8),
            "action_mask": self.action_mask(),
            "steps": self._steps,
            "max_steps": self.max_steps,
            "key_actions_done": len(progress.done),
            "key_actions_left": len(progress.left),
            "success": progress.success,
            "goal_unmet": "; ".join(map(str, self._goal_unmet)),
            "end_reason": self.end_reason,
            "end_appended": appended,
            "fault": self._fault,
        }
        entries = cast(dict[str, Any], info)
        observations = self._settings.observations
        for kind in observations.values():
            entries.update(kind.info(situation))
        return {name: kind.build(situation) for name, kind in observations.items()}, entries

    def drawn(self) -> NDArray[np.uint8]:
        """The agent's view, a copy; it is drawn now if no observation needs it."""
        if self.perception.frame is None:
            headless, self._controller.headless = self._controller.headless, False
            frame = self._controller.step(action="Pass").frame
            self._controller.headless = headless
            self.perception = replace(self.perception, frame=frame)
        return np.array(self.picture(self.perception))

    def in_words(self) -> str:
        """Where the agent is, what it sees, holds and can do, and the last feedback."""
        pose = self.perception.pose
        where = f"You are in {self.task.scene}, at x {pose.x:.2f} m, z {pose.z:.2f} m"
        return f"{where}, and look to {pose.rotation % 360:.0f}°.\n{text_of(self._situation)}"

    @property
    def details(self) -> Details:
        """er-gym's own objects of the last step, which ``info`` lacks; made anew by each call."""
        situation = self._situation
        details: Details = {
            "task": self.task,
            "keys_done": self._progress.done,
            "keys_left": self._progress.left,
            "unmet": self._goal_unmet,
            "side_effects": self._changed_unasked() if self.end_reason else (),
            "visible": self.perception.visible_names,
            "navigable": self._known.names,
            "interactable": self._available.in_reach,
            "legal": LegalActions(self.action_mask()),
            # Copies, since an observation may be built from a view's frame.
            "views": {
                name: None if view.frame is None else np.array(self.picture(view))
                for name, view in situation.views.items()
            },
            "object_views": (),
            "object_views_around": {},
            "instance_ids": (),
        }
        for kind in self._settings.observations.values():
            cast(dict[str, Any], details).update(kind.details(situation))
        return details


def _feedback(action: Action, outcome: skills.Outcome) -> str:
    if outcome.success:
        return feedback_words.DONE(action=action)
    return failed(action, outcome.problem, outcome.error)
