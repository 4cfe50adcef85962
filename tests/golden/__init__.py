"""Golden results: words, costs, trajectories and verdicts of shipped missions and of fifty random ones.

`results.json` was written by `python -m tests.golden` before the modules were moved into rooms (that of `meeting`, which counts robots,
later), on the platform that it names. A change in it means that a mission is planned, flown or judged otherwise than before: each
such case stands, with its reason, in `CHANGED`. It is not written again to get a pass.

Samples are drawn alike everywhere, but sums of floats are rounded as the processor's vector units add them, and cross-entropy
follows the last digit: costs on two processors differed by up to 6 %, and ties between robots were broken otherwise. So the
numbers are compared to the last bit on the platform that wrote them, with the kernels that its linear algebra used; elsewhere what must hold on any. To compare two
checkouts on another machine: `python -m tests.golden FILE` in the one, `python -m tests.golden --against FILE` in the other.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import platform as machine
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import refine
import verify
from ltlplan import load_mission, parse_mission, plan
from tests.helpers.missions.courses import course
from tests.helpers.missions.random_missions import random_mission
from tests.helpers.missions.shipped import GOLDEN_MISSIONS
from verify.data import LtlplanError, Mission, Word, mission_to_yaml

RESULTS = Path(__file__).parent / "results.json"

LATER = ("ordered", "precedences")
"""Claims that certificates did not make when the results were written."""

_PAST_REGIONS = "a leg past regions takes the shortest way through free space: the path is cheaper"
_TOUCHED = "visits are made where the route touches their regions, not in their middles: the paths are cheaper"
_LAPS = "a lap touches its regions, and begins and ends in one of them: the paths are cheaper"
_TOUCHING = (0, 1, 2, 5, 6, 7, 10, 11, 12, 15, 16, 20, 21, 22, 25, 27, 30, 31, 32, 35, 36, 37, 40, 41, 45, 46, 47)
_DRAWS = "draws are the same for all robots, along axes that the path gives: costs are as before in the mean"
CHANGED: dict[str, str] = {
    "shipped firefighting": _DRAWS,
    **{f"random {seed}": _DRAWS for seed in (4, 9, 14, 24, 29, 39, 44, 49)},
    **{f"random {seed}": _TOUCHED for seed in _TOUCHING},
    "shipped meeting": "a robot that the formula lets depart at once waits for nobody, and places are taken by which ways are short: it is shorter",
    **{f"random {seed}": _LAPS for seed in range(3, 50, 5)},
    "random 17": _PAST_REGIONS,
    "random 26": "likewise, so that no region is flown through for it; and visits are made where the route touches: cheaper by 1.6 %",
    "random 42": _PAST_REGIONS,
}
"""Cases whose results differ from the golden ones, each with its reason."""


def cases() -> list[str]:
    """Return the names of all cases."""
    return [f"shipped {name}" for name in GOLDEN_MISSIONS] + [f"random {seed}" for seed in range(50)]


def mission_of(case: str) -> Mission:
    """Return a case's mission; the random ones are teams by either method, patrols, and courses of hoops, in turn."""
    kind, name = case.split()
    if kind == "shipped":
        return load_mission(name)
    seed = int(name)
    match seed % 5:
        case 0 | 1:
            return random_mission(seed, samples=20, rounds=4)
        case 2:
            return _changed(random_mission(seed, samples=20, rounds=4), {"method: mtac-e": "method: exact"})
        case 3:
            team = random_mission(seed, robots=1, samples=20, rounds=4)
            first, second, *_ = team.regions
            formula = f"G F {first} & G F {second}"
            return _changed(team, {team.spec.formula or "": formula, "trace: finite": "trace: infinite", "mtac-e": "exact"})
        case _:
            rng = np.random.default_rng(seed)
            made = None
            while made is None:
                made = course(rng, 3, 3, cycle=seed % 2 == 0)
            return made


def _changed(mission: Mission, texts: dict[str, str]) -> Mission:
    text = mission_to_yaml(mission)
    for old, new in texts.items():
        assert old in text, old
        text = text.replace(old, new)
    return parse_mission(text)


def result(case: str) -> dict[str, Any]:
    """Plan, refine and judge one case, and return what must not change."""
    mission = mission_of(case)
    try:
        made = plan(mission)
        team = refine.refine(made, pace="nominal")
    except LtlplanError as error:
        return {"refused": type(error).__name__}
    certificate = verify.judge(made, team)
    return {
        "words": {name: _letters(word) for name, word in made.words.items()},
        "cost": made.cost,
        "claims": [[claim.name, claim.robot, claim.outcome] for claim in certificate.claims if claim.name not in LATER],
        "trajectories": {
            name: hashlib.sha256(flown.durations.tobytes() + flown.coefficients.tobytes()).hexdigest()[:16]
            for name, flown in team.items()
        },
    }


def _letters(word: Word) -> dict[str, Any]:
    cycle = word.cycle
    return {
        "prefix": [sorted(letter) for letter in word.prefix],
        "cycle": None if cycle is None else [sorted(letter) for letter in cycle],
    }


def platform() -> dict[str, str]:
    """Return what the last digits hang on: processor, vector units that numpy uses, OpenBLAS' kernels, versions of what computes."""
    units = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    versions = {name: version(name) for name in ("numpy", "scipy", "casadi", "osqp", "cvxpy", "spottl")}
    return {"processor": machine.machine(), "vector units": " ".join(units), "kernels": kernels(), **versions}


def kernels() -> str:
    """Return which processor's kernels numpy's OpenBLAS uses: the one at hand, or that of `OPENBLAS_CORETYPE`; "unknown" elsewhere."""
    found = sorted(Path(np.__file__).parents[1].glob("numpy.libs/libscipy_openblas*"))
    name = getattr(ctypes.CDLL(str(found[0])), "scipy_openblas_get_corename64_", None) if found else None
    if name is None:
        return "unknown"
    name.restype = ctypes.c_char_p
    return name().decode()


def golden(path: Path = RESULTS) -> tuple[dict[str, str], dict[str, dict[str, Any]]]:
    """Read golden results: the platform that they were made on, and each case's."""
    read = json.loads(path.read_text())
    return read["platform"], read["cases"]


def write(path: Path) -> None:
    """Write the results of all cases, a line each."""
    lines = ",\n".join(f"  {json.dumps(case)}: {json.dumps(result(case))}" for case in cases())
    path.write_text(f'{{\n "platform": {json.dumps(platform())},\n "cases": {{\n{lines}\n }}\n}}\n')


def differences(wanted: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """Return the names of what differs between two results of one case."""
    return [key for key in sorted({*wanted, *found}) if wanted.get(key) != found.get(key)]
