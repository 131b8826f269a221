"""A run as a file or a folder that opens from a disk, for a colleague or a paper's supplement.

::

    x.html                      everything in one file; ?episode=3 shows the third replay

    x/index.html                the run's page
    x/episodes/0003.html        a replay
    x/pictures/0003-000.jpeg    its pictures

It is made of the templates of the server's pages, so it shows what the server shows; what needs the
server is left out. Nothing of the run is in a script: scripts are those of ``static/``; the page's
own policy forbids all others, and requests.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from dataclasses import replace as changed
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import parse_qsl, urlencode, urlsplit

from markupsafe import Markup

from agents.vlm.record import PictureRecord
from benchmarks.monitor import formats
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.episode_filter import FLAG, SORTS, Filter
from benchmarks.monitor.episode_view import EpisodeView, StepView, picture_file, view_of
from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.language import Translator
from benchmarks.monitor.listing import Page
from benchmarks.monitor.pages.replays import PICTURE_KINDS, drawn_room, no_room
from benchmarks.monitor.pages.runs import run_variables
from benchmarks.monitor.site import Site
from benchmarks.monitor.world import CannotReplay, Worlds
from er_gym.data.pictures import encode_picture
from er_gym.rollout.run_directory import RunDirectory
from er_gym.writing import MARKDOWN_MARK, CannotWrite, make_folder, replaced, write_atomic

INDEX, EPISODES, PICTURES = "index.html", "episodes", "pictures"
USUAL_EPISODES = 20
"""So many replays are put into a file unless another number is asked for."""
_STYLES, _SCRIPTS = ("monitor.css", "charts.css"), ("export.js", "episode.js", "enlarge.js")
_MOST_TEXT = 500
_END_OF_TITLE = "<!-- the end of the title -->"
"""Cannot stand in a title, in which ``<`` is escaped."""

Link: TypeAlias = Callable[[str, Mapping[str, str]], "str | None"]
"""From an address of the server, as path and parameters, to another; None if there is none."""


class CannotExport(ValueError):
    """There is nothing to export, or something is in the way; the message is one line."""


@dataclass(frozen=True)
class ExportRequest:
    """What is exported.

    Attributes:
        run: the run directory.
        out: a file ``.html``, or a folder.
        episodes: the most replays; None for all.
        filter: which episodes have a replay, in its order.
        language: of the words.
        draw: whether what the agent could see is drawn where it was shown no pictures.
        overwrite: whether an earlier export is replaced.
    """

    run: Path
    out: Path
    episodes: int | None
    filter: Filter = field(default_factory=Filter)
    language: str = "en"
    draw: bool = False
    overwrite: bool = False

    @property
    def is_file(self) -> bool:
        """Whether it is one file."""
        return self.out.suffix.lower() in (".html", ".htm")


@dataclass(frozen=True)
class OfflinePage:
    """A page without its shell: its title and what is in the ``body``, both as HTML."""

    title: str
    body: str


@dataclass(frozen=True)
class Exported:
    """What was exported.

    Attributes:
        n: how many episodes have a replay.
        total: how many have ended.
        first: the filter with which the list opens, as the parameters of an address.
        map: the map of the room of a replay, as HTML.
    """

    n: int
    total: int
    first: str = ""
    map: Callable[[], Markup] = Markup

    def row(self, row: EpisodeRow) -> str:
        """What the script needs to filter and to sort a row, as JSON."""
        values = {name: _sortable(key(row)) for name, key in SORTS.items()}
        noted = (row.note.text, FLAG if row.note.flag else "note") if row.note else ("", "")
        text = f"{row.key} {row.instruction} {noted[0]}".casefold()[:_MOST_TEXT]
        return json.dumps({**values, "scene": row.scene, "text": text, "note": noted[1]})


def export(
    wanted: ExportRequest, tell: Callable[[int, int], None] = lambda done, of: None
) -> Exported:
    """Export a run.

    Args:
        wanted: what.
        tell: is called with the number of replays that are done, and of how many, from 0 on.

    Raises:
        CannotExport: there is no run, or an earlier export is in the way.
        CannotWrite: the disk is full, for example; what was there is unchanged.
    """
    _check_place(wanted)
    maker = _Maker(wanted)
    tell(0, len(maker.keys))
    try:
        _write_file(maker, tell) if wanted.is_file else _write_folder(maker, tell)
    except CannotWrite:
        raise
    except OSError as error:
        raise CannotWrite(f"{wanted.out}: cannot be written: {error.strerror or error}") from error
    return maker.exported


def _check_place(wanted: ExportRequest) -> None:
    out = wanted.out
    if not (out.exists() or out.is_symlink()):
        return
    if not wanted.overwrite:
        raise CannotExport(f"{out} is there already; choose another --out, or give --overwrite")
    if wanted.is_file:
        if not out.is_file():
            raise CannotExport(f"{out} is no file; choose another --out")
        return
    ours = (out / INDEX).is_file() and {each.name for each in out.iterdir()} <= {
        INDEX,
        EPISODES,
        PICTURES,
    }
    if not out.is_dir() or out.is_symlink() or (any(out.iterdir()) and not ours):
        raise CannotExport(f"{out} holds something else than an export; choose another --out")


class _Maker:
    """Makes the pages of an export."""

    def __init__(self, wanted: ExportRequest) -> None:
        directories = Directories([wanted.run])
        root = wanted.run.resolve()
        directory = next((p for p in directories.of_kind("run") if p.path == root), None)
        if directory is None:
            raise CannotExport(f"{wanted.run} holds no run.json; give the directory of a run")
        self.wanted, self.directory = wanted, directory
        self._site, self._worlds = Site(directories), Worlds()
        self._words = Translator(wanted.language)
        self._run = RunDirectory.open(root)
        with self._site.runs.use(directory) as view:
            view.read_records(float("inf"))
            unknown = wanted.filter.unknown_type(view.choices()["type"])
            if unknown:
                raise CannotExport(unknown)
            rows = [row for row in view.chosen(wanted.filter) if row.ended]
            self.keys = [row.key for row in rows[: wanted.episodes]]
            total = sum(row.ended is not None for row in view.rows.values())
            self._notes = view.noted.notes.episodes
        self._numbers = {key: number for number, key in enumerate(self.keys, 1)}
        types = {row.task_type for row in rows}
        # The script knows types by their full names alone.
        first = wanted.filter.query(type=wanted.filter.type if wanted.filter.type in types else "")
        self.exported = Exported(len(self.keys), total, first)

    def list_page(self) -> OfflinePage:
        """The run's page with all rows."""
        with self._site.runs.use(self.directory) as view:
            variables = run_variables(view, Filter(), self._words)
            every = view.chosen(Filter())
            variables["page"] = Page(every, len(every), 1, 1)

        def replay(path: str, parameters: Mapping[str, str]) -> str | None:
            return self._episode_address(path, parameters, f"{EPISODES}/")

        return self._page("run.html", {**variables, "exported": self.exported}, "", replay)

    def episode_page(self, key: str, picture: Callable[[int, bytes, str], str]) -> OfflinePage:
        """An episode's page.

        Args:
            key: of the episode.
            picture: from a picture's number, content and suffix to its address.
        """
        at = self._numbers[key] - 1
        try:
            episode = view_of(self._run, key)
        except (ValueError, OSError) as error:
            why = Markup('<p class="problem">{}</p>').format(formats.brief(str(error)))
            return OfflinePage(escape(formats.brief(key)), str(why))
        contents = list(self._pictures(episode))
        if not contents and self.wanted.draw:
            episode, contents = self._drawn(episode)
        addresses = [picture(n, *each) if each else None for n, each in enumerate(contents)]
        variables = {
            "run": self._site.summary(self.directory),
            "key": key,
            "episode": episode,
            "filter": Filter(),
            "before": self.keys[at - 1] if at else "",
            "note": self._notes.get(key),
            "after": self.keys[at + 1] if at + 1 < len(self.keys) else "",
            "exported": changed(self.exported, map=lambda: self._map(episode)),
        }

        def shown(path: str, parameters: Mapping[str, str]) -> str | None:
            if path.endswith("/picture"):
                n = parameters.get("n", "")
                return addresses[int(n)] if n.isdigit() and int(n) < len(addresses) else None
            return self._episode_address(path, parameters, "")

        return self._page("episode.html", variables, "../", shown)

    def _page(
        self, template: str, variables: Mapping[str, Any], up: str, other: Link
    ) -> OfflinePage:
        """A page of the server for a disk.

        Args:
            template: the page's.
            variables: its variables.
            up: from the page to the list's folder.
            other: where addresses lead beside those of the list.
        """

        def link(address: str) -> str | None:
            parts = urlsplit(address)
            parameters = dict(parse_qsl(parts.query))
            if parts.path not in (f"/runs/{self.directory.id}", "/"):
                return other(parts.path, parameters)
            query = f"?{urlencode(parameters)}" if parameters or self.wanted.is_file else ""
            return query if self.wanted.is_file else f"{up}{INDEX}{query}"

        variables = {**variables, "end_of_title": Markup(_END_OF_TITLE)}
        title, _, body = self._site.page(template, variables, self._words, link=link).partition(
            _END_OF_TITLE
        )
        return OfflinePage(title.strip(), body)

    def _episode_address(self, path: str, parameters: Mapping[str, str], folder: str) -> str | None:
        number = self._numbers.get(parameters.get("key", ""))
        if number is None or not path.endswith("/episode"):
            return None
        if self.wanted.is_file:
            return f"?episode={number}"
        return f"{folder}{number:04}.html"

    def _pictures(self, episode: EpisodeView) -> Iterator[tuple[bytes, str] | None]:
        for each in episode.pictures:
            file = picture_file(self.directory.path, each)
            kind = file.suffix.lower() if file else ""
            yield (file.read_bytes(), kind) if file and kind in PICTURE_KINDS else None

    def _drawn(self, episode: EpisodeView) -> tuple[EpisodeView, list[tuple[bytes, str] | None]]:
        """The episode as if the agent had been shown what it could see."""
        contents: list[tuple[bytes, str] | None] = []
        records: list[PictureRecord] = []
        try:
            for frame in self._worlds.frames(self._run.manifest, episode.record):
                contents.append((encode_picture(frame), ".jpeg"))
                height, width = frame.shape[:2]
                records.append(PictureRecord(path="", digest="", width=width, height=height))
        except CannotReplay:
            return episode, []
        steps: list[StepView] = [
            changed(step, pictures=(step.number - 1,) if 0 < step.number <= len(records) else ())
            for step in episode.steps
        ]
        return changed(episode, steps=steps, pictures=records), contents

    def _map(self, episode: EpisodeView) -> Markup:
        try:
            return drawn_room(self._worlds, self._run.manifest, episode.record, self._words)
        except CannotReplay as error:
            return no_room(error, self._words)


