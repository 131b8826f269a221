"""``er-gym ui --export`` and ``er-gym ui --video``: what is shown, as files."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import EXISTING_FOLDER, LANGUAGES, PATH, OptionGroup, option
from benchmarks.terminal import echo, terminal


@dataclass(frozen=True)
class FileOptions(OptionGroup):
    """The options of ``er-gym ui`` for files."""

    export: Path | None = option(
        type=EXISTING_FOLDER,
        metavar="RUN",
        help="Start no server; write a run's pages to --out: one self-contained file if the name "
        "ends in .html, else a folder.",
    )
    episodes: int | None = option(
        type=click.IntRange(0),
        help="With --export: the most episodes that can be replayed.  [default: 20 in a file, "
        "all in a folder]",
    )
    only: tuple[str, ...] = option(
        multiple=True,
        metavar="NAME=VALUE",
        help="With --export: which episodes can be replayed, as the page filters and sorts them, "
        "such as outcome=failure, type=single_search, type=Search, steps=5-10 or sort=-steps.",
    )
    draw: bool = option(
        is_flag=True,
        help="With --export: render the agent's view if it was shown no pictures.",
    )
    video: Path | None = option(
        type=EXISTING_FOLDER,
        metavar="RUN",
        help="Start no server; write an episode of a run to --out as a video: .webp, or .mp4 with "
        "imageio-ffmpeg.",
    )
    episode: str | None = option(
        metavar="KEY", help="With --video: the episode.  [default: the first]"
    )
    out: Path | None = option(type=PATH, help="What --export or --video writes.")
    language: str = option(
        type=click.Choice(LANGUAGES),
        default="en",
        show_default=True,
        help="With --export: the language of the pages.",
    )
    overwrite: bool = option(is_flag=True, help="Replace what is at --out.")


def write_files(options: FileOptions) -> bool:
    """Write what was asked for; False if nothing was.

    Raises:
        BadInput: options do not go together, or something is in the way.
    """
    if options.export is None and options.video is None:
        given = [flag for flag in options.given if flag != "--language"]  # it has a default
        if given:
            raise BadInput(f"{given[0]} goes with --export RUN or --video RUN; give one of these")
        return False
    if options.export is not None and options.video is not None:
        raise BadInput("give either --export or --video")
    if options.out is None:
        raise BadInput("give --out, such as --out run.html or --out episode.webp")
    (_export if options.export is not None else _video)(options, options.out)
    return True


def _export(options: FileOptions, out: Path) -> None:
    from benchmarks.cli.progress import counting
    from benchmarks.monitor.export import USUAL_EPISODES, ExportRequest, export

    assert options.export is not None
    is_file = out.suffix.lower() in (".html", ".htm")
    most = options.episodes
    wanted = ExportRequest(
        run=options.export,
        out=out,
        episodes=USUAL_EPISODES if most is None and is_file else most,
        filter=_filter(options.only),
        language=options.language,
        draw=options.draw,
        overwrite=options.overwrite,
    )
    with bad_input(), counting(terminal(), "episodes") as tell:
        made = export(wanted, tell)
    more = f"; --episodes {made.total} takes all" if is_file and made.n < made.total else ""
    echo(f"{out}: {made.n:,} of {made.total:,} episodes can be replayed in it{more}")


def _filter(only: Sequence[str]) -> Any:
    """The filter that the options name."""
    from benchmarks.monitor.episode_filter import SORTS, Filter

    names = [name for name in Filter.names() if name != "page"]
    given: dict[str, str] = {}
    for one in only:
        name, equal, value = one.partition("=")
        if name not in names or not equal:
            raise BadInput(f"--only {one!r:.100}: give NAME=VALUE; NAME is {', '.join(names)}")
        given[name] = value
    sort = given.get("sort", "ended").removeprefix("-")
    if sort not in SORTS:
        raise BadInput(f"--only sort={sort!r:.100}: sort by one of {', '.join(SORTS)}")
    return Filter(**given)  # type: ignore[arg-type]


def _video(options: FileOptions, out: Path) -> None:
    from benchmarks.monitor.video import FORMATS, as_webp, film, write_mp4
    from benchmarks.monitor.world import Worlds
    from er_gym.rollout.run_directory import RunDirectory
    from er_gym.writing import write_atomic

    assert options.video is not None
    suffix = out.suffix.lower()
    if suffix not in FORMATS:
        raise BadInput(f"{out}: a video is {' or '.join(FORMATS)}; give --out with such an ending")
    if suffix == ".mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise BadInput(
            "a .mp4 needs imageio-ffmpeg, which is not installed: pip install imageio-ffmpeg, or "
            "give a name that ends in .webp"
        )
    if (out.exists() or out.is_symlink()) and not options.overwrite:
        raise BadInput(f"{out} is there already; choose another --out, or give --overwrite")
    with bad_input():
        run = RunDirectory.open(options.video)
        key = options.episode or next((each.key for each in run.episodes()), "")
        if not key:
            raise BadInput(f"{options.video} has no episode yet")
        frames = film(run, key, Worlds())
        if suffix == ".mp4":
            write_mp4(frames, out)
        else:
            write_atomic(out, as_webp(frames))
    seconds = sum(frame.seconds for frame in frames)
    echo(f"{out}: {key}, {len(frames)} frames, {seconds:.0f} s")
