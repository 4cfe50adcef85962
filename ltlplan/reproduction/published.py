"""Published problems and case studies: words, flights and certificates, computed anew.

Formulas are published and free of *next*; maps of the case studies belong to their papers, and places here are ours. So the work is the same
and the ways are not: costs cannot be compared, and times of computing say that a task of this size is no trouble.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from ltlplan.logic.conjunction import conjunct_automaton
from ltlplan.missions import load_mission
from ltlplan.pipeline import certified_team, run
from ltlplan.replanning.checked_plan import plan
from ltlplan.reproduction import published_missions as missions
from ltlplan.reproduction.element import Element, Findings, Quantity, holds
from ltlplan.search.exact import assign
from verify.data import Mission

_BY = ("ltlplan.search.exact.assign", "ltlplan.pipeline.certified_team")
_GRID = 'The grid of 14 by 8 places with a wall and two doors is ours; "until, and then not" is a robot\'s action here.'


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A published case study for a team, with places of ours.

    Attributes:
        id: Of its element, without the publication.
        title: Its name.
        mission: Makes it.
        says: What is asked, in a sentence.
        differs: What differs here, in a sentence.
        time: Computing as published.
        cost: Cost as published.
        flown: Whether a flight is certified, and not only words are planned.
    """

    id: str
    title: str
    mission: Callable[[], Mission]
    says: str
    differs: str
    time: str = ""
    cost: str = ""
    flown: bool = True

    def compute(self) -> Findings:
        """Plan the words, and certify a flight of them."""
        mission = self.mission()
        conjunct_automaton.cache_clear()
        begun = time.process_time()
        words = assign(mission)
        searched = time.process_time() - begun
        unit = "m, the dearer robot" if mission.planner.objective == "longest" else "m"
        rows = [
            Quantity("cost of the words", words.cost, unit, self.cost, 1),
            holds("proved cheapest", words.complete),
            Quantity("computing the words", searched, "s", self.time),
        ]
        if self.flown:
            begun = time.process_time()
            certificate = certified_team(plan(mission)).certificate
            rows += [
                holds("certified for all times", certificate.holds),
                Quantity("flight", certificate.duration, "s", digits=1),
                Quantity("computing from the mission to the certificate", time.process_time() - begun, "s"),
            ]
        return Findings(tuple(rows))


