"""The generator: from the objects of a scene to its tasks."""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from er_gym.tasks import verbs
from er_gym.tasks.arrangement import Arrangement, random_arrangement, set_up_scene
from er_gym.tasks.generate.plan_builder import ImpossiblePlan
from er_gym.tasks.generate.rules import all_rules
from er_gym.tasks.generate.scene_graph import Accepts, SceneGraph, SceneObject, read_scene_graph
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule
from er_gym.tasks.goal import Condition, unmet_conditions
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, canonical_names, task_type
from er_gym.tasks.wordings.instructions import instruction
from er_gym.tasks.wordings.words import in_or_on_the, subject_words
from er_gym.thor import accepts as thor_accepts

AMBIGUOUS = "the words fit several objects, which ask for different actions"
DONE_ALREADY = "the goal holds from the start"
SAME_PLACES = "one type would name two places"


def generator_for(controller: Any, scene: str, seed: int) -> Generator:
    """Set up a scene in one of its arrangements, and return the generator for it.

    Args:
        controller: an AI2-THOR controller.
        scene: such as ``FloorPlan1``.
        seed: the seed of the arrangement; 0 for the recorded one.
    """
    arrangement = random_arrangement(controller, scene, seed) if seed else Arrangement()
    return Generator(
        scene, set_up_scene(controller, scene, arrangement).metadata["objects"], arrangement
    )


