# pyright: strict, reportUnnecessaryTypeIgnoreComment=true, reportUnknownMemberType=false
"""What callers get, as a type checker sees it; read by pyright and never run."""

from __future__ import annotations

from pathlib import Path
from typing import assert_type

import numpy as np
from numpy.typing import NDArray

import flight
import ltlplan
import refine
import verify
from verify.data.sections import Limits

# the README's chain
mission = assert_type(ltlplan.load_mission("firefighting"), ltlplan.Mission)
mission = assert_type(mission.changed(separation=0.25, limits=mission.limits.changed(speed=1.2)), ltlplan.Mission)
assert_type(mission.limits, Limits)
plan = assert_type(ltlplan.plan(mission, seed=0), ltlplan.Plan)
assert_type(ltlplan.plan("firefighting"), ltlplan.Plan)
assert_type(ltlplan.plan(Path("mine.yaml")), ltlplan.Plan)
assert_type(plan.words, dict[str, ltlplan.Word])
assert_type(plan.cost, float)
team = assert_type(refine.refine(plan), dict[str, ltlplan.Trajectory])
certificate = assert_type(verify.certify(plan, team), verify.Certificate)
assert_type(verify.judge(plan, team, largest=False), verify.Certificate)
assert_type(certificate.claims, tuple[verify.Claim, ...])
assert_type(certificate.margin, float)
log = assert_type(flight.fly(plan, team, certificate, seed=0), flight.FlightLog)
assert_type(flight.fly(plan, team, certificate, wind="1.5+0.4", noise=0.001), flight.FlightLog)
assert_type(log.worst_error(), float)
found = assert_type(flight.campaign(plan, team, certificate, runs=10), flight.Campaign)
assert_type(found.share_inside, flight.Proportion | None)
assert_type(flight.export(team, certificate, "exported", format="crazyswarm2"), flight.Exported)

# the whole way
result = assert_type(ltlplan.run(mission, out="run", seed=1), ltlplan.Result)
assert_type(result.certificate, verify.Certificate)
assert_type(result.team, dict[str, ltlplan.Trajectory])
assert_type(result.log, flight.FlightLog)
assert_type(result.files, tuple[Path, ...])

# the judge by itself
assert_type(verify.check_word("F a & G !b", [set(), {"a"}]), verify.Verdict)
assert_type(verify.check_word(mission.formula, [["a"]], cycle=[frozenset({"b"})]), verify.Verdict)
assert_type(verify.check_team("F a & F b", {"quad0": [set(), {"a"}]}).sequential, verify.Verdict)
assert_type(verify.recheck("run"), verify.Certificate)
samples = assert_type(verify.load_flight_log(Path("flight.csv"), mission), verify.Samples)
assert_type(verify.load_reference("run"), verify.FlightReference)
assert_type(verify.check_flight(samples, verify.load_reference("run"), max_speed=2.0, start=0.0), verify.FlightVerdict)
assert_type(verify.check_samples([0.0, 1.0], np.zeros((2, 3)), mission, max_speed=1.0), verify.Verdict)

# refinement by itself
path = assert_type(refine.minimum_snap(np.zeros((3, 4)), [0.0, 1.0, 2.0]), refine.Spline)
assert_type(refine.quantise(path), ltlplan.Trajectory)
assert_type(team["quad0"].durations, NDArray[np.float64])
assert_type(team["quad0"].duration, float)

# a service from afar
client = ltlplan.Client("http://127.0.0.1:8000", token="secret")
assert_type(client.plan("firefighting", seed=1), ltlplan.Plan)
assert_type(client.run(mission, out=Path("run")), ltlplan.Result)
assert_type(client.check_word("F a", [set(), {"a"}]), verify.Verdict)
assert_type(client.check_team("F a & F b", {"quad0": "1; a"}).parallel, verify.Verdict)
assert_type(client.recheck("0123456789abcdef-1"), verify.Certificate)
assert_type(client.load_mission("firefighting"), ltlplan.Mission)
assert_type([job.id for job in client.jobs(state="done")], list[str])
assert_type(client.submit(mission).wait(timeout=60.0).result(), ltlplan.Result)
assert_type(ltlplan.judge_flight("run", Path("flight.csv"), max_speed=2.0).verdict, verify.FlightVerdict)
