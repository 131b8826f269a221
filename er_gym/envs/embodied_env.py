"""The environment: it owns the loop, and nothing but the loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from numpy.typing import NDArray

from er_gym.envs import instances as which
from er_gym.envs import skills
from er_gym.envs.actions import ACTIONS, Action, AnyAction
from er_gym.envs.conduct import Setting
from er_gym.envs.info import Info, LegalActions
from er_gym.envs.legality import Known
from er_gym.envs.observations import (
    MAX_REPEATS,
    OBSERVATIONS,
    Memory,
    Situation,
    goal_row,
    parse_obs_mode,
)
from er_gym.envs.percept import Percept
from er_gym.envs.protocol import DEFAULT, protocol_named
from er_gym.envs.sources import GENERATE, EpisodeSource, Source, make_source
from er_gym.tasks import verbs
from er_gym.tasks.goal import Condition, unmet
from er_gym.tasks.judge import Criteria, Progress
from er_gym.tasks.start import begin
from er_gym.tasks.task import AgentPose, Task
from er_gym.tasks.types import task_type as look_up_type
from er_gym.thor import make_controller
from er_gym.thor.objects import ENTRY_KEYS

MAX_UNKNOWN = 3
"""So many replies in a row that name no known action end the episode."""
_CUT_OFF = frozenset({"step limit", "no known action"})
"""Why an episode ends that the agent does not end."""


class EmbodiedEnv(gymnasium.Env[dict[str, Any], Any], EzPickle):
    """A household task in an AI2-THOR room, played with high-level actions.

    ## Description
    The agent stands in a corner of a room and is told what to do: find a thing, pick one up, switch
    one on, carry one somewhere. It walks, opens, takes and puts by naming object types, as in the
    paper *Embodied-Reasoner* (arXiv 2503.21696), and is judged by the task's key actions.

    ## Action Space
    ``Discrete`` over :data:`er_gym.envs.actions.ACTIONS`, the same in every scene: ``observe``,
    ``move forward``, ``end``, and a verb with an object type for ``navigate to``, ``pickup``, ``put
    in``, ``open``, ``close``, ``toggle`` and ``slice``. ``step`` also takes an
    :class:`~er_gym.envs.actions.Action` or its text (``"navigate to Fridge"``).
    ``info["action_mask"]`` and :meth:`action_masks` say which are legal now.

    - ``navigate to`` goes to where the object can be handled. Legal for what is, or was once in
      this episode, plain to see (:func:`er_gym.envs.legality.navigable_within`), and for the task's
      own ``navigable_objects``.
    - ``pickup``, ``put in``, ``open``, ``close``, ``toggle``, ``slice`` need the object to be plain
      to see now, or visible and of a type that lies in the receptacle last navigated to; ``slice``,
      which the paper does not have, needs a knife in the hand. A stove burner can be toggled, too,
      where what stands on it and hides it is in reach.
    - ``observe`` looks right, behind and left; ``info["views"]`` has the pictures.
    - ``end`` says that the task is done.

    An illegal action costs a step, changes nothing and is answered in words.

    ## Observation Space
    ``Dict`` of what ``obs_mode`` asks for, joined with ``+``:

    - ``rgb``: the agent's view, ``(height, width, 3)`` uint8.
    - ``state``: ``(D,)`` float32 in [-1, 1], see :data:`er_gym.envs.observations.STATE_LAYOUT`.
    - ``text``: the task, what is seen, held and possible, and feedback, in words.

    ## Info
    ``reset`` and ``step`` return an :class:`er_gym.envs.info.Info`: what is ``visible``, ``held``,
    ``navigable``, ``interactable`` and ``legal`` now, what came of the action, the steps taken and
    allowed, and how far the task has come.

    ## Rewards
    Each key action of the task is worth its reward (1) once, in any order unless the type of task
    is ordered; which instance of a type it is done to does not matter, unless the task singles one
    out. ``end`` is worth its own only when all others but navigation are done, the task's goal
    holds (``info["goal_unmet"]`` says what of it does not), and, for a search, when the target can
    be interacted with. :mod:`er_gym.tasks.judge` states the rules in full. ``step_penalty`` and
    ``illegal_penalty`` are subtracted for each counted step and each illegal action.

    ## Starting State
    The agent stands at the reachable position nearest to a corner of the scene's bounds and looks
    diagonally into the room, which is as recorded or rearranged as the task says. ``reset(seed=…)``
    draws a task from ``episode_source``, of ``task_type`` if that is given. ``options`` pins it:
    ``{"task": task}`` (a :class:`~er_gym.tasks.task.Task`, or its id), ``{"scene": "FloorPlan1"}``,
    ``{"suite": name or file}`` to draw from that one this time, or any of them together.

    ## Episode End
    Terminates on ``end``; on the fourth same action in a row; on the third reply in a row that
    names no known action (such a reply costs no step). Truncates at ``max_steps``, placing the
    agent counting as the first step. ``info["end_reason"]`` says which.

    ## Arguments
    - ``episode_source``: what episodes are drawn from: a list of tasks; the name of a suite
      (default ``"mini"``); the path of a task file; ``"generate"``: the generator, live, an endless
      stream of verified tasks in the training rooms; or an
      :class:`~er_gym.envs.sources.EpisodeSource`.
    - ``task_type``: draw tasks of this type only.
    - ``backend``: ``"embedded"`` or ``"unity"`` (:func:`er_gym.thor.make_controller`).
    - ``width``, ``height`` pixels; ``field_of_view`` degrees, vertical; ``grid_size`` and
      ``visibility_distance`` metres.
    - ``instances``: ``"target"``: a type name stands for the task's object of that type first, as
      in the paper; ``"explore"``: for the nearest not yet visited (navigation) or the nearest
      (interaction), whatever the task.
    - ``protocol``: ``"default"``, or ``"paper"`` to play by the rules of the paper's evaluation
      program (:mod:`er_gym.envs.protocol`).
    - ``max_steps``: default: the task type's own.
    - ``render_device``: what the embedded engine draws with, one for all environments of a process:
      ``"cpu"``, or ``"gpu"`` where there is one with EGL.
    - ``annotate``: write the types of things into the pictures, as set-of-marks prompting does.

    ## Version History
    - v0: first.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012  (Gymnasium's own)

    def __init__(
        self,
        episode_source: Source = "mini",
        *,
        task_type: str | None = None,
        obs_mode: str = "rgb+text",
        backend: str = "embedded",
        width: int = 800,
        height: int = 450,
        field_of_view: float = 90.0,
        grid_size: float = 0.1,
        visibility_distance: float = 20.0,
        instances: str = which.TARGET,
        protocol: str = DEFAULT.name,
        max_steps: int | None = None,
        step_penalty: float = 0.0,
        illegal_penalty: float = 0.0,
        annotate: bool = False,
        render_device: str = "cpu",
        render_mode: str | None = None,
    ) -> None:
        EzPickle.__init__(
            self, episode_source, task_type=task_type, obs_mode=obs_mode, backend=backend,
            width=width, height=height, field_of_view=field_of_view, grid_size=grid_size,
            visibility_distance=visibility_distance, instances=instances, protocol=protocol,
            max_steps=max_steps, step_penalty=step_penalty, illegal_penalty=illegal_penalty,
            annotate=annotate, render_device=render_device, render_mode=render_mode,
        )  # fmt: skip
        if instances not in which.POLICIES:
            raise ValueError(
                f"unknown instances {instances!r}; choose one of: {', '.join(which.POLICIES)}"
            )
        self._protocol = protocol_named(protocol)
        if self._protocol.chooses_instances and instances != which.TARGET:
            raise ValueError(
                f"the {protocol} protocol decides itself what a type name stands for; "
                f"leave out instances={instances!r}"
            )
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"unknown render_mode {render_mode!r}; choose 'rgb_array' or None")
        self._live: EpisodeSource | None = None
        self._generates = isinstance(episode_source, str) and episode_source == GENERATE
        self._source = self._from(episode_source)
        self._task_type = look_up_type(task_type) if task_type else None
        self.render_mode = render_mode
        self._obs = parse_obs_mode(obs_mode)
        self._draws = "rgb" in self._obs
        self._instances = instances
        self._max_steps = max_steps
        self._step_penalty, self._illegal_penalty = step_penalty, illegal_penalty
        self._grid_size = grid_size
        self._backend = backend
        self._controller_arguments: dict[str, Any] = {
            "width": width,
            "height": height,
            "fieldOfView": field_of_view,
            "gridSize": grid_size,
            "visibilityDistance": visibility_distance,
            "snapToGrid": False,
            "headless": not self._draws,
            "renderInstanceSegmentation": annotate and self._draws,
        }
        if self._draws and backend == "embedded":
            self._controller_arguments["render_device"] = render_device
        self._controller: Any = None
        self._percept: Percept  # what was taken in last; nothing before the first reset
        self.action_space = spaces.Discrete(len(ACTIONS))
        self.observation_space = spaces.Dict(
            {name: OBSERVATIONS[name].space(width, height) for name in self._obs}
        )

    # -- Gymnasium's interface -------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode; ``options`` may pin its ``task``, ``scene`` or ``suite``."""
        super().reset(seed=seed)
        self.task = self._choose(**_checked(options or {}))
        controller = self._started_controller(self.task.scene)
        bounds = begin(controller, self.task.scene, self.task.start).metadata["sceneBounds"]
        floor = skills.reachable(controller, (self._backend, self.task.scene, self._grid_size))
        pose = self._protocol.start(bounds, floor)
        self._memory = Memory(pose, goal_row(self.task.instruction))
        self._progress = Progress.start(Criteria.of(self.task))
        self._known = Known(self.task.navigable_objects)
        self._conduct = self._protocol.conduct(
            Setting(self.task, controller, floor, pose, self._grid_size, self._instances)
        )
        self._steps = 1
        self._limit = self._max_steps or self.task.max_steps
        self._unknown = 0
        self._end_reason = ""
        self._goal_unmet: tuple[Condition, ...] = ()
        placed = skills.place(controller, pose)
        self._take_in(placed)
        feedback = "You look around the room."
        info = self._info(None, "", placed.success, "", feedback)
        return self._observation(feedback, True), cast(dict[str, Any], info)

    def step(self, action: AnyAction) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Do an action: an index, an :class:`~er_gym.envs.actions.Action` or its text.

        Raises:
            gymnasium.error.ResetNeeded: there is no episode, or it is over.
            gymnasium.error.InvalidAction: an index that is out of range, or something else that is
                no action at all. (Text that names no known action is answered, not raised.)
        """
        if self._controller is None or self._end_reason:
            raise gymnasium.error.ResetNeeded("call reset() first: no episode is under way")
        understood, text = self._protocol.understand(action, self._percept.objects)
        if understood is None:
            return self._not_understood(text)
        self._unknown = 0
        if understood == self._memory.last and self._memory.repeats >= MAX_REPEATS:
            self._end_reason = "repeated action"
            times = self._memory.repeats + 1
            feedback = f"You have tried to {understood} {times} times in a row; that is it."
            said = self._protocol.repeated or understood
            return self._reply(said, text, False, "", feedback, 0.0)
        self._steps += understood.verb != verbs.END or self._protocol.end_is_step
        refused = self._conduct.objection(understood, self._around, self._known)
        if refused:
            object_id, outcome = "", skills.Outcome(None, False, refused)
        else:
            object_id, outcome = self._conduct.do(
                understood, self._percept, self._around, self._progress.left
            )
        self._memory.act(understood, outcome.success)
        self._take_in(outcome)
        reward = self._judge(understood, outcome, object_id) - self._step_penalty
        if refused:
            reward -= self._illegal_penalty
        if understood.verb == verbs.END:
            self._end_reason = "end"
        elif self._steps >= self._limit:
            self._end_reason = "step limit"
        feedback = refused or _feedback(understood, outcome)
        return self._reply(
            understood, text, outcome.success, object_id, feedback, reward, outcome.views
        )

    def action_masks(self) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for each action that is legal now."""
        return self._conduct.legal(self._around, self._known)

    @property
    def agent_pose(self) -> AgentPose:
        """Where the agent is now."""
        return self._percept.pose

    @property
    def objects(self) -> Sequence[Mapping[str, Any]]:
        """AI2-THOR's metadata of all objects, as they are now."""
        return self._controller.last_event.metadata["objects"]  # type: ignore[no-any-return]

    def render(self) -> NDArray[np.uint8] | None:
        """The agent's view, (height, width, 3) uint8, with ``render_mode="rgb_array"``."""
        if self.render_mode is None or self._controller is None:
            return None
        if self._percept.frame is None:
            headless, self._controller.headless = self._controller.headless, False
            frame = self._controller.step(action="Pass").frame
            self._controller.headless = headless
            self._percept = replace(self._percept, frame=frame)
        return np.ascontiguousarray(self._percept.picture)

    def close(self) -> None:
        """Stop the controller, and the generator if there is one."""
        if self._controller is not None:
            self._controller.stop()
            self._controller = None
        live, self._live = self._live, None
        getattr(live, "close", lambda: None)()

    # -- the loop's parts ------------------------------------------------------------------------

    def _started_controller(self, scene: str) -> Any:
        if self._controller is None:
            self._controller = make_controller(
                self._backend, scene=scene, **self._controller_arguments
            )
        return self._controller

    def _from(self, source: Source) -> EpisodeSource:
        """Where to draw from; the generator is made once for an environment, which closes it."""
        if not isinstance(source, str) or source != GENERATE:
            return make_source(source)
        if self._live is None:
            self._live = make_source(GENERATE)
        return self._live

    def _choose(
        self,
        task: Task | str | None = None,
        scene: str | None = None,
        suite: Source | None = None,
    ) -> Task:
        source = self._source
        if suite is not None:
            source = self._from(suite)
        elif self._generates and self._live is None:  # closed, and begun again
            source = self._source = self._from(GENERATE)
        if task is None:
            return source.draw(self.np_random, self._task_type, scene)
        wanted = source.find(task) if isinstance(task, str) else task
        if scene not in (None, wanted.scene):
            raise ValueError(f"task {wanted.id} plays in {wanted.scene}, not in {scene}")
        return wanted

    def _take_in(self, outcome: skills.Outcome) -> None:
        """Remember what can be seen after a step, and in the views of an "observe"."""
        for percept in (*outcome.views.values(), outcome.percept):
            if percept is not None:
                self._percept = percept
                self._around = self._conduct.around(percept)
                self._known.add(percept.objects.kinds[self._around.navigable])
                self._memory.look(percept, self._at_kind)

    @property
    def _at_kind(self) -> int | None:
        """The type of what was last navigated to, if that is still there."""
        objects = self._percept.objects
        row = objects.row.get(self._conduct.at)
        return None if row is None else int(objects.kinds[row])

    def _judge(self, action: Action, outcome: skills.Outcome, object_id: str) -> float:
        """The reward that an action earned, by the rules of :mod:`er_gym.tasks.judge`."""
        if not outcome.success:
            return 0.0
        if action.verb == verbs.END and self.task.goal:
            self._goal_unmet = unmet(self.task.goal, self._objects_of_goal(), self._around.in_reach)
        self._progress, reward = self._progress.after(
            action.verb,
            action.object_type,
            object_id,
            in_reach=self._around.in_reach,
            goal_holds=not self._goal_unmet,
        )
        return reward

    def _objects_of_goal(self) -> Sequence[Mapping[str, Any]]:
        """Metadata of the objects that the goal is about; of all, where it asks for more than is
        at hand, since that takes longer than the rest of a step."""
        goal = self.task.goal
        if all(name in ENTRY_KEYS for condition in goal for name, _ in condition.state):
            return self._percept.objects.entries({condition.object_type for condition in goal})
        return self.objects

    def _not_understood(
        self, text: str
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self._unknown += 1
        if self._protocol.unknown_breaks_runs:
            self._memory.forget_last()
        if self._unknown >= MAX_UNKNOWN:
            self._end_reason = "no known action"
        feedback = (
            f"{text!r} names no action. Say one of: {', '.join(verbs.BARE_VERBS)}; or one of "
            f"{', '.join(verbs.OBJECT_VERBS)} with an object type, such as 'navigate to Fridge'."
        )
        return self._reply(None, text, False, "", feedback, 0.0)

    # -- what is handed out ----------------------------------------------------------------------

    def _reply(
        self,
        action: Action | None,
        text: str,
        success: bool,
        object_id: str,
        feedback: str,
        reward: float,
        views: Mapping[str, Percept] | None = None,
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        truncated = self._end_reason == "step limit"
        terminated = bool(self._end_reason) and not truncated
        appended = self._protocol.appends_end and self._end_reason in _CUT_OFF
        if appended:
            reward += self._judge(Action(verbs.END), skills.Outcome(None, True), "")
        info = self._info(action, text, success, object_id, feedback)
        info["end_appended"] = appended
        if views:
            info["views"] = {name: view.picture for name, view in views.items()}
        obs = self._observation(feedback, success)
        return obs, reward, terminated, truncated, cast(dict[str, Any], info)

    def _observation(self, feedback: str, success: bool) -> dict[str, Any]:
        situation = Situation(
            percept=self._percept,
            around=self._around,
            memory=self._memory,
            known=self._known,
            instruction=self.task.instruction,
            feedback=feedback,
            at=self._at_kind,
            success=success,
            steps=self._steps,
            max_steps=self._limit,
        )
        return {name: OBSERVATIONS[name].build(situation) for name in self._obs}

    def _info(
        self, action: Action | None, text: str, success: bool, object_id: str, feedback: str
    ) -> Info:
        mask = self.action_masks()
        return {
            "task": self.task,
            "action": action,
            "action_text": text,
            "action_success": success,
            "object_id": object_id,
            "feedback": feedback,
            "success": self._progress.success,
            "goal_unmet": self._goal_unmet,
            "key_actions_done": self._progress.done,
            "key_actions_left": self._progress.left,
            "visible": self._percept.visible_names,
            "held": self._percept.held_name,
            "navigable": self._known.names,
            "interactable": self._around.in_reach,
            "legal": LegalActions(mask),
            "action_mask": mask,
            "steps": self._steps,
            "max_steps": self._limit,
            "end_reason": self._end_reason,
        }


def _checked(options: Mapping[str, Any]) -> Mapping[str, Any]:
    unknown = options.keys() - {"task", "scene", "suite"}
    if unknown:
        raise ValueError(f"unknown option {min(unknown)!r} at reset; there are: task, scene, suite")
    for name, kinds in (("task", Task | str), ("scene", str)):
        if not isinstance(options.get(name), kinds | None):
            raise ValueError(
                f"option {name!r} at reset is {options[name]!r}; give a "
                f"{'Task or its id' if name == 'task' else 'scene such as FloorPlan1'}"
            )
    return options


def _feedback(action: Action, outcome: skills.Outcome) -> str:
    if outcome.success:
        return f"Done: {action}."
    return f"You could not {action}: {outcome.problem}"