@dataclass(frozen=True)
class Generator:
    """Generates the tasks of a scene in one arrangement.

    Attributes:
        scene: its name, such as ``FloorPlan1``.
        objects: ``event.metadata["objects"]`` after the scene was arranged.
        arrangement: how the scene was arranged.
        accepts: whether an object of one type may be put into a receptacle of another.
        rules: the kinds of tasks to generate.
        dropped: how many choices gave no task, by reason.
    """

    scene: str
    objects: Sequence[Mapping[str, Any]]
    arrangement: Arrangement = field(default_factory=Arrangement)
    accepts: Accepts = thor_accepts
    rules: Sequence[TaskRule] = field(default_factory=all_rules)
    dropped: Counter[str] = field(default_factory=Counter)

    @cached_property
    def scene_graph(self) -> SceneGraph:
        """The objects and what lies in what."""
        return read_scene_graph(self.objects, self.accepts)

    def tasks(self, types: Collection[str] = ()) -> Iterator[Task]:
        """Yield the candidate tasks, rule by rule; the same for the same arguments.

        Args:
            types: names of task types or groups; all types if it is empty.

        Raises:
            ValueError: there is no such type.
        """
        made: set[str] = set()
        wanted = canonical_names(types)
        for rule in self.rules:
            if not wanted or rule.type in wanted:
                for choice in rule.choices(self.scene_graph):
                    task = self._candidate(rule, choice)
                    if isinstance(task, str):
                        self.dropped[task] += 1
                    elif task.id not in made:  # else an equal task about an equivalent object
                        made.add(task.id)
                        yield task

    def request(self, type_name: str, *object_ids: str) -> Task:
        """The task of a type about given objects, even if the rules would not choose these.

        Args:
            type_name: a name of a type (:func:`~er_gym.tasks.types.task_type`); not the long-range
                type.
            object_ids: the objects and their targets, in the order of the instruction: one id for a
                search, a pickup or a toggle, two for a transfer, four for two transfers.

        Raises:
            ValueError: the type cannot be requested, the scene lacks an object, or the number of
                objects is wrong.
        """
        with suppress(ValueError):  # told below, with the types that can be requested
            type_name = task_type(type_name).name
        rule = next((rule for rule in self.rules if rule.type == type_name and not rule.slug), None)
        if rule is None:
            known = ", ".join(rule.type for rule in self.rules if not rule.slug)
            raise ValueError(f"{type_name!r} tasks cannot be requested; choose one of: {known}")
        unknown = [i for i in object_ids if i not in self.scene_graph.objects]
        if unknown:
            raise ValueError(f"{self.scene} has no object {unknown[0]!r} when the task begins")
        chosen = [self.scene_graph.objects[object_id] for object_id in object_ids]
        try:
            plan = rule.plan(self.scene_graph, *chosen)
        except (TypeError, ImpossiblePlan) as error:
            raise ValueError(
                f"no {type_name!r} task about {len(chosen)} objects: {error}"
            ) from None
        return self._task(rule, plan, ())

    def _candidate(self, rule: TaskRule, choice: tuple[SceneObject, ...]) -> Task | str:
        """The task for a choice, or the reason why there is none."""
        plan = rule.plan(self.scene_graph, *choice)
        if not plan.one_object_per_type:
            return SAME_PLACES
        named: list[SceneObject] = []
        for subject in plan.subjects:
            others = self.scene_graph.others_of_type(subject)
            if not others:
                continue
            if self._interchangeable(rule, choice, plan, subject, others):
                continue
            if not rule.may_name_places or not self._told_by_place(subject, others):
                return AMBIGUOUS
            named.append(subject)
        task = self._task(rule, plan, named)
        # Only an agent can tell whether a search begins within reach of its target.
        standing = [condition for condition in task.goal if not condition.in_reach]
        return DONE_ALREADY if standing and not unmet_conditions(standing, self.objects) else task

    def _interchangeable(
        self,
        rule: TaskRule,
        choice: tuple[SceneObject, ...],
        plan: TaskPlan,
        subject: SceneObject,
        others: list[SceneObject],
    ) -> bool:
        """Whether any object of the subject's type will do: all need the same actions."""
        if any(not unmet_conditions((each,), self.objects) for each in _about(plan.goal, subject)):
            return False
        for other in others:
            swapped = tuple(other if obj == subject else obj for obj in choice)
            try:
                if rule.plan(self.scene_graph, *swapped).scored != plan.scored:
                    return False
            except ImpossiblePlan:
                return False
        return True

    def _told_by_place(self, subject: SceneObject, others: list[SceneObject]) -> bool:
        """Whether the type of its receptacle distinguishes an object from the others."""
        place = self.scene_graph.place_of(subject)
        holders = {parent.type for other in others for parent in self.scene_graph.parents(other)}
        return place != subject and place.type not in holders

    def _task(self, rule: TaskRule, plan: TaskPlan, named: Sequence[SceneObject]) -> Task:
        task_id = self._id(rule, plan, named)
        words = {**self._words(plan, named), **plan.words}
        instructions = rule.instructions(words)
        name = instructions[0]
        gone_to = [action.object_id for action in plan.key_actions if action.verb == verbs.NAVIGATE]
        ids = {obj.type: obj.id for obj in named}
        return Task(
            id=task_id,
            type=BY_NAME[rule.type],
            scene=self.scene,
            # Not hash(): it differs between processes.
            instruction=instruction(name, task_id, self.scene)
            or instructions[zlib.crc32(task_id.encode()) % len(instructions)],
            name=name,
            key_actions=plan.key_actions,
            target_objects=tuple(dict.fromkeys(gone_to)),
            related_objects=plan.related,
            goal=tuple(
                replace(condition, object_id=ids.get(condition.object_type, ""))
                for condition in plan.goal
            ),
            arrangement=replace(self.arrangement, dirty=plan.dirty),
            extra={"made_by": rule.slug or rule.type},
        )

    def _id(self, rule: TaskRule, plan: TaskPlan, named: Sequence[SceneObject]) -> str:
        handled = [
            action.object_type
            for action in plan.key_actions
            if action.verb in verbs.INTERACTIONS and action.verb not in (verbs.OPEN, verbs.CLOSE)
        ] or [obj.type for obj in plan.subjects]
        places = [f"from_{self.scene_graph.place_of(obj).type}" for obj in named]
        return "-".join(
            (self.arrangement.layout or self.scene, rule.slug or rule.type, *handled, *places)
        )

    def _words(self, plan: TaskPlan, named: Sequence[SceneObject]) -> dict[str, str]:
        words = {"room": room_kind(self.scene)}
        for prefix, obj in zip(("", "second_"), plan.subjects, strict=False):
            place = in_or_on_the(self.scene_graph.place_of(obj).type) if obj in named else ""
            said = subject_words(obj.type, place)
            words |= {f"{prefix}{field}": word for field, word in said.items()}
        return words


def _about(goal: Sequence[Condition], obj: SceneObject) -> list[Condition]:
    return [c for c in goal if c.object_type == obj.type and not (c.in_reach or c.held)]


def generate_tasks(
    objects: Sequence[Mapping[str, Any]],
    scene: str,
    accepts: Accepts = thor_accepts,
    arrangement: Arrangement = Arrangement(),  # noqa: B008  (frozen)
) -> Iterator[Task]:
    """Yield the candidate tasks of a scene: :meth:`Generator.tasks`."""
    return Generator(scene, objects, arrangement, accepts).tasks()
