"""What all pages of the monitor share: the directories that they show, templates and words."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeAlias
from urllib.parse import urlencode

from fastapi import Request, Response
from fastapi.responses import HTMLResponse
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from benchmarks.monitor import formats, svg
from benchmarks.monitor.decided_on import decided_on
from benchmarks.monitor.directories import Directories, Directory, Kind
from benchmarks.monitor.episode_view import MOST_TEXT
from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.fingerprint import fingerprint
from benchmarks.monitor.forms import Forms
from benchmarks.monitor.language import Translator, chosen_language
from benchmarks.monitor.notes import MOST_TEXT as MOST_TEXT_OF_NOTE
from benchmarks.monitor.page_tables import KINDS, saved_table
from benchmarks.monitor.record_figures import FailureCounts, Means
from benchmarks.monitor.run_view import RunSummary, run_views
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.writing import file_stem

Routes: TypeAlias = Mapping[str, Callable[..., Any]]
"""The function that answers at each address."""
LANGUAGE = "er-gym-language"
"""The cookie with the reader's choice."""
AN_HOUR = {"Cache-Control": "private, max-age=3600"}
"""For what does not change: pictures."""

READ_SECONDS = 0.1
"""How long records are read at a time, while a page waits; the rest follows while it is open."""
_MOST_ASKED = 2000
_MOST_FORM = 12 * MOST_TEXT_OF_NOTE + 4096
"""A character of a form has at most 12 bytes."""


class NotFound(Exception):
    """There is nothing at this address.

    Args:
        key: of the words that say so.
        back: the address that the page leads to.
    """

    def __init__(self, key: str = "gone", back: str = "/") -> None:
        super().__init__(key)
        self.key, self.back = key, back


@contextmanager
def or_nothing() -> Iterator[None]:
    """Within, what cannot be read is not there: raises :class:`NotFound`."""
    try:
        yield
    except (ValueError, OSError):
        raise NotFound from None


