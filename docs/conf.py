"""The documentation site. ``make docs`` builds it in build/docs, offline and without a warning.

The pages are those of docs/, which read as well by themselves; the first one is the README. Links
that lead out of docs/ are mended here: a file of the repository becomes a download.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from er_gym import __version__

ROOT = Path(__file__).resolve().parents[1]

project = "er-gym"
author = "the authors of er-gym"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["_*"]
nitpicky = False

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
suppress_warnings = [
    "misc.highlighting_failure",  # what a page shows need not be whole programs
    "ref.python",  # fields of the same name, which docstrings name without their class
]

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"er-gym {__version__}"
html_static_path: list[str] = []
html_copy_source = False
html_show_sphinx = False

_LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s:]+?)(#[^)\s]*)?\)")
"""A link or picture within the repository: what stands before its target, the target, its place."""


def _mended(text: str, folder: Path) -> str:
    """A page's text with links that the site can follow.

    Args:
        text: Markdown.
        folder: against which its links are read.
    """

    def link(found: re.Match[str]) -> str:
        start, target, place = found[1], found[2], found[3] or ""
        file = (folder / target).resolve()
        if not target or not file.exists():
            return found[0]
        if file.is_relative_to(ROOT / "docs"):
            inside = file.relative_to(ROOT / "docs")
            return f"{start}/{inside}{place})" if folder == ROOT else found[0]
        if file.is_dir():
            return f"{start[1:-2]} (`{file.relative_to(ROOT)}`)"
        page = {"CHANGELOG.md": "changelog", "CONTRIBUTING.md": "contributing"}.get(file.name)
        if file.parent == ROOT and page:
            return f"{start}/{page}.md{place})"
        return f"{start}path:/../{file.relative_to(ROOT)})"

    return _LINK.sub(link, text)


_INCLUDED = {"index": "README.md", "changelog": "CHANGELOG.md", "contributing": "CONTRIBUTING.md"}
"""Pages that stand in the root of the repository."""


def _read(app: Any, page: str, content: list[str]) -> None:
    """Put a file of the root before what its page says, and mend links."""
    if page in _INCLUDED:
        text = (ROOT / _INCLUDED[page]).read_text("utf-8")
        content[0] = _mended(text, ROOT) + "\n" + content[0]
    else:
        content[0] = _mended(content[0], Path(app.env.doc2path(page)).parent)


def _headings(
    app: Any, kind: str, name: str, found: object, options: Any, lines: list[str]
) -> None:
    """Show the Markdown headings of a docstring in Gymnasium's manner as such."""
    lines[:] = [
        f".. rubric:: {line.removeprefix('## ')}\n" if line.startswith("## ") else line
        for line in lines
    ]
    lines[:] = "\n".join(lines).split("\n")


def setup(app: Any) -> None:
    """Sphinx calls this."""
    app.connect("source-read", _read)
    app.connect("autodoc-process-docstring", _headings)