CASES: tuple[Case, ...] = (
    Case(
        id="bai-first", title="Bai, first: two robots, for ever", mission=missions.bai_first, time="225 product states, 10.6 s",
        says="G F f_b & G F f_h & G F f_n & (!(f_m | f_pg | f_n) U e_h), for two robots (bairuofei/sampling_ltl_planning).",
        differs="The until is kept in whatever order the robots are read; laps begin together and are certified with their separation.",
    ),
    Case(
        id="bai-second", title="Bai, second: two robots", mission=missions.bai_second, time="0.41 s by search, 3.7 s by sampling, discrete plan only",
        says="F r_l1 & F r_l2 & F r_l3 & F r_c1 & G(r_begin -> F r_u1) & G !r_z (bairuofei/sampling_ltl_planning).",
        differs="Both robots begin in r_begin and are read in every order, so that both come to r_u1 in the end.",
    ),
    Case(
        id="schillinger-second", title="Schillinger, second: six robots, 112 places", mission=missions.schillinger_second, time="11.5 s", cost="88",
        says="Three documents go to three desks and are not carried through public places (IJRR 2018; figures of Hierarchical-LTL-STAP).",
        differs=_GRID,
    ),
    Case(
        id="schillinger-second-joint", title="Schillinger, second, under `joint` with counts", mission=missions.schillinger_second_together,
        time="11.5 s", cost="88", says="The same for a team that is read at once.", differs=f"Asked with `some` and `all`. {_GRID}",
    ),
    Case(
        id="schillinger-third", title="Schillinger, third: six robots, 112 places", mission=missions.schillinger_third, time="21.1 s", cost="98",
        says="Photos in three rooms with the camera off elsewhere, a document, and a guest who is shown to a room (IJRR 2018).",
        differs=_GRID,
    ),
    Case(
        id="schillinger-third-joint", title="Schillinger, third, under `joint`, with a robot that is named", mission=missions.schillinger_third_together,
        time="21.1 s", cost="98", says="The same for a team that is read at once, the guest led by quad5.",
        differs=f"quad5 flies everything, as no other robot is near a place that is left. {_GRID}",
    ),
    Case(
        id="bosch", title="Bosch: Schillinger's second to the letter", mission=missions.bosch,
        says="F(p & carry & (carry U (d10 & !carry))), the same for d7 and d5, and G(carry -> !public), for six robots (Schillinger, Buerger, of Bosch, and Dimarogonas).",
        differs="A hall of ours with four places; read at once (`team: joint`), as an idle robot's letter would break the until in some order.",
    ),
    Case(
        id="lomap-fifth", title="LOMAP, fifth: a patrol of two, for ever", mission=missions.lomap_fifth,
        says="G F gather1 & G F gather2 & G F gather3 & G F gather4, shared by two robots (wasserfeder/lomap, ijrr2013).",
        differs="Their robots move on graphs weighted by times; here each takes two corners, and `objective: longest` is minimised.",
    ),
    Case(
        id="meeting", title="A meeting in each lap", mission=missions.meeting_in_each_lap,
        says="G F(count(post) >= 2) & G F quad0.west & G F quad1.east: two robots meet again and again.", differs="A problem of ours.",
    ),
    Case(
        id="meeting-longest", title="A meeting in each lap, by the dearer robot", mission=missions.meeting_by_the_dearer_robot,
        says="The same with `objective: longest`.", differs="A problem of ours.",
    ),
    Case(
        id="five-gather", title="Five gather", mission=missions.gathering,
        says="F(count(meet) >= 5 & F all(home)).", differs="A problem of ours.",
    ),
    Case(
        id="ten-meet", title="Ten meet", mission=partial(missions.many_meet, 10, 1.6),
        says="F(count(a) >= 5) & G(count(b) <= 2) & F all(home).", differs="A problem of ours.",
    ),
    Case(
        id="thirty-meet", title="Thirty meet", mission=partial(missions.many_meet, 30, 2.2), flown=False,
        says="The same for thirty robots.", differs="A problem of ours; words are planned, no flight.",
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Problem:
    """A published problem that ships as a mission.

    Attributes:
        mission: Name of the mission, and of its element without the publication.
        says: What is asked, in a sentence.
        differs: What differs here, in a sentence.
        bound: What is asked of times.
    """

    mission: str
    says: str
    differs: str
    bound: str = ""

    def compute(self) -> Findings:
        """Plan, certify and fly it in simulation."""
        begun = time.process_time()
        result = run(load_mission(self.mission))
        seconds = time.process_time() - begun
        slacks = [claim.bound for claim in result.certificate.claims if claim.name == "timing" and claim.bound is not None]
        rows = [
            holds("certified for all times", result.certificate.holds),
            holds("the simulated flight stays in its tube", result.log.tube == "inside"),
            Quantity("flight", result.certificate.duration, "s", self.bound),
        ]
        rows += [Quantity("least slack of its bounds in seconds", slack, "s") for slack in sorted(slacks)[:1]]
        return Findings((*rows, Quantity("computing from the mission to the flight", seconds, "s")))


_SUN = "Sun, Chen, Mitra, Fan, RA-L 2022"
_SMOOTH = "Their paths are planar and piecewise linear; here flights are smooth and proved for all times."

PROBLEMS: tuple[Problem, ...] = (
    Problem("door-puzzle", f"One robot fetches five keys for five doors ({_SUN}).", f"Without the deadline of 30 s, at up to 1.5 m/s, slowed where the simulated flight strays. {_SMOOTH}"),
    Problem("wall-swap", f"Four robots change places through a gap of one metre ({_SUN}).", f"Without the deadline of 6 s. {_SMOOTH}"),
    Problem("wall-2", f"The same within 6 s ({_SUN}).", _SMOOTH, "four robots in 6 s"),
    Problem("doorpuzzle-1", f"Five keys, five doors, one robot ({_SUN}).", _SMOOTH, "goal in 30 s"),
    Problem("rover-2", f"Two rovers observe four places, recharge and report ({_SUN}).", _SMOOTH, "four places in 8 s, chargers and reports within 10 s"),
    Problem("stlcg-1", f"Stay 5 s in each of two boxes, and out of a third ({_SUN}, after Leung et al. 2019).", _SMOOTH, "two dwells of 5 s in 15 s"),
    Problem("stlcg-2", f"Stay 5 s in a box, and out of two others ({_SUN}, after Leung et al. 2019).", _SMOOTH, "a dwell of 5 s in 10 s"),
)  # fmt: skip


def soft_specification() -> Findings:
    """Plan and certify the published hard and soft formula in both worlds."""
    rows: list[Quantity] = []
    far = missions.loads("r2")
    asked = {"with the soft part": f"({far.spec.formula}) & G !r3", "without it": far.spec.formula or ""}
    for title, formula in asked.items():
        words = assign(far.asking(formula), explained=False)
        rows.append(Quantity(f"loads at r2 or r3, {title}", " ".join(visit.region for visit in words.robots["turtle"].visits)))
        rows.append(Quantity(f"length there, {title}", words.cost, "m"))
    for title, mission, outcome in (("r2 or r3", far, "holds"), ("r3 only", missions.loads("r3"), "fails")):
        certificate = certified_team(plan(mission)).certificate
        rows.append(holds(f"loads at {title}: the formula is certified for ever", certificate.holds))
        rows.append(holds(f"loads at {title}: G !r3 {outcome}", [part.outcome for part in certificate.soft] == [outcome]))
    return Findings(tuple(rows))


PUBLISHED: tuple[Element, ...] = (
    *(
        Element(
            id=f"published-{problem.mission}", publication="published", kind="problem", title=f"Sun: {problem.mission}", says=problem.says,
            differs=problem.differs, by=("ltlplan.pipeline.run",), compute=problem.compute,
        )
        for problem in PROBLEMS
    ),
    *(
        Element(
            id=f"published-{case.id}", publication="published", kind="problem", title=case.title, says=case.says, differs=case.differs,
            by=_BY, compute=case.compute,
        )
        for case in CASES
    ),
    Element(
        id="published-kth-soft", publication="published", kind="problem", title="KTH: a hard and a soft formula",
        says="Load and unload again and again, and stay out of r3 if that can be (KTH-SML/ltl_automaton_core, no figures published).",
        differs="Places in the air are ours, and so is where the robot loads.",
        by=("ltlplan.replanning.checked_plan.plan", "verify.claims.soft_claims"), compute=soft_specification,
    ),
)  # fmt: skip
