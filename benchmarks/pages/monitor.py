"""Takes pictures of every kind of page of er-gym ui, as its readers see them.

    python -m benchmarks.pages.monitor FOLDER --out DIR [--only run --only ladder]
    python -m benchmarks.pages.monitor FOLDER --docs --only ladder

The first command takes whole pages, at three widths, light and dark, in English and Chinese, to be
looked at after a change; it says which are wider than the window. The second one takes pictures as
``docs/monitor.md`` has them. Of each kind of directory in FOLDER the first one is shown; the first
run is compared with those of the same tasks. Playing writes into a folder of its own, which goes
away.
"""

from __future__ import annotations

import contextlib
import itertools
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode, urljoin

import click
from PIL import Image

from benchmarks.harness.processes import ER_GYM
from benchmarks.monitor.directories import Directories, Directory, Kind
from er_gym.data.collection import Collection
from er_gym.data.pictures import open_picture
from er_gym.rollout.run_directory import RunDirectory

WIDTHS = (1440, 900, 360)
SCHEMES = ("light", "dark")
LANGUAGES = ("en", "zh")
_HIGHEST = 3000
"""No more of a page is taken, pixels."""
_OF_DOCS = {"width": 1180, "height": 760}
_IMAGES = Path("docs/images")
_PATIENCE_MS = 120_000


class Shown:
    """What there is to see under a folder. Its functions raise LookupError where there is nothing.

    Args:
        folder: as er-gym ui takes it.
        scratch: an empty folder.
    """

    def __init__(self, folder: Path, scratch: Path) -> None:
        self._all = Directories([folder]).all()
        self._scratch = scratch

    def of(self, *kinds: Kind) -> list[Directory]:
        """The directories of some kinds."""
        return [each for each in self._all if each.kind in kinds]

    def at(self, address: str, kind: Kind) -> str:
        """An address under which the first directory of a kind stands."""
        return f"/{address}/{self.of(kind)[0].id}"

    def key(self) -> str:
        """The first episode of the first run."""
        for record in RunDirectory.open(self.of("run")[0].path).episodes():
            return record.key
        raise LookupError

    def trajectory(self) -> str:
        """The first trajectory of the first collection."""
        for trajectory in Collection.open(self.of("collection")[0].path).trajectories():
            return trajectory.id
        raise LookupError

    def alike(self) -> list[tuple[str, str]]:
        """The first run and all that have played the same, as an address asks for them."""
        key = self.key()
        alike = [each for each in self.of("run") if RunDirectory.open(each.path).has(key)]
        if len(alike) < 2:
            raise LookupError
        return [("of", each.id) for each in alike]

    def exported(self) -> str:
        """The first run as a file."""
        file = self._scratch / "run.html"
        if not file.exists():
            what = ["--export", str(self.of("run")[0].path), "--out", str(file), "--episodes", "2"]
            subprocess.run([*ER_GYM, "ui", *what], check=True, capture_output=True)
        return file.as_uri()


def _play(page: Any) -> None:
    going_on = page.locator(".sessions a")
    (going_on if going_on.count() else page.locator("button.main")).first.click()
    page.wait_for_selector("button[name=action]")


def _look_around(page: Any) -> None:
    _play(page)
    page.click("button[value=observe]")
    page.wait_for_selector(".views.n4")


def _pool(page: Any) -> None:
    page.check("[name=pool]")
    page.locator("[name=smooth]").fill("0.5")


def _play_to_the_end(page: Any) -> None:
    _play(page)
    page.click("button[value=end]")
    page.wait_for_selector("p.result")


def _watch(page: Any) -> None:
    going_on = page.locator(".sessions li:has-text('random') a")
    if going_on.count():
        going_on.first.click()
    else:
        page.fill("input[name=agent]", "random")
        page.click("button.main")
    page.wait_for_selector("button[data-press]")
    page.click("button[data-press=' ']")
    page.wait_for_selector(".played-steps li")


@contextlib.contextmanager
def _lost(page: Any) -> Iterator[None]:
    """While the server does not answer."""
    page.context.set_offline(True)
    page.wait_for_selector("#away:not([hidden])")
    yield
    page.context.set_offline(False)


@dataclass(frozen=True)
class PageKind:
    """A kind of page.

    Attributes:
        address: where it stands; LookupError where there is nothing to show.
        ready: what is there, as a selector, before its picture is taken.
        before: what is done on it.
        during: how it is while its picture is taken.
    """

    address: Callable[[Shown], str]
    ready: str = "main"
    before: Callable[[Any], None] = lambda page: None
    during: Callable[[Any], contextlib.AbstractContextManager[None]] = contextlib.nullcontext


def _curves(shown: Shown) -> str:
    of = [("of", each.id) for each in shown.of("policy", "finetuning", "reinforcement")]
    return f"/training/curves?{urlencode(of)}" if of else shown.at("training", "policy")


def _two_episodes(shown: Shown) -> str:
    runs = shown.alike()
    asked = urlencode([runs[0], runs[-1], ("key", shown.key())])
    return f"/compare/episode?{asked}#a-step-1"


