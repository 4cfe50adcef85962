"""What it costs to audit a show: a Skybrush file of drones that fly 600 s in one-second cubic pieces, and breaches planted in it.

python tests/benchmarks/audit.py                      # 100, 300 and 1000 drones, with growth exponents
python tests/benchmarks/audit.py 1000 --breaches 1000 # every breach of about 50 ms and 1 cm must be found
python tests/benchmarks/audit.py --teams 10000        # the broad phase against the plain judge of all pairs, on random small teams
python tests/benchmarks/audit.py 1000 --seconds 20 --proof  # a proof of it, and the kernel's check
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import resource
import sys
import tempfile
import time
import zipfile
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

import verify
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.motion.fleets import wandering
from verify.arithmetic.balls import Floats
from verify.third_party import near_pieces
from verify.third_party.distances import Breach, Closest, Nearest, Separation, judge_distances

SPACING = 3.0
"""m between drones of one layer, and between layers."""
ASKED = verify.AuditLimits(
    columns=False,
    separation=2.0,
    speed=8.0,
    acceleration=8.0,
    min_height=0.0,
    workspace=(-500.0, -500.0, 0.0, 500.0, 500.0, 200.0),
)
STAGES = ("reading", "how pieces join", "the workspace", "speeds", "accelerations", "distances")


def show(drones: int, seconds: int) -> tuple[Floats, Floats]:
    """Return grid places (drones, 3) and control points (drones, seconds, 3, 4): layers swing through each other at up to 8 m/s."""
    side = max(round((drones / 4) ** 0.5), 1)  # four layers
    index = np.arange(drones)
    layer, rest = index // side**2, index % side**2
    grid = np.stack([rest % side, rest // side, layer + 1], -1) * SPACING
    times = np.arange(seconds + 1.0)
    ease = np.clip(times / 10.0, 0, 1) * np.clip((seconds - times) / 10.0, 0, 1)
    ease, slope = ease**2 * (3 - 2 * ease), np.gradient(ease**2 * (3 - 2 * ease), times)
    swing = 20 * np.sin(0.2 * times) * ease
    speed = 4 * np.cos(0.2 * times) * ease + 20 * np.sin(0.2 * times) * slope
    speed[[0, -1]] = 0.0
    sign = np.where(layer % 2, 1.0, -1.0)
    x = grid[:, 0, None] + sign[:, None] * swing
    v = sign[:, None] * speed
    points = np.repeat(np.broadcast_to(grid[:, None, :, None], (drones, seconds, 3, 1)), 4, -1)
    points[:, :, 0] = np.stack([x[:, :-1], x[:, :-1] + v[:, :-1] / 3, x[:, 1:] - v[:, 1:] / 3, x[:, 1:]], -1)
    return grid, points


def plant(points: Floats, count: int, rng: np.random.Generator) -> set[tuple[int, int, int]]:
    """Raise drones towards one that passes above them, so that the two come within 1.99 m for about 50 ms; return pairs and pieces."""
    planted: set[tuple[int, int, int]] = set()
    drones = len(points)
    middle = (points @ np.array([1, 3, 3, 1])) / 8.0
    fast = np.flatnonzero(np.abs(points[0, :, 0, 3] - points[0, :, 0, 0]) > 3.9)
    taken: set[tuple[int, int]] = set()
    for _ in range(200 * count):
        if len(planted) == count:
            break
        one, piece = int(rng.integers(drones)), int(rng.choice(fast))
        gap = middle[:, piece] - middle[one, piece]
        above = np.flatnonzero((np.abs(gap[:, 2] - SPACING) < 1e-6) & (np.abs(gap[:, 1]) < 1e-6) & (np.abs(gap[:, 0]) < 0.5))
        if not len(above) or (one, piece) in taken or (int(above[0]), piece) in taken:
            continue
        other = int(above[0])
        speed = (points[other, piece, 0, 3] - points[other, piece, 0, 0]) - (
            points[one, piece, 0, 3] - points[one, piece, 0, 0]
        )
        place = 0.5 - gap[other, 0] / speed
        points[one, piece, 2, 1:3] += (SPACING - 1.99) / (3 * place * (1 - place))
        taken |= {(one, piece), (other, piece)}
        planted.add((min(one, other), max(one, other), piece))
    assert len(planted) == count, f"only {len(planted)} of {count} breaches find room"
    return planted


def write(path: Path, points: Floats) -> None:
    """Write control points (drones, seconds, 3, 4) as a show with a member for each drone, in millimetres."""
    drones = [
        {"type": "generic", "settings": {"name": f"d{i}", "trajectory": {"$ref": f"./drones/d{i}/trajectory.json"}}}
        for i in range(len(points))
    ]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("show.json", json.dumps({"version": 1, "swarm": {"drones": drones}}))
        for i, exactly in enumerate(points):
            pieces = np.round(exactly, 3)
            keyframes: list[object] = [[0, pieces[0, :, 0].tolist(), []]]
            keyframes += [
                [t, end, inner]
                for t, (end, inner) in enumerate(
                    zip(pieces[:, :, 3].tolist(), pieces[:, :, 1:3].transpose(0, 2, 1).tolist(), strict=True), start=1
                )
            ]
            archive.writestr(f"drones/d{i}/trajectory.json", json.dumps({"version": 1, "points": keyframes}))


def measure(drones: int, seconds: int, breaches: int) -> dict[str, float]:
    """Audit one show and return the processor time of each stage."""
    _, points = show(drones, seconds)
    planted = plant(points, breaches, np.random.default_rng(0))
    spent: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "show.skyc"
        write(path, points)
        size = path.stat().st_size / 1e6
        del points
        stage, since = "", time.process_time()
        begun = since

        def told(sentence: str, _share: float) -> None:
            nonlocal stage, since
            now = time.process_time()
            spent[stage] = spent.get(stage, 0.0) + now - since
            stage, since = sentence, now

        found = verify.audit(path, limits=ASKED, progress=told)
        told("", 1.0)
    spent["all"] = time.process_time() - begun
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    cells = " | ".join(f"{spent.get(name, 0.0):.2f}" for name in (*STAGES, "all"))
    print(f"| {drones} | {found.pieces} | {size:.0f} | {cells} | {memory:.2f} |", flush=True)
    if breaches:
        names = {(f"d{one}", f"d{other}", piece) for one, other, piece in planted}
        told_of = {(c.robot, c.other, int(c.time or 0)) for c in found.broken if c.name == "separation"}
        lasting = [c.sentence for c in found.broken if c.name == "separation"][:2]
        print(f"planted {len(names)}, found {len(names & told_of)}, more {len(told_of - names)}; such as {lasting}")
        assert names <= told_of
    else:
        assert found.holds, found.broken[:3]
    return spent


def compare(teams: int) -> None:
    """Judge random teams of 2 to 4 drones with the broad phase and without it, and fail where the two see different breaches or distances."""
    rng = np.random.default_rng(7)
    near_pieces.FEW = 0
    spent, broken = {"plain": 0.0, "broad phase": 0.0}, 0
    for team in range(teams):
        pieces, common, size = int(rng.integers(1, 4)), bool(rng.integers(2)), float(rng.uniform(2, 12))
        fleet = wandering(int(rng.integers(2, 5)), pieces, rng, common=common, size=size)
        limit = float(rng.uniform(0.01, 1.0))
        asked = Separation(
            lambda one, other, limit=limit: np.full(np.broadcast(one, other).shape, limit),
            limit, Fraction(1), np.zeros(len(fleet)), limit,
        )  # fmt: skip
        found: list[tuple[Nearest, list[Breach]]] = []
        for name in spent:
            since, closest = time.process_time(), Closest()
            near = near_pieces.all_pieces(fleet) if name == "plain" else near_pieces.near_pieces(fleet, asked, closest)
            found.append(judge_distances(fleet, asked, near, closest))
            spent[name] += time.process_time() - since
        (plain, theirs), (fast, ours) = found
        seen = [sorted((b.one, b.other, round(b.start, 6), round(b.stop, 6)) for b in breaches) for breaches in (theirs, ours)]
        assert seen[0] == seen[1], f"team {team}: {seen}"
        pairs = ((plain.low, fast.low), (plain.high, fast.high))  # told to a millionth of a metre, or of its square
        alike = all(min(abs(a - b), abs(a * a - b * b)) < 2e-6 for a, b in pairs)
        assert theirs or alike, f"team {team}: {plain}, {fast}"
        broken += bool(theirs)
    times = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in spent.items())
    print(f"{teams} random teams, {broken} of them with breaches: the broad phase leaves nothing out ({times})")


def prove(drones: int, seconds: int) -> None:
    """Audit one show with a proof, have the kernel check that again, and print a row."""
    with tempfile.TemporaryDirectory() as folder:
        path, since = Path(folder) / "show.skyc", time.process_time()
        write(path, show(drones, seconds)[1])
        verify.audit(path, limits=ASKED)
        alone, since = time.process_time() - since, time.process_time()
        found = verify.audit(path, limits=ASKED, proof=True)
        proving, memory = time.process_time() - since - alone, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        for name, content in found.files.items():
            (Path(folder) / name).write_bytes(content)
        since = time.process_time()
        verdict = verify.check_proof(folder)
        checking, size = time.process_time() - since, len(found.files["proof.json"]) / 1e6
    assert found.holds
    assert not any(claim.missing for claim in verdict.claims if claim.name == "separation")
    print(
        f"| {drones} | {seconds} | {len(verdict.claims)} | {alone:.1f} | {proving - checking:.1f} | {checking:.1f} | {size:.2f} | {memory:.2f} |",
        flush=True,
    )


def table(sizes: Sequence[int], seconds: int, breaches: int) -> None:
    """Print a row for each size, and how each stage grows."""
    print(f"| drones | pieces | MB | {' | '.join(STAGES)} | all, s | GB |")
    rows = [(drones, measure(drones, seconds, breaches)) for drones in sizes]
    for (few, before), (many, after) in itertools.pairwise(rows):
        growth = [f"{name} {math.log(after[name] / before[name]) / math.log(many / few):.2f}" for name in (*STAGES, "all")]
        print(f"exponents from {few} to {many} drones: {', '.join(growth)}")


def main() -> None:
    """Do what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=int, default=[100, 300, 1000])
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--breaches", type=int, default=0)
    parser.add_argument(
        "--teams", type=int, default=0, help="compare the broad phase with the plain judge on so many random teams"
    )
    parser.add_argument("--proof", action="store_true", help="write a proof of each show, and check it")
    asked = parser.parse_args()
    if asked.teams:
        compare(asked.teams)
    elif asked.proof:
        print("| drones | pieces | claims | audit, s | finding, s | checking, s | MB | GB |")
        for drones in asked.sizes:
            prove(drones, asked.seconds)
    else:
        table(asked.sizes, asked.seconds, asked.breaches)


if __name__ == "__main__":
    run_benchmark(
        main,
        ["8", "16", "--seconds", "20"],
        ["40", "--seconds", "60", "--breaches", "2"],
        ["--teams", "20"],
        ["8", "--seconds", "10", "--proof"],
    )
