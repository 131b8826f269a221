"""What the environment tells an agent, in English and Chinese: one table of sentences.

A sentence has slots, such as ``{thing}`` for an object type. Types and actions keep their names in
every language, as in prompts: an agent has to write them. The environment speaks English; who shows
an agent prompts in another language tells the sentences in that language
(:func:`er_gym.envs.feedback.told_in`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

_SLOT = re.compile(r"\\\{(\w+)\\\}")


@dataclass(frozen=True)
class Sentence:
    """A sentence of the environment, with the same slots in each language.

    Attributes:
        en, zh: in English and in Chinese.
    """

    en: str
    zh: str

    def __call__(self, **slots: object) -> str:
        """The sentence in English."""
        return self.en.format(**slots)

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """Finds the slots in an English sentence."""
        return re.compile(_SLOT.sub(r"(?P<\1>.+?)", re.escape(self.en)), re.DOTALL)


# -- of an action ----------------------------------------------------------------------------------

BEGUN = Sentence("You look around the room.", "你环顾了房间。")
DONE = Sentence("Done: {action}.", "已完成：{action}。")
FAILED = Sentence("You could not {action}: {problem}.", "你没能完成 {action}：{problem}。")
REPEATED = Sentence(
    "You have tried to {action} {times} times in a row, so the episode ends.",
    "你已经连续 {times} 次尝试 {action}，所以这一回合结束。",
)
NO_HINT = Sentence("That did not work.", "没有成功。")
SAY = Sentence(
    "Say one of: {alone}; or one of {others} with an object type, such as 'navigate to Fridge'.",
    "请说其中之一：{alone}；或者 {others} 之一加上物体类型，例如 'navigate to Fridge'。",
)
NO_ACTION = Sentence(
    f"{{quoted}} names no action. {SAY.en}",
    f"{{quoted}} 不是一个动作。{SAY.zh}",
)

# -- why an action is illegal ----------------------------------------------------------------------

NOT_KNOWN = Sentence(
    "You cannot navigate to {thing}: none has been close enough to see clearly. You could go to: "
    "{places}.",
    "你不能 navigate to {thing}：你还没有在足够近的地方看清过它。你可以去：{places}。",
)
OUT_OF_REACH = Sentence(
    "You cannot {action}: none is within reach and in view. There is: {places}.",
    "你不能 {action}：够得着、看得见的地方没有它。这里有：{places}。",
)
HAND_FULL = Sentence(
    "You hold {thing} already; put it down first.", "你手里已经拿着 {thing}；先把它放下。"
)
HAND_EMPTY = Sentence(
    "Your hand is empty; pick something up first.", "你手里是空的；先拿起一样东西。"
)
NO_TOOL = Sentence(
    "You cannot {action} without {tool} in your hand; pick up {tools} first.",
    "手里没有工具，你不能 {action}；先拿起 {tools}。",
)
NOT_FIT = Sentence("You cannot {action}. {why}", "你不能 {action}。{why}")
WRONG_STATE = Sentence("It is not in the state for that.", "它现在的状态不允许这样做。")
PAPER_PLACE = Sentence("You cannot navigate to {thing}.", "你不能 navigate to {thing}。")
PAPER_REACH = Sentence(
    "You cannot {action}: it is not available for interaction.",
    "你不能 {action}：现在不能对它做什么。",
)
OF_VERBS = (
    Sentence("It cannot be picked up.", "它拿不起来。"),
    Sentence("It is closed, or nothing can be put into it.", "它是关着的，或者里面不能放东西。"),
    Sentence("It is open already, or does not open.", "它已经是打开的，或者打不开。"),
    Sentence("It is closed already, or does not close.", "它已经是关着的，或者关不上。"),
    Sentence("It has no switch.", "它没有开关。"),
    Sentence("It cannot be sliced.", "它不能切。"),
)
"""What er-gym's own verbs say of an object that does not allow them (``Verb.otherwise``)."""

# -- why an action was not done --------------------------------------------------------------------

