"""The environment: Gymnasium's interface, the controller, and where tasks come from."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from numpy.typing import NDArray

from er_gym.envs import object_selection
from er_gym.envs.actions import ACTIONS, AnyAction
from er_gym.envs.arguments import flag, number, one_of, whole_number
from er_gym.envs.episode import Episode, EpisodeSettings, ResetResult, StepResult
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.faults import FaultPlan, Faults, fault_rates
from er_gym.envs.info import Details
from er_gym.envs.observations import parse_obs_mode, sensors_of
from er_gym.envs.outer_limit import outer_step_limit
from er_gym.envs.perception import SENSORS
from er_gym.envs.protocol import DEFAULT, protocol_named
from er_gym.envs.reset_options import checked_options
from er_gym.envs.saved_episode import BROKEN_OFF, SavedEpisode
from er_gym.envs.sources import GENERATE, EpisodeSource, Source, make_source
from er_gym.envs.window import Window
from er_gym.houses.names import is_house, named
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import AgentPose, Task
from er_gym.tasks.types import types_named
from er_gym.thor import BACKENDS, LIGHTS, RENDER_DEVICES, check_size, make_controller

_NOT_BEGUN, _CLOSED = "no episode has begun", "the environment is closed"
"""Reasons why no episode is under way."""
_LARGEST_SIDE = 4096
"""The longest side of a picture, pixels."""
_SMALLEST_GRID, _LARGEST_GRID = 0.01, 5.0
"""Metres. AI2-THOR allows less, but working out where the agent can stand then takes minutes."""


class EmbodiedEnv(SavedEpisode, gymnasium.Env[dict[str, Any], Any]):
    """A household task in an AI2-THOR room, played with high-level actions.

    ## Description
    The agent stands in a corner of a room and gets an instruction: find an object, pick it up,
    switch it on, carry it somewhere. It walks, opens, picks up and puts by naming object types, as
    in the paper *Embodied-Reasoner* (arXiv 2503.21696). The task's key actions decide its success.

    ## Action Space
    ``Discrete`` over :data:`er_gym.envs.actions.ACTIONS`, the same in every scene: ``observe``,
    ``move forward``, ``end``, and a verb with an object type for ``navigate to``, ``pickup``, ``put
    in``, ``open``, ``close``, ``toggle`` and ``slice``. ``step`` also takes an
    :class:`~er_gym.envs.actions.Action` or its text (``"navigate to Fridge"``), and the index as an
    array of one integer, as learners' ``predict`` returns it.
    ``info["action_mask"]`` and :meth:`action_masks` say which are legal now.

    - ``navigate to`` goes to where the agent can handle the object. It is legal for types that have
      been clearly visible in this episode (:func:`er_gym.envs.legality.navigable_within`), and for
      the task's ``navigable_objects``.
    - ``pickup``, ``put in``, ``open``, ``close``, ``toggle``, ``slice`` are legal if the object is
      clearly visible now, or if it is visible and of a type that lies in the receptacle last
      navigated to. ``slice``, which the paper does not have, needs a knife in the hand. A stove
      burner can also be toggled if the object that stands on it is in reach.
    - ``observe`` looks right, behind and left; ``env.unwrapped.details["views"]`` has the pictures,
      in an environment that draws.
    - ``end`` says that the task is done.

    An illegal action costs a step and changes nothing; ``info["feedback"]`` says why, in plain
    words. ``info["error_message"]`` has what the simulator itself said.

    ## Observation Space
    ``Dict`` of what ``obs_mode`` asks for, joined with ``+``:

    - ``rgb``: the agent's view, ``(height, width, 3)`` uint8.
    - ``depth``: ``(height, width)`` float32, the distance of each pixel's surface from the camera
      along its axis, metres; :data:`er_gym.envs.observations.FAR`, 40, where there is nothing.
    - ``instance``: ``(height, width)`` int32, the number of the object at each pixel, 0 for the
      room. ``env.unwrapped.details["instance_ids"][number]`` is its object id. The numbers are
      those of this step: they can change when something is sliced.
    - ``objects``: ``(T, 6)`` float32 in [-1, 1], a row for each of
      :data:`er_gym.thor.OBJECT_TYPES`: how many of the type are in view, and where the nearest one
      is (:data:`er_gym.envs.object_view.FEATURES`). ``env.unwrapped.details["object_views"]`` lists
      each object in view.
    - ``state``: ``(D,)`` float32 in [-1, 1], see :data:`er_gym.envs.observations.STATE_LAYOUT`.
    - ``text``: the task, what the agent sees, holds and can do, and feedback, in words.
      ``text_task``, ``text_caption`` and ``text_targets`` tell less
      (:data:`er_gym.envs.observations.TEXTS`).
    - ``anchor``: ``(16,)`` uint8, a digest of what the agent has observed and done so far, also in
      hex as ``info["anchor"]`` (:func:`er_gym.envs.observations.anchor_of`).
    - an observation of another package, by name or as ``package.module:ROW`` (docs/extending.md).

    ## Info
    ``reset`` and ``step`` return an :class:`er_gym.envs.info.Info`: what the agent sees, holds and
    can do now, the result of the action, the steps taken and allowed, and how many key actions are
    done and left. It is plain data, with the same names and shapes at ``reset`` and every step.
    ``env.unwrapped.details`` (:class:`er_gym.envs.info.Details`) has er-gym's own objects: the
    task, the key actions, the legal actions, names in place of masks, the pictures of ``observe``.

    ## Rewards
    Each key action of the task is worth its reward (1) once, in any order unless the type of task
    is ordered. Any instance of its object type counts, unless the task names one. ``end`` earns its
    reward only if all key actions but navigation are done, the task's goal holds
    (``info["goal_unmet"]`` lists what does not), and, in a search, the agent can interact with the
    target. :mod:`er_gym.tasks.judge` states the rules in full. ``step_penalty`` and
    ``illegal_penalty`` are subtracted for each counted step and each illegal action.

    ## Starting State
    The agent stands at the reachable position nearest to a corner of the scene's bounds and looks
    diagonally into the room, which is as recorded or rearranged as the task says. ``reset(seed=…)``
    draws a task from ``episode_source``, of ``task_type`` if given. ``options`` pins the task:
    ``{"task": task}`` (a :class:`~er_gym.tasks.task.Task`, or its id), ``{"scene": "FloorPlan1"}``,
    ``{"suite": name or file}`` to draw from that suite this time, or any of them together.

    ## Episode End
    The episode terminates on ``end``, on the fourth same action in a row, and on the third reply in
    a row that names no known action (such a reply costs no step). It truncates at ``max_steps``;
    placing the agent counts as the first step. A limit of Gymnasium's, as
    ``gymnasium.make(…, max_episode_steps=…)`` sets it, counts the calls of ``step``; the
    environment reads it at ``reset``, and the lower of the two limits holds. ``info["end_reason"]``
    names the reason, and ``info["max_steps"]`` the step limit.

    ## Copies and Threads
    ``copy.deepcopy`` and ``pickle`` keep the episode: a copy goes on with equal observations.
    :meth:`snapshot` gives the episode alone as bytes, :meth:`restore` goes back to it, and
    :meth:`fork` makes environments in which it goes on independently. ``backend="unity"`` does not
    tell its state, so there only an environment without an episode can be copied. Threads that
    share an environment wait for each other.

    ## Arguments
    - ``episode_source``: where tasks are drawn from: a list of tasks; the name of a suite (default
      ``"mini"``); the path of a task file; ``"generate"``, an endless stream of tasks in the
      training rooms, each generated and verified when it is drawn; or an
      :class:`~er_gym.envs.sources.EpisodeSource`.
    - ``task_type``: draw tasks of this type only, or of these: any name of a type or of a group, or
      a list of names (:func:`er_gym.tasks.types.types_named`). Each type is as likely as another.
    - ``backend``: ``"embedded"`` or ``"unity"`` (:func:`er_gym.thor.make_controller`).
    - ``width``, ``height``: pixels, at most 4096 each; ``field_of_view``: degrees,
      vertical; ``grid_size`` and ``visibility_distance``: metres.
    - ``instances``: ``"target"``: a type name stands for the task's object of that type first, as
      in the paper; ``"explore"``: for the nearest not yet visited (navigation) or the nearest
      (interaction), whatever the task.
    - ``protocol``: ``"default"``, or ``"paper"`` to play by the rules of the paper's evaluation
      program (:mod:`er_gym.envs.protocol`).
    - ``max_steps``: 1 or more; default: the task type's own.
    - ``step_penalty``, ``illegal_penalty``: 0 or more, see Rewards.
    - ``render_device``: the device that the embedded engine draws with, the same for all
      environments of a process: ``"cpu"``, or ``"gpu"`` on a machine that has one with EGL.
    - ``light``: that the embedded engine draws in: ``"soft"``, from windows and lamps and with soft
      shadows, or ``"flat"``, the same everywhere.
    - ``render_mode``: what :meth:`render` returns: ``"rgb_array"``, the agent's view as (height,
      width, 3) uint8; ``"ansi"``, the room, the pose, what the agent sees and holds and the last
      feedback, in words; ``"human"``, nothing: ``reset`` and ``step`` show a window (extra
      ``render``).
    - ``annotate``: write the object types into the pictures, as set-of-marks prompting does.
    - ``faults``: the rate from 0 to 1 at which actions go wrong, or a rate for each kind, such as
      ``{"navigate": 0.2, "open": 0.1}`` (:mod:`er_gym.envs.faults`).

    ## Version History
    - v0: the first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["ansi", "human", "rgb_array"], "render_fps": 1}  # noqa: RUF012  (Gymnasium's own)
    _episode_type = Episode

    def __init__(
        self,
        episode_source: Source = "mini",
        *,
        task_type: str | Sequence[str] | None = None,
        obs_mode: str = "rgb+text",
        backend: str = "embedded",
        width: int = 800,
        height: int = 450,
        field_of_view: float = 90.0,
        grid_size: float = 0.1,
        visibility_distance: float = 20.0,
        instances: str = object_selection.TARGET,
        protocol: str = DEFAULT.name,
        max_steps: int | None = None,
        step_penalty: float = 0.0,
        illegal_penalty: float = 0.0,
        annotate: bool = False,
        render_device: str = "cpu",
        light: str = "soft",
        render_mode: str | None = None,
        faults: Faults = 0.0,
    ) -> None:
        EzPickle.__init__(
            self, episode_source, task_type=task_type, obs_mode=obs_mode, backend=backend,
            width=width, height=height, field_of_view=field_of_view, grid_size=grid_size,
            visibility_distance=visibility_distance, instances=instances, protocol=protocol,
            max_steps=max_steps, step_penalty=step_penalty, illegal_penalty=illegal_penalty,
            annotate=annotate, render_device=render_device, light=light, render_mode=render_mode,
            faults=faults,
        )  # fmt: skip
        # Check every argument before anything is started.
        one_of("instances", instances, object_selection.POLICIES)
        rules = protocol_named(protocol)
        if rules.chooses_instances and instances != object_selection.TARGET:
            raise ValueError(
                f"the {protocol} protocol decides which object a type name stands for; "
                f"leave out instances={instances!r}"
            )
        if render_mode is not None:
            one_of("render_mode", render_mode, self.metadata["render_modes"])
        width = whole_number("width", width, 1, _LARGEST_SIDE)
        height = whole_number("height", height, 1, _LARGEST_SIDE)
        check_size(width, height)
        annotate = flag("annotate", annotate)
        self._backend = one_of("backend", backend, BACKENDS)
        grid_size = number("grid_size", grid_size, _SMALLEST_GRID, _LARGEST_GRID)
        step_penalty = number("step_penalty", step_penalty, 0)
        illegal_penalty = number("illegal_penalty", illegal_penalty, 0)
        max_steps = None if max_steps is None else whole_number("max_steps", max_steps, 1)
        self.set_faults(faults)
        names: Sequence[Any] = task_type if isinstance(task_type, list | tuple) else [task_type]
        self._task_types = types_named(each for each in names if each is not None)
        self._obs = parse_obs_mode(obs_mode)
        sensors = sensors_of(self._obs.values())
        if annotate and sensors:
            sensors |= {"instances"}
        self._settings = EpisodeSettings(
            protocol=rules,
            observations=self._obs,
            instances=instances,
            grid_size=grid_size,
            max_steps=max_steps,
            step_penalty=step_penalty,
            illegal_penalty=illegal_penalty,
            annotate=annotate,
        )
        self.render_mode = render_mode
        self._window = Window("er-gym")
        self._controller_arguments: dict[str, Any] = {
            "width": width,
            "height": height,
            "fieldOfView": number("field_of_view", field_of_view, 0, 180, above=True),
            "gridSize": grid_size,
            "visibilityDistance": number("visibility_distance", visibility_distance, 0, above=True),
            "snapToGrid": False,
            "headless": not sensors,
            **{name: on for sensor in sensors for name, on in SENSORS[sensor].items()},
        }
        one_of("render_device", render_device, RENDER_DEVICES)
        one_of("light", light, LIGHTS)
        if sensors and backend == "embedded":
            self._controller_arguments.update(render_device=render_device, light=light)
        self._generator: EpisodeSource | None = None
        self._generates = isinstance(episode_source, str) and episode_source == GENERATE
        self._source = self._resolve_source(episode_source)
        self._controller: Any = None
        self._episode: Episode | None = None
        self._lock = threading.RLock()
        self._no_episode = _NOT_BEGUN  # why no episode is under way; "" if one is
        self._outer_limit: int | None = None  # of this episode, see outer_limit.py
        self.action_space = spaces.Discrete(len(ACTIONS))
        self.observation_space = spaces.Dict(
            {name: kind.space(width, height) for name, kind in self._obs.items()}
        )

    # -- Gymnasium's interface -------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> ResetResult:
        """Begin an episode; ``options`` may pin its ``task``, ``scene`` or ``suite``.

        The scene may be a house: a name such as ``House3-17``, or a dictionary in ProcTHOR's JSON.
        If there are no tasks for it, one is generated.

        Raises:
            ValueError: an option does not fit, or there is no such task. The episode under way goes
                on.
            gymnasium.error.Error: the seed is not a whole number of at least 0.
        """
        checked = checked_options({} if options is None else options)
        with self._lock:
            super().reset(seed=seed)
            task = self._choose(**checked)
            answer = self._begin(task, self._faults_with(seed), outer_step_limit(self))
            self._show()
            return answer

    def set_faults(self, faults: Faults, *, seed: int | None = None) -> None:
        """Set the faults of the episodes that ``reset`` begins from now on.

        Args:
            faults: see Arguments; ValueError if a rate is out of its range.
            seed: chooses other faults for the same seeds of ``reset``.
        """
        seeds = () if seed is None else (whole_number("the seed of faults", seed, 0),)
        self._faults = FaultPlan(fault_rates(faults), seeds)

    def step(self, action: AnyAction) -> StepResult:
        """Do an action: an index, an :class:`~er_gym.envs.actions.Action` or its text.

        Raises:
            ResetNeeded: there is no episode, or it is over.
            gymnasium.error.InvalidAction: the index is out of range, or the value is not an action.
                The episode goes on. (Text that names no known action, such as a number, raises
                nothing: models write it, and the feedback answers it.)
        """
        with self._lock:
            episode = self._current("step()")
            if episode.end_reason:
                raise ResetNeeded(
                    f"the episode is over ({episode.end_reason}): call reset() before step()"
                )
            answer = self._do(episode, action)
            self._show()
            return answer

    def action_masks(self) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for each action that is legal now."""
        with self._lock:
            return self._current("action_masks()").action_mask()

    @property
    def task(self) -> Task:
        """The task of the episode."""
        return self._current("asking for the task").task

    @property
    def details(self) -> Details:
        """er-gym's own objects of the last step, beside ``info``: see :class:`.info.Details`."""
        with self._lock:
            return self._current("asking for the details").details

    @property
    def agent_pose(self) -> AgentPose:
        """Where the agent is now."""
        return self._current("asking for the agent's pose").perception.pose

    @property
    def unmet_now(self) -> tuple[Condition, ...]:
        """The conditions of the task's goal that do not hold now."""
        with self._lock:
            return self._current("asking for the goal").unmet_now()

    @property
    def objects(self) -> Sequence[Mapping[str, Any]]:
        """AI2-THOR's metadata of all objects now, as a copy that the caller may change."""
        with self._lock:
            objects = self._current("asking for the objects").all_objects()
            # Pickling is nine times as quick as deepcopy, and metadata are plain data.
            return pickle.loads(pickle.dumps(objects))  # type: ignore[no-any-return]

    def render(self) -> NDArray[np.uint8] | str | None:
        """What ``render_mode`` asks for; see Arguments.

        An array is a copy that the caller may change.

        Raises:
            ResetNeeded: no episode has begun.
            gymnasium.error.Error: a window cannot be opened.
        """
        with self._lock:
            episode = self._current("render()")
            if self.render_mode is None:
                gymnasium.logger.warn(
                    "render() draws nothing, since the environment was made without a render_mode; "
                    "make it with render_mode='rgb_array'"
                )
                return None
            if self.render_mode == "ansi":
                return episode.in_words()
            picture = episode.drawn()
            if self.render_mode == "human":
                self._window.show(picture, self.metadata["render_fps"])
                return None
            return picture

    def _show(self) -> None:
        if self.render_mode == "human":
            self.render()

    def close(self) -> None:
        """Stop the controller, and the generator if there is one; ``reset`` opens them again."""
        with self._lock:
            if self._controller is not None:
                self._controller.stop()
                self._controller = None
            self._no_episode = _CLOSED
            self._window.close()
            live, self._generator = self._generator, None
            getattr(live, "close", lambda: None)()

    # -- the loop's parts ------------------------------------------------------------------------

    def _current(self, before: str) -> Episode:
        """The episode that is under way; ResetNeeded if there is none."""
        if self._no_episode or self._episode is None:
            raise ResetNeeded(f"{self._no_episode}: call reset() before {before}")
        return self._episode

    def _faults_with(self, seed: int | None) -> FaultPlan | None:
        """The faults of an episode that is begun with this seed; None draws one."""
        if not self._faults.rates:
            return None
        own = int(self.np_random.integers(2**63)) if seed is None else seed
        return replace(self._faults, seed=(own, *self._faults.seed))

    def _begin(self, task: Task, faults: FaultPlan | None, replies: int | None) -> ResetResult:
        self._no_episode = BROKEN_OFF  # until this has succeeded
        controller = self._started_controller(task.scene)
        self._episode = self._new_episode(task, controller, faults, replies)
        answer = self._episode.begin()
        self._no_episode = ""
        return answer

    def _new_episode(
        self, task: Task, controller: Any, faults: FaultPlan | None, replies: int | None
    ) -> Episode:
        self._outer_limit = replies
        return self._episode_type(self._settings, task, controller, self._backend, faults, replies)

    def _do(self, episode: Episode, action: AnyAction) -> StepResult:
        understood, text = episode.parse_action(action)
        self._no_episode = BROKEN_OFF  # until this has succeeded
        answer = episode.step(understood, text)
        self._no_episode = ""
        return answer

    def _started_controller(self, scene: str) -> Any:
        if self._controller is None:
            self._controller = make_controller(
                self._backend, scene=scene, **self._controller_arguments
            )
        return self._controller

    def _resolve_source(self, source: Source) -> EpisodeSource:
        """The source to draw from. An environment makes one generator and closes it."""
        if not isinstance(source, str) or source != GENERATE:
            return make_source(source, verification_env)
        if self._generator is None:
            self._generator = make_source(GENERATE, verification_env)
        return self._generator

    def _choose(
        self,
        task: Task | str | None = None,
        scene: str | Mapping[str, Any] | None = None,
        suite: Source | None = None,
    ) -> Task:
        if not isinstance(scene, str) and isinstance(scene, Mapping):
            scene = named(scene)
        source = self._source
        if suite is not None:
            source = self._resolve_source(suite)
        elif self._generates and self._generator is None:  # close() has closed it
            source = self._source = self._resolve_source(GENERATE)
        if task is None:
            if suite is None and scene is not None and is_house(scene):
                with suppress(ValueError):  # it has no tasks there
                    return self._draw(source, scene)
                source = self._resolve_source(GENERATE)
            return self._draw(source, scene)
        wanted = source.find(task) if isinstance(task, str) else task
        if scene not in (None, wanted.scene):
            raise ValueError(f"task {wanted.id} plays in {wanted.scene}, not in {scene}")
        return wanted

    def _draw(self, source: EpisodeSource, scene: str | None) -> Task:
        """Draw a task of one of the types; a type that the source lacks is passed over."""
        kinds = self._task_types
        if len(kinds) < 2:
            return source.draw(self.np_random, kinds[0] if kinds else None, scene)
        first, *others = self.np_random.permutation(len(kinds)).tolist()
        for other in others:
            try:
                return source.draw(self.np_random, kinds[first], scene)
            except ValueError:
                first = other
        return source.draw(self.np_random, kinds[first], scene)


def verification_env() -> EmbodiedEnv:
    """An environment in which a verifier plays generated tasks; it draws no pictures."""
    return EmbodiedEnv((), obs_mode="state")
