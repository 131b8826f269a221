"""Conversations as tokens: the same as at play, and which of them get loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from numpy.typing import NDArray

from agents.finetune.settings import DataSettings, Mask
from agents.vlm.chat import template_message
from er_gym.data.cells import CoveredPicture, on_grid
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.train_mask import train_mask
from er_gym.data.trajectory import PictureRecord

FEEDBACK = "<|feedback|>"
"""Stands before the environment's answer to an action that could not be done; a token."""
_PROBE = ("USER1", "REPLY1", "USER2", "REPLY2")


@dataclass(frozen=True)
class EncodedCells:
    """What covers a picture, in tokens.

    Attributes:
        cells: as :class:`er_gym.data.cells.CoveredPicture` has them.
        tokens: the token for each thing that covers it: the first of its name.
    """

    cells: str
    tokens: tuple[int, ...]

    def on_grid(self, rows: int, columns: int) -> list[int]:
        """The token for each square of the grid of a picture's tokens, row by row."""
        return [self.tokens[each] for each in on_grid(self.cells, rows, columns)]


@dataclass(frozen=True)
class EncodedChat:
    """A conversation in tokens, a picture being one token still.

    Attributes:
        id: the conversation's.
        ids: (tokens,) int32.
        learnt: (tokens,) bool; whether a token gets loss.
        pictures: in order.
        picture_tokens: for each picture, how many tokens it will be.
        cells: for each picture what covers it, which is learnt at its tokens; None if that is not
            known.
    """

    id: str
    ids: NDArray[np.int32]
    learnt: NDArray[np.bool_]
    pictures: tuple[PictureRecord, ...]
    picture_tokens: tuple[int, ...]
    cells: tuple[EncodedCells | None, ...] = ()

    @property
    def length(self) -> int:
        """Tokens, those of the pictures included."""
        return len(self.ids) + sum(self.picture_tokens) - len(self.picture_tokens)

    @property
    def learnt_tokens(self) -> int:
        """How many tokens get loss."""
        covered = zip(self.picture_tokens, self.cells, strict=False)
        return int(self.learnt.sum()) + sum(count for count, cells in covered if cells)


class Encoder:
    """Turns conversations into tokens by a model's own template, tokenizer and image processor.

    Args:
        tokenizer, template, image_processor: the model's; None where it does not see.
        image_token: the token where a picture goes.
        settings: the mask, and the bounds of pictures.

    Attributes:
        begin, end: the tokens around what the assistant says.

    Raises:
        ValueError: the template rewrites earlier turns when a conversation goes on, so that what
            would be learnt is not what is read at play.
    """

    def __init__(
        self,
        tokenizer: Any,
        template: str,
        image_processor: Any,
        image_token: int | None,
        settings: DataSettings,
    ) -> None:
        self.tokenizer = tokenizer
        self._template, self._image_processor = template, image_processor
        self._image_token, self._settings = image_token, settings
        begin, end = self._marks()
        self.begin, self.end = self.tokens(begin), self.tokens(end)
        feedback = tokenizer.convert_tokens_to_ids(FEEDBACK)
        self._feedback: int | None = None if feedback == tokenizer.unk_token_id else feedback

    def tokens(self, text: str) -> list[int]:
        """The tokens of a text; words that are special tokens are read as these."""
        found: list[int] = self.tokenizer(text, add_special_tokens=False)["input_ids"]
        return found

    def text(self, turns: Sequence[ChatTurn], *, reply_next: bool = False) -> str:
        """A conversation in the model's format; at its end the assistant may be asked to speak."""
        return self._rendered(
            [template_message(turn.role, turn.parts) for turn in turns], reply_next
        )

    def encode(self, chat: Chat) -> EncodedChat:
        """A conversation in tokens.

        Raises:
            ValueError: the template does not take it, or words of it are marks of the model.
        """
        ids = self.tokens(self.text(chat.turns))
        places = 0 if self._image_token is None else ids.count(self._image_token)
        if places != len(chat.pictures):
            raise ValueError(
                f"{chat.id}: it has {len(chat.pictures)} pictures and {places} places for them in "
                "the model's format; "
                + ("the model has no vision: give one that has, or a data.dialect without pictures"
                   if self._image_token is None else "no words of it may be the model's own marks")
            )  # fmt: skip
        try:
            learnt = self._learnt(ids, chat.train)
        except ValueError as error:
            raise ValueError(f"{chat.id}: {error}") from None
        counts = tuple(self.picture_tokens(each) for each in chat.pictures)
        return EncodedChat(
            chat.id,
            np.array(ids, np.int32),
            np.array(learnt, bool),
            chat.pictures,
            counts,
            tuple(self._cells(each) for each in chat.pictures),
        )

    def _cells(self, picture: PictureRecord) -> EncodedCells | None:
        if not isinstance(picture, CoveredPicture):
            return None
        return EncodedCells(
            picture.cells, tuple(self.tokens(f" {each}")[0] for each in picture.covers)
        )

    def picture_tokens(self, picture: PictureRecord) -> int:
        """How many tokens a picture is, by its size alone."""
        bounds = {
            "min_pixels": self._settings.min_pixels,
            "max_pixels": self._settings.max_pixels,
        }
        try:
            patches = self._image_processor.get_number_of_image_patches(
                picture.height, picture.width, bounds
            )
        except ValueError as error:  # too long and thin
            raise ValueError(f"{picture.path}: {error}") from None
        return int(patches) // int(self._image_processor.merge_size) ** 2

    def _learnt(self, ids: list[int], train: Sequence[bool]) -> list[bool]:
        found = mask(ids, train, self._settings.mask, self.begin, self.end, self._feedback)
        return [each and one != self._image_token for each, one in zip(found, ids, strict=True)]

    def _marks(self) -> tuple[str, str]:
        """What stands before and after a reply, found by probing the template."""
        said = [
            {"role": role, "content": words}
            for role, words in zip(("user", "assistant") * 2, _PROBE, strict=True)
        ]
        whole = self._rendered(said, False)
        first, later = (self._rendered(said[:n], True) for n in (1, 3))
        begin = first[len(self._rendered(said[:1], False)) :]
        end = whole.partition(_PROBE[1])[2].partition(_PROBE[2])[0]
        mark = next(
            (each for each in self.tokenizer.all_special_tokens if end.lstrip().startswith(each)),
            "",
        )
        keeps = whole.startswith(first + _PROBE[1]) and whole.startswith(later + _PROBE[3])
        if not (begin and mark and keeps):
            raise ValueError(
                "the model's chat template "
                + ("writes a turn otherwise once the conversation goes on" if not keeps
                   else "marks neither beginning nor end of a reply by a special token")
                + ", so that what is learnt would not be what is read at play; give a model whose "
                "template keeps earlier turns, such as one without built-in thoughts"
            )  # fmt: skip
        return begin, end[: end.index(mark) + len(mark)]

    def _rendered(self, messages: list[dict[str, Any]], reply_next: bool) -> str:
        try:
            text: str = self.tokenizer.apply_chat_template(
                messages,
                chat_template=self._template,
                tokenize=False,
                add_generation_prompt=reply_next,
            )
        except (jinja2.TemplateError, TypeError) as error:
            raise ValueError(
                f"the model's chat template does not take such conversations: {error}"
            ) from None
        return text


