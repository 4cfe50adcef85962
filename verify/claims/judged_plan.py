"""Fields of a plan that a certificate rests on, and those that say how the plan came about.

`plan.json` carries both. The first are proved: the checker reads them, and `recheck` refuses them where they are not so. The second are
the planner's own (its waypoints and times, costs, notes): nothing is proved of them, and the checker is handed a plan without them, so that no
claim can depend on them. A new field of a plan belongs to one of the two (`tests/verify/test_plan_fields.py`).
"""

from __future__ import annotations

from verify.data.plan import Plan, RobotPlan, Waypoint

PROVED: dict[str, frozenset[str]] = {
    "Plan": frozenset({"mission", "robots", "precedences", "meetings"}),
    "RobotPlan": frozenset({"word", "visits", "cycle_visit"}),
    "Visit": frozenset({"region", "direction", "actions"}),
    "Precedence": frozenset({"first", "then", "done", "due"}),
    "Meeting": frozenset({"first", "then"}),
}
"""By type of value: fields that the certificate is about."""

OF_PLANNING: dict[str, frozenset[str]] = {
    "Plan": frozenset({"hovers", "method", "seed", "cost", "lower_bound", "complete", "notes"}),
    "RobotPlan": frozenset({"waypoints", "times", "cycle_waypoint", "hold", "cost"}),
}
"""By type of value: fields that no claim depends on. Of the waypoints `recheck` refuses a first one that is not the robot's start."""


def judged_plan(plan: Plan) -> Plan:
    """Return a plan without what is the planner's own: what a certificate is about, and no more.

    Args:
        plan: As planned or read from a file.
    """
    robots = {
        name: RobotPlan(
            word=robot.word,
            visits=robot.visits,
            cycle_visit=robot.cycle_visit,
            waypoints=(Waypoint(position=plan.mission.agents[name].start, role="start"),),
            times=(0.0,),
        )
        for name, robot in plan.robots.items()
    }
    return Plan(mission=plan.mission, robots=robots, precedences=plan.precedences, meetings=plan.meetings)
