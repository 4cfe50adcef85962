"""Messages between a flight in the air and the service, over one socket: frames and pictures come, orders to stop go.

A flight sends a frame ten times a second: the newest there is, never one from a queue. It sends what a picture is made of when it begins to fly something
else. Each frame carries the flight's own clock. An order to stop carries the clock of the last frame back, so that the flight can tell how old the order
is at most, whatever either machine takes for the time of day.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ltlplan.service.event_inbox.names import FLIGHT
from ltlplan.service.models import StopLevel, Told

MOST_FRAME = 200_000
"""Letters of a frame."""
MOST_ROBOTS = 500
FRESH = 2.0
"""s after which an order to stop is not heeded any more."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Place = tuple[Number, Number, Number]
Name = Annotated[str, Field(max_length=200)]
Sentence = Annotated[str, Field(max_length=2000)]
Outcome = Literal["taken", "expired", "refused"]


class RobotFrame(Told):
    """A robot as the flight sees it.

    Attributes:
        at: Where it was measured last, m in the mission's frame; None before it was.
        yaw: Its heading, rad.
        age: s between its pose and the observation.
        off: Its distance from its plan, m; None where it flies none that is watched.
        left: Margin that is left: the margin, less that distance and what the measurement may be off, m.
        battery: s that its battery lasts.
        fault: What blocks it, in words; empty where nothing does.
        acknowledged: The highest command of the flight's end that it has acknowledged.
    """

    at: Place | None = None
    yaw: Number | None = None
    age: Number | None = None
    off: Number | None = None
    left: Number | None = None
    battery: Number | None = None
    fault: Sentence = ""
    acknowledged: Literal["hold", "land", "stop"] | None = None


class Said(Told):
    """Something that the flight said: s of its clock, of which robot, what kind, and the sentence."""

    time: Number
    robot: Name | None = None
    kind: Name = "note"
    sentence: Sentence


class OrderOutcome(Told):
    """Outcome of an order to stop, as the flight says it."""

    order: Annotated[str, Field(max_length=40)]
    outcome: Outcome
    sentence: Sentence = ""


class Frame(Told):
    """A flight at an instant.

    Attributes:
        number: Grows from frame to frame of one connection.
        sent: The flight's own clock when it was sent, s.
        time: The link's clock when it was observed, s.
        stale: s between the two.
        stage: What is flown, in words.
        into: s into it.
        lasts: s that it lasts.
        margin: m.
        picture: Number of the picture that shows what is flown; 0 before there is one.
        begun: s since what the picture shows began.
        robots: By name.
        parts: The formula's parts, each with its state.
        said: What was said since the last frame.
        ending: Whether the flight ends: all hold or land.
        ordered: The highest level of a stop that was ordered; None before any.
        over: Whether it is over.
        orders: What became of the last orders to stop.
        hears: Whether it takes events.
    """

    number: int
    sent: Number
    time: Number | None = None
    stale: Number = 0.0
    stage: Name = ""
    into: Number = 0.0
    lasts: Number = 0.0
    margin: Number = 0.0
    picture: int = 0
    begun: Number = 0.0
    robots: Annotated[dict[Name, RobotFrame], Field(default_factory=dict, max_length=MOST_ROBOTS)]
    parts: Annotated[tuple[tuple[Annotated[str, Field(max_length=10_000)], Name], ...], Field(max_length=500)] = ()
    said: Annotated[tuple[Said, ...], Field(max_length=200)] = ()
    ending: bool = False
    ordered: StopLevel | None = None
    over: bool = False
    orders: Annotated[tuple[OrderOutcome, ...], Field(max_length=20)] = ()
    hears: bool = True


class Track(Told):
    """Trajectory of a robot, sampled evenly: s between two places, and the places, m."""

    step: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    points: Annotated[tuple[Place, ...], Field(min_length=1, max_length=20_000)]


class Shown(Told):
    """Sources of a picture.

    Attributes:
        number: Grows from picture to picture of one connection.
        mission: The mission as it is now, as a file.
        margin: m.
        tracks: What each robot flies.
    """

    number: int
    mission: Annotated[str, Field(max_length=1_000_000)]
    margin: Number = 0.0
    tracks: Annotated[dict[Name, Track], Field(default_factory=dict, max_length=MOST_ROBOTS)]


class Sent(Told):
    """A message of a flight: one of its two kinds."""

    frame: Frame | None = None
    shown: Shown | None = None


class StopOrder(Told):
    """An order to stop, as it goes to the flight.

    Attributes:
        order: Names it.
        flight: The flight's own name for itself.
        level: `hold`: all hold where they can stop, for as long as that can last. `land`: all land. `motors`: all motors stop.
        who: Who orders it.
        after: The flight's clock in the last frame that the service had then, s.
        since: s since that frame came.
    """

    order: Annotated[str, Field(max_length=40)]
    flight: Annotated[str, Field(pattern=FLIGHT)]
    level: StopLevel
    who: Name
    after: Number
    since: Annotated[float, Field(ge=0, allow_inf_nan=False)]
