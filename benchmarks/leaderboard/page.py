"""The leaderboard's page: one HTML file, without anything from elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby

from benchmarks.leaderboard.board import PAPER_HEAD, Row, paper_rows
from benchmarks.leaderboard.checking import Checked
from benchmarks.leaderboard.columns import COLUMNS, SUCCESS, Cell

_MOST_PROBLEMS = 5


def page(rows: Iterable[Row], refused: Sequence[Checked]) -> str:
    """The page.

    Args:
        rows: of the board, see :func:`benchmarks.leaderboard.board.row`.
        refused: submissions with problems, which are named at the end.
    """
    parts = [
        f"<!-- Written by er-gym -->\n<!doctype html>\n<html lang='en'>\n{_HEAD}\n<body><main>",
        f"<h1>er-gym: leaderboard</h1>\n<p>{_ABOUT}</p>",
    ]
    in_order = sorted(rows, key=lambda each: (each.suite, each.instances, -_success(each)))
    for number, ((suite, instances), several) in enumerate(
        groupby(in_order, key=lambda each: (each.suite, each.instances))
    ):
        title = f"{suite}, instances {instances}"
        parts.append(f"<h2>{escape(title)}</h2>\n<p>{_INSTANCES.get(instances, '')}</p>")
        parts.append(_board(f"board-{number}", title, [*several]))
    told = "\n".join(
        f"<dt>{escape(each.title)}</dt><dd>{escape(each.about)}</dd>" for each in COLUMNS
    )
    parts += [
        f"<details open><summary>What the columns say</summary>\n<dl>\n{told}\n</dl></details>",
        f"<h2>Measured elsewhere</h2>\n<p>{_ELSEWHERE}</p>",
        _table(
            "paper", "The paper's table", [(each, "") for each in PAPER_HEAD],
            [("", cells) for cells in sorted(paper_rows(), key=lambda each: -(each[1].value or 0))],
        ),
    ]  # fmt: skip
    if refused:
        lines = "\n".join(map(_refused, refused))
        parts.append(f"<h2>Not listed</h2>\n<ul>\n{lines}\n</ul>")
    parts.append(f"<script>{_SCRIPT}</script>\n</main></body>\n</html>\n")
    return "\n".join(parts)


def _success(row: Row) -> float:
    return row[SUCCESS].value or 0.0


def _board(name: str, title: str, rows: Sequence[Row]) -> str:
    """The table of rows that compare, without the columns that none of them fills."""
    filled = [n for n in range(len(COLUMNS)) if any(each.cells[n].text != "-" for each in rows)]
    return _table(
        name,
        title,
        [(COLUMNS[n].title, COLUMNS[n].about) for n in filled],
        [("reference" * each.reference, [each.cells[n] for n in filled]) for each in rows],
    )


def _table(
    name: str,
    title: str,
    head: Sequence[tuple[str, str]],
    rows: Sequence[tuple[str, Sequence[Cell]]],
) -> str:
    """A table that sorts by a click, and is sorted by success.

    Args:
        name: its id.
        title: for who does not see it.
        head: the title of each column, and what it says.
        rows: each with its class.
    """
    figures = [any(cells[n].value is not None for _, cells in rows) for n in range(len(head))]
    titles = "".join(
        f"<th scope='col'{' class=figure' * is_figure}"
        f"{' aria-sort=descending' * (each == SUCCESS)}>"
        f"<button title='{escape(about)}'>{escape(each)}</button></th>"
        for (each, about), is_figure in zip(head, figures, strict=True)
    )
    lines = "\n".join(
        f"<tr{f' class={kind}' if kind else ''}>{''.join(map(_cell, cells))}</tr>"
        for kind, cells in rows
    )
    return (
        f"<div class='wide' tabindex='0' role='region' aria-label='{escape(title)}'>"
        f"<table id='{name}'>\n<thead><tr>{titles}</tr></thead>\n"
        f"<tbody>\n{lines}\n</tbody></table></div>"
    )


def _cell(cell: Cell) -> str:
    more = f"<small>{escape(cell.more)}</small>" if cell.more else ""
    if cell.value is None:
        return f"<td><b>{escape(cell.text)}</b>{more}</td>"
    return f"<td class='figure' data-value='{cell.value!r}'>{escape(cell.text)}{more}</td>"


def _refused(checked: Checked) -> str:
    told = [str(each) for each in checked.problems[:_MOST_PROBLEMS]]
    more = len(checked.problems) - len(told)
    told += [f"and {more} more"] * bool(more)
    return f"<li><b>{escape(checked.path.name)}</b>: {escape('; '.join(told))}</li>"


_ABOUT = (
    "Each row is a submission, a file that holds every step of a run. Its results were computed "
    "anew from these, and its actions were done again on the engine where the last column says so. "
    "Rows in <i>italics</i> are references, such as the oracle, which knows the answers: they show "
    "what a figure is worth, and compete with none. Click on a column to sort by it; a table "
    "scrolls to the side. Columns that no row of a table fills are left out. The rules are in "
    "docs/leaderboard.md."
)
_INSTANCES = {
    "explore": "The environment does not look at the task to choose which object a word such as "
    "<i>Cabinet</i> means: the agent has to find the right one.",
    "target": "The environment looks at the task to choose which object a word such as "
    "<i>Cabinet</i> means, which helps much: do not compare these rows with those of "
    "<i>explore</i>.",
}
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
td:first-child, th:first-child { position: sticky; left: 0; background: Canvas; min-width: 15rem;
  max-width: 19rem; white-space: normal; }
td b { font-weight: inherit; }
td:first-child b { font-weight: 600; overflow-wrap: anywhere; }
td small { display: block; opacity: .8; }
.reference { font-style: italic; }
dl { columns: 24rem; }
dt { font-weight: 600; break-after: avoid; }
dd { margin: 0 0 .4rem 1rem; break-inside: avoid; }
details { margin-top: 1.5rem; }
@media (max-width: 40rem) {
  td:first-child, th:first-child { min-width: 7rem; max-width: 8rem; }
  td:first-child small { display: none; }
}
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
    const rows = [...table.tBodies[0].rows];
    const value = row => row.cells[column].dataset.value;
    const figures = rows.some(row => value(row) !== undefined);
    const now = head.getAttribute("aria-sort");
    const sign = (now ? now === "descending" : !figures) ? 1 : -1;
    const absent = row => row.cells[column].textContent === "-";  // always last
    const order = figures
      ? (a, b) => value(a) - value(b)
      : (a, b) => a.cells[column].textContent.localeCompare(b.cells[column].textContent);
    rows.sort((a, b) => absent(a) - absent(b) || (absent(a) ? 0 : sign * order(a, b)));
    heads.forEach(each => each.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
    table.tBodies[0].append(...rows);
  }));
}
"""