GONE = Sentence("there is no {thing} any more", "已经没有 {thing} 了")
NONE_SUCH = Sentence("there is no such {thing}", "没有这样的 {thing}")
NO_WAY = Sentence("no way was found to where {thing} can be seen", "找不到能看见 {thing} 的位置")
PAPER_WAY = Sentence("no way was found to {thing}", "找不到去 {thing} 的路")
FAULT_OPEN = Sentence("your hand slipped, and it is still closed", "你的手滑了，它还是关着的")
FAULT_CLOSE = Sentence("your hand slipped, and it is still open", "你的手滑了，它还是开着的")
FAULT_PICKUP = Sentence(
    "it slipped out of your grip, and your hand is still empty", "它从你手里滑脱了，你手里还是空的"
)
FAULT_PUT = Sentence(
    "your arm missed the place, and you still hold what you held",
    "你的手臂没有对准位置，东西还在你手里",
)
FAULT_TOGGLE = Sentence(
    "your hand missed the switch, and nothing changed", "你的手没有碰到开关，什么也没有变"
)
NOWHERE_ELSE = Sentence(
    "you did not get there, and are still where you were", "你没有到那里，还在原来的地方"
)
ASTRAY = Sentence("you arrived at {thing} instead", "你走到了 {thing} 那里")

# -- what the simulator refused, see thor_errors.py ------------------------------------------------

BLOCKED = Sentence("{thing} is in the way", "{thing} 挡住了路")
BLOCKED_BY_WALL = Sentence("a wall is in the way", "墙挡住了路")
BLOCKED_SOMEHOW = Sentence("something is in the way", "有东西挡住了路")
HELD_BLOCKS = Sentence("what you hold would hit something", "你手里的东西会碰到别的东西")
NO_ROOM = Sentence("there is no room to stand there", "那里没有地方可站")
IN_CLOSED = Sentence("it is inside {thing}, which is closed", "它在 {thing} 里面，而那是关着的")
NOT_SEEN = Sentence(
    "it is out of view, too far away, or behind something", "它不在视野里、太远，或者被挡住了"
)
HOLDS = Sentence("you hold {thing} already", "你手里已经拿着 {thing}")
HOLDS_SOMETHING = Sentence("you hold something already", "你手里已经拿着东西")
HOLDS_NOTHING = Sentence("you hold nothing", "你手里没有东西")
IN_HAND = Sentence("it is in your own hand", "它在你自己手里")
SHUT = Sentence("{thing} is closed; open it first", "{thing} 是关着的；先把它打开")
SHUT_IT = Sentence("it is closed; open it first", "它是关着的；先把它打开")
NOT_TAKEN = Sentence("{thing} does not go there", "{thing} 不能放在那里")
NOT_TAKEN_HELD = Sentence("what you hold does not go there", "你手里的东西不能放在那里")
NO_SPACE = Sentence("there is no free space for it", "那里没有空位放它")
NO_PLACE = Sentence("nothing can be put there", "那里不能放东西")
IS_OPEN = Sentence("it is open already", "它已经是打开的")
IS_CLOSED = Sentence("it is closed already", "它已经是关着的")
IS_ON = Sentence("it is on already", "它已经开着了")
IS_OFF = Sentence("it is off already", "它已经关掉了")
IS_SO = Sentence("that is done already", "这已经做过了")
RUNNING = Sentence("it is on; switch it off first", "它正开着；先关掉它的开关")
AJAR = Sentence("it is open; close it first", "它是打开的；先把它关上")
BY_OTHER = Sentence("its switch is a part of its own; use that", "它的开关是单独的部件；用那个开关")
NO_PICKUP = Sentence("it cannot be picked up", "它拿不起来")
NO_OPENING = Sentence("it does not open or close", "它不能打开或关上")
NO_SWITCH = Sentence("it has no switch", "它没有开关")
NO_SLICING = Sentence("it cannot be sliced", "它不能切")
IN_PARTS = Sentence("only its parts are left", "它只剩下碎块了")
UNFIT = Sentence("that cannot be done to it", "不能对它这样做")
NOT_THERE = Sentence("it is not there", "它不在那里")
DID_NOT_WORK = Sentence("it did not work", "没有成功")

SENTENCES = tuple(
    sorted(
        (each for each in [*globals().values(), *OF_VERBS] if isinstance(each, Sentence)),
        key=lambda each: "{" in each.en,  # a slot could take the words of a sentence without one
    )
)
"""All sentences, in the order in which a text is compared with them."""
