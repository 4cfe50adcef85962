"""Identification: true numbers inside their intervals at the stated rate, logs that cannot tell refused, profiles that are flown."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flight
from flight.identification.identify import WEIGHED, identify
from flight.identification.least_squares import LEVEL, STEP, bumps_over, fitted
from flight.identification.profile import profile_text, read_profile
from flight.identification.recorded import RATE, Recorded, even, read_recorded
from flight.model.airframe import airframe_of
from flight.rehearsal.corners import USUAL, fly_corners, intervals_of
from ltlplan.cli import app
from tests.helpers.motion.stand_ins import hop, stand_in
from tests.helpers.vehicles.identification_flights import Flown, flown_logs
from verify.data import BadInput, Vehicle, load_vehicle
from verify.data.files.mission_file import parse_mission

STOCK = load_vehicle("crazyflie-2.1")


@functools.cache
def twenty() -> tuple[Flown, ...]:
    return tuple(flown_logs(STOCK, range(20)))


def inside(logs: tuple[Flown, ...] | list[Flown]) -> dict[str, float]:
    """Return the share of logs whose true numbers are inside their intervals; the mass is weighed within its own."""
    rng, kept = np.random.default_rng(5), dict.fromkeys(("mass", "thrust", "drag", "latency"), 0)
    for log in logs:
        found = identify(log.recorded, log.vehicle, mass=log.true.mass * (1.0 + rng.uniform(-WEIGHED, WEIGHED)))
        for name in kept:
            number, true = getattr(found, name), getattr(log.true, name)
            kept[name] += number.least <= true <= number.most
    return {name: count / len(logs) for name, count in kept.items()}


def test_true_numbers_are_inside_their_intervals():
    assert min(inside(twenty()).values()) >= LEVEL


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "drag"),
    [
        ("crazyflie-2.1", 1.0),
        ("crazyflie-2.1", 3.0),
        ("crazyflie-brushless", 1.0),
        ("crazyflie-brushless", 2.5),
        ("px4-x500", 1.0),
    ],
)
def test_true_numbers_are_inside_their_intervals_at_the_stated_rate(vehicle: str, drag: float):
    """Five kinds of two hundred logs each."""
    assert min(inside(flown_logs(load_vehicle(vehicle), range(1000, 1200), drag=drag)).values()) >= LEVEL


def columns_of(log: Flown, since: float = 0.0, until: float = np.inf) -> dict[str, np.ndarray]:
    """Return a stretch of a log as columns."""
    recorded = log.recorded
    times = np.arange(len(recorded.thrust)) / RATE
    own = (times >= since) & (times < until)
    found = {"t": times[own], **{name: recorded.position[own, i] for i, name in enumerate("xyz")}}
    found |= {name: recorded.attitude[own, i] for i, name in enumerate(("roll", "pitch", "yaw"))} | {
        "thrust": recorded.thrust[own]
    }
    return found | {f"e{name}": recorded.estimated[own, i] for i, name in enumerate("xyz")}


@pytest.mark.parametrize(("since", "until", "said"), [
    (0.0, 0.5, "lasts 0.5 s, too short"),
    (0.0, 5.5, "flies a line for 0.0 s .* needed to tell the drag"),
    (9.0, 17.0, "hovers for .* needed to tell the thrust"),
])  # fmt: skip
def test_a_log_that_cannot_tell_is_refused(since: float, until: float, said: str):
    with pytest.raises(BadInput, match=said):
        identify(even(columns_of(twenty()[0], since, until)), STOCK)


def test_a_line_one_way_a_wrong_unit_and_a_wrong_mass_are_refused():
    columns = columns_of(twenty()[0])
    rng = np.random.default_rng(0)
    along = {**columns, "x": 6.0 * np.arange(len(columns["x"])) / len(columns["x"])}
    along["x"] = np.where(columns["t"] < 6.0, 0.0, 0.6 * (columns["t"] - 6.0))
    with pytest.raises(BadInput, match="one way: wind and drag cannot be told apart"):
        identify(even(along), STOCK)
    with pytest.raises(BadInput, match=r"does not explain this log.*Are attitudes in rad"):
        identify(even({**columns, "pitch": np.degrees(columns["pitch"])}), STOCK)
    with pytest.raises(BadInput, match="is not that of 'crazyflie"):
        identify(twenty()[0].recorded, STOCK, mass=33.0)
    drift = np.zeros((2, len(columns["t"])))  # of attitudes, over a second
    for k in range(1, drift.shape[1]):
        drift[:, k] = 0.99 * drift[:, k - 1] + 0.007 * rng.standard_normal(2)
    rough = {**columns, "roll": columns["roll"] + drift[0], "pitch": columns["pitch"] + drift[1]}
    with pytest.raises(BadInput, match="cannot tell the drag"):
        identify(even(rough), STOCK)


def test_numbers_that_no_vehicle_has_are_refused_with_what_may_be_wrong():
    columns = columns_of(twenty()[3])
    with pytest.raises(BadInput, match=r"thrust comes out as .* 0.5 to 1.5 may be. Is `thrust` in N of all rotors"):
        identify(even({**columns, "thrust": columns["thrust"] / 9.81 * 1000.0}), STOCK)
    with pytest.raises(BadInput, match="is the vehicle a 'px4-x500'"):
        identify(even(columns), load_vehicle("px4-x500"))
    ahead = {**columns, "ex": 2.0 * columns["x"] - columns["ex"] + 0.1 * np.gradient(columns["x"], columns["t"])}
    ahead |= {name: 2.0 * columns[name[1]] - columns[name] for name in ("ey", "ez")}
    with pytest.raises(BadInput, match=r"latency comes out as -\d+ ms; 0 to 200 may be"):
        identify(even(ahead), STOCK)


def test_without_estimates_nothing_is_said_of_latency():
    columns = {name: values for name, values in columns_of(twenty()[1]).items() if not name.startswith("e")}
    found = identify(even(columns), STOCK)
    assert found.latency is None
    assert "not told" in found.sentences[3]
    assert found.profile.uncertain is not None
    assert found.profile.uncertain.latency is None


def test_a_bump_integrates_by_parts():
    """Of a parabola the second derivative is 2, of a line the first is its slope."""
    times = np.arange(300) / RATE
    bumps = bumps_over(300)
    assert bumps.curve @ times**2 == pytest.approx(2.0, abs=2e-3)
    assert -(bumps.slope @ (3.0 * times)) == pytest.approx(3.0, abs=1e-3)
    assert bumps.plain @ np.ones(300) == pytest.approx(1.0)


def test_intervals_of_least_squares_hold_at_their_rate_where_residuals_hang_together():
    rng = np.random.default_rng(2)
    count, true, kept = 150, np.array([1.5, -0.7]), np.zeros(2)
    for _ in range(400):
        columns = np.stack([np.ones(count), np.sin(np.arange(count) * STEP)], axis=1)
        noise = np.zeros(count)
        for k in range(1, count):
            noise[k] = 0.9 * noise[k - 1] + 0.1 * rng.standard_normal()
        fit = fitted(columns[:, None, :], (columns @ true + noise)[:, None])
        kept += np.abs(fit.values - true) <= fit.half
    assert np.all(kept / 400 > LEVEL - 2.5 * np.sqrt(LEVEL * (1 - LEVEL) / 400)), kept


def csv_of(columns: Mapping[str, np.ndarray], robots: tuple[str, ...] = ()) -> str:
    """Return columns as a table, for each of some robots where any are named."""
    lines = [",".join([*(["robot"] if robots else []), *columns])]
    for row in zip(*columns.values(), strict=True):
        lines += [",".join([*([robot] if robots else []), *(f"{value:.9g}" for value in row)]) for robot in robots or ("",)]
    return "\n".join(lines) + "\n"


def test_the_command_writes_a_profile_that_a_mission_takes(tmp_path: Path):
    log, out = tmp_path / "log.csv", tmp_path / "mine.yaml"
    log.write_text(csv_of(columns_of(twenty()[2])))
    asked = ["identify", str(log), "--vehicle", "crazyflie-2.1", "--mass", "0.0331", "--out", str(out)]
    done = CliRunner().invoke(app, asked, catch_exceptions=False)
    assert done.exit_code == 0
    assert "thrust" in done.output
    assert "left over" in done.output
    vehicle = read_profile(out)
    assert vehicle.mass == pytest.approx(0.0331)
    assert vehicle.autopilot == STOCK.autopilot
    assert vehicle.uncertain is not None
    assert set(vehicle.uncertain.ends) == {"mass", "thrust", "drag", "latency"}
    with pytest.raises(BadInput, match="is there already"):
        CliRunner().invoke(app, asked, catch_exceptions=False)
    text = (Path("ltlplan") / "missions" / "hoops-sequence.yaml").read_text(encoding="utf-8")
    mission = parse_mission(text.replace("vehicle: crazyflie-2.1\n", out.read_text(encoding="utf-8")))
    assert mission.vehicle == vehicle
    assert parse_mission(flight_yaml(mission)).vehicle == vehicle
    again = CliRunner().invoke(app, ["identify", str(log), "--vehicle", str(out), "--json"], catch_exceptions=False)
    assert '"drag"' in again.output


def flight_yaml(mission) -> str:
    from verify.data.files.mission_file import mission_to_yaml

    return mission_to_yaml(mission)


@pytest.mark.parametrize(("change", "said"), [
    ({"thrust": None}, "lacks the columns thrust"),
    ({"ey": None}, "some of the columns ex, ey, ez"),
    ({"t": np.zeros(3)}, "times must go forward"),
    ({"t": np.array([0.0, 0.01, 0.9])}, "gap of 0.89 s at 0.01 s"),
    ({"t": np.array([0.0, 0.1, 0.2])}, "10 samples a second; 40 are needed"),
    ({"x": np.array([0.0, np.nan, 0.2])}, "line 3: x is 'nan'; it must be a number"),
])  # fmt: skip
def test_a_table_that_is_none_is_refused(tmp_path: Path, change: Mapping[str, np.ndarray | None], said: str):
    columns = {
        name: np.linspace(0.0, 0.02, 3) for name in ("t", "x", "y", "z", "roll", "pitch", "yaw", "thrust", "ex", "ey", "ez")
    }
    path = tmp_path / "log.csv"
    path.write_text(csv_of({name: values for name, values in {**columns, **change}.items() if values is not None}))
    with pytest.raises(BadInput, match=said):
        read_recorded(path)


def test_of_several_robots_one_is_named(tmp_path: Path):
    path = tmp_path / "log.csv"
    path.write_text(
        csv_of({name: np.linspace(0.0, 0.02, 3) for name in ("t", "x", "y", "z", "roll", "pitch", "yaw", "thrust")}, ("a", "b"))
    )
    with pytest.raises(BadInput, match="2 robots; name one with --robot: a, b"):
        read_recorded(path)
    with pytest.raises(BadInput, match="no rows of 'c'"):
        read_recorded(path, "c")
    assert isinstance(read_recorded(path, "b"), Recorded)
    path.write_text(
        csv_of({name: np.linspace(0.0, 0.02, 3) for name in ("t", "x", "y", "z", "roll", "pitch", "yaw", "thrust")})
    )
    with pytest.raises(BadInput, match="has no column `robot`"):
        read_recorded(path, "b")


@pytest.mark.parametrize(("text", "said"), [
    ("vehicles: {}\n", "is no profile"),
    ("vehicle: {name: mine}\n", "mass"),
    (profile_text(STOCK).replace("mass: 0.033", "mass: 0.033\n  uncertain: {mass: [0.034, 0.035]}"), "not within uncertain.mass"),
    (profile_text(STOCK).replace("mass: 0.033", "mass: 0.033\n  uncertain: {thrust: [1.05, 0.95]}"), "no range"),
])  # fmt: skip
def test_a_profile_that_is_none_is_refused(tmp_path: Path, text: str, said: str):
    path = tmp_path / "profile.yaml"
    path.write_text(text)
    with pytest.raises(BadInput, match=said):
        read_profile(path)


def ranged(**uncertain: tuple[float, float]) -> Vehicle:
    return STOCK.changed(uncertain=uncertain)


def test_corners_are_the_ends_of_what_is_not_known():
    plan, team = hop()
    still = plan.mission.model_copy(update={"vehicle": ranged(thrust=(1.0, 1.0), mass=(0.033, 0.033), noise=(0.001, 0.001))})
    one = fly_corners(still, team, 0.05)
    assert [dict(corner.ends) for corner in one.corners] == [{"latency": "least"}, {"latency": "most"}]
    whole = fly_corners(plan.mission, team, 0.05, seeds=(0,))
    assert len(whole.corners) == 2 ** len(USUAL)
    assert whole.worst.worst >= max(corner.worst for corner in one.corners)
    assert "by quad0, flown by mellinger" in whole.sentences[0]
    narrow = fly_corners(plan.mission, team, 0.9 * whole.worst.worst)
    assert 0 < sum(bool(corner.left) for corner in narrow.corners) < 16
    assert "The tube is left at" in narrow.sentences[1]
    assert narrow.to_dict()["corners"][0]["ends"]["mass"] == "least"


def test_drag_that_was_identified_is_what_flies():
    vehicle = ranged(drag=(2.0e-6, 3.0e-6))
    airframe = airframe_of(vehicle)
    assert airframe.rotor_drag == pytest.approx(2.5e-6)
    assert airframe.inflow_drag / airframe.rotor_drag == pytest.approx(7.553 / 10.2506)
    assert airframe.doubt == ""
    assert intervals_of(airframe)["drag"] == (2.0e-6, 3.0e-6)
    assert intervals_of(airframe_of(STOCK))["thrust"] == (0.92, 1.08)


def test_a_rehearsal_flies_the_corners_of_a_profile():
    plan, team = hop()
    few = flight.Combinations(("mellinger",), (1.0,), (0.015,), ("0",), corners=True, profiles=(ranged(thrust=(0.8, 1.2)),))
    found = flight.rehearse(plan, team, stand_in(plan, team), combinations=few, runs=1)
    assert found.corners is not None
    assert found.corners.intervals["quad0"]["thrust"] == (0.8, 1.2)
    assert found.to_dict()["corners"]["runs"] == 1
    assert any("corners of what is not known" in sentence for sentence in found.sentences)
    plain = flight.Combinations(("mellinger",), (1.0,), (0.015,), ("0",))
    assert flight.rehearse(plan, team, stand_in(plan, team), combinations=plain, runs=1).corners is None
    with pytest.raises(BadInput, match="which nobody flies here"):
        fly_corners(plan.mission, team, 0.05, profiles=(load_vehicle("px4-x500"),))


@pytest.mark.slow
def test_a_run_with_such_a_profile_states_the_worst():
    import ltlplan
    from ltlplan.report.brief import brief_lines

    mission = ltlplan.load_mission("hoops-sequence").changed(vehicle=ranged(thrust=(0.97, 1.0), drag=(1.0e-6, 1.2e-6)))
    result = ltlplan.run(mission)
    assert result.corners is not None
    assert len(result.corners.corners) == 32
    assert any("corners of what is not known" in line for line in brief_lines(result))
    assert ltlplan.run("hoops-sequence").corners is None
