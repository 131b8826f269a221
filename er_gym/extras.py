"""How an error names a package that is not installed, and the extra of er-gym that brings it."""

from __future__ import annotations


def is_own(error: ImportError) -> bool:
    """Whether a module of er-gym's own cannot be imported: no package that could be installed."""
    return (error.name or "").partition(".")[0] in ("er_gym", "agents", "benchmarks")


class MissingPackage(ValueError):
    """A part of er-gym needs a package that is not installed; the message says what to install.

    Attributes:
        package: the first that is missing.

    Args:
        what: the part, as the user named it; the subject of the sentence.
        package: see there.
        install: what brings all that this part needs, such as ``er-gym[vlm]``.
    """

    def __init__(self, what: str, package: str, install: str) -> None:
        super().__init__(f"{what} needs {package}, which is not installed: pip install '{install}'")
        self.package = package
