"""An episode as a video: what the agent saw before each step, what it thought, and what it did."""

from __future__ import annotations

import io
import os
import secrets
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

from benchmarks.monitor.episode_view import EpisodeView, StepView, picture_file, view_of
from benchmarks.monitor.formats import visible
from benchmarks.monitor.world import CannotReplay, Worlds
from er_gym.data.fonts import Font, NoFont, font_for
from er_gym.data.pictures import UnusablePicture, open_picture
from er_gym.data.strips import wrap_text
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks.verbs import INIT

FORMATS = (".webp", ".mp4")
_WIDTH, _HEIGHT = 640, 360
"""Of the picture, pixels."""
_MARGIN, _LINES = 14, 4
_TEXT, _SMALL = 17, 14
_LEADING = 1.35
_INK, _MUTED, _PAPER, _DONE, _FAILED = "#1c1e21", "#5d646e", "#ffffff", "#1b6e35", "#a32020"
_FASTEST, _SLOWEST, _LAST = 1.3, 6.0, 3.0
"""Seconds that a frame is shown: at least, at most, and the last one."""
_LETTERS_PER_SECOND = 32
_FPS = 10
_MOST_STEPS = 500


class CannotFilm(ValueError):
    """There is no such episode, or it cannot be drawn; the message is one line."""


@dataclass(frozen=True)
class Frame:
    """A frame of a video, and how long it is shown, seconds."""

    picture: Image.Image
    seconds: float


def film(run: RunDirectory, key: str, worlds: Worlds) -> list[Frame]:
    """The frames of an episode.

    The agent's own pictures where it was shown any, else what it could see, drawn now.

    Args:
        run: the run.
        key: of the episode.
        worlds: draws.

    Raises:
        CannotFilm: see there.
    """
    try:
        episode = view_of(run, key)
    except (ValueError, OSError) as error:
        why = str(error).splitlines()[0]
        raise CannotFilm(f"{key!r:.200} is no episode that can be read: {why}") from None
    if len(episode.steps) > _MOST_STEPS:
        raise CannotFilm(f"the episode has {len(episode.steps):,} steps, more than {_MOST_STEPS}")
    steps = [step for step in episode.steps if step.record.verb != INIT]
    fonts = _fonts(episode, steps)
    seen = _own(run.path, episode, steps) if episode.pictures else _drawn(run, episode, worlds)
    frames, total, last = [], len(steps), None
    pictures = iter(seen)
    try:
        for step in steps:
            last = next(pictures, None) or last or Image.new("RGB", (_WIDTH, _HEIGHT), _MUTED)
            frames.append(_frame(last, episode, step, total, fonts))
        last = next(pictures, None) or last
    except CannotReplay as error:
        raise CannotFilm(f"the agent was shown no pictures, and {error}") from None
    end = _frame(last or Image.new("RGB", (_WIDTH, _HEIGHT), _MUTED), episode, None, total, fonts)
    return [*frames, end]


def as_webp(frames: Sequence[Frame]) -> bytes:
    """The frames as an animated WebP."""
    data = io.BytesIO()
    first, *rest = [frame.picture for frame in frames]
    first.save(
        data,
        "WEBP",
        save_all=True,
        append_images=rest,
        duration=[round(1000 * frame.seconds) for frame in frames],
        loop=0,
        quality=80,
    )
    return data.getvalue()


def write_mp4(frames: Sequence[Frame], path: Path) -> None:
    """Write the frames as an MP4.

    Raises:
        ImportError: imageio-ffmpeg is not installed.
        OSError: the file cannot be written.
    """
    import imageio_ffmpeg

    draft = path.with_name(f".{path.stem}.{secrets.token_hex(8)}.draft.mp4")
    try:
        writer: Any = imageio_ffmpeg.write_frames(
            str(draft), frames[0].picture.size, fps=_FPS, macro_block_size=2, quality=8
        )
        writer.send(None)
        for frame in frames:
            for _ in range(max(1, round(frame.seconds * _FPS))):
                writer.send(frame.picture.tobytes())
        writer.close()
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def _own(run: Path, episode: EpisodeView, steps: Sequence[StepView]) -> Iterator[Image.Image]:
    """What the agent was shown for each step; the last again where it was shown nothing."""
    last = Image.new("RGB", (_WIDTH, _HEIGHT), _MUTED)
    for step in steps:
        files = [picture_file(run, episode.pictures[n]) for n in step.pictures]
        opened = [each for each in map(_opened, files) if each is not None]
        last = _arranged(opened) if opened else last
        yield last