_MAP = "svg.room, .map .empty"
KINDS: Mapping[str, PageKind] = {
    "runs": PageKind(lambda shown: "/"),
    "away": PageKind(lambda shown: "/", during=_lost),
    "run": PageKind(lambda shown: shown.at("runs", "run")),
    "episode": PageKind(
        lambda shown: f"{shown.at('runs', 'run')}/episode?{urlencode({'key': shown.key()})}#step-1",
        ready=_MAP,
    ),
    "compare": PageKind(lambda shown: f"/compare?{urlencode(shown.alike())}"),
    "compare-episode": PageKind(_two_episodes, ready="svg.room >> nth=1"),
    "exported": PageKind(lambda shown: shown.exported()),
    "data": PageKind(lambda shown: "/data"),
    "collection": PageKind(lambda shown: shown.at("data", "collection")),
    "trajectory": PageKind(
        lambda shown: (
            f"{shown.at('data', 'collection')}/trajectory?{urlencode({'key': shown.trajectory()})}"
        ),
        ready=_MAP,
    ),
    "training": PageKind(lambda shown: "/training"),
    "policy": PageKind(lambda shown: shown.at("training", "policy")),
    "finetuning": PageKind(lambda shown: shown.at("training", "finetuning")),
    "reinforcement": PageKind(lambda shown: shown.at("training", "reinforcement")),
    "ladder": PageKind(lambda shown: shown.at("training", "ladder")),
    "ablation": PageKind(lambda shown: shown.at("training", "ablation")),
    "curves": PageKind(_curves, ready="#curves canvas", before=_pool),
    "choose": PageKind(lambda shown: "/play"),
    "play": PageKind(lambda shown: "/play", before=_look_around),
    "played": PageKind(lambda shown: "/play", before=_play_to_the_end),
    "watched": PageKind(lambda shown: "/play", before=_watch),
    "nothing": PageKind(lambda shown: "/nothing"),
}


@click.command()
@click.argument("folder", type=click.Path(path_type=Path, exists=True, file_okay=False))
@click.option("--out", type=click.Path(path_type=Path), help="Where pictures of whole pages go.")
@click.option("--docs", is_flag=True, help=f"Take those of docs/monitor.md, into {_IMAGES}.")
@click.option("--only", type=click.Choice(list(KINDS)), multiple=True, help="Kinds of pages.")
@click.option("--width", type=int, multiple=True, default=WIDTHS, show_default=True)
@click.option("--scheme", type=click.Choice(SCHEMES), multiple=True, default=SCHEMES)
@click.option("--language", type=click.Choice(LANGUAGES), multiple=True, default=LANGUAGES)
def main(
    folder: Path,
    out: Path | None,
    docs: bool,
    only: tuple[str, ...],
    width: tuple[int, ...],
    scheme: tuple[str, ...],
    language: tuple[str, ...],
) -> None:
    """Serve FOLDER, open its pages in Chromium, and take pictures."""
    if docs == bool(out):
        raise click.UsageError("give either --out or --docs")
    out = out or _IMAGES
    out.mkdir(parents=True, exist_ok=True)
    ways = [("light", "en")] if docs else list(itertools.product(scheme, language))
    scratch = contextlib.ExitStack()
    with scratch, _browser() as browser:
        shown = Shown(folder, Path(scratch.enter_context(tempfile.TemporaryDirectory())))
        for colours, words in ways:
            context = browser.new_context(
                color_scheme=colours, locale=words, viewport=_OF_DOCS, reduced_motion="reduce"
            )
            page = context.new_page()
            page.set_default_timeout(_PATIENCE_MS)
            with _served(folder) as address:
                for name in only or KINDS:
                    try:
                        page.goto(urljoin(address, KINDS[name].address(shown)))
                    except LookupError:
                        continue
                    KINDS[name].before(page)
                    page.wait_for_selector(KINDS[name].ready)
                    with KINDS[name].during(page):
                        page.evaluate("scrollTo(0, 0)")
                        if docs:
                            _small(page.screenshot(), out / f"monitor-{name}.png")
                            continue
                        for wide in width:
                            _whole(page, wide, out / f"{name}-{wide}-{colours}-{words}.png")
            context.close()


def _small(picture: bytes, file: Path) -> None:
    """Keep a picture in 256 colours."""
    image = open_picture(picture).quantize(256, dither=Image.Dither.NONE)
    image.save(file, optimize=True)


def _whole(page: Any, width: int, file: Path) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    page.wait_for_timeout(200)  # charts are drawn anew
    size = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"
    wide, high = page.evaluate(size)
    clip = {"x": 0, "y": 0, "width": width, "height": min(high, _HIGHEST)}
    page.screenshot(path=file, full_page=True, clip=clip)
    click.echo(f"{file.name}: {width}x{high}" + f", {wide - width} too wide" * (wide > width))


@contextlib.contextmanager
def _served(folder: Path) -> Iterator[str]:
    """The monitor over a folder; yields its address."""
    with tempfile.TemporaryDirectory() as scratch:
        command = [*ER_GYM, "ui", str(folder), "--no-browser", "--port", "0"]
        command += ["--play", f"{scratch}/played"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        try:
            told = re.search(r"http://\S+:\d+", server.stdout.readline())
            if told is None:
                raise click.ClickException("er-gym ui does not start")
            yield told[0]
        finally:
            server.terminate()
            server.wait()


@contextlib.contextmanager
def _browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        raise click.UsageError("needs the browser: apt-get install chromium")
    with sync_playwright() as playwright:
        # Chromium's sandbox does not start for root; the pages are this checkout's own.
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


if __name__ == "__main__":
    main()
