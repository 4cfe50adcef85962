"""Who gives its place where too many wait: the one that has waited longest, of the address that has most."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltlplan.service.api.events import Streams
from ltlplan.service.problems import Busy
from ltlplan.service.security.connections import Waiting
from ltlplan.service.settings import Limits


class _Connection:
    """A connection that notes when it was closed."""

    def __init__(self, address: str) -> None:
        self.address, self.closed, self.transport = address, False, self

    def abort(self) -> None:
        self.closed = True


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.booleans()), max_size=60),
    st.integers(1, 6),
    st.integers(1, 6),
)
def test_nobody_holds_more_than_may_wait_and_the_newest_always_may(
    moves: list[tuple[str, bool]], most: int, most_of_one: int
) -> None:
    waiting = Waiting(most, most_of_one)
    present: list[_Connection] = []
    for address, leaves in moves:
        mine: Any = next((each for each in present if each.address == address), None) if leaves else _Connection(address)
        if mine is None:
            continue
        if leaves:
            waiting.drop(address, mine)
            waiting.drop(address, mine)
            present.remove(mine)
            continue
        waiting.add(address, mine)
        present.append(mine)
        closed = [each for each in present if each.closed]
        assert len(closed) <= 1
        present = [each for each in present if not each.closed]
        assert len(present) <= most
        counts = {each: sum(one.address == each for one in present) for each in "abc"}
        assert max(counts.values()) <= most_of_one
        for gone in closed:
            alike = [each for each in present if each.address == gone.address]
            assert counts[gone.address] + 1 >= max(counts.values()), "it is taken from who has most"
            assert gone is not mine or not alike


def test_one_client_has_only_some_of_the_streams() -> None:
    streams = Streams(Limits(streams=3, streams_of_one=2))
    with streams.counted("alice"), streams.counted("alice"):
        with pytest.raises(Busy, match="2 streams of yours"):
            streams.require_room("alice")
        with streams.counted("bob"), pytest.raises(Busy, match="3 streams are open"):
            streams.require_room("carol")
        streams.require_room("carol")
    streams.require_room("alice")
