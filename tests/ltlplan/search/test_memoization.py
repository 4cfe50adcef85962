"""Answers that objects keep."""

from ltlplan.search.memoization import memoized


class Doubler:
    """Doubles numbers, and counts how often it had to."""

    def __init__(self) -> None:
        self.asked: list[int] = []

    @memoized
    def doubled(self, number: int) -> int:
        """Return twice a number."""
        self.asked.append(number)
        return 2 * number


def test_each_object_works_out_an_answer_once() -> None:
    one, other = Doubler(), Doubler()
    assert [one.doubled(3), one.doubled(3), one.doubled(4), other.doubled(3)] == [6, 6, 8, 6]
    assert (one.asked, other.asked) == ([3, 4], [3])
