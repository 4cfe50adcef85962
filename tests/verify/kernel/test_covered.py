"""Missions of every kind, all of whose claims the kernel checks: legs, endurance, openings, unions, laps of teams, weighted distances."""

import json

from ltlplan import parse_mission
from ltlplan.pipeline import certified_team
from ltlplan.replanning.checked_plan import plan
from tests.helpers.few import few_of
from tests.helpers.kernel.proofs import checked, missing, tables
from verify.proofs.finder import prove

WORLD = """
format: 1
name: world
vehicle: crazyflie-2.1
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.2]}
"""
BALL = "radii: [0.3, 0.3, 0.3]"
MISSIONS = {
    "legs": f"""
spec: {{formula: "F a & F b & F c"}}
regions:
  a: {{center: [1, 0, 1], {BALL}}}
  b: {{center: [1, 1.5, 1], size: [0.5, 0.5, 0.5]}}
  c: {{center: [-1, 1, 1], cylinder: {{radius: 0.4, height: 0.8}}}}
agents: {{r0: {{start: [-1, -1, 1]}}}}
limits: {{speed: 1.0, endurance: 60, legs: {{b: {{speed: 0.3}}, a: {{acceleration: 0.5}}}}}}
""",
    "laps of a team": f"""
spec: {{formula: "G F a & G F b & G F c", trace: infinite, repeat: 3}}
regions: {{a: {{center: [1, 0, 1], {BALL}}}, b: {{center: [1, 1.5, 1], {BALL}}}, c: {{center: [-1, 1, 1], {BALL}}}}}
agents: {{r0: {{start: [-1, -1, 1]}}, r1: {{start: [0, -1, 1]}}}}
separation_z: 0.6
limits: {{endurance: 300}}
""",
    "openings": f"""
spec: {{formula: "F a & F b"}}
regions: {{a: {{center: [1.5, 0.5, 1], {BALL}}}, b: {{center: [-1.5, 1, 1], {BALL}}}}}
hoops: {{w: {{center: [0, 0, 1], yaw_deg: 0, radii: [0.25, 0.25, 0.25], opening: 0.4, rim: 0.02}}}}
obstacles: {{wall: {{center: [0, 0, 1.2], size: [0.1, 6.2, 2.6], openings: [w]}}}}
agents: {{r0: {{start: [-1, -1, 1]}}}}
""",
    "unions": f"""
spec: {{formula: "F room & F b"}}
regions:
  room: {{union: [{{center: [1, 0, 1], size: [1, 1, 0.8]}}, {{center: [2, 0, 1], size: [1, 1, 0.8]}}, {{center: [1, 1, 1], size: [1, 1, 0.8]}}]}}
  b: {{center: [-1, 1.5, 1], {BALL}}}
agents: {{r0: {{start: [-1, -1, 1]}}}}
""",
}
FALSE = {
    "legs": [("limits.legs.speed", lambda table: table["robots"]["r0"]["legs"]["b"].update(speed=0.1)),
             ("limits.legs.acceleration", lambda table: table["robots"]["r0"]["legs"]["a"].update(acceleration=0.01)),
             ("limits.endurance", lambda table: table["robots"]["r0"].update(endurance=12.0))],
    "laps of a team": [("separation", lambda table: table.update(separation_z=0.05)),
                       ("visits", lambda table: table["robots"]["r0"].update(cycle_visit=0 if table["robots"]["r0"]["cycle_visit"] else 1)),
                       ("limits.endurance", lambda table: table["robots"]["r0"].update(endurance=12.0))],
    "openings": [("obstacles", lambda table: table["obstacles"]["wall"].update(openings=[])),
                 ("obstacles", lambda table: table["regions"]["w"]["ring"].update(opening=0.1))],
    "unions": [("visits", lambda table: table["regions"]["room"]["parts"].pop(0)), ("formula", lambda table: table.update(margin=0.35))],
}  # fmt: skip


@few_of(1, "name", MISSIONS)
def test_all_claims_are_checked_and_false_ones_are_not(name, pace):
    made = certified_team(plan(parse_mission(WORLD + MISSIONS[name]), pace=pace))
    proof = prove(made.plan, made.team, made.certificate)
    files = tables(made.plan, made.team)
    claims = checked(proof.statement, proof.evidence, files)
    assert missing(claims) == set()
    assert len(claims) == len(made.certificate.claims)
    for claim, change in FALSE[name]:
        table = json.loads(proof.statement)
        change(table)
        assert claim in missing(checked(json.dumps(table), proof.evidence, files)), claim
