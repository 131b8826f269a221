"""A session: one run that a person plays or watches, in a thread of its own.

The run is an ordinary one (:func:`er_gym.rollout.runner.run`). Its agent waits for the person where
another would think, so the records are those of any run.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

from agents.vlm.agent import VLMAgent
from agents.vlm.chat import Picture
from benchmarks.monitor.play.plan import Cast, Plan
from benchmarks.monitor.play.turn import Turn, turn_of
from er_gym.envs.actions import Action, text_of
from er_gym.rollout.agent import (
    Agent,
    Attachments,
    CanBeOverruled,
    CannotFinish,
    CannotGoOn,
    Decision,
    LeavesAttachments,
)
from er_gym.rollout.events import EpisodeEnded, Event
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.records import PERSON, EpisodeRecord
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import episodes_of, finished, run
from er_gym.tasks.task import Task

Phase: TypeAlias = Literal["starting", "deciding", "acting", "over", "closed"]
"""``deciding``: it waits for the person; ``acting``: the agent thinks, or the environment works;
``over``: the episode has ended; ``closed``: the session has."""
Order: TypeAlias = Literal["step", "go", "next", "skip"]
"""What the person may ask for, besides an action: that the agent takes a step, that it goes on by
itself, that the next task begins, and that this one is given up for the next."""
_LONGEST_TEXT = 20_000
_LEFT = "the person left"
_SKIPPED = "the person skipped it"


class Refused(Exception):
    """What the person asks for cannot be done now; nothing has changed.

    Attributes:
        key: of the words that say why, with ``values`` in their places.
        status: HTTP's.
    """

    def __init__(self, key: str, status: int = 409, **values: object) -> None:
        super().__init__(key)
        self.key, self.status, self.values = key, status, values


@dataclass(frozen=True)
class PlayedStep:
    """A step that was taken.

    Attributes:
        number: from 1.
        action: in words.
        thought: of the agent.
        said: what a model said, as it said it; "" for others.
        by_person: whether the person decided it.
        success, feedback: the environment's answer; None and "" until it is there.
    """

    number: int
    action: str
    thought: str = ""
    said: str = ""
    by_person: bool = False
    success: bool | None = None
    feedback: str = ""


@dataclass(frozen=True)
class SessionState:
    """A session at one moment.

    Attributes:
        version: changes whenever anything does.
        phase: see :data:`Phase`.
        going: whether the agent goes on by itself.
        yields: whether the agent plays on after a step that a person decided.
        turn: what the person is shown; None before the first episode.
        shown: the pictures of this episode by the number of their turn.
        steps: of this episode.
        ended: how the last episode ended; None while one is played.
        done, wanted: how many tasks of the session are finished, and how many it has.
        left: whether the session is closed because the person left.
        why: the error that closed it; "" for none.
    """

    version: int = 0
    phase: Phase = "starting"
    going: bool = False
    yields: bool = True
    turn: Turn | None = None
    shown: Mapping[int, Sequence[Picture]] = field(default_factory=dict)
    steps: Sequence[PlayedStep] = ()
    ended: EpisodeEnded | None = None
    done: int = 0
    wanted: int = 0
    left: bool = False
    why: str = ""


class Session:
    """Plays a plan; the methods are called from any thread.

    Args:
        plan: what is played.
        idle_seconds: a person who decides nothing for so long has left.

    Attributes:
        id: a random name.
        plan: what is played.
    """

    def __init__(self, plan: Plan, idle_seconds: float) -> None:
        self.id = secrets.token_urlsafe(12)
        self.plan = plan
        self._idle = idle_seconds
        self._changed = threading.Condition()
        self._now = SessionState(wanted=len(plan.tasks))
        self._order: Order | Action | None = None
        self._leaving = self._skips = False
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()

    # -- for the pages ---------------------------------------------------------------------------

    @property
    def now(self) -> SessionState:
        """The session at this moment."""
        return self._now

    def wait(self, seconds: float, version: int = -1) -> SessionState:
        """The session once the person can do something, or after some seconds.

        Args:
            seconds: the longest wait.
            version: that it must have left.
        """

        def settled() -> bool:
            now = self._now
            waits = now.phase in ("deciding", "over", "closed") and self._order is None
            return now.version != version and (waits or now.going)

        with self._changed:
            self._changed.wait_for(settled, seconds)
            return self._now

    def decide(self, action: Action, number: int) -> SessionState:
        """The person decides a step.

        Args:
            action: a legal one.
            number: of the turn that the person was shown.

        Returns:
            The state before.

        Raises:
            Refused: the action is not legal, the turn is another, or the agent could not go on.
        """
        with self._changed:
            now = self._expect("deciding")
            if now.turn is None or now.turn.number != number:
                raise Refused("play_too_late")
            if not now.yields:
                raise Refused("play_cannot_yield", agent=self.plan.agent)
            if not now.turn.allows(action):
                raise Refused("play_illegal", 422, action=str(action))
            return self._give(action)

    def order(self, order: Order) -> SessionState:
        """Take an order of the person.

        Returns:
            The state before.

        Raises:
            Refused: it makes no sense now.
        """
        with self._changed:
            if order in ("step", "go") and not self.plan.agent:
                raise Refused("play_nobody")
            self._expect("over" if order == "next" else "deciding")
            return self._give(order)

    def pause(self) -> SessionState:
        """The agent is to wait after its step; returns the state before."""
        with self._changed:
            before = self._now
            if before.going:
                self._become(going=False)
            return before

    def close(self, seconds: float = 0.0) -> None:
        """End the session, and wait so long for it; the episode in play leaves no record."""
        with self._changed:
            self._leaving = True
            self._changed.notify_all()
        self._thread.join(seconds)

    def _expect(self, phase: Phase) -> SessionState:
        if self._now.phase != phase or self._order is not None or self._leaving:
            raise Refused("play_closed" if self._now.phase == "closed" else "play_too_late")
        return self._now

    def _give(self, order: Order | Action) -> SessionState:
        before, self._order = self._now, order
        self._changed.notify_all()
        return before

    def _become(self, **changes: Any) -> None:
        """Change the state; whoever waits for that is told."""
        with self._changed:
            self._now = replace(self._now, version=self._now.version + 1, **changes)
            self._changed.notify_all()

    # -- in the thread of the run ----------------------------------------------------------------

    def _play(self) -> None:
        plan, why = self.plan, ""
        try:
            with RunDirectory.locked(plan.path, plan.manifest) as directory:
                directory.move_aside(episodes_of(plan.tasks))
                with plan.cast(directory) as cast:
                    self._run(directory, cast)
        except CannotGoOn as stop:
            why = "" if self._leaving else str(stop)
        except (Exception, SystemExit) as error:  # the pages go on, and tell it
            why = " ".join(str(error).split()) or type(error).__name__
        self._become(phase="closed", going=False, left=self._leaving, why=why)

    def _run(self, directory: RunDirectory, cast: Cast) -> None:
        plan = self.plan
        self._become(done=len(finished(directory, plan.tasks)))

        begun = ""

        def make(task: Task, seed: int) -> Agent:
            nonlocal begun
            if begun not in ("", task.id):  # the same task begins again if its process has died
                self._wait_for_end()
            begun = task.id
            agent = cast.make(task, seed)
            self._become(
                phase="starting",
                ended=None,
                turn=None,
                shown={},
                steps=(),
                yields=isinstance(agent, CanBeOverruled),
            )
            return _Directed(agent, self)

        run(
            directory,
            plan.tasks,
            make,
            executor="threads",
            parallelism=Parallelism(1, 1),
            listeners=[self._hear],
            cost=cast.cost,
        )

    def _hear(self, event: Event) -> None:
        if isinstance(event, EpisodeEnded):
            crashed = bool(event.error)
            done = self._now.done + (not crashed)
            self._become(phase="over", going=False, ended=event, done=done)
            if self._skips:
                self._skips = False
                with self._changed:
                    self._order = "next" if done < self._now.wanted else None

    def _wait_for_end(self) -> None:
        """Wait until the last episode is written and the person asks for the next."""
        with self._changed:
            self._changed.wait_for(lambda: self._now.ended is not None or self._leaving)
        self._wait_for_order()

    def _wait_for_order(self) -> Order | Action:
        """What the person asks for.

        Raises:
            CannotGoOn: the person has left.
        """
        until = time.monotonic() + self._idle
        with self._changed:
            while self._order is None and not self._leaving:
                if not self._changed.wait(max(0.0, until - time.monotonic())):
                    self._leaving = self._order is None
            if self._leaving:
                raise CannotGoOn(_LEFT)
            order, self._order = self._order, None
            assert order is not None
            return order

    def decision(
        self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]
    ) -> Action | None:
        """What the person decides; None if the agent is to decide.

        Raises:
            CannotGoOn: the person has left.
            CannotFinish: the person skips this task.
        """
        turn = turn_of(task, obs, info, self.plan.pictures)
        with self._changed:
            if self._leaving:
                raise CannotGoOn(_LEFT)
            going = self._now.going
            self._become(
                phase="acting" if going else "deciding",
                turn=turn,
                shown={**self._now.shown, turn.number: (*turn.pictures.values(),)},
                steps=_answered(self._now.steps, turn),
            )
        if going:
            return None
        order = self._wait_for_order()
        self._become(phase="acting", going=order == "go")
        if order == "skip":
            self._skips = True
            raise CannotFinish(_SKIPPED)
        return order if isinstance(order, Action) else None

    def decided(self, decision: Decision, said: str) -> None:
        """The agent, or the person in its place, has decided a step."""
        step = PlayedStep(
            number=len(self._now.steps) + 1,
            action=text_of(decision.action),
            thought=decision.thought[:_LONGEST_TEXT],
            said=said[:_LONGEST_TEXT],
            by_person=bool(decision.by),
        )
        self._become(steps=(*self._now.steps, step))


class _Directed:
    """An agent that asks the person before each step."""

    def __init__(self, agent: Agent, session: Session) -> None:
        self.obs_mode = agent.obs_mode
        self._agent, self._session = agent, session
        self._leaves = agent if isinstance(agent, LeavesAttachments) else None
        self.attachment_folders = self._leaves.attachment_folders if self._leaves else ()

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        self._task = task
        self._agent.reset(task, obs, info)

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        session, agent = self._session, self._agent
        action = session.decision(self._task, obs, info)
        if action is None:
            decision = agent.act(obs, info)
            session.decided(decision, _last_words(agent))
        else:
            assert isinstance(agent, CanBeOverruled)
            agent.overruled(action, obs, info)
            decision = Decision(action, by=PERSON if session.plan.agent else "")
            session.decided(decision, "")
        return decision

    def attachments(self, episode: EpisodeRecord, stem: str) -> Attachments:
        return self._leaves.attachments(episode, stem) if self._leaves else {}


def _last_words(agent: Agent) -> str:
    """What a model has just said; "" for other agents."""
    if not isinstance(agent, VLMAgent):
        return ""
    last = agent.messages[-1]
    said = [part for part in last.parts if isinstance(part, str)]
    return "\n".join([*filter(None, [last.reasoning]), *said])


def _answered(steps: Sequence[PlayedStep], turn: Turn) -> Sequence[PlayedStep]:
    """The steps with the answer to the last one."""
    if not steps:
        return steps
    *before, last = steps
    return (*before, replace(last, success=turn.success, feedback=turn.feedback))
