"""Entries of the gallery, in their order."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count


@dataclass(frozen=True, slots=True)
class Entry:
    """One page of the gallery.

    Attributes:
        name: Of its page, and of its mission's file where it has one of its own.
        group: Under which it is listed.
        question: What it answers, in one sentence.
        commands: What is typed, without `ltlplan`; the last one makes the page and the figures.
        page: The page that is made, in the folder of the entry.
        expected: Exit code of the last command.
        source: Where the mission is from, if it is no invention of ours.
    """

    name: str
    group: str
    question: str
    commands: tuple[str, ...]
    page: str = "run/report.html"
    expected: int = 0
    source: str = ""


def _run(name: str, group: str, question: str, mission: str = "", more: str = "", source: str = "") -> Entry:
    """Return an entry of a run: of a shipped mission, or of `gallery/missions/NAME.yaml`."""
    return Entry(name, group, question, (f"run {mission or f'{name}.yaml'} --out run{more and f' {more}'}",), source=source)


HOOPS = "Banks, Slovak, Coogan, Egerstedt, IROS 2019"
FIRE = "Banks, Coogan, Egerstedt, 2022"
SUN = "Sun, Chen, Mitra, Fan, IEEE RA-L 2022"
PAPERS, PUBLISHED, SHAPES, TEAMS = "The papers' scenarios", "Published problems", "Worlds", "Teams"
FLIGHT, JUDGED = "In flight", "Answers that are no"

ENTRIES = (
    _run("hoops-sequence", PAPERS, "How does a quadcopter fly four given hoops in a row?", "hoops-sequence", source=f"{HOOPS}, Scenario 4.1"),
    _run("hoops-published", PAPERS, "Does the published run keep the published formula?", "hoops-published", source=f"{HOOPS}, Scenario 4.2"),
    _run("hoops-ltl", PAPERS, "How does one patrol hoop0 for ever, each time hoop2 before hoop1?", "hoops-ltl", source=f"{HOOPS}, Scenario 4.2"),
    _run("firefighting", PAPERS, "Who fetches water, and who visits which site, if smoke is never entered without water?", "firefighting",
         source=f"{FIRE}, Section 7"),
    _run("wall-swap", PUBLISHED, "How do four robots change places through a gap of one metre, all at one height?", "wall-swap", source=SUN),
    _run("door-puzzle", PUBLISHED, "In which order are five keys fetched for the five doors on the way?", "door-puzzle", source=SUN),
    _run("wall-2", PUBLISHED, "Can the four change places within 6 s?", "wall-2", source=SUN),
    _run("doorpuzzle-1", PUBLISHED, "Can the doors be passed within 30 s?", "doorpuzzle-1", source=SUN),
    _run("rover-2", PUBLISHED, "Can two rovers observe and transmit in their windows?", "rover-2", source=SUN),
    _run("stlcg-1", PUBLISHED, "Can one be in b2 for 5 s, and in b3 for 5 s, all within 15 s?", "stlcg-1", source=f"{SUN}, after Leung et al. 2019"),
    _run("shapes", SHAPES, "Which shapes may a region have?"),
    _run("room-with-a-window", SHAPES, "How do two robots get through a wall with one window?"),
    _run("window-inspection", SHAPES, "How are four windows looked at from outside, around a house and a no-fly zone?", "window-inspection"),
    _run("watched-gate", TEAMS, "Can the gate be passed only while two others watch?"),
    _run("meeting", TEAMS, "Two of three meet beyond a gate for one: who waits for whom?", "meeting"),
    _run("mixed-fleet", TEAMS, "Who carries the parcel, and who reads the meter?"),
    _run("office", TEAMS, "Who looks into which room, and who brings the letters?", "office"),
    _run("warehouse", TEAMS, "How do six robots of two kinds pick up and put down among twenty shelves?", "warehouse"),
    Entry("robot-lost-hoop-moved", FLIGHT, "What happens if a robot fails and a hoop moves while all fly?",
          ("online firefighting --certified --event '1 quad2 fails' --event '2.8 loc2 moves -0.5,0.3,1.1' --out run",)),
    Entry("campaign", FLIGHT, "How far do robots stray in wind, over a hundred flights?",
          ("run firefighting --out run", "campaign run --runs 100 --wind 0.3+0.1 --out many"), "many/campaign.html"),
    _run("proved-inspection", FLIGHT, "How near to their plans are two robots proved to stay in light air?", "proved-inspection"),
    Entry("recording", FLIGHT, "Did the robots that were recorded do what was proved?",
          ("run room-with-a-window.yaml --out run", "fly run --link simulated --out flown",
           "certify run --flight flown/live.csv --start 0 --max-speed 1.5 --report judged.html"), "judged.html"),
    Entry("show-of-100", FLIGHT, "Are a hundred drones of a show apart at all times?", ("show", "audit show --separation 0.5 --speed 2.5 --report show.html"), "show.html"),
    Entry("show-that-collides", JUDGED, "Where do two drones of a show come too near, though samplers see nothing?",
          ("show-with-divers", "audit show --separation 0.5 --speed 2.5 --report show.html"), "show.html", expected=5),
    Entry("no-plan", JUDGED, "Why can nobody reach the plant?", ("plan room-with-a-window.yaml --formula 'F plant & G !window'",), "", expected=3),
)  # fmt: skip
"""All of them. `show` and `show-with-divers` are commands of the gallery's own: they write a show's files (`shows`)."""

NUMBERS = {entry.name: f"{number:02}" for number, entry in zip(count(1), ENTRIES, strict=False)}
"""Two digits each, by their names."""
