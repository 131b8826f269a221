"""The workers of these tests are spawned, as those of users are."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from forked import SPAWNED


@pytest.fixture(scope="package", autouse=True)
def spawned() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("er_gym.rollout.processes.CONTEXT", SPAWNED)
        yield
