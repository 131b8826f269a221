"""What hatch asks when it builds er-gym: the README as it reads away from its repository.

An index of packages shows the README without the files beside it. Links into the repository become
absolute once ``address`` in pyproject.toml says where that is. Until then they become plain text,
and pictures go, so that no link leads nowhere.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?P<target>[^)\s:]+)\)")
"""A link or picture within the repository: an address elsewhere has a colon."""


def readable_anywhere(readme: str, address: str, version: str) -> str:
    """The README for a reader who has no file beside it.

    Args:
        readme: Markdown.
        address: of the repository, such as ``https://example.org/er-gym``; "" if it has none.
        version: whose files are meant; its tag is ``v`` and the version.
    """

    def link(found: re.Match[str]) -> str:
        if not address:
            return "" if found["picture"] else found["text"]
        kind = "raw" if found["picture"] else "blob"
        place = f"{address}/{kind}/v{version}/{found['target']}"
        return f"{found['picture']}[{found['text']}]({place})"

    return _LINK.sub(link, readme)


class Readme(MetadataHookInterface):
    """Hatch's hook for what pyproject.toml calls dynamic."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the README and, with an address, the project's URLs."""
        address = str(self.config["address"]).rstrip("/")
        told = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        text = readable_anywhere(told, address, metadata["version"])
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
        if address:
            metadata["urls"] = {
                "Source": address,
                "Issues": f"{address}/issues",
                "Changelog": f"{address}/blob/v{metadata['version']}/CHANGELOG.md",
            }
