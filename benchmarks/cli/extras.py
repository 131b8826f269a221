"""The requirements of er-gym's extras, and those that this Python lacks.

They are read from the package's own metadata, so there is no second list to maintain. Requirements
of requirements are checked too: pip can leave a package installed whose own requirements are no
longer met.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, metadata, packages_distributions, version
from importlib.metadata import requires as requirements_in_metadata

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = "er-gym"

Requires = Callable[[str], Iterable[str]]
"""From a distribution's name to its requirements, as ``Requires-Dist`` words them; nothing for
what is not installed."""


@cache  # every extra asks again, and metadata is slow to read
def installed_requires(name: str) -> list[str]:
    """The requirements of an installed distribution; none where it is not installed."""
    try:
        return requirements_in_metadata(name) or []
    except PackageNotFoundError:
        return []


def extras() -> list[str]:
    """All extras of er-gym, in the order in which pyproject.toml has them.

    Raises:
        PackageNotFoundError: er-gym itself is not installed.
    """
    return metadata(PROJECT).get_all("Provides-Extra") or []


@dataclass(frozen=True)
class ExtraState:
    """How far an extra is installed.

    Attributes:
        name: the extra.
        packages: what is installed of the packages that er-gym names for it, with versions.
        missing: what is not installed.
        wrong: sentences about packages whose version another package does not accept.
        unsupported: what this Python or machine cannot have, with the condition.
    """

    name: str
    packages: tuple[str, ...]
    missing: tuple[str, ...]
    wrong: tuple[str, ...]
    unsupported: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether the extra can be used in full."""
        return not (self.missing or self.wrong or self.unsupported)


def state_of(extra: str, requires: Requires = installed_requires) -> ExtraState:
    """How far an extra is installed in this Python."""
    packages: dict[str, str] = {}
    missing: dict[str, str] = {}
    wrong: dict[str, str] = {}
    for wanted_by, requirement in closure(extra, requires):
        name = canonicalize_name(requirement.name)
        if name == PROJECT:
            continue  # another of its extras, whose requirements follow
        found = installed_version(name)
        if wanted_by.startswith(PROJECT) and found is not None:
            packages[name] = f"{requirement.name} {found}"
        if found is None:
            missing.setdefault(name, requirement.name)
        elif not requirement.specifier.contains(found, prereleases=True):
            wrong.setdefault(
                name, f"{name} is {found}, but {wanted_by} wants {requirement.specifier}"
            )
    return ExtraState(
        extra,
        tuple(packages.values()),
        tuple(missing.values()),
        tuple(wrong.values()),
        tuple(_unsupported(extra, requires)),
    )


def closure(
    extra: str, requires: Requires = installed_requires
) -> Iterator[tuple[str, Requirement]]:
    """All that an extra of er-gym requires on this machine, and who requires it.

    Args:
        extra: its name.
        requires: of any distribution, er-gym included.

    Yields:
        Pairs (who requires, the requirement). Who requires is a distribution's name or, for what
        er-gym itself requires, ``er-gym[extra]``. What er-gym requires without any extra is left
        out: without that, this code would not run.
    """
    queue = deque([(PROJECT, extra)])
    done: set[tuple[str, str]] = set()
    while queue:
        name, of = queue.popleft()
        if (name, of) in done:
            continue
        done.add((name, of))
        wanted_by = f"{PROJECT}[{of}]" if name == PROJECT else name
        for requirement in map(_parsed, requires(name)):
            if _applies(requirement, of, with_core=name != PROJECT):
                yield wanted_by, requirement
                required = canonicalize_name(requirement.name)
                queue.extend((required, each) for each in requirement.extras or {""})


def _applies(requirement: Requirement, extra: str, *, with_core: bool) -> bool:
    """Whether a distribution requires this on this machine, installed with the extra ("": none).

    Args:
        requirement: one of the distribution's.
        extra: one of its extras.
        with_core: what it requires without any extra counts too.
    """
    if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
        return with_core
    return requirement.marker.evaluate({"extra": extra})


def _unsupported(extra: str, requires: Requires) -> Iterator[str]:
    """What the extra names for newer Pythons or other machines than this.

    What it names for older Pythons is left out: it stands in there for what this Python has itself.
    """
    own = {extra}
    for _, requirement in closure(extra, requires):
        if canonicalize_name(requirement.name) == PROJECT:
            own |= requirement.extras
    for requirement in map(_parsed, requires(PROJECT)):
        marker = requirement.marker
        if marker is None:
            continue
        for each in sorted(own):
            older = {"extra": each, "python_version": "3.0", "python_full_version": "3.0.0"}
            for_it = f'extra == "{each}"' in str(marker)
            if for_it and not marker.evaluate({"extra": each}) and not marker.evaluate(older):
                yield f"{requirement.name} (for {str(marker).partition(' and extra == ')[0]})"
                break


_parsed = cache(Requirement)  # every extra has requirements of others


@cache
def installed_version(name: str) -> str | None:
    """The version of an installed distribution; None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def claimants(package: str) -> list[str]:
    """The distributions besides er-gym that install a top-level package of this name."""
    names = {canonicalize_name(each) for each in _distributions().get(package, ())}
    return sorted(names - {PROJECT})


_distributions = cache(packages_distributions)  # reads what every distribution has installed
