"""What plan.json says of words is judged by `recheck`, also where a forger has made all digests anew."""

import hashlib
import json
from pathlib import Path

import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.verify.test_run_folder import write_folder
from verify import certify, recheck
from verify.certificate import payload_digest
from verify.data import NotCertified
from verify.data.language.word import Word
from verify.data.plan import Visit
from verify.data.sections import Action

TANK = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"
REGIONS = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [-1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"
TRUE = [[], ["a"], ["a", "wet"], ["wet"]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    mission = small_mission("F a & F wet", margin=0.02, extra=TANK, regions=REGIONS)
    fill = Action.model_validate({"from": "dry", "to": "wet", "at": "a"})
    visits = {"r0": [Visit(region="a", actions=(fill,))]}
    plan = plan_of(mission, visits, {"r0": Word.of(TRUE)})
    team = {"r0": legs([[0, 0, 1], [1, 0, 1], [0, 0.5, 1]])}
    return write_folder(tmp_path / "out", plan, team, certify(plan, team))


def forge(folder: Path, change: dict) -> None:
    """Edit the plan's robot, and make the digests anew that anybody can compute."""
    path = folder / "plan.json"
    data = json.loads(path.read_text())
    data["robots"]["r0"].update(change)
    path.write_text(json.dumps(data, indent=1) + "\n")
    certificate = json.loads((folder / "certificate.json").read_text())
    certificate["plan"] = hashlib.sha256(path.read_bytes()).hexdigest()
    certificate["digest"] = payload_digest({key: value for key, value in certificate.items() if key != "digest"})
    (folder / "certificate.json").write_text(json.dumps(certificate))


def word(*prefix: list[str], cycle: list | None = None) -> dict:
    return {"word": {"prefix": list(prefix), "cycle": cycle}}


def test_the_words_of_the_visits_are_true(folder: Path) -> None:
    assert recheck(folder).holds
    forge(folder, word(*TRUE))
    assert recheck(folder).holds


@few_of(
    2,
    ("change", "says"),
    [
        (word([], ["b"], ["b", "wet"], ["wet"]), "not what its visits"),
        (word([], ["a"], []), "not what its visits"),
        (word([], ["a"], ["a", "wet"], ["wet"], ["a", "wet"], ["wet"]), "not what its visits"),
        (word([], ["wet"], ["a", "wet"], ["wet"]), "not what its visits"),
        (word([], ["a"], ["a", "wet"], ["wet"], [], ["wet"]), "not what its visits"),
        (word([], ["a"], ["wet"]), "certified flight can show"),
        (word([], ["a"], ["a", "wet"]), "certified flight can show"),
        (word(["a"], ["a", "wet"], ["wet"]), "certified flight can show"),
        (word([], ["a", "b"], ["a", "wet"], ["wet"]), "not what its visits"),
        (word([], ["a"], ["a", "wet"], ["gold", "wet"]), "no region or proposition"),
        (word([], ["a"], cycle=[["a", "wet"]]), "go on for ever"),
        ({"waypoints": [{"position": [0.5, 0.0, 1.0], "role": "start", "region": None, "visit": None}]}, "not its start"),
    ],
)
def test_forged_plans_are_refused(folder: Path, change: dict, says: str) -> None:
    forge(folder, change)
    with pytest.raises(NotCertified, match=rf"plan\.json was changed, or was never true: r0's .*{says}"):
        recheck(folder)
