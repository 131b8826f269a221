"""Prompts from a dialect: a tuned model gets the same texts at play as in its training files.

The texts are made by the functions that make the training files (:mod:`er_gym.data.dialects`).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Any

from agents.vlm.prompt_set import (
    IMAGE_MARK,
    Decide,
    LastAction,
    Sees,
    TurnContext,
    without_marks,
)
from er_gym.data.dialects import ActionResult, DialectTexts, load_dialect, system_text, user_turn
from er_gym.data.trajectory import Language
from er_gym.tasks import verbs

_AHEAD = "ahead"
_NOTHING = "(no action)"
"""Stands for the action of a reply that names none."""


@dataclass(frozen=True, kw_only=True)
class DialectPrompts:
    """Prompts from a dialect; a :class:`~agents.vlm.prompt_set.PromptSet`.

    Attributes:
        texts: the dialect's, in one language.
    """

    name: str
    digest: str
    about: str
    after_observe: int | None = field(default=3, init=False)
    as_recorded: bool = field(default=True, init=False)
    texts: DialectTexts = field(repr=False)

    def check(self, *, decide: Decide, sees: Sees) -> None:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        if (decide, sees) != ("tags", self.texts.sees):
            raise ValueError(
                f"the dialect {self.name} needs decide: tags and sees: {self.texts.sees}, not "
                f"{decide} and {sees}; change these, or leave out prompts.dialect"
            )

    def system(self, *, decide: Decide, sees: Sees, task: str = "") -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return system_text(self.texts, without_marks(task))

    def first(self, turn: TurnContext) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._told(turn, None, (_AHEAD,))

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        last = ActionResult(
            last_action.action, last_action.success, without_marks(last_action.feedback)
        )
        return self._told(turn, last, last_action.directions)

    def feedback(self, *, problem: str, decide: Decide, action: str = "") -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        last = ActionResult(without_marks(action) or _NOTHING, False, without_marks(problem))
        return "".join(user_turn(self.texts, "", last, ()))

    def _told(
        self, turn: TurnContext, last: ActionResult | None, directions: tuple[str, ...]
    ) -> str:
        marks = [(each, IMAGE_MARK) for each in directions if turn.sees == "pictures"]
        task = without_marks(turn.task)
        return "".join(user_turn(self.texts, task, last, marks, turn.now, turn.before))


def dialect_prompts(dialect: str, language: Language) -> DialectPrompts:
    """The prompts of a dialect.

    Args:
        dialect: its name, or a folder.
        language: one that it has.

    Raises:
        ValueError: there is no such dialect, or it lacks the language.
    """
    loaded = load_dialect(dialect)
    texts = loaded.texts_in(language)
    return DialectPrompts(
        name=f"{dialect}/{language}",
        digest=digest_of(texts),
        about=f"the texts of the dialect {dialect} in {language}",
        texts=texts,
    )


_ADDED_WORDS = (
    ("named", ("seen", "far")),
    ("notes", ("far", "at")),
    ("named", ("at_far",)),
    ("notes", ("at_far",)),
    ("places", ("opened",)),
)
"""Words that older versions did not have, by the version that has them: ``""`` where a dialect
does not use them."""


def digest_of(texts: DialectTexts) -> str:
    """The sha256, in hex, of the texts without what no prompt depends on, and without what they do
    not use of what older versions did not have: so that older runs can be continued."""
    left_out: dict[str, Any] = {"frames": True}
    left_out |= {"scene_by": True} if texts.scene_by == "user" else {}
    left_out |= {name: True for name in ("named", "places") if getattr(texts, name) is None}
    for name, words in _ADDED_WORDS:
        told = getattr(texts, name)
        if told is not None and not any(getattr(told, word) for word in words):
            left_out.setdefault(name, set()).update(words)
    digest = hashlib.sha256(texts.model_dump_json(exclude=left_out).encode())
    if verbs.ADDED:
        digest.update(repr(verbs.ADDED).encode())
    return digest.hexdigest()
