"""People of a folder of their own, whose passwords cost nothing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from ltlplan.service.people import passwords
from ltlplan.service.people.people import People
from ltlplan.service.security.tokens import Tokens


@pytest.fixture(autouse=True)
def _cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    from argon2 import PasswordHasher

    cheap = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr(passwords, "hasher", lambda: cheap)


@pytest.fixture
def people(tmp_path: Path) -> Iterator[People]:
    """Yield the people of a new folder."""
    made = People(Tokens(tmp_path))
    made.references.load()
    yield made
    made.close()
