"""A team of which one robot passes another too near for 10 ms: refused with the right pair and time, from values and from files."""

import math
from pathlib import Path

import pytest

import verify
from ltlplan.output import write_plan_files, write_trajectories
from tests.helpers.commands import Command
from tests.helpers.motion.flights import plan_of, small_mission
from tests.helpers.motion.stand_ins import hover, rest_to_rest
from verify.data import NotCertified, Plan, Trajectory

MARGIN = 0.02
ROBOTS = 16
SPACING = 1.2
"""m between robots that hover in a square; r6 is 0.1 m nearer to the row before it, where one robot passes."""
SECONDS, LENGTH = 8.0, 4.0
SPEED = LENGTH / SECONDS * 35 / 16
"""m/s, of `rest_to_rest` at half way."""


def fleet(*, seconds: float) -> tuple[Plan, dict[str, Trajectory]]:
    """Return robots that hover, and r16, which passes r6 after half of its flight.

    Args:
        seconds: How long it is nearer than separation and margins ask; where negative, it stays outside by as much as it would be inside.
    """
    places = [(SPACING * (i % 4), SPACING * (i // 4) - (0.1 if i == 6 else 0.0), 1.0) for i in range(ROBOTS)]
    mission = small_mission(regions="", starts=places)
    limit = mission.separation + 2 * MARGIN
    apart = math.sqrt(limit**2 - math.copysign((SPEED * seconds / 2) ** 2, seconds))
    x, y, _ = places[6]
    line = [(x - LENGTH / 2, y - apart, 1.0), (x + LENGTH / 2, y - apart, 1.0)]
    team = {f"r{i}": hover(place=place, duration=SECONDS) for i, place in enumerate(places)}
    team[f"r{ROBOTS}"] = rest_to_rest(line, [SECONDS])
    starts = [tuple(flight.coefficients[0, :3, 0].tolist()) for flight in team.values()]
    return plan_of(small_mission(regions="", starts=starts, margin=MARGIN), {}), team


def require_said(refused: NotCertified) -> None:
    (witness,) = refused.witnesses
    assert witness.claim == "separation"
    assert {witness.robot, witness.other} == {"r6", f"r{ROBOTS}"}
    assert witness.time == pytest.approx(SECONDS / 2, abs=0.005)
    assert witness.limit == pytest.approx(small_mission().separation + 2 * MARGIN)
    assert witness.bound is not None
    assert 0 < (witness.limit or 0.0) - witness.bound < 1e-4


@pytest.mark.parametrize("seconds", [0.01, 0.002])
def test_a_pass_of_ten_milliseconds_is_refused_with_its_pair_and_time(seconds: float) -> None:
    with pytest.raises(NotCertified) as refused:
        verify.certify(*fleet(seconds=seconds), clock_error=0.0)
    require_said(refused.value)


def test_the_same_pass_a_little_farther_away_is_certified() -> None:
    assert verify.certify(*fleet(seconds=-0.01), clock_error=0.0).holds


def put(folder: Path, plan: Plan, team: dict[str, Trajectory]) -> Path:
    folder.mkdir(exist_ok=True)
    write_plan_files(plan, folder)
    write_trajectories(plan, team, folder)
    return folder


def test_files_of_such_a_team_are_refused_likewise(tmp_path: Path) -> None:
    near, far = fleet(seconds=0.01), fleet(seconds=-0.01)
    folder = put(tmp_path / "run", *far)
    sound = verify.certify(*far, clock_error=0.0)
    (folder / "certificate.json").write_text(sound.to_json())
    assert verify.recheck(folder).holds
    put(folder, *near)  # with the certificate of the others it is another mission; with one of its own it is proved anew
    with pytest.raises(NotCertified, match=r"mission.yaml was changed"):
        verify.recheck(folder)
    (folder / "certificate.json").write_text(verify.judge(*near, clock_error=0.0).to_json())
    with pytest.raises(NotCertified) as refused:
        verify.recheck(folder)
    require_said(refused.value)


@pytest.mark.slow
def test_the_command_line_says_who_and_when(tmp_path: Path, ltlplan: Command) -> None:
    put(tmp_path / "run", *fleet(seconds=0.01))
    said = ltlplan("certify", "run", "--clock-error", "0", cwd=tmp_path)
    assert said.returncode == 5, said.stderr
    line = next(line for line in (said.stdout + said.stderr).splitlines() if "r16" in line)
    assert "r6" in line
    assert "4.0000 s" in line
