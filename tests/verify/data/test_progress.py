"""Progress of a part, told as progress of the whole."""

import pytest

from verify.data.progress import part_of, silent


def test_a_part_is_told_as_its_share_of_the_whole() -> None:
    told: list[tuple[str, float]] = []
    part = part_of(lambda sentence, share: told.append((sentence, share)), 0.2, 0.6)
    for share in (0.0, 0.5, 1.0):
        part("half done", share)
    assert told == [("half done", pytest.approx(share)) for share in (0.2, 0.4, 0.6)]


def test_where_nobody_listens_nobody_is_told() -> None:
    assert part_of(None, 0.0, 1.0) is silent