def _opened(file: Path | None) -> Image.Image | None:
    try:
        return open_picture(file) if file else None
    except UnusablePicture:
        return None


def _drawn(run: RunDirectory, episode: EpisodeView, worlds: Worlds) -> Iterator[Image.Image]:
    for frame in worlds.frames(run.manifest, episode.record):
        yield _arranged([Image.fromarray(frame)])


def _arranged(pictures: Sequence[Image.Image]) -> Image.Image:
    """Pictures side by side in the space of one."""
    page = Image.new("RGB", (_WIDTH, _HEIGHT), "#e4e6ea")
    columns = 1 if len(pictures) == 1 else 2
    rows = -(-len(pictures) // columns)
    for number, picture in enumerate(pictures[: columns * rows]):
        room = _WIDTH // columns, _HEIGHT // rows
        scale = min(room[0] / picture.width, room[1] / picture.height)
        size = max(1, round(picture.width * scale)), max(1, round(picture.height * scale))
        small = picture.resize(size, Image.Resampling.LANCZOS)
        left, top = number % columns * room[0], number // columns * room[1]
        page.paste(small, (left + (room[0] - size[0]) // 2, top + (room[1] - size[1]) // 2))
    return page


def _thought(step: StepView) -> str:
    return " ".join(visible(each.text, 2_000) for each in step.thoughts).strip()


def _fonts(episode: EpisodeView, steps: Sequence[StepView]) -> dict[str, Font]:
    texts = [episode.record.instruction, *map(_thought, steps), "✓✗→…/+"]
    letters = "".join(sorted({*"".join(visible(each, 10_000) for each in texts)}))
    sizes = {"text": _TEXT, "small": _SMALL}
    try:
        return {name: font_for(letters, size) for name, size in sizes.items()}
    except NoFont:  # what no font has is shown as a box
        return {name: font_for("A", size) for name, size in sizes.items()}


def _frame(
    picture: Image.Image,
    episode: EpisodeView,
    step: StepView | None,
    total: int,
    fonts: dict[str, Font],
) -> Frame:
    """A picture over its caption; the last one, without a step, says how it ended."""
    record, line = episode.record, round(_TEXT * _LEADING)
    small = round(_SMALL * _LEADING)
    height = _HEIGHT + 2 * _MARGIN + small + line * (_LINES + 1)
    page = Image.new("RGB", (_WIDTH, height + height % 2), _PAPER)
    page.paste(picture, (0, 0))
    pen = ImageDraw.Draw(page)
    top, wide = _HEIGHT + _MARGIN, _WIDTH - 2 * _MARGIN
    task = wrap_text(visible(record.instruction, 500), fonts["small"], wide - 60)
    pen.text((_MARGIN, top), _cut(task, 1)[0], _MUTED, fonts["small"])
    number = f"{step.number if step else total} / {total}"
    pen.text((_WIDTH - _MARGIN, top), number, _MUTED, fonts["small"], anchor="ra")
    top += small + 2
    if step is None:
        good, did, thought = episode.success, episode.failure or record.end_reason, ""
        did = "success" if good else visible(did or "failure", 80)
    else:
        good, did, thought = step.record.success, visible(step.action, 80), _thought(step)
    reward = f"  +{step.record.reward:g}" if step and step.record.reward > 0 else ""
    mark = "✓" if good else "✗"
    pen.text((_MARGIN, top), f"→ {did}  {mark}{reward}", _DONE if good else _FAILED, fonts["text"])
    top += line
    for text in _cut(wrap_text(thought, fonts["text"], wide), _LINES) if thought else ():
        pen.text((_MARGIN, top), text, _INK, fonts["text"])
        top += line
    seconds = _LAST if step is None else _FASTEST + len(thought) / _LETTERS_PER_SECOND
    return Frame(page, min(seconds, _SLOWEST))


def _cut(lines: Sequence[str], most: int) -> list[str]:
    """At most so many lines; the last one says if there were more."""
    if len(lines) <= most:
        return list(lines)
    return [*lines[: most - 1], f"{lines[most - 1][:-2]} …"]
