"""The embedded engine: an action goes in, metadata and images come out. It only dispatches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple
from weakref import ReferenceType, ref

from er_gym.sim.actions import perform
from er_gym.sim.bystander import Bystander
from er_gym.sim.crew import copy_of
from er_gym.sim.errors import ActionFailed, WrongCall
from er_gym.sim.house.build import EMPTY, house_scene
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.metadata import PROCEDURAL, metadata
from er_gym.sim.render.view import View, draw, with_flags
from er_gym.sim.scene import SCENE_NAMES, UnknownSceneError, load_scene
from er_gym.sim.settings import LIGHTS, SOFT, Settings
from er_gym.sim.size import check_size
from er_gym.sim.world import World

_WALKS = frozenset(
    {
        *("MoveAhead", "MoveBack", "MoveLeft", "MoveRight", "MoveGlobal", "Teleport"),
        *("TeleportFull", "RotateLeft", "RotateRight", "LookUp", "LookDown", "RotateLook"),
        *("Stand", "Crouch", "Pass", "Done", "GetReachablePositions", "GetInteractablePoses"),
    }
)
"""Actions that change no object while the hand is empty."""
_MOST_UNSETTLED = 64


class Answer(NamedTuple):
    """The answer to an action.

    Attributes:
        error: why it failed, ``""`` if it succeeded.
        code: AI2-THOR's ``errorCode``.
        reply: its ``actionReturn``.
    """

    error: str = ""
    code: str | None = None
    reply: Any = None


def _answer(act: Callable[[], Any]) -> Answer:
    try:
        return Answer(reply=act())
    except ActionFailed as failure:
        return Answer(str(failure), failure.code, failure.reply)
    except WrongCall as failure:
        return Answer(str(failure), failure.code)


class Engine:
    """A scene that answers AI2-THOR actions.

    Args:
        width, height: size of frames, pixels.
        metadata_kind: the class of the metadata that :meth:`step` returns.
        light: that frames are drawn in, one of :data:`~er_gym.sim.settings.LIGHTS`.

    Raises:
        ValueError: no frame is of that size, see :func:`~er_gym.sim.size.check_size`; or there is
            no such light.
    """

    def __init__(
        self,
        width: int = 300,
        height: int = 300,
        metadata_kind: type[LazyMetadata] = LazyMetadata,
        light: str = SOFT,
    ) -> None:
        check_size(width, height)
        if light not in LIGHTS:
            raise ValueError(f"unknown light {light!r}; choose one of: {', '.join(LIGHTS)}")
        self._kind = metadata_kind
        self._last: list[ReferenceType[LazyMetadata | Bystander]] = []
        # What each agent of several did last, and with which answer.
        self._did: dict[int, tuple[str, Answer]] = {}
        self.bystanders: tuple[Bystander, ...] = ()
        settings = Settings(width=width, height=height, light=light)
        self.world = World.load(load_scene(SCENE_NAMES[0]), settings)

    def step(self, request: Mapping[str, Any]) -> tuple[LazyMetadata, View | None]:
        """Do one action, given as the AI2-THOR client sends it.

        This raises nothing. The metadata report every failure (``lastActionSuccess``,
        ``errorMessage``, ``errorCode``). :attr:`bystanders` are the agents that did not act,
        in the order of their ids.

        Returns:
            The acting agent's metadata, and its images unless ``renderImage`` is False.
        """
        name = str(request.get("action"))
        self.bystanders = ()
        if name == "Reset":  # it makes a new world, so the last metadata need not be settled
            answer = _answer(lambda: self._reset(request))
        else:
            if not self._keeps_objects(name, request):
                self._settle()
            answer = _answer(lambda: perform(self.world, request))
        settings = self.world.settings
        self.world.settings = with_flags(settings, request)
        now, several = self.world, bool(self.world.others)
        if several:
            _ = now.nesting  # otherwise each copy computes its own
            now = copy_of(now)
        report = metadata(now, name, *answer, self._kind)
        frames = draw(now) if request.get("renderImage", True) else None
        if several:
            self.bystanders = self._watching(now, name, answer, frames)
            unread: list[LazyMetadata | Bystander] = [report, *self.bystanders]
            self._last = [*(each for each in self._last if each() is not None), *map(ref, unread)]
        else:
            self._last = [ref(report)]
        self.world.settings = settings
        return report, frames

    def _keeps_objects(self, name: str, request: Mapping[str, Any]) -> bool:
        """Whether an action of one of several agents leaves all objects as they are. Then what was
        told before can be computed later: it is of a copy of the world, which has its own poses."""
        world, agent = self.world, request.get("agentId")
        if not world.others or name not in _WALKS or len(self._last) > _MOST_UNSETTLED:
            return False
        number = 0 if agent is None else agent
        if type(number) is not int:
            return False
        other = world.others.get(number)
        return (world if other is None else other).held < 0

    def _watching(
        self, world: World, name: str, answer: Answer, frames: View | None
    ) -> tuple[Bystander, ...]:
        """The agents that did not act, by their ids; each is told again what it did itself.

        Args:
            world: a copy, which no action changes.
        """
        if name == "Initialize" and not answer.error:
            self._did = {}  # all did
        self._did[world.acting] = name, answer
        cameras, found = None if frames is None else frames.third_party, []
        for number in sorted(world.others):
            did, said = self._did.setdefault(number, (name, answer))
            told = partial(self._told, did, said)
            found.append(Bystander(world, number, told, cameras, self._note))
        return tuple(found)

    def _told(self, did: str, answer: Answer, own: World) -> LazyMetadata:
        return metadata(own, did, *answer, self._kind)

    def _note(self, told: LazyMetadata) -> None:
        """Settle these metadata, too, before an object changes."""
        self._last.append(ref(told))

    def do(self, act: Callable[[World], Any]) -> Answer:
        """Do something to the world, without metadata and images; what it raises is answered."""
        self.bystanders = ()
        self._settle()
        return _answer(lambda: act(self.world))

    def _settle(self) -> None:
        """Compute and draw what readers may still want to know of the state before an action."""
        unread, self._last = self._last, []
        for each in unread:
            last = each()
            if last is not None:
                last.settle()
        self._last = []  # what bystanders made just now is settled

    def _reset(self, request: Mapping[str, Any]) -> None:
        name = request.get("sceneName") or self.world.scene.name  # by default the same scene again
        if not isinstance(name, str):
            raise ActionFailed(f"sceneName is a text such as FloorPlan1, not {name!r:.200}.")
        try:
            scene = house_scene(EMPTY) if name == PROCEDURAL else load_scene(name)
        except UnknownSceneError as error:
            raise ActionFailed(str(error)) from None
        now = self.world.settings
        fresh = Settings(width=now.width, height=now.height, light=now.light)
        chance = self.world.chance
        self.world = World.load(scene, fresh)
        self.world.chance = chance
