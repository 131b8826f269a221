from __future__ import annotations

import pytest
from conformance import Course, all_courses


@pytest.fixture(scope="session")
def courses() -> tuple[Course, ...]:
    return all_courses()
