"""Assertions about flights that hold for all times, for other people's tests, and what hypothesis draws from.

Import from here, or load the module as a pytest plugin (`-p verify.testing`, or `pytest_plugins = ["verify.testing"]`), which
says in the header of a run what the assertions rest on. A failure prints the sentence, the counterexample and the label timeline.
The strategies need hypothesis (`pip install 'ltlplan[hypothesis]'`); nothing of it is loaded before one of them is asked for.

`assertions` are what tests call; `drawn_words` and `drawn_missions` are the strategies, over `engine`, the adapter to hypothesis.
Examples are in docs/testing.md.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use
from verify.testing.assertions import Regions, Samples, assert_satisfies, assert_within_limits

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from verify.testing.drawn_missions import missions, plans
    from verify.testing.drawn_words import formulas, lassos, letters, soft_parts, team_words, words

__all__ = [
    "Regions",
    "Samples",
    "assert_satisfies",
    "assert_within_limits",
    "formulas",
    "lassos",
    "letters",
    "missions",
    "plans",
    "soft_parts",
    "team_words",
    "words",
]

if not TYPE_CHECKING:  # no `__dir__`: pytest looks at all names of a plugin, and would load what nobody has asked for
    __getattr__, _ = loaded_at_first_use(
        __name__,
        {
            "verify.testing.drawn_missions": ("missions", "plans"),
            "verify.testing.drawn_words": ("formulas", "lassos", "letters", "soft_parts", "team_words", "words"),
        },
    )


def pytest_report_header() -> str:
    """Say in the header of a test run what the assertions rest on."""
    return "verify: flights are judged for all times; sampled paths need a speed bound"