def _write_file(maker: _Maker, tell: Callable[[int, int], None]) -> None:
    """One file. Its episodes are written one by one, so memory does not grow with their number."""
    out = Path(os.path.realpath(maker.wanted.out))
    with replaced(out, errors="replace") as file:
        page = maker.list_page()
        head, tail = _shell(maker.wanted.language, page.title, "data:")
        file.write(f'{head}<div id="page">{page.body}</div>\n')
        for number, key in enumerate(maker.keys, 1):
            one = maker.episode_page(key, _as_data)
            title = one.title.replace('"', "&quot;")
            file.write(f'<template data-episode="{number}" data-title="{title}">')
            file.write(f"{one.body}</template>\n")
            tell(number, len(maker.keys))
        file.write(tail)


def _write_folder(maker: _Maker, tell: Callable[[int, int], None]) -> None:
    """A folder, made beside its place and moved there."""
    out = maker.wanted.out
    unique = f".{out.name}.{secrets.token_hex(4)}"
    draft, old = out.with_name(f"{unique}.draft"), out.with_name(f"{unique}.old")
    try:
        for folder in (draft / EPISODES, draft / PICTURES):
            make_folder(folder)
        language = maker.wanted.language
        for number, key in enumerate(maker.keys, 1):

            def put(n: int, content: bytes, suffix: str, number: int = number) -> str:
                name = f"{number:04}-{n:03}{suffix}"
                write_atomic(draft / PICTURES / name, content)
                return f"../{PICTURES}/{name}"

            one = maker.episode_page(key, put)
            _write_page(draft / EPISODES / f"{number:04}.html", language, one)
            tell(number, len(maker.keys))
        _write_page(draft / INDEX, language, maker.list_page())
        if out.exists():
            out.rename(old)
        draft.rename(out)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _write_page(file: Path, language: str, page: OfflinePage) -> None:
    head, tail = _shell(language, page.title, "'self' file: data:")
    text = f'{head}<div id="page">{page.body}</div>\n{tail}'
    write_atomic(file, text.encode("utf-8", "replace"))


