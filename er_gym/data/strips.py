"""Draws a trajectory as a strip: for each turn what was seen, thought and done, from top to bottom.

The kinds of thoughts differ in colour and are named, so that nobody depends on the colours.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image, ImageDraw

from er_gym.data.fonts import Font, font_for
from er_gym.data.pictures import open_picture
from er_gym.data.trajectory import THOUGHT_KINDS, PictureRecord, ThoughtKind, Trajectory, Turn
from er_gym.writing import inside

COLOURS: Mapping[ThoughtKind, str] = {
    "analysis": "#0072b2",
    "reasoning": "#a05195",
    "planning": "#00775c",
    "reflection": "#b34700",
    "verification": "#665200",
}
"""Okabe and Ito's palette for all kinds of eyes, dark enough for white letters."""
_INK, _MUTED, _LINE, _PAPER = "#222222", "#5f5f5f", "#d8d8d8", "#ffffff"
_DONE, _FAILED = "#1b6e35", "#a32020"
_MARGIN, _GAP = 20, 12
_PICTURES, _WORDS = 420, 640
"""Widths of the column of pictures and of that of words, pixels."""
_TEXT, _SMALL, _TITLE = 16, 14, 22
_LEADING = 1.35
_MOST_HEIGHT = 60_000
"""Pixels; a JPEG can hold 65,500."""


@dataclass(frozen=True)
class _Line:
    """A line of words; with a colour as its ``label``, the name of a kind on a ground of it."""

    text: str
    font: Font
    colour: str
    label: str = ""
    indent: int = 0

    @property
    def height(self) -> int:
        return round(self.font.size * _LEADING)


def draw_strip(trajectory: Trajectory, folder: Path, font_file: Path | None = None) -> Image.Image:
    """A trajectory as a picture.

    Args:
        trajectory: what is drawn.
        folder: the collection's, where the pictures are.
        font_file: a font; None for one of the system's that has all characters.

    Raises:
        ValueError: a picture is missing, no font has the characters, or the strip gets too high.
    """
    fonts = _fonts(trajectory, font_file)
    head = list(_head(trajectory, fonts))
    rows = [
        (_arranged(turn.pictures, folder), list(_words(index, turn, fonts)))
        for index, turn in enumerate(trajectory.turns)
    ]
    heights = [
        max(
            picture.height if picture else 0,
            sum(line.height for line in lines),
        )
        for picture, lines in rows
    ]
    top = _MARGIN + sum(line.height for line in head) + _GAP
    height = top + sum(height + 2 * _GAP for height in heights) + _MARGIN
    if height > _MOST_HEIGHT:
        raise ValueError(
            f"the strip of {trajectory.id} would be {height:,} pixels high, more than "
            f"{_MOST_HEIGHT:,}; leave out --out to read it in the terminal"
        )
    width = _MARGIN + _PICTURES + _GAP + _WORDS + _MARGIN
    page = Image.new("RGB", (width, height), _PAPER)
    pen = ImageDraw.Draw(page)
    _write(pen, head, _MARGIN, _MARGIN)
    for (picture, lines), row_height in zip(rows, heights, strict=True):
        pen.line((_MARGIN, top, width - _MARGIN, top), fill=_LINE)
        if picture is not None:
            page.paste(picture, (_MARGIN, top + _GAP))
        _write(pen, lines, _MARGIN + _PICTURES + _GAP, top + _GAP)
        top += row_height + 2 * _GAP
    return page


def _fonts(trajectory: Trajectory, file: Path | None) -> dict[str, Font]:
    texts = [trajectory.instruction, trajectory.id]
    for turn in trajectory.turns:
        texts += [turn.feedback, str(turn.action), *(thought.text for thought in turn.thoughts)]
    letters = "".join({*"".join(texts), *"".join(THOUGHT_KINDS)})
    sizes = {"text": _TEXT, "small": _SMALL, "title": _TITLE}
    return {name: font_for(letters, size, file) for name, size in sizes.items()}


def _head(trajectory: Trajectory, fonts: Mapping[str, Font]) -> Iterator[_Line]:
    width = _PICTURES + _GAP + _WORDS
    yield from _folded(trajectory.instruction, fonts["title"], _INK, width)
    kind = " ".join(filter(None, (trajectory.kind, trajectory.mode)))
    done = "done" if trajectory.success else f"not done: {trajectory.end_reason}"
    told = f"{trajectory.id}, {trajectory.scene}, kind {kind}, {trajectory.actor}, {done}"
    yield from _folded(told, fonts["small"], _MUTED, width)


