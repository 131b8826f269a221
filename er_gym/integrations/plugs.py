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
        name="minari",
        title="Minari",
        module="er_gym.integrations.minari",
        requires=(
            "h5py>=3.8; python_version >= '3.11'",
            "minari>=0.5.3; python_version >= '3.11'",
        ),
        tried="minari 0.5.4",
        page="docs/integrations/minari.md",
        extra="minari",
    ),
    Plug(
        name="ms-swift",
        title="ms-swift",
        module="er_gym.integrations.ms_swift",
        requires=("ms-swift>=4.6",),
        tried="ms-swift 4.6.0",
        page="docs/integrations/ms-swift.md",
        extra="ms-swift",
    ),
    Plug(
        name="nemo-gym",
        title="NeMo Gym",
        module="er_gym.integrations.nemo_gym",
        requires=("nemo-gym>=0.4; python_version >= '3.12'",),
        tried="nemo-gym 0.4.0",
        page="docs/integrations/nemo-gym.md",
        extra="nemo-gym",
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
    Plug(
        name="rllib",
        title="Ray RLlib",
        module="er_gym.integrations.rllib",
        requires=("ray[rllib]>=2.50",),
        tried="ray 2.60.0",
        page="docs/integrations/rllib.md",
        extra="rllib",
    ),
    Plug(
        name="skyrl-gym",
        title="SkyRL-gym",
        module="er_gym.integrations.skyrl_gym",
        requires=("skyrl-gym>=0.4",),
        tried="skyrl-gym 0.4.0",
        page="docs/integrations/skyrl-gym.md",
        extra="skyrl-gym",
    ),
    Plug(
        name="trl",
        title="TRL",
        module="er_gym.integrations.trl",
        requires=("jinja2>=3.1", "torch>=2.4", "trl>=1.16"),
        tried="trl 1.16.0",
        page="docs/integrations/trl.md",
        extra="trl",
    ),
    Plug(
        name="vagen",
        title="VAGEN",
        module="er_gym.integrations.vagen",
        requires=(),
        tried="",
        page="docs/integrations/vagen.md",
        apart="it is not on PyPI: install er-gym into its environment",
    ),
    Plug(
        name="verifiers",
        title="verifiers",
        module="er_gym.integrations.verifiers",
        requires=("verifiers>=0.4; python_version >= '3.11'",),
        tried="verifiers 0.4.0",
        page="docs/integrations/verifiers.md",
        extra="verifiers",
    ),
    Plug(
        name="verl",
        title="verl",
        module="er_gym.integrations.verl",
        requires=("verl[verl-core]>=0.9; python_version < '3.13'",),
        tried="verl 0.9.1",
        page="docs/integrations/verl.md",
        extra="verl",
    ),
    Plug(
        name="verl-agent",
        title="verl-agent",
        module="er_gym.integrations.verl_agent",
        requires=(),
        tried="",
        page="docs/integrations/verl-agent.md",
        apart="it is not on PyPI: install er-gym into its environment",
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