class Site:
    """The directories, read while they grow, and pages made from templates.

    Attributes:
        directories: those that it shows.
        runs: what was read of those that are runs.
        forms: reads the forms of pages that note something.
    """

    def __init__(self, directories: Directories) -> None:
        self.directories = directories
        self.runs = run_views()
        self._templates = Environment(
            loader=PackageLoader("benchmarks.monitor", "templates"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        self.forms = Forms(_MOST_FORM)
        self._templates.globals.update(
            secret_of_notes=self.forms.secret,
            most_note=MOST_TEXT_OF_NOTE,
            svg=svg,
            query=urlencode,
            most_text=MOST_TEXT,
            decided_on=decided_on,
        )
        self._templates.filters.update(formats.FILTERS)

    def show(
        self, request: Request, template: str, variables: Mapping[str, Any], status: int = 200
    ) -> Response:
        """A page in the reader's language; one of its tables as a file if the address asks for it
        (:mod:`benchmarks.monitor.page_tables`).

        Args:
            request: asks for it.
            template: its file.
            variables: the template's variables; ``live`` is what the page wants to
                hear of, as :meth:`state_of` takes it.
            status: of the answer.
        """
        here = request.url.path + (f"?{request.url.query}" if request.url.query else "")
        live = variables.get("live", "")
        told = {"state": self.state_of(live), **variables} if live else variables
        page = self.page(template, told, self.translator(request), here)
        kind, name = (request.query_params.get(each, "") for each in ("as", "table"))
        return _file(page, name, kind) if kind and status == 200 else HTMLResponse(page, status)

    def page(
        self,
        template: str,
        variables: Mapping[str, Any],
        t: Translator,
        here: str = "",
        link: Callable[[str], str | None] = lambda address: address,
    ) -> str:
        """A page in a language, as HTML.

        Args:
            template: its file.
            variables: the template's variables; ``exported`` if there will be no server.
            t: the words.
            here: its address.
            link: from an address of the server to where it leads from this page; None for nowhere.
        """

        def to(address: str, attribute: str = "href") -> Markup:
            """An attribute that names an address; none where it leads nowhere."""
            there = link(address)
            return Markup("") if there is None else Markup(' {}="{}"').format(attribute, there)

        shared = {"live": "", "state": "", "scripts": (), "at": "", "exported": None, "to": to}
        return self._templates.get_template(template).render(
            {**shared, **variables, "t": t, "here": here}
        )

    def translator(self, request: Request) -> Translator:
        """The words in the reader's language."""
        accepted = request.headers.get("accept-language", "")
        return Translator(chosen_language(request.cookies.get(LANGUAGE, ""), accepted))

    def directory(self, id: str, kind: Kind) -> Directory:
        """The directory with an id.

        Raises:
            NotFound: there is none of this kind.
        """
        directory = self.directories.get(id)
        if directory is None or directory.kind != kind:
            raise NotFound
        return directory

    def summary(self, directory: Directory) -> RunSummary:
        """A run at this moment."""
        with self.runs.use(directory) as view:
            return view.summary()

    def read_runs(self, closing: threading.Event) -> None:
        """Read all runs, one after the other, until ``closing`` is set: pages that are asked for
        meanwhile wait for what is being read, and need not read it again."""
        for directory in self.directories.of_kind("run"):
            if closing.is_set():
                return
            self.summary(directory)

    def rows(self, directory: Directory) -> dict[str, EpisodeRow]:
        """A run's episodes by key."""
        with self.runs.use(directory) as view:
            return dict(view.rows)

    def failures(self, directory: Directory) -> FailureCounts:
        """Why a run's episodes failed, as far as that has been counted."""
        with self.runs.use(directory) as view:
            view.read_records(READ_SECONDS)
            return view.failures

    def means(self, directory: Directory) -> Means | None:
        """The metrics of a run, over the records that have been read; None if none has."""
        with self.runs.use(directory) as view:
            return view.means()[0]

    def version(self, directory: Directory, closely: bool = False) -> object:
        """What changes whenever a directory does.

        Args:
            directory: which.
            closely: whether a page shows it alone, and so why its episodes failed.
        """
        if directory.kind != "run":
            return fingerprint(directory)
        with self.runs.use(directory) as view:
            if closely:
                view.read_records(READ_SECONDS)
            summary = view.summary()
            return summary.version, summary.state, view.figures.done

    def state_of(self, of: str, closely: bool = False) -> str:
        """What changes whenever some directories do, 16 hex digits.

        Args:
            of: the ids of directories, with commas between, or ``*`` for all.
            closely: whether more is read meanwhile of why their episodes failed.
        """
        asked = frozenset(of[:_MOST_ASKED].split(","))
        told = [
            (directory.id, self.version(directory, closely=closely and directory.id in asked))
            for directory in self.directories.all()
            if "*" in asked or directory.id in asked
        ]
        return hashlib.sha256(repr(told).encode()).hexdigest()[:16]

    def record(self, id: str, key: str) -> tuple[EpisodeRecord, Manifest]:
        """An episode's record, and its run's manifest.

        Raises:
            NotFound: there is none.
        """
        with or_nothing():
            run = RunDirectory.open(self.directory(id, "run").path)
            return run.episode(key), run.manifest


def _file(page: str, name: str, kind: str) -> Response:
    """A table of a page as a file."""
    text = saved_table(page, name, kind) if kind in KINDS else None
    if text is None:
        raise NotFound
    named = f'attachment; filename="{file_stem(name)}.{kind}"'
    return Response(text, media_type=KINDS[kind], headers={"Content-Disposition": named})


def is_here(address: str) -> bool:
    """Whether an address is one of this server's: a path, and not of another host (``//host``)."""
    return (
        address.startswith("/") and not address.startswith(("//", "/\\")) and address.isprintable()
    )