def _words(index: int, turn: Turn, fonts: Mapping[str, Font]) -> Iterator[_Line]:
    """The words of a turn: thoughts with the names of their kinds, the action, its result."""
    yield _Line(f"{index}  {turn.purpose}", fonts["small"], _MUTED)
    for thought in turn.thoughts:
        yield _Line(thought.kind, fonts["small"], _PAPER, label=COLOURS[thought.kind])
        yield from _folded(thought.text, fonts["text"], _INK, _WORDS, indent=8)
    yield _Line("", fonts["small"], _INK)
    arrow = f"> {turn.action}"
    yield from _folded(arrow, fonts["text"], _DONE if turn.success else _FAILED, _WORDS)
    fault = f", fault: {turn.fault}" if turn.fault else ""
    result = f"{'done' if turn.success else 'failed'}{fault}"
    earned = f" (+{turn.reward:g})" if turn.reward > 0 else ""
    yield from _folded(f"{result}{earned}. {turn.feedback}", fonts["small"], _MUTED, _WORDS)


def _folded(text: str, font: Font, colour: str, width: int, *, indent: int = 0) -> Iterator[_Line]:
    for line in wrap_text(text, font, width - indent):
        yield _Line(line, font, colour, indent=indent)


def wrap_text(text: str, font: Font, width: int) -> list[str]:
    """Lines of a text that fit a width, broken between words, or within where a word is longer or
    has no spaces, as in Chinese.

    Args:
        width: pixels.
    """
    lines: list[str] = []
    for paragraph in text.splitlines() or [""]:
        line = ""
        for piece in _pieces(paragraph):
            if font.getlength(line + piece.rstrip()) <= width:
                line += piece
                continue
            if line.strip():
                lines.append(line.rstrip())
            line = ""
            for letter in piece.lstrip() if font.getlength(piece) > width else ():
                if line and font.getlength(line + letter) > width:
                    lines.append(line)
                    line = ""
                line += letter
            line = line or piece.lstrip()
        lines.append(line.rstrip())
    return lines


def _pieces(text: str) -> Iterator[str]:
    """What a line may be broken between: words with the space after them, or single characters of
    scripts without spaces."""
    word = ""
    for letter in text:
        if ord(letter) >= 0x2E80:
            if word:
                yield word
            yield letter
            word = ""
        else:
            word += letter
            if letter == " ":
                yield word
                word = ""
    if word:
        yield word


def _write(pen: ImageDraw.ImageDraw, lines: Sequence[_Line], left: int, top: int) -> None:
    for line in lines:
        if line.label:
            wide = round(line.font.getlength(line.text)) + 12
            pen.rounded_rectangle((left, top + 2, left + wide, top + line.height), 4, line.label)
            pen.text((left + 6, top + 2), line.text, _PAPER, line.font)
        elif line.text:
            pen.text((left + line.indent, top), line.text, line.colour, line.font)
        top += line.height


def _arranged(records: Sequence[PictureRecord], folder: Path) -> Image.Image | None:
    """A turn's pictures in one: a single one as wide as the column, several below one another with
    their directions; None for none."""
    if not records:
        return None
    pictures = [open_picture(inside(folder, record.path)) for record in records]
    width = _PICTURES if len(records) == 1 else _PICTURES * 2 // 3
    scaled = [
        picture.resize(
            (width, max(1, round(picture.height * width / picture.width))),
            Image.Resampling.LANCZOS,
        )
        for picture in pictures
    ]
    if len(records) == 1:
        return scaled[0]
    page = Image.new(
        "RGB", (_PICTURES, sum(one.height for one in scaled) + 4 * (len(scaled) - 1)), _PAPER
    )
    pen = ImageDraw.Draw(page)
    font = font_for("".join(record.direction for record in records), _SMALL)
    top = 0
    for record, picture in zip(records, scaled, strict=True):
        page.paste(picture, (0, top))
        pen.text((width + 8, top), record.direction, _MUTED, font)
        top += picture.height + 4
    return page
