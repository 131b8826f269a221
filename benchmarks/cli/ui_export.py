"""``er-gym ui --export`` and ``er-gym ui --video``: what is shown, as files."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import Place
from benchmarks.terminal import echo, terminal

_Command = TypeVar("_Command", bound=Callable[..., Any])
_FOLDER = Place(exists=True, file_okay=False, path_type=Path)
_VIDEOS = (".webp", ".mp4")


@dataclass(frozen=True)
class FileOptions:
    """The options of ``er-gym ui`` for files.

    Attributes:
        export, video: the run that becomes pages, or whose episode becomes a video.
        out: the file or folder that is made.
        episodes: the most replays.
        only: which episodes have one, each ``NAME=VALUE``.
        episode: the key of the video's.
        draw: whether pictures are drawn where the agent was shown none.
        language: of the words.
        overwrite: whether what is there is replaced.
    """

    export: Path | None
    video: Path | None
    out: Path | None
    episodes: int | None
    only: tuple[str, ...]
    episode: str | None
    draw: bool
    language: str
    overwrite: bool


_OPTIONS: Sequence[Callable[[Any], Any]] = (
    click.option(
        "--export",
        type=_FOLDER,
        metavar="RUN",
        help="Show nothing; write a run's pages to --out: one file with everything in it where the "
        "name ends in .html, else a folder.",
    ),
    click.option(
        "--episodes",
        type=click.IntRange(0),
        help="With --export: the most episodes that can be replayed.  [default: 20 in a file, "
        "all in a folder]",
    ),
    click.option(
        "--only",
        multiple=True,
        metavar="NAME=VALUE",
        help="With --export: which episodes can be replayed, as the page filters and sorts them, "
        "such as outcome=failure, type=single_search, type=Search, steps=5-10 or sort=-steps.",
    ),
    click.option(
        "--draw",
        is_flag=True,
        help="With --export: draw what the agent could see where it was shown no pictures.",
    ),
    click.option(
        "--video",
        type=_FOLDER,
        metavar="RUN",
        help="Show nothing; write an episode of a run to --out as a video: .webp, or .mp4 with "
        "imageio-ffmpeg.",
    ),
    click.option("--episode", metavar="KEY", help="With --video: which.  [default: the first]"),
    click.option("--out", type=Place(path_type=Path), help="What --export or --video writes."),
    click.option(
        "--language",
        type=click.Choice(("en", "zh")),
        default="en",
        show_default=True,
        help="With --export: of the words.",
    ),
    click.option("--overwrite", is_flag=True, help="Replace what is at --out."),
)


def file_options(command: _Command) -> _Command:
    """Adds the options; the command gets them as its argument ``files``."""

    @functools.wraps(command)
    def with_files(**given: Any) -> Any:
        mine = {each.name: given.pop(each.name) for each in fields(FileOptions)}
        return command(files=FileOptions(**mine), **given)

    for option in reversed(_OPTIONS):
        option(with_files)
    return with_files  # type: ignore[return-value]


def write_files(options: FileOptions) -> bool:
    """Write what was asked for; False if nothing was.

    Raises:
        BadInput: options do not go together, or something is in the way.
    """
    if options.export is None and options.video is None:
        alone = {"--out": options.out, "--episode": options.episode, "--only": options.only,
                 "--episodes": options.episodes, "--draw": options.draw,
                 "--overwrite": options.overwrite}  # fmt: skip
        given = [name for name, value in alone.items() if value not in (None, (), False)]
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
    from benchmarks.cli.progress import bar
    from benchmarks.monitor.export import USUAL_EPISODES, Wanted, export

    assert options.export is not None
    is_file = out.suffix.lower() in (".html", ".htm")
    most = options.episodes
    wanted = Wanted(
        run=options.export,
        out=out,
        episodes=USUAL_EPISODES if most is None and is_file else most,
        filter=_filter(options.only),
        language=options.language,
        draw=options.draw,
        overwrite=options.overwrite,
    )
    with bad_input(), bar(terminal()) as progress:
        task = progress.add_task("episodes", total=None, status="")

        def tell(done: int, of: int) -> None:
            progress.update(task, completed=done, total=of)

        made = export(wanted, tell)
    more = f"; --episodes {made.total} takes all" if is_file and made.n < made.total else ""
    echo(f"{out}: {made.n:,} of {made.total:,} episodes can be replayed in it{more}")


def _filter(only: Sequence[str]) -> Any:
    """The filter that the options name."""
    from benchmarks.monitor.run_view import SORTS, Filter

    names = [each.name for each in fields(Filter) if each.name != "page"]
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
