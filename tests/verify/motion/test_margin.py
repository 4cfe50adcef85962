"""Whoever stays within the margin keeps the claim: a random search that tries hard to break it."""

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import firefighting, legs, plan_of, small_mission
from verify import certify, judge
from verify.data.language.word import Word
from verify.data.plan import Visit
from verify.logic.semantics import satisfies


def pushed(rng, mission, times, path, margin):
    """Return a path within the margin of another: adversarial near boundaries, where it dithers."""
    kind = rng.integers(0, 4)
    push = np.zeros_like(path)
    if kind == 0:
        push[:] = rng.normal(size=3)
    elif kind == 1:
        phase = rng.uniform(0, 2 * np.pi, 3)
        push[:] = np.sin(times[:, None] * rng.uniform(0.5, 60, 3) + phase)
    else:  # towards the boundary of the nearest region, this way and that
        levels = np.stack([np.sqrt(region.level(path)) for region in mission.all_regions.values()], 1)
        centres = np.array([region.center for region in mission.all_regions.values()])
        nearest = np.argmin(np.abs(levels - 1), 1)
        outward = path - centres[nearest]
        sign = np.where(rng.uniform(size=len(times)) < 0.5, -1.0, 1.0) if kind == 2 else np.sign(rng.normal())
        push = outward * np.broadcast_to(sign, len(times))[:, None]
    size = np.linalg.norm(push, axis=1, keepdims=True)
    reach = margin * (1 - 1e-9) * (1.0 if kind else rng.uniform(0.5, 1))
    return path + np.where(size > 0, push / np.maximum(size, 1e-12), 0.0) * reach


def team_word(rng, mission, certificate, times, paths):
    """Read every robot at every sample, in any order; a word of the team (`own` reading)."""
    letters = {}
    for robot, path in paths.items():
        inside = {name: region.level(path) <= 1 for name, region in mission.all_regions.items()}
        actions = [(a.time, frozenset(mission.robot.states[a.target])) for a in certificate.actions if a.robot == robot]
        rows = []
        for k, time in enumerate(times):
            internal = mission.initial_letter(robot)
            for at, names in actions:
                internal = names if time >= at else internal
            rows.append(frozenset(name for name in inside if inside[name][k]) | internal)
        letters[robot] = rows
    word = []
    for k in range(len(times)):
        for robot in rng.permutation(list(paths)):
            if not word or word[-1] != letters[robot][k]:
                word.append(letters[robot][k])
    return Word(tuple(word))


def attack(plan, team, certificate, rng, rounds, samples):
    """Fly perturbed paths and hold each against the claims; return how far the worst of them was pushed, m."""
    furthest = 0.0
    mission, margin = plan.mission, certificate.margin
    times = np.linspace(0, certificate.duration, samples)
    nominal = {name: trajectory.evaluate(times)[:, :3] for name, trajectory in team.items()}
    low, high = np.array(mission.workspace.min), np.array(mission.workspace.max)
    for _ in range(rounds):
        paths = {name: pushed(rng, mission, times, path, margin) for name, path in nominal.items()}
        assert satisfies(mission.formula, team_word(rng, mission, certificate, times, paths))
        names = list(paths)
        for i, a in enumerate(names):
            furthest = max(furthest, float(np.linalg.norm(paths[a] - nominal[a], axis=1).max()))
            assert np.all(paths[a] >= low)
            assert np.all(paths[a] <= high)
            for b in names[i + 1 :]:
                assert np.linalg.norm(paths[a] - paths[b], axis=1).min() >= mission.separation
            for hoop in mission.hoops.values():
                offset = paths[a] - np.array(hoop.center)
                along = offset @ np.array(hoop.normal)
                across = np.linalg.norm(offset - along[:, None] * np.array(hoop.normal), axis=1)
                radial = np.maximum(np.maximum(hoop.opening - across, across - hoop.opening - hoop.rim), 0)
                gap = np.hypot(radial, np.maximum(np.abs(along) - hoop.rim / 2, 0))
                assert gap.min() > mission.vehicle.radius
    return furthest


@few_of(1, "margin", ["largest", 0.0, 0.02, 0.05])
def test_nobody_within_the_margin_breaks_the_claim(margin):
    plan, team = firefighting()
    wanted = judge(plan, team).largest_margin if margin == "largest" else margin
    certificate = certify(plan, team, margin=wanted)
    assert certificate.margin == wanted
    assert attack(plan, team, certificate, np.random.default_rng(0), 12, 1500) == pytest.approx(wanted, abs=1e-8)


FORMULAS = ["F a", "G !b", "F (a & F b)", "!b U a", "G (a -> F b)", "F a & G !c", "F G a", "G (b -> c)", "F (a & b)", "!a U b"]
REGIONS = """a: {center: [1.0, 0.0, 1.0], radii: [0.3, 0.3, 0.3]}
b: {center: [1.0, 1.0, 1.0], radii: [0.4, 0.3, 0.3], yaw_deg: 30}
c: {center: [0.0, 1.0, 1.0], radii: [0.3, 0.5, 0.3]}"""


@pytest.mark.slow
def test_random_flights_with_random_formulas():
    """Whatever the judge certifies of the formula, no perturbed flight breaks; refusals are not held against it."""
    rng = np.random.default_rng(1)
    certified = 0
    for _ in range(15):
        points = [[0, 0, 1], *np.column_stack([rng.uniform(-0.2, 1.2, (2, 2)), np.ones(2)])]
        mission = small_mission(str(rng.choice(FORMULAS)), regions=REGIONS, margin=float(rng.choice([0.0, 0.02, 0.1])))
        plan, team = plan_of(mission, {"r0": ()}), {"r0": legs(points, speed=0.5)}
        certificate = judge(plan, team, largest=False)
        formula = next(claim for claim in certificate.claims if claim.name == "formula")
        if formula.outcome != "holds":
            continue
        certified += 1
        times = np.linspace(0, certificate.duration, 1200)
        nominal = team["r0"].evaluate(times)[:, :3]
        for _ in range(6):
            path = {"r0": pushed(rng, mission, times, nominal, certificate.margin)}
            assert satisfies(mission.formula, team_word(rng, mission, certificate, times, path))
    assert certified >= 5
    assert Visit(region="a").direction is None