def _shell(language: str, title: str, pictures: str) -> tuple[str, str]:
    """What is around a page: ``title`` is HTML, ``pictures`` says where they may come from."""
    folder = files("benchmarks.monitor").joinpath("static")
    styles = [folder.joinpath(name).read_text(encoding="utf-8") for name in _STYLES]
    scripts = [folder.joinpath(name).read_text(encoding="utf-8") for name in _SCRIPTS]
    policy = (
        f"default-src 'none'; style-src {_hashes(styles)}; script-src {_hashes(scripts)}; "
        f"img-src {pictures}; form-action 'none'; base-uri 'none'"
    )
    head = (
        f"{MARKDOWN_MARK}<!doctype html>\n"
        f'<html lang="{language}">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{escape(policy, quote=True)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="referrer" content="no-referrer">\n'
        f'<title>{title}</title>\n<link rel="icon" href="data:,">\n'
        f"{''.join(f'<style>{style}</style>' for style in styles)}\n</head>\n<body>\n"
    )
    tail = "".join(f"<script>{script}</script>\n" for script in scripts) + "</body>\n</html>\n"
    return head, tail


def _hashes(texts: Sequence[str]) -> str:
    digests = (hashlib.sha256(text.encode()).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(each).decode()}'" for each in digests)


def _as_data(n: int, content: bytes, suffix: str) -> str:
    return f"data:{PICTURE_KINDS[suffix]};base64,{base64.b64encode(content).decode()}"


def _sortable(value: object) -> object:
    """A value by which JavaScript sorts as Python does."""
    if isinstance(value, tuple):
        return f"{value[0]:09}{value[1]}"
    return 1e18 if value == float("inf") else value
