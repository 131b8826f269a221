"""What is beside the steps of an episode: its pictures, the room, and what could be seen in it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

from fastapi import Request, Response
from fastapi.responses import HTMLResponse
from markupsafe import Markup

from benchmarks.monitor import formats
from benchmarks.monitor.language import Translator
from benchmarks.monitor.room_map import room_map
from benchmarks.monitor.site import AN_HOUR, NotFound, Routes, Site, or_nothing
from benchmarks.monitor.world import DRAWN, CannotReplay, Worlds
from er_gym.data.pictures import encode_picture
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest

PICTURE_KINDS = {
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".png": "image/png",
    ".webp": "image/webp",
}


class ReplayPages(ABC):
    """Pages of episodes that can be played again.

    Attributes:
        address: under which they stand, with the directory's ``{id}``.
    """

    address: ClassVar[str]

    def __init__(self, site: Site) -> None:
        self._site = site
        self._worlds = Worlds()

    def routes(self) -> Routes:
        """The pages by address."""
        return {
            f"{self.address}/picture": self.picture,
            f"{self.address}/map": self.map,
            f"{self.address}/frame": self.frame,
        }

    @abstractmethod
    def _played(self, id: str, key: str) -> tuple[Manifest, EpisodeRecord]:
        """An episode, and the manifest of its run.

        Raises:
            NotFound: there is none.
            CannotReplay: there is no manifest.
        """

    @abstractmethod
    def _picture(self, id: str, key: str, n: int) -> Path | None:
        """The file of an episode's picture; None if there is none.

        Raises:
            NotFound: there is no such episode.
        """

    def picture(self, id: str, key: str = "", n: int = 0) -> Response:
        """A picture that the agent was shown."""
        file = self._picture(id, key, n)
        kind = PICTURE_KINDS.get(file.suffix.lower()) if file else None
        if file is None or kind is None:
            raise NotFound
        with or_nothing():
            return Response(file.read_bytes(), media_type=kind, headers=AN_HOUR)

    def map(self, request: Request, id: str, key: str = "") -> Response:
        """The room of an episode from above, as SVG, or why it cannot be drawn."""
        words = self._site.translator(request)
        try:
            drawn = drawn_room(self._worlds, *self._played(id, key), words)
        except CannotReplay as error:
            drawn = no_room(error, words)
        return HTMLResponse(drawn)

    def frame(self, id: str, key: str = "", n: int = 0, what: str = "rgb") -> Response:
        """What the agent could see after a step, drawn now: in colours, as depth or by object."""
        if what not in DRAWN:
            raise NotFound
        with or_nothing():
            manifest, record = self._played(id, key)
            if not 0 <= n < len(record.steps):
                raise NotFound
            picture = self._worlds.frame(manifest, record, n, what)
        return Response(encode_picture(picture), media_type="image/jpeg", headers=AN_HOUR)


def drawn_room(
    worlds: Worlds, manifest: Manifest, record: EpisodeRecord, words: Translator
) -> Markup:
    """The room of an episode from above, as SVG.

    Raises:
        CannotReplay: the episode cannot be played again.
    """
    wanted = {key_action.object_id for key_action in record.key_actions}
    return room_map(worlds.world(manifest, record), wanted, words("map"))


def no_room(error: CannotReplay, words: Translator) -> Markup:
    """Why a room cannot be drawn, as HTML."""
    why = words("no_replay", why=formats.brief(str(error)))
    return Markup('<p class="empty">{}</p>').format(why)
