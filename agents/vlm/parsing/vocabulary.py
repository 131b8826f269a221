"""The vocabulary for reading replies: tags, verbs, JSON fields, and words around a name."""

from __future__ import annotations

import re
from collections.abc import Mapping

from er_gym.tasks import verbs

DECISION = "DecisionMaking"
"""The tag that holds the action."""
THINK = "think"
"""The tag of reasoning models: decisions inside it are only considered."""
TOOL_CALL = "toolcall"

THOUGHT_TAGS: Mapping[str, str] = {
    name: kind
    for kind, names in {
        "Observation": "observation situationanalysis observations 观察 情况分析 现状分析",
        "Planning": "planning taskplanning plan 规划 任务规划 计划",
        "Thinking": f"thinking spatialreasoning reasoning thought thoughts {THINK} 思考 空间推理",
        "Reflection": "reflection selfreflection 反思 自我反思",
        "Verification": "verification doubleverification 验证 双重验证",
    }.items()
    for name in names.split()
}
"""The kind of thought by the name of a tag or field, as :func:`normalized` gives it."""

DECISION_TAGS = frozenset(
    {
        "decisionmaking", "decision", "decisions", "finaldecision", "action", "actions",
        "nextaction", "finalaction", "answer", "finalanswer", "决策", "决定", "行动", "动作",
    }
)  # fmt: skip
CALL_TAGS = frozenset({TOOL_CALL, "toolcalls", "functioncall", "tooluse"})

VERB_FIELDS = (
    "decisionmaking", "decision", "action", "nextaction", "actiontype", "actionname", "verb",
    "command", "act", "answer", "tool", "function", "toolname", "functionname", "name", "决策",
    "动作", "actions",
)  # fmt: skip
"""Fields of a JSON object that may hold the verb; the first that does counts. ``name`` is a tool's
where it is a verb, else perhaps the object's."""
PLACE_FIELDS = (
    "receptacle", "receptacleobjectid", "receptacleid", "receptaclename", "receptacletype", "recep",
    "targetreceptacle", "container", "targetcontainer", "destination", "destinationobject",
    "destinationreceptacle", "place", "location", "targetlocation", "surface", "targetsurface",
    "where", "into", "onto", "inside", "in", "on", "inon", "to", "putin", "target", "targetobject",
    "args 2", "arguments 2", "parameters 2", "params 2", "inputs 2", "objects 2",
)  # fmt: skip
"""Fields that hold the receptacle rather than the object; the first that is set counts. ``args 2``
is the second string of a list."""
MAYBE_PLACE_FIELDS = frozenset({"target", "targetobject"})
"""Those of them that hold the object in other replies."""
HELD_FIELDS = frozenset({"held", "helditem", "heldobject", "holding", "inhand", "inventory"})
"""Fields that hold what is in the hand."""
OBJECT_FIELDS = (
    "objecttype", "object", "objectid", "objectname", "target", "targetobject", "item", "thing",
    "name", "argument", "arguments", "args", "arg", "parameter", "parameters", "params", "input",
    "inputs", "objects", "物体", "对象", "目标",
)  # fmt: skip

VERBS: Mapping[str, str] = {
    **dict.fromkeys(("take a step forward", "take one step forward"), verbs.MOVE_FORWARD),
    **{phrase: verb.name for verb in verbs.table() for phrase in verb.said},
}
"""The verb by each phrase for it, in lower case with single spaces."""
FILLER = frozenset(
    {
        "the", "this", "my", "our", "a", "task", "tasks", "episode", "mission", "search", "job",
        "game", "now", "here", "all", "done", "action", "it", "successfully", "任务", "本次任务",
        "搜索", "了",
    }
)  # fmt: skip
_ROOM = frozenset(
    {"room", "rooms", "house", "scene", "surroundings", "environment", "around", "view", "一下",
     "四周", "周围", "环境", "周围环境", "周围的环境", "房间", "整个房间"}
)  # fmt: skip
ALONE: Mapping[str, frozenset[str]] = {
    **{phrase: FILLER for phrase, verb in VERBS.items() if verb == verbs.END},
    **dict.fromkeys(("look", "look at", "take a look", "查看"), FILLER | _ROOM | {"at"}),
}
"""Phrases that mean their verb only if nothing but certain words follow: "stop the Microwave" does
not end the episode, and "look at the Fridge" is no turn around."""

ARTICLE = re.compile(
    r"(?:(?:the|an?|this|that|these|those|my|your|some|any|another|nearest|closest|nearby|"
    r"(?:doors?|lid|location|position|handle)\sof|"
    r"(?:[\w-]{1,20}\s){0,2}[\w-]{1,20}['’]s)\s+"
    r"|[那这一][个台张把只扇盏]\s*)+",
    re.IGNORECASE,
)
CLAUSE = re.compile(
    r"\s+(?:from|out of|off|inside|into|in|onto|on|at|with|using|to|and|then|next to|near|beside|"
    r"behind|under|over|by|for|so|because|since|which|that|the|where|if|while|again|now|first|"
    r"instead of|rather than|not)(?!\w)"
    r"|而不是|而非|那(?:里|儿|边)|[,;:(){}<>\[\]、。]|\.\s|\s[-–—]\s|[里上中前旁](?:面|边)?$|(?<=[^\x00-\x7f])内$",
    re.IGNORECASE,
)
"""Marks the end of a name and the start of a clause: ``Egg from the Fridge``, ``Fridge, which is
closed``."""
PART_OF = re.compile(
    r"['’]s\s(?:current\s)?(?:location|position|spot|doors?|lid|handle|switch)(?!\w)", re.IGNORECASE
)
"""Follows a name: ``the egg's location``."""
NO_NAME = frozenset(
    {
        "it", "them", "this", "that", "one", "there", "object", "objects", "something", "nothing",
        "none", "null", "the", "a", "an",
    }
)  # fmt: skip
"""Words in place of a name that name no object."""
EDGES = " \t\r\n.,;:!?\"'`*_~=()[]{}<>-。、…“”‘’"
"""Characters that may surround a name."""

_NOT_IN_WORDS = re.compile(r"[\W_]+")


def normalized(name: str) -> str:
    """A tag's or field's name without case, spaces, hyphens and underscores."""
    return _NOT_IN_WORDS.sub("", name).casefold()