def mask(
    ids: Sequence[int],
    train: Sequence[bool],
    mode: Mask,
    begin: Sequence[int],
    end: Sequence[int],
    feedback: int | None,
) -> list[bool]:
    """Whether each token gets loss.

    Args:
        ids: (n,) the tokens of a conversation.
        train: for each turn of the assistant, whether it is marked to be learnt.
        mode: ``turns``: of the assistant's turns, those that are marked. ``released``: what the
            assistant says after the first ``<|feedback|>``, marked or not; all if there is none.
            ``all``: every token but the assistant's turns that are not marked.
        begin, end: the tokens around a turn of the assistant.
        feedback: the token of ``<|feedback|>``; None if the model has none.

    Raises:
        ValueError: as :func:`er_gym.data.train_mask.train_mask`.
    """
    if mode == "turns":
        return train_mask(ids, train, begin=begin, end=end)
    if mode == "all":
        unmarked = train_mask(ids, [not each for each in train], begin=begin, end=end)
        return [not each for each in unmarked]
    found = train_mask(ids, [True] * len(train), begin=begin, end=end)
    if feedback is not None and feedback in ids:
        first = list(ids).index(feedback)
        found[: first + 1] = [False] * (first + 1)
    return found


def expanded(
    chat: EncodedChat, image_token: int | None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Tokens and labels with each picture's token repeated as often as it has tokens.

    Returns:
        (length,) ids, and (length,) labels: the token itself, or -100 where there is no loss.
    """
    times = np.ones(len(chat.ids), np.int64)
    times[chat.ids == image_token] = chat.picture_tokens
    ids = np.repeat(chat.ids.astype(np.int64), times)
    learnt = np.repeat(chat.learnt, times)
    return ids, np.where(learnt, ids, -100)


def check_lengths(chats: Sequence[EncodedChat], limit: int, where: Path | str) -> None:
    """Raise ValueError if a conversation has more tokens than ``data.max_length``.

    The message says which is longest and by how much, how many others there are, and what to set.
    """
    long = [chat for chat in chats if chat.length > limit]
    if not long:
        return
    worst = max(long, key=lambda chat: chat.length)
    pictures = sum(worst.picture_tokens)
    others = f", and {len(long) - 1:,} others are too long" if len(long) > 1 else ""
    raise ValueError(
        f"{where}: the conversation {worst.id} has {worst.length:,} tokens, {pictures:,} of them "
        f"for {len(worst.pictures)} pictures: {worst.length - limit:,} more than data.max_length "
        f"{limit:,}{others}; set data.max_length={worst.length}"
        + (" or a lower data.max_pixels" if pictures else "")
        + " (nothing is ever cut off)"
    )
