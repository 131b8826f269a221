"""An episode: its steps, pictures and key actions, and the room from above."""

from __future__ import annotations

import io
import threading

from fastapi import Request, Response
from fastapi.responses import HTMLResponse
from markupsafe import Markup
from PIL import Image

from benchmarks.monitor import formats
from benchmarks.monitor.episode_view import picture_file, view_of
from benchmarks.monitor.listing import neighbours
from benchmarks.monitor.room_map import room_map
from benchmarks.monitor.run_view import Filter
from benchmarks.monitor.site import AN_HOUR, NothingThere, Routes, Site
from benchmarks.monitor.video import as_webp, film
from benchmarks.monitor.world import CannotReplay, Worlds
from er_gym.rollout.run_directory import RunDirectory
from er_gym.writing import file_stem

PICTURE_KINDS = {
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".png": "image/png",
    ".webp": "image/webp",
}


class EpisodePages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._worlds = Worlds()
        self._filming = threading.Lock()

    def routes(self) -> Routes:
        """The pages by address."""
        return {
            "/runs/{id}/episode": self.episode,
            "/runs/{id}/picture": self.picture,
            "/runs/{id}/map": self.map,
            "/runs/{id}/frame": self.frame,
            "/runs/{id}/video": self.video,
        }

    def episode(self, request: Request, id: str, key: str = "") -> Response:
        """An episode."""
        place = self._site.place(id, "run")
        chosen = Filter.of(request.query_params)
        try:
            episode = view_of(RunDirectory.open(place.path), key)
        except (ValueError, OSError):
            raise NothingThere from None
        with self._site.runs.use(place) as view:
            before, after = neighbours([row.key for row in view.chosen(chosen)], key)
            summary = view.summary()
        told = {
            "run": summary,
            "key": key,
            "episode": episode,
            "filter": chosen,
            "before": before,
            "after": after,
            "scripts": ("episode.js",),
        }
        return self._site.show(request, "episode.html", told)

    def picture(self, id: str, key: str = "", n: int = 0) -> Response:
        """A picture that an agent was shown."""
        place = self._site.place(id, "run")
        try:
            pictures = view_of(RunDirectory.open(place.path), key).pictures
            file = picture_file(place.path, pictures[n]) if 0 <= n < len(pictures) else None
            kind = PICTURE_KINDS.get(file.suffix.lower()) if file else None
            if file is None or kind is None:
                raise NothingThere
            return Response(file.read_bytes(), media_type=kind, headers=AN_HOUR)
        except (ValueError, OSError):
            raise NothingThere from None

    def map(self, request: Request, id: str, key: str = "") -> Response:
        """The room of an episode from above, as SVG, or why it cannot be drawn."""
        record, manifest = self._site.record(id, key)
        words = self._site.translator(request)
        try:
            world = self._worlds.world(manifest, record)
        except CannotReplay as error:
            text = words("no_replay", why=formats.visible(str(error)))
            return HTMLResponse(Markup("<p class=empty>{}</p>").format(text))
        wanted = {key_action.object_id for key_action in record.key_actions}
        return HTMLResponse(room_map(world, wanted, words("map")))

    def frame(self, id: str, key: str = "", n: int = 0) -> Response:
        """What the agent could see after a step, drawn now."""
        record, manifest = self._site.record(id, key)
        if not 0 <= n < len(record.steps):
            raise NothingThere
        try:
            picture = self._worlds.frame(manifest, record, n)
        except CannotReplay:
            raise NothingThere from None
        data = io.BytesIO()
        Image.fromarray(picture).save(data, "JPEG", quality=85)
        return Response(data.getvalue(), media_type="image/jpeg", headers=AN_HOUR)

    def video(self, id: str, key: str = "") -> Response:
        """An episode as an animated WebP, to keep."""
        try:
            run = RunDirectory.open(self._site.place(id, "run").path)
            with self._filming:  # one at a time: it is the costliest page
                data = as_webp(film(run, key, self._worlds))
        except (ValueError, OSError):
            raise NothingThere from None
        named = f'attachment; filename="{file_stem(key)}.webp"'
        return Response(data, media_type="image/webp", headers={"Content-Disposition": named})
