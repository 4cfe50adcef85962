# pyright: strict, reportUnnecessaryTypeIgnoreComment=true, reportUnknownMemberType=false
"""Mistakes that a type checker must see: each error is expected, and pyright complains where one does not come; never run."""

from __future__ import annotations

import flight
import ltlplan
import refine
import verify

mission = ltlplan.load_mission("firefighting")
plan = ltlplan.plan(mission)
team = refine.refine(plan)
certificate = verify.certify(plan, team)

ltlplan.plan(3)  # pyright: ignore[reportArgumentType]
ltlplan.plan(mission, 0)  # pyright: ignore[reportCallIssue]  a seed has its name
ltlplan.plan(mission, seed="0")  # pyright: ignore[reportArgumentType]
ltlplan.run()  # pyright: ignore[reportCallIssue]
print(ltlplan.paln)  # pyright: ignore[reportAttributeAccessIssue, reportUnknownArgumentType]
certificate.margin = 1.0  # pyright: ignore[reportAttributeAccessIssue]  values are frozen
refine.refine(mission)  # pyright: ignore[reportArgumentType]
refine.refine(plan, pace="fast")  # pyright: ignore[reportArgumentType]
verify.certify(plan, plan)  # pyright: ignore[reportArgumentType]
verify.certify(team, plan)  # pyright: ignore[reportArgumentType]
verify.check_word("F a", 3)  # pyright: ignore[reportArgumentType]
verify.check_team("F a", [set()])  # pyright: ignore[reportArgumentType]
verify.check_flight("flight.csv", certificate)  # pyright: ignore[reportArgumentType]
flight.fly(plan, team, certificate, speed=1.0)  # pyright: ignore[reportCallIssue]
flight.campaign(plan, team, certificate, runs="many")  # pyright: ignore[reportArgumentType]
flight.export(team, certificate, 3, format="px4")  # pyright: ignore[reportArgumentType]
