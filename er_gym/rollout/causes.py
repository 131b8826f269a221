"""The causes of unusable replies and failed episodes, and what to do about each.

An agent names the causes of each decision, and the cause of an episode that it cannot finish. This
table says what a cause means and what to do. :func:`count_causes` counts the names in records, for
the end of a run, for reports and for the monitor.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.tasks.verbs import INIT

CUT: Final = "cut"
UNFINISHED_THOUGHT: Final = "unfinished thought"
EMPTY: Final = "empty"
REFUSAL: Final = "refusal"
FILTERED: Final = "filtered"
UNREADABLE: Final = "unreadable"
TRIMMED: Final = "trimmed"
CONTEXT: Final = "context"
PICTURES: Final = "pictures"
CONTENT: Final = "content"
REQUEST: Final = "request"


@dataclass(frozen=True)
class Cause:
    """A cause that records name.

    Attributes:
        name: in records.
        means: what happened; follows "of 20 replies" or "of 20 episodes" in a sentence.
        do: what the user can do; follows a colon in the sentence.
        settings: the agent's settings that decide it, by path.
    """

    name: str
    means: str
    do: str
    settings: tuple[str, ...] = ()


CAUSES: Mapping[str, Cause] = {
    cause.name: cause
    for cause in (
        # of a reply
        Cause(
            CUT,
            "were cut at the most tokens of a reply",
            "raise sampling.max_tokens, or have the model think less (reasoning.effort)",
            ("sampling.max_tokens",),
        ),
        Cause(
            UNFINISHED_THOUGHT,
            "ended within their thoughts, before any decision",
            "raise sampling.max_tokens, or have the model think less (reasoning.effort)",
            ("sampling.max_tokens", "reasoning.effort"),
        ),
        Cause(
            EMPTY,
            "were empty",
            "see whether the server's chat template fits the model, and whether its reasoning or "
            "tool parser takes the words away; decide says in which form they are asked for",
            ("decide",),
        ),
        Cause(
            REFUSAL,
            "were refusals of the model",
            "read one in the monitor (er-gym ui); other prompts (prompts.profile) may not provoke "
            "them",
            ("prompts.profile",),
        ),
        Cause(
            FILTERED,
            "were withheld or cut by the server's content filter",
            "see to the filter of the server, or to the prompts",
        ),
        Cause(
            UNREADABLE,
            "named no action that can be read",
            "read one in the monitor (er-gym ui); a model that was tuned for other prompts needs "
            "them (prompts.dialect, prompts.dataset), and decide names the form",
            ("decide",),
        ),
        Cause(
            TRIMMED,
            "were given to a history without its oldest pictures or words, since the whole one was "
            "over a limit of the server",
            "raise the limit of the server, lower pictures.keep, or forbid it with "
            "history.trim=false",
            ("pictures.keep", "history.trim"),
        ),
        # of an episode
        Cause(
            CONTEXT,
            "ended since the conversation did not fit into the model's context",
            "raise the context length of the server, lower sampling.max_tokens or pictures.keep; "
            "history.trim=true first leaves out what is oldest",
            ("sampling.max_tokens", "pictures.keep", "history.trim"),
        ),
        Cause(
            PICTURES,
            "ended since the conversation had more pictures than the server takes",
            "raise the limit of the server, or lower pictures.keep; history.trim=true first leaves "
            "out the oldest pictures, pictures.views=false sends one picture of a turn",
            ("pictures.keep", "pictures.views", "history.trim"),
        ),
        Cause(
            CONTENT,
            "ended since the server refuses the content of the conversation",
            "see to the filter of the server, or to the prompts",
        ),
        Cause(
            REQUEST,
            "ended since the server refuses the conversation, and answers others",
            "read the cause in the record of the episode",
        ),
    )
}
"""All causes by name; an agent of other people may name others."""


@dataclass(frozen=True)
class CauseCount:
    """How often a cause occurs.

    Attributes:
        name: of the cause.
        number, of: how many of how many, ``what``: replies or episodes.
        episodes: in how many episodes.
        unusable: how many of the replies named no action.
    """

    name: str
    number: int
    of: int
    what: str
    episodes: int
    unusable: int = 0

    def sentence(self, settings: Mapping[str, Any] | None = None) -> str:
        """One line: how many, what it means, and what to do.

        Args:
            settings: the agent's, whose values are told; None if they are unknown.
        """
        cause = CAUSES.get(self.name)
        means = cause.means if cause else f"have the cause {self.name!r}"
        line = f"{self.number:,} of {self.of:,} {self.what} {means}"
        if self.what == "replies":
            named = f", {self.unusable:,} of them named no action" if self.unusable else ""
            line += f" (in {self.episodes:,} episodes{named})"
        if cause is None:
            return line
        told = ", ".join(_values(cause.settings, settings or {}))
        return f"{line}: {cause.do}" + (f"; now: {told}" if told else "")


def _values(paths: Iterable[str], settings: Mapping[str, Any]) -> Iterable[str]:
    """``sampling.max_tokens=1024`` for each setting that is known."""
    for path in paths:
        value: Any = settings
        for name in path.split("."):
            value = value.get(name) if isinstance(value, Mapping) else None
        if value not in (None, ""):
            yield f"{path}={str(value).lower() if isinstance(value, bool) else value}"


@dataclass(frozen=True)
class EpisodeCauses:
    """The causes that an episode's record names.

    Attributes:
        replies: how many replies of the agent it has.
        causes: how many of them have a cause, by its name.
        unusable: how many of these named no action.
        ended: the cause that ended it; "" for none.
    """

    replies: int = 0
    causes: Mapping[str, int] = field(default_factory=dict)
    unusable: Mapping[str, int] = field(default_factory=dict)
    ended: str = ""


def causes_in(episode: EpisodeRecord) -> EpisodeCauses:
    """The causes that a record names."""
    causes, unusable = Counter[str](), Counter[str]()
    replies = 0
    for step in episode.steps:
        if step.verb == INIT or step.appended or step.by:
            continue
        replies += 1
        causes.update(step.causes)
        unusable.update(step.causes if step.verb == ERROR else ())
    ended = (episode.cause or REQUEST) if episode.gave_up else ""
    return EpisodeCauses(replies, dict(causes), dict(unusable), ended)


def count_causes(episodes: Iterable[EpisodeCauses]) -> list[CauseCount]:
    """The causes of some episodes, in the order of :data:`CAUSES`, and others after them."""
    replies, unusable, within, over = Counter[str](), Counter[str](), Counter[str](), Counter[str]()
    said = played = 0
    for episode in episodes:
        played += 1
        said += episode.replies
        replies.update(episode.causes)
        unusable.update(episode.unusable)
        within.update(episode.causes.keys())
        over.update([episode.ended] * bool(episode.ended))
    counts = [
        *(
            CauseCount(name, number, said, "replies", within[name], unusable[name])
            for name, number in replies.items()
        ),
        *(CauseCount(name, number, played, "episodes", number) for name, number in over.items()),
    ]
    order = {name: place for place, name in enumerate(CAUSES)}
    return sorted(counts, key=lambda each: (order.get(each.name, len(order)), each.name))
