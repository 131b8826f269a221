"""Plausible wrong places named by a model, as in the paper, instead of drawn by likelihood."""

from __future__ import annotations

import re
from collections.abc import Sequence
from random import Random

from agents.expert.places import draw_places
from agents.expert.writers.prompts import WriterPrompts
from agents.vlm.chat import Client, ModelError, model_reply
from er_gym.rollout.agent import ModelReply

_LIST = re.compile(r"\[([^\[\]]{1,2000})\]")
_BETWEEN = re.compile(r"[,;，；、\n]")
_NOT_LETTERS = re.compile(r"[\W_\d]+")


class ModelPlaces:
    """Asks a model for the likeliest places, once for each search; a
    :class:`~agents.expert.places.PlaceChooser`.

    Names of other places are dropped. Where too few are left, or there is no reply, the likelihoods
    fill the rest.

    Args:
        client: asks the model.
        prompts: what it is told.
        seed: of the episode.
    """

    def __init__(self, client: Client, prompts: WriterPrompts, seed: int) -> None:
        self._client, self._prompts, self._seed = client, prompts, seed
        self._replies: list[ModelReply] = []

    def choose(
        self, thing: str, weighted: Sequence[tuple[str, float]], number: int, random: Random
    ) -> list[str]:
        """See :class:`~agents.expert.places.PlaceChooser`."""
        places = [place for place, _ in weighted]
        chosen: list[str] = []
        if number and places:
            chosen = self._asked(thing, places, min(number, len(places)))[:number]
        left = [each for each in weighted if each[0] not in chosen]
        return [*chosen, *draw_places(left, number - len(chosen), random)]

    def take_replies(self) -> Sequence[ModelReply]:
        """What the model has replied since the last call."""
        replies, self._replies = self._replies, []
        return replies

    def _asked(self, thing: str, places: Sequence[str], number: int) -> list[str]:
        conversation = self._prompts.places(thing, places, number)
        try:
            reply = self._client.reply(conversation, self._seed)
        except ModelError:
            return []
        self._replies.append(model_reply(reply))
        return named_places(reply.text, places)


def named_places(text: str, places: Sequence[str]) -> list[str]:
    """The places that the first list of a reply names, each once, in its order."""
    found = _LIST.search(text[:20_000])
    known = {_plain(place): place for place in places}
    said = (_plain(name) for name in _BETWEEN.split(found[1])) if found else ()
    return list(dict.fromkeys(known[name] for name in said if name in known))


def _plain(name: str) -> str:
    return _NOT_LETTERS.sub("", name).casefold()
