"""Bounds in seconds of a team in flight: what can no longer be met, and from when on no way from where robots hover comes in time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from flight.monitoring.timed_state import TimedState
from ltlplan.replanning.timing.plans_in_time import latest_start
from verify.data import Letter, Mission


@dataclass
class Deadlines:
    """State of the conjuncts that are bounded in seconds. It changes as the team flies.

    Attributes:
        state: What was shown of them.
        no_return: Flight time after which robots that hover come too late by straight ways, s; None where that is not known.
    """

    state: TimedState
    no_return: float | None = None
    _news: list[str] = field(default_factory=list[str])
    _lost: bool = False

    @classmethod
    def of(
        cls, mission: Mission, first: Mapping[str, Letter], shown: Iterable[tuple[float, Mapping[str, Letter]]]
    ) -> Deadlines:
        """Return the state after what was shown so far.

        Args:
            mission: What is asked now.
            first: What each robot showed first.
            shown: Every change of a letter: (s, {robot: letter}).
        """
        found, held = cls(TimedState(mission.timed_parts)), dict(first)
        found.see(0.0, held)
        for time, letters in shown:
            held |= letters
            found.see(time, held)
        return found

    def see(self, now: float, held: Mapping[str, Letter], *, hovers: bool = False) -> None:
        """Take note of what is shown, and of what can no longer be met.

        Args:
            now: Flight time, s.
            held: What each robot shows.
            hovers: Whether the team holds its position, with nothing to fly.
        """
        if self._lost:
            return
        if self.state.see(now, held) == "violated":
            self._lost = True
            self._news.append(f"At {now:.2f} s `{self.state.broken}` can no longer be met.")
        elif hovers and self.no_return is not None and now > self.no_return:
            self._lost = True
            self._news.append(f"At {now:.2f} s no way from where the robots hover comes in time any more.")

    def refused(self, left: Mission, begins: float) -> str:
        """Return the point of no return as a sentence, where robots hover without anything to fly; empty where it is not known or lies behind.

        Args:
            left: What is left, from where they hover.
            begins: Flight time from which its bounds count, s.
        """
        room = latest_start(left)
        self.no_return = None if room is None else begins + room
        if self.no_return is None:
            return ""
        return f" Point of no return: {self.no_return:.2f} s, after which no straight way from there comes in time."

    def news(self) -> tuple[str, ...]:
        """Return what is to be told since it was asked last."""
        told, self._news = tuple(self._news), []
        return told

    def satisfied(self, *, ended: bool) -> bool:
        """Return whether all parts are satisfied, as far as was seen: surely, or of a flight that has ended none is broken."""
        return self.state.verdict == "satisfied" or (ended and self.state.verdict == "open" and not self._lost)
