"""Token counts of a request: the server's counts if they are plausible, otherwise upper bounds.

A budget holds only if no count is too low. If a server reports no count, or an impossible one, an
upper bound replaces it: in every tokenizer in use a token covers at least one byte of text, and a
picture takes no more tokens than with the most expensive model known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Annotated, Any

from pydantic import Field, WrapValidator

from agents.vlm.chat import Message, Picture, Usage
from agents.vlm.clients.tolerant_model import OrNone, TolerantModel

_WRONG = -1
_TEMPLATE = 512
"""Tokens that a server's chat template may add: a system prompt, markers, tool descriptions."""
_MARKS = 16  # tokens around a reply
_BYTES_OF_A_TOKEN = 64
"""More bytes than a token covers on average in any text: a lower count cannot be true."""
_PROVIDERS_OWN = 50_000
"""The longest prompt, in tokens, that a provider may put before ours."""
_BEYOND_LIMIT = 16
"""Some servers let a reasoning model exceed ``max_tokens``, but never by this factor."""
_UNLIMITED = 131_072  # tokens of a reply, where no limit is sent


def picture_at_most(width: int, height: int) -> int:
    """An upper bound for a picture's tokens: gpt-4o-mini's 2,833 plus 5,667 per 512-pixel square.

    Open models take fewer: 256 to 1,601 for each of 4 to 12 squares (InternVL, Llama 3.2), or one
    for each 14×14 pixels or more (Pixtral, Qwen).
    """
    return 2_833 + 5_667 * ceil(width / 512) * ceil(height / 512)


@dataclass(frozen=True)
class RequestSize:
    """The size of a request, for bounds on its tokens.

    Attributes:
        text: bytes of its JSON without the pictures. JSON's punctuation outweighs a template's
            markers.
        pictures: an upper bound for the tokens of all pictures.
        max_tokens: the limit of the reply; None if none is sent.
        thinks: whether the reply may have hidden tokens.
    """

    text: int
    pictures: int
    max_tokens: int | None
    thinks: bool

    @staticmethod
    def of(
        body: bytes, messages: Sequence[Message], picture_bytes: int, fields: Mapping[str, Any]
    ) -> RequestSize:
        """The size of a request whose pictures take ``picture_bytes`` bytes of the body."""
        shown = [part for each in messages for part in each.parts if isinstance(part, Picture)]
        limits = (fields.get("max_tokens"), fields.get("max_completion_tokens"))
        known = [each for each in limits if type(each) is int and each > 0]
        return RequestSize(
            text=len(body) - picture_bytes,
            pictures=sum(picture_at_most(each.width, each.height) for each in shown),
            max_tokens=min(known, default=None),
            thinks=fields.get("reasoning_effort", "none") != "none",
        )

    @property
    def prompt_at_most(self) -> int:
        """An upper bound for the tokens of the prompt."""
        return self.text + self.pictures + _TEMPLATE


# -- a server's count ------------------------------------------------------------------------------


def _or_wrong(value: object, check: Any) -> Any:
    try:
        return check(value)
    except ValueError:
        return _WRONG


_Whole = Annotated[int, Field(strict=True, ge=0, le=2**53)]
_Count = Annotated[_Whole | None, WrapValidator(_or_wrong)]


class _Details(TolerantModel):
    cached_tokens: _Count = None
    reasoning_tokens: _Count = None


class ReportedUsage(TolerantModel):
    """The counts that a server reports; -1 stands for an invalid value."""

    prompt_tokens: _Count = None
    completion_tokens: _Count = None
    prompt_tokens_details: OrNone[_Details] = None
    completion_tokens_details: OrNone[_Details] = None


def usage_of(
    reported: ReportedUsage | None, request_size: RequestSize, said: int | None, cut: bool = False
) -> Usage:
    """The token counts of a request and its reply, never too low.

    Args:
        reported: the server's count, if there is one.
        request_size: the request.
        said: bytes of the reply's text, thoughts and call; None if it cannot be read.
        cut: whether the reply ended at the limit.
    """
    reported = reported or ReportedUsage()
    estimated = False
    prompt = reported.prompt_tokens
    if prompt is None or not _possible_prompt(prompt, request_size):
        prompt, estimated = request_size.prompt_at_most, True
    cached = (reported.prompt_tokens_details or _Details()).cached_tokens or 0
    if not 0 <= cached <= prompt:
        cached, estimated = 0, True
    completion = reported.completion_tokens
    if completion is None or not _possible_completion(completion, request_size, said):
        completion, estimated = _completion_at_most(request_size, said, cut), True
    reasoning = (reported.completion_tokens_details or _Details()).reasoning_tokens or 0
    if not _possible_completion(reasoning, request_size, 0):
        reasoning, estimated = 0, True
    if reasoning > completion:  # some servers count thoughts beside the words, not among them
        completion, estimated = completion + reasoning, True
    return Usage(prompt, completion, cached, reasoning, estimated)


def _possible_prompt(count: int, request_size: RequestSize) -> bool:
    least = max(1, request_size.text // _BYTES_OF_A_TOKEN)
    return least <= count <= 2 * request_size.prompt_at_most + _PROVIDERS_OWN


def _possible_completion(count: int, request_size: RequestSize, said: int | None) -> bool:
    said = said or 0
    least = 0 if not said else max(1, said // _BYTES_OF_A_TOKEN)
    limit = (
        _UNLIMITED if request_size.max_tokens is None else _BEYOND_LIMIT * request_size.max_tokens
    )
    return least <= count <= max(limit, said + _MARKS)


def _completion_at_most(request_size: RequestSize, said: int | None, cut: bool) -> int:
    limit = request_size.max_tokens or 0
    if said is None:
        return limit or _UNLIMITED
    return max(said + _MARKS, limit if cut or request_size.thinks else 0)
