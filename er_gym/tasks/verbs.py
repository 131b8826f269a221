"""The high-level verbs: one table, :func:`table`, with one row for each verb.

An action is a verb, alone (:data:`BARE_VERBS`) or with an object type (:data:`OBJECT_VERBS`). Verb
names are plain strings, as in files and replies, in the spelling of the paper's files.

The action space, the legality mask, the ``state`` and ``text`` observations, task files, the
parsing of replies, prompts and tool calls all derive from the rows. Other packages add rows
(``docs/extending.md``):

- with an entry point in the group ``er_gym.verbs``;
- with ``verbs=package.module:Name`` in the environment variable ``ER_GYM_PLUGINS``;
- with :func:`register`, before anything derives from the table.

The table is built when it is first used, not when this module is imported, because a module that
defines a verb must import this module first.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from difflib import get_close_matches
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from er_gym.plugins import VARIABLE, PluginError, added_objects
from er_gym.thor.object_types import OBJECT_TYPES
from er_gym.thor.objects import PROPERTY_OF_STATE

ANY, EMPTY, FULL = "any", "empty", "full"
"""What a verb may require of the hand, besides certain object types in it."""


@dataclass(frozen=True, kw_only=True)
class Words:
    """The phrases for a verb in one language.

    Attributes:
        said: phrases by which models may name it, in lower case with single spaces.
        meaning: the sentence by which a prompt explains the verb. A prompt does not use it if its
            ``actions.yaml`` explains the verb, as the bundled prompts do for er-gym's own verbs.
    """

    said: tuple[str, ...] = ()
    meaning: str = ""


@dataclass(frozen=True, kw_only=True)
class Verb:
    """A high-level verb: its object, its effect, and the phrases for it.

    Attributes:
        name: the canonical name, in lower case with single spaces: ``"put in"``.
        aliases: other spellings that task files and ``EmbodiedEnv.step`` accept as well.
        thor_action: the AI2-THOR action for it. It gets the ``objectId``, unless the verb is
            ``alone``.
        parameters: further parameters of that action.
        alone: whether the verb takes no object.
        object_property: AI2-THOR's name of the property that an object must have,
            ``"dirtyable"``; ``""`` for any object, or for those of ``object_types`` only.
        object_types: types that take the verb without the property.
        object_state: a field of AI2-THOR's metadata and its required value before the verb,
            ``("isDirty", True)``; it is tested only on objects that have the field. None for any
            state.
        hand: :data:`ANY`, :data:`EMPTY`, :data:`FULL`, or object types of which the hand must hold
            one.
        tool: a common name of these types: ``"a knife"``.
        in_hand: whether the verb can also be done to the held object.
        makes: fields of the object's metadata and their values after the verb, for the goals of
            generated tasks.
        scored: whether success requires key actions with this verb.
        plan: the wording in a list of steps for people; ``{it}`` is the object.
        otherwise: the feedback to an agent if the object or its state does not allow the verb.
        words: language code (``"en"``) to the phrases in that language.
    """

    name: str
    aliases: tuple[str, ...] = ()
    thor_action: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    alone: bool = False
    object_property: str = ""
    object_types: tuple[str, ...] = ()
    object_state: tuple[str, bool] | None = None
    hand: str | tuple[str, ...] = ANY
    tool: str = ""
    in_hand: bool = False
    makes: tuple[tuple[str, bool | str], ...] = ()
    scored: bool = True
    plan: str = ""
    otherwise: str = ""
    words: Mapping[str, Words] = field(default_factory=dict)

    def takes(self, object_type: str) -> bool:
        """Whether the verb is possible for an object type in at least one state."""
        if object_type in self.object_types:
            return True
        if self.object_property:
            return self.object_property in OBJECT_TYPES[object_type].properties
        return not self.object_types and object_type not in NOWHERE

    @property
    def said(self) -> tuple[str, ...]:
        """All phrases for the verb, in all languages."""
        phrases = (phrase for words in self.words.values() for phrase in words.said)
        return tuple(dict.fromkeys((*phrases, self.name, *self.aliases)))

    @property
    def in_plan(self) -> str:
        """:attr:`plan`, or the name where there is none."""
        return self.plan or (self.name if self.alone else f"{self.name} {{it}}")


NOWHERE = frozenset({"Floor"})
"""Types to which the agent cannot navigate, because it is always there."""
NAVIGATE = "navigate to"
PICKUP = "pickup"
PUT = "put in"
OPEN = "open"
CLOSE = "close"
TOGGLE = "toggle"
SLICE = "slice"
OBSERVE = "observe"
MOVE_FORWARD = "move forward"
END = "end"
INIT = "init"
"""Not an action: the verb of an episode's first recorded step, which places the agent."""


