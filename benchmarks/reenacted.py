"""One trajectory played anew beside its replay: what :mod:`benchmarks.reenacting` makes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from agents.expert.course import Course, Intent, View
from agents.expert.legs import at_hand, legs_of
from agents.expert.replayed_intents import replayed_purpose
from agents.expert.thinker import ThinkingAgent
from agents.expert.writers.base import ThoughtRequest, ThoughtWriter, WrittenThoughts
from er_gym.data.train_rule import QUOTING
from er_gym.data.trajectory import Subgoal, ThoughtRecord, Turn
from er_gym.tasks import verbs
from er_gym.tasks.task import Task


class DecidedCourse:
    """Does again what a model decided; :class:`~agents.expert.course.Course`.

    Args:
        task: the task.
        turns: the recorded ones.
    """

    view: View

    def __init__(self, task: Task, turns: Sequence[Turn]) -> None:
        self._legs, self._turns = legs_of(task), turns

    def intents(self) -> Iterator[Intent]:
        """What was decided, with the reasons as :class:`~agents.expert.decider.DecidingAgent`
        infers them."""
        for turn in self._turns:
            here = at_hand(self._legs, self.view.left)
            yield Intent(
                turn.action,
                replayed_purpose(turn.action, self.view.held),
                here[1] if here else Subgoal(),
                plan=(turn.object_type,) if turn.verb == verbs.NAVIGATE else (),
            )


class Witness:
    """Hears which thoughts are asked for, and says those that were recorded;
    :class:`~agents.expert.writers.base.ThoughtWriter`.

    Args:
        turns: the recorded ones.
        writer: writes the thoughts that they should have; None if only their kinds are known.
    """

    name = "witness"

    def __init__(self, turns: Sequence[Turn], writer: ThoughtWriter | None) -> None:
        self._turns, self._writer = turns, writer
        self.writes = writer is not None
        self.request: ThoughtRequest | None = None
        self.thoughts: list[ThoughtRecord] = []

    def write(self, request: ThoughtRequest) -> WrittenThoughts:
        """Remember what is asked for, and what should be written."""
        recorded = self._turns[request.knowledge.turn].thoughts
        self.request = request
        if self._writer is not None:
            self.thoughts = [*self._writer.write(request).thoughts]
        else:
            there = [*recorded, *[ThoughtRecord(kind="planning", text="")] * len(request.kinds)]
            pairs = zip(request.kinds, there, strict=False)
            self.thoughts = [each.model_copy(update={"kind": kind}) for kind, each in pairs]
        return WrittenThoughts(tuple(recorded))


class Attempt:
    """The course of an episode that fails, up to its first mistake.

    Args:
        course: of the episode.
        length: how many of its actions are repeated.
    """

    def __init__(self, course: Course, length: int) -> None:
        self._course, self._left = course, length
        self._intents: Iterator[Intent] | None = None

    def next(self, info: Mapping[str, Any]) -> Mapping[str, Any]:
        """The verb and the object of the next action; empty after the last."""
        if not self._left:
            return {}
        self._left -= 1
        self._course.view = View.of({}, info)  # explorers observe nothing besides
        if self._intents is None:
            self._intents = self._course.intents()
        action = next(self._intents).action
        return {"verb": action.verb, "object_type": action.object_type}


class Reenacted:
    """One trajectory; :class:`er_gym.data.reenactment.Reenactment`.

    Args:
        header: see there.
        task: the trajectory's.
        agent: decides anew; None if nothing tells how.
        witness: of the agent's thoughts.
        attempt: the beginning of a correction; None if it is not known.
    """

    def __init__(
        self,
        header: Mapping[str, Any],
        task: Task,
        agent: ThinkingAgent | None,
        witness: Witness,
        attempt: Attempt | None,
    ) -> None:
        self.header = header
        self._task, self._agent, self._witness, self._attempt = task, agent, witness, attempt

    def decide(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Mapping[str, Any]:
        """See :class:`er_gym.data.reenactment.Reenactment`."""
        if self._agent is None:
            return {}
        if self._witness.request is None:
            self._agent.reset(self._task, obs, info)
        tried = self._attempt.next(info) if self._attempt else {}
        self._agent.act(obs, info)
        request = self._witness.request
        assert request is not None
        known = request.knowledge
        told = {
            "verb": known.decision.verb,
            "object_type": known.decision.object_type,
            **tried,
            "purpose": known.purpose,
            "subgoal": known.subgoal,
            "plan": [*known.plan],
        }
        return told if self._quotes(known.turn) else {**told, "thoughts": self._witness.thoughts}

    def _quotes(self, turn: int) -> bool:
        """Whether the thoughts of a turn are those of an agent that decided itself."""
        said = self.header["correction"]
        if said is not None and said.agent:
            return bool(turn <= said.first_wrong)
        return self.header["kind"] in QUOTING and not self._witness.writes
