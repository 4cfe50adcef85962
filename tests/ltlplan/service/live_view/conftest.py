"""A flight that a service sees, by a name of its own."""

from __future__ import annotations

import uuid
from collections.abc import Iterator

import pytest

from tests.helpers.live.live_feeds import FedFlight, fed, watching
from tests.helpers.serving.services import Served


@pytest.fixture
def name() -> str:
    return f"lab-{uuid.uuid4().hex[:12]}"


@pytest.fixture
def flying(served: Served, name: str) -> Iterator[FedFlight]:
    with fed(f"{served.url}/live/{name}") as flight:
        with watching(served.url, name) as viewer:
            viewer.frame(lambda frame: bool(frame["robots"]))
        yield flight