def _say(en: str, zh: str) -> Mapping[str, Words]:
    """The phrases of er-gym's own verbs, separated by ``/``."""
    return {"en": Words(said=tuple(en.split("/"))), "zh": Words(said=tuple(zh.split("/")))}


OWN: tuple[Verb, ...] = (
    Verb(
        name=NAVIGATE,
        aliases=("navigate", "go to"),
        scored=False,
        plan="go to {the}{reason}",
        words=_say(
            "navigate to/navigate towards/navigate toward/navigate/go to/go towards/"
            "go toward/go over to/go back to/walk to/walk towards/walk toward/walk over to/move to/"
            "move towards/move toward/move over to/head to/head towards/head toward/"
            "head over to/get to/get closer to/move closer to/return to/travel to/approach",
            "导航到/导航至/导航去/前往/走到/走向/走去/移动到/去到/去往/去",
        ),
    ),
    Verb(
        name=PICKUP,
        aliases=("pick up",),
        thor_action="PickupObject",
        object_property="pickupable",
        hand=EMPTY,
        plan="pick up {the}",
        otherwise="It cannot be picked up.",
        words=_say(
            "pick up/pick up object/pick/grab/grasp/take/take out/get/collect",
            "拿起/捡起/拾取/拾起/拿取/取出/拿出/抓起/抓取/拿",
        ),
    ),
    Verb(
        name=PUT,
        aliases=("put",),
        thor_action="PutObject",
        # forceAction lets any type into any receptacle: the paper asks for a Cup in the GarbageCan.
        # Free space, reach and a closed door still count.
        parameters={"forceAction": True},
        object_property="receptacle",
        object_types=("Sink", "Bathtub"),  # objects go into their basins
        object_state=("isOpen", True),
        hand=FULL,
        plan="put {held} {inside}",
        otherwise="It is closed, or nothing can be put into it.",
        words=_say(
            "put in/put into/put/put down/put object/place/place in",
            "放入/放进/放到/放在/放置在/放置到/放下",
        ),
    ),
    Verb(
        name=OPEN,
        thor_action="OpenObject",
        object_property="openable",
        object_state=("isOpen", False),
        otherwise="It is open already, or does not open.",
        words=_say("open/open up/open object", "打开"),
    ),
    Verb(
        name=CLOSE,
        thor_action="CloseObject",
        object_property="openable",
        object_state=("isOpen", True),
        otherwise="It is closed already, or does not close.",
        words=_say("close/close object/shut", "关闭/关上/合上"),
    ),
    Verb(
        name=TOGGLE,
        thor_action="ToggleObjectOn",  # or ToggleObjectOff, see er_gym/envs/skills.py
        object_property="toggleable",
        object_types=("StoveBurner",),  # by its knob
        plan="switch {it} on or off",
        otherwise="It has no switch.",
        words=_say(
            "toggle/toggle on/toggle off/toggle object/toggle object on/toggle object off/"
            "turn on/turn off/switch/switch on/switch off/power on/power off/activate/deactivate",
            "开关/切换/启动/开启/按下",
        ),
    ),
    Verb(
        name=SLICE,  # ours, not the paper's
        aliases=("cut",),
        thor_action="SliceObject",
        object_property="sliceable",
        hand=("Knife", "ButterKnife"),
        tool="a knife",
        otherwise="It cannot be sliced.",
        words=_say("slice/slice up/slice object/cut/cut up/chop", "切/切开/切片/切割"),
    ),
    Verb(
        name=OBSERVE,
        alone=True,
        scored=False,
        plan="look around",
        words=_say(
            "observe/look around/look about/look at/look/take a look/take a look around/scan",
            "观察/环顾/环视/查看/环顾四周",
        ),
    ),
    Verb(
        name=MOVE_FORWARD,
        alone=True,
        scored=False,
        plan="take a step forward",
        words=_say(
            "move forward/move forwards/move ahead/move straight/go forward/go ahead/"
            "walk forward/walk ahead/step forward/forward",
            "前进/向前移动/向前走/往前走",
        ),
    ),
    Verb(
        name=END,
        alone=True,
        plan="say that it is done",
        words=_say(
            "end/end task/end episode/finish/finished/done/stop/complete/completed/terminate/"
            "exit/quit/task completed/task complete/task finished/task done/task is completed/"
            "task is complete/task is done/task is finished/the task is complete/"
            "the task is completed/the task is done/the task is finished/mission accomplished",
            "结束/完成/停止/任务完成/任务已完成/任务已经完成/完成了任务/任务结束/结束任务/完成任务",
        ),
    ),
)
"""The verbs of er-gym: those of the paper, and "slice"."""


