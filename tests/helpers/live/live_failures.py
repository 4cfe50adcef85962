"""What fails in live flights over the simulated link, and what is asked of a flight's end and record then."""

from __future__ import annotations

import json
from collections import deque

from flight.link.live_executive import LiveFlight
from flight.link.simulated import Faults, SimulatedLink

KINDS = ("unseen", "pushed", "flat", "deaf", "lost", "both")


def fault(kind: str, robot: str, when: float, others: tuple[str, ...] = ()) -> Faults:
    """One robot fails, or the link; `both` is one robot that is not seen and others that hear nothing."""
    return {
        "unseen": Faults(unseen={robot: when}),
        "pushed": Faults(pushed={robot: (when, 0.07)}),
        "flat": Faults(flat={robot: when}),
        "deaf": Faults(deaf={robot: when}),
        "lost": Faults(lost=when),
        "both": Faults(unseen={robot: when}, deaf=dict.fromkeys(others, when)),
    }[kind]


def on_the_ground(link: SimulatedLink, seconds: float = 30.0) -> bool:
    """Whether all come to stand still with motors off, on their own where nobody could tell them."""
    end = link.now() + seconds
    while link.spinning and link.now() < end:
        link.sleep(0.5)
    return not link.spinning


def disturb(link: SimulatedLink, kind: str, robot: str, when: float, lasts: float) -> None:
    """Have something fail: a robot, the link, or the host (it hangs, is interrupted, or is in error)."""
    if kind in KINDS:
        link.faults = fault(kind, robot, when, tuple(name for name in link.robots if name != robot))
        return
    slept = link.sleep

    def sleep(seconds: float) -> None:
        if link.now() < when:
            slept(seconds)
            return
        link.sleep = slept
        if kind != "hangs":
            raise {"interrupted": KeyboardInterrupt, "error": ZeroDivisionError}[kind]("somebody stopped it")
        link.faults.lost = link.now()  # nobody hears of a host that hangs
        slept(lasts)
        link.faults.lost = None

    link.sleep = sleep


def require_whole_logs(done: LiveFlight, stages: tuple[str, ...] = ("climb", "way", "flight", "landing")) -> None:
    """Hold what is kept of a flight to itself: readable, in order of time, and with all that its answer says."""
    files = done.record.files()
    data = json.loads(files["live.json"])
    assert list(data["starts"]) == [name for name in stages if name in data["starts"]]
    assert set(data["ends"]) >= set(list(data["starts"])[:-1]), "a stage began only where the one before had ended"
    for name in ("poses.csv", "setpoints.csv"):
        head, *rows = files[name].splitlines()
        times = [float(row.split(",")[0]) for row in rows]
        assert head == "t,robot,x,y,z"
        assert all(len(row.split(",")) == 5 for row in rows)
        assert times == sorted(times)
        assert len({(row.split(",")[0], row.split(",")[1]) for row in rows}) == len(rows), (
            "at most one row of each robot at a time"
        )
    sentences = [event["sentence"] for event in data["events"]]
    refused = [check.sentence for check in done.checks if not check.passed]
    assert not done.reason or done.reason in sentences or (refused and set(refused) <= set(sentences))
    assert all(any(s.startswith(f"{robot} has not acknowledged") for s in sentences) for robot in done.unsafe)


class Remembers(SimulatedLink):
    """Simulated robots of which is known how they were when their motors were told to stop.

    Attributes:
        stops: Height in m, and by how much it had changed in the half second before, when each was told so first.
    """

    def __init__(self, *given, **named) -> None:
        super().__init__(*given, **named)
        self.stops: dict[str, tuple[float, float]] = {}
        self._heights: dict[str, deque[float]] = {name: deque(maxlen=25) for name in self.robots}

    def sleep(self, seconds: float) -> None:
        """Fly on, and remember heights 50 times a second."""
        for _ in range(max(1, round(seconds / 0.02))):
            super().sleep(min(seconds, 0.02))
            for name, heights in self._heights.items():
                if (pose := self.pose(name)) is not None:
                    heights.append(pose.position[2])

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors."""
        if robot in self.spinning:
            heights = self._heights[robot]
            self.stops.setdefault(robot, (heights[-1], max(heights) - min(heights)))
        return super().stop(robot)
