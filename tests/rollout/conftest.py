"""The workers of these tests are spawned, as those of users are."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from forked import SPAWNED


# For pytest a folder without an __init__.py is no package: "package" would be the whole session.
@pytest.fixture(scope="module", autouse=True)
def spawned() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("er_gym.rollout.processes.CONTEXT", SPAWNED)
        yield