# -- what other packages add -----------------------------------------------------------------------

_registered: list[Verb] = []
_ABOUT_OBJECTS = ("object_property", "object_types", "object_state", "in_hand", "makes")
_TYPES = TypeAdapter(Verb)
_PHRASE = re.compile(r"[^\W_]+(?: [^\W_]+)*")
_SLOTS = frozenset({"it", "the", "held", "inside", "reason"})


def register(verb: Verb) -> None:
    """Add a verb in this process; worker processes need one of the other two ways.

    Raises:
        PluginError: the verb is invalid, or the table has been built already.
    """
    if table.cache_info().currsize:
        raise PluginError(
            f"verb {verb.name!r} is registered too late: the action space has been built. Register "
            f"it before er_gym.envs or agents are imported, or name it in ${VARIABLE}"
        )
    _merged(_merged({each.name: each for each in OWN}, _registered), [verb])
    _registered.append(verb)


@lru_cache(maxsize=1)
def table() -> tuple[Verb, ...]:
    """All verbs: er-gym's own, then added verbs in the order of their names.

    Raises:
        PluginError: a verb cannot be loaded, or is invalid.
    """
    expected = f"an {__name__}.Verb"
    given = [
        *((verb, "register()") for verb in _registered),
        *added_objects("verb", "verbs", expected),
    ]
    for verb, origin in given:
        if not isinstance(verb, Verb):
            raise PluginError(f"{origin} is {verb!r}; give {expected}")
    found = _merged({verb.name: verb for verb in OWN}, [verb for verb, _ in given])
    # Sorted by name: the number of an action must not depend on the order of loading.
    return (*OWN, *(found[name] for name in sorted(found.keys() - {each.name for each in OWN})))


def _merged(known: Mapping[str, Verb], verbs: list[Verb]) -> dict[str, Verb]:
    """The known verbs and further ones by name; equal rows count once."""
    found = dict(known)
    for verb in map(_typed, verbs):
        if verb == found.get(verb.name):
            continue
        taken = {phrase: other.name for other in found.values() for phrase in other.said}
        problem = _problem(verb, taken)
        if problem:
            raise PluginError(f"verb {verb.name!r}: {problem}")
        found[verb.name] = verb
    return found


def _typed(verb: Verb) -> Verb:
    """The row, after a check of its fields' types."""
    try:
        return _TYPES.validate_python(asdict(verb))
    except ValidationError as error:
        first = error.errors()[0]
        field_name = ".".join(map(str, first["loc"]))
        raise PluginError(
            f"verb {verb.name!r}: {field_name} is {first['input']!r}: {first['msg']}"
        ) from None


