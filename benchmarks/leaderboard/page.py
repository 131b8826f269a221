"""The leaderboard's page: one HTML file, without anything from elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from benchmarks.leaderboard.board import HEAD, PAPER_HEAD, WORDS, Cell, paper_rows
from benchmarks.leaderboard.checking import Checked

_MOST_PROBLEMS = 5


def page(rows: Sequence[tuple[Cell, ...]], refused: Sequence[Checked]) -> str:
    """The page.

    Args:
        rows: of the board, see :func:`benchmarks.leaderboard.board.row`.
        refused: submissions with problems, which are named at the end.
    """
    best_first = sorted(rows, key=lambda cells: -(cells[HEAD.index("Success, %")].value or 0.0))
    parts = [
        f"<!-- Written by er-gym -->\n<!doctype html>\n<html lang='en'>\n{_HEAD}\n<body>",
        f"<h1>er-gym: leaderboard</h1>\n<p>{_ABOUT}</p>",
        _table("board", HEAD, best_first),
        f"<h2>Measured elsewhere</h2>\n<p>{_ELSEWHERE}</p>",
        _table("paper", PAPER_HEAD, paper_rows()),
    ]
    if refused:
        lines = "\n".join(map(_refused, refused))
        parts.append(f"<h2>Not listed</h2>\n<ul>\n{lines}\n</ul>")
    parts.append(f"<script>{_SCRIPT}</script>\n</body>\n</html>\n")
    return "\n".join(parts)


def _table(name: str, head: Iterable[str], rows: Iterable[tuple[Cell, ...]]) -> str:
    titles = "".join(
        f"<th scope='col'{'' if title in WORDS or title == 'Model' else ' class=figure'}>"
        f"<button>{escape(title)}</button></th>"
        for title in head
    )
    lines = "\n".join(f"<tr>{''.join(map(_cell, cells))}</tr>" for cells in rows)
    return (
        f"<div class='wide'><table id='{name}'>\n<thead><tr>{titles}</tr></thead>\n"
        f"<tbody>\n{lines}\n</tbody></table></div>"
    )


def _cell(cell: Cell) -> str:
    if cell.value is None:
        return f"<td>{escape(cell.text)}</td>"
    return f"<td class='figure' data-value='{cell.value!r}'>{escape(cell.text)}</td>"


def _refused(checked: Checked) -> str:
    told = [str(each) for each in checked.problems[:_MOST_PROBLEMS]]
    more = len(checked.problems) - len(told)
    told += [f"and {more} more"] * bool(more)
    return f"<li><b>{escape(checked.path.name)}</b>: {escape('; '.join(told))}</li>"


_ABOUT = (
    "Each row is a submission: its results were computed anew from its records, and its actions "
    "were done again on the engine where the last column says so. Success is that of the corrected "
    "scorer, with Wilson's 95 % interval; tidy success is a success that changed nothing in the "
    "room that the task did not ask for. Instances <i>target</i>: the environment looks at the "
    "task to choose which object a type name means, so compare only rows with the same. The oracle "
    "knows the key actions; it is no competitor. Click on a column to sort by it. The rules are in "
    "docs/leaderboard.md."
)
_ELSEWHERE = (
    "The table that the paper <i>Embodied-Reasoner</i> (arXiv 2503.21696) published: its models on "
    "its 809 tasks, in Unity, by its own scorer. Nobody has measured these here, and they do not "
    "compare with the rows above."
)
_HEAD = """<head>
<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>er-gym: leaderboard</title>
<style>
:root { color-scheme: light dark; --line: #8884; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 110rem;
  padding: 0 1rem; }
p { max-width: 50rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .35rem .6rem; border-bottom: 1px solid var(--line); text-align: left; }
td { white-space: nowrap; }
td:first-child { position: sticky; left: 0; background: Canvas; }
.figure { text-align: right; }
th button { font: inherit; font-weight: 600; background: none; border: 0; padding: 0;
  color: inherit; cursor: pointer; text-align: inherit; }
th[aria-sort=ascending] button::after { content: " \\2191"; }
th[aria-sort=descending] button::after { content: " \\2193"; }
</style>
</head>"""
_SCRIPT = """
for (const table of document.querySelectorAll("table")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.firstChild.addEventListener("click", () => {
    const body = table.tBodies[0];
    const rows = [...body.rows];
    const value = row => row.cells[column].dataset.value;
    const figures = rows.some(row => value(row) !== undefined);
    const up = head.getAttribute("aria-sort") === (figures ? "descending" : null);
    const order = figures
      ? (a, b) => (value(a) ?? -Infinity) - (value(b) ?? -Infinity)
      : (a, b) => a.cells[column].textContent.localeCompare(b.cells[column].textContent);
    rows.sort((a, b) => up ? order(a, b) : order(b, a));
    heads.forEach(each => each.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    body.append(...rows);
  }));
}
"""
