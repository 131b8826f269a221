"""The table of plugs, and which of them can be used in this Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from packaging.requirements import Requirement


@dataclass(frozen=True)
class Plug:
    """A program or a protocol that er-gym can be used with.

    Attributes:
        name: ``"openenv"``.
        title: as its makers write it.
        module: the file that connects it.
        requires: the distributions that it imports, as pip takes them.
        tried: the distribution and version that the conformance test has run with.
        extra: the extra of er-gym that brings them; ``""`` if they do not install beside er-gym's.
        apart: in that case, why not, and what to do.
        page: its page of documentation.
    """

    name: str
    title: str
    module: str
    requires: tuple[str, ...]
    tried: str
    page: str
    extra: str = ""
    apart: str = ""

    @property
    def install(self) -> str:
        """How to get what is missing, in words."""
        return (
            f"pip install 'er-gym[{self.extra}]'" if self.extra else f"{self.apart} ({self.page})"
        )


PLUGS: tuple[Plug, ...] = (
    Plug(
        name="mcp",
        title="Model Context Protocol",
        module="er_gym.integrations.mcp",
        requires=("mcp>=2.3", "mcp-types>=2.3", "uvicorn>=0.35"),
        tried="mcp 2.3.0",
        page="docs/integrations/mcp.md",
        extra="mcp",
    ),
    Plug(
        name="openenv",
        title="OpenEnv",
        module="er_gym.integrations.openenv",
        requires=("fastapi>=0.120", "openenv-core>=0.3", "uvicorn>=0.35"),
        tried="openenv-core 0.3.0",
        page="docs/integrations/openenv.md",
        extra="openenv",
    ),
)
"""Every plug, in alphabetical order."""


def lacks(plug: Plug) -> Iterator[str]:
    """What keeps a plug from being used in this Python, in words; nothing if it can be used.

    Only what is installed is looked up; no library is imported.
    """
    for requirement in map(Requirement, plug.requires):
        if requirement.marker is not None and not requirement.marker.evaluate():
            yield f"this Python cannot have {requirement.name} (for {requirement.marker})"
            continue
        try:
            found = version(requirement.name)
        except PackageNotFoundError:
            yield f"{requirement.name} missing"
            continue
        if not requirement.specifier.contains(found, prereleases=True):
            yield f"{requirement.name} is {found}, wanted is {requirement.specifier}"


def installed(plug: Plug) -> str:
    """The installed distributions that a plug requires, with their versions."""
    names = [Requirement(each).name for each in plug.requires]
    return ", ".join(f"{name} {version(name)}" for name in names)