def _problem(verb: Verb, taken: Mapping[str, str]) -> str:
    """The first problem of a row, "" if there is none."""
    for phrase in verb.said:
        if not _PHRASE.fullmatch(phrase) or phrase != phrase.lower():
            return f"{phrase!r} is not a phrase; write lower-case words with single spaces"
        if phrase in {*taken, INIT}:
            return f"{phrase!r} already means {taken.get(phrase, INIT)!r}; choose another phrase"
    if not verb.thor_action:
        return "it has no thor_action; give the AI2-THOR action that does it"
    if taken_over := {"action", "objectId"} & verb.parameters.keys():
        return f"parameters has {min(taken_over)!r}, which er-gym sets itself; leave it out"
    try:
        verb.in_plan.format_map(dict.fromkeys(_SLOTS, ""))
    except (KeyError, ValueError, AttributeError, IndexError):
        return f"plan is {verb.plan!r}; write words and {{it}}, and no other braces"
    return _problem_of_object(verb) or _problem_of_hand(verb)


def _problem_of_object(verb: Verb) -> str:
    about = [name for name in _ABOUT_OBJECTS if getattr(verb, name)]
    if verb.alone and about:
        return f"alone means no object, so {about[0]} has no effect; leave one of them out"
    properties = sorted({name for kind in OBJECT_TYPES.values() for name in kind.properties})
    if verb.object_property not in ("", *properties):
        return (
            f"no object has the property {verb.object_property!r}; "
            f"choose one of: {', '.join(properties)}; or give object_types"
        )
    if verb.object_state is not None and verb.object_state[0] not in PROPERTY_OF_STATE:
        known = ", ".join(PROPERTY_OF_STATE)
        return f"{verb.object_state[0]!r} is not a state; choose one of: {known}"
    return _unknown_type(verb.object_types)


def _problem_of_hand(verb: Verb) -> str:
    if verb.hand and not isinstance(verb.hand, str):
        return _unknown_type(verb.hand)
    if verb.hand in (ANY, EMPTY, FULL):
        return ""
    return f"hand is {verb.hand!r}; give {ANY!r}, {EMPTY!r}, {FULL!r} or a tuple of object types"


def _unknown_type(names: tuple[str, ...]) -> str:
    unknown = [name for name in names if name not in OBJECT_TYPES]
    if not unknown:
        return ""
    near = get_close_matches(unknown[0], OBJECT_TYPES, n=3)
    hint = f"; did you mean {' or '.join(near)}?" if near else ""
    return f"there is no object type {unknown[0]!r}{hint}"


# -- what derives from the table -------------------------------------------------------------------


def verb_named(name: str) -> Verb:
    """A row of the table by its canonical name."""
    return _by_name()[name]


def canonical_verb(verb: str) -> str:
    """The canonical spelling of a verb: "put" becomes "put in"."""
    verb = " ".join(verb.lower().split())
    return _derived()["ALIASES"].get(verb, verb)  # type: ignore[no-any-return]


@lru_cache(maxsize=1)
def _by_name() -> Mapping[str, Verb]:
    return MappingProxyType({verb.name: verb for verb in table()})


@lru_cache(maxsize=1)
def _derived() -> Mapping[str, Any]:
    with_object = tuple(verb.name for verb in table() if not verb.alone)
    return {
        "BARE_VERBS": tuple(verb.name for verb in table() if verb.alone),
        "OBJECT_VERBS": with_object,
        "INTERACTIONS": tuple(name for name in with_object if name != NAVIGATE),
        "ADDED": table()[len(OWN) :],
        "UNSCORED": frozenset({INIT, *(verb.name for verb in table() if not verb.scored)}),
        "ALIASES": {alias: verb.name for verb in table() for alias in verb.aliases},
    }


if TYPE_CHECKING:
    BARE_VERBS: tuple[str, ...]
    """Verbs without an object."""
    OBJECT_VERBS: tuple[str, ...]
    """Verbs with an object type."""
    INTERACTIONS: tuple[str, ...]
    """Verbs that change their object: :data:`OBJECT_VERBS` except "navigate to"."""
    ADDED: tuple[Verb, ...]
    """The rows of other packages."""
    UNSCORED: frozenset[str]
    """Verbs that success does not require, such as navigation and observation."""
    ALIASES: Mapping[str, str]
    """Other spellings of verbs."""
else:

    def __getattr__(name: str) -> Any:
        if name in ("BARE_VERBS", "OBJECT_VERBS", "INTERACTIONS", "ADDED", "UNSCORED", "ALIASES"):
            return _derived()[name]
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
