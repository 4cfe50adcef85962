"""Nothing is exported that is not certified, that the target cannot hold, or that would take the place of somebody else's files."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import flight
from flight.exports.crazyflies.compressed import COMPRESSED, compressed_bytes
from tests.helpers.motion.stand_ins import Claim, hoop6, hover, rest_to_rest, stand_in
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.vehicles.trajectory_bytes import compressed_trajectory
from verify.data import BadInput, DoesNotFit, NotCertified, Trajectory, load_vehicle


def test_what_is_not_certified_is_refused(certified, tmp_path):
    team, cert = certified
    out = tmp_path / "out"
    with pytest.raises(NotCertified, match="no certificate"):
        flight.export(team, None, out, force=True)
    coefficients = team["quad0"].coefficients.copy()
    coefficients[0, 0, 7] = np.nextafter(np.float32(coefficients[0, 0, 7]), np.float32(1))
    with pytest.raises(NotCertified, match="differ"):
        flight.export({**team, "quad0": Trajectory(team["quad0"].durations, coefficients)}, cert, out, force=True)
    with pytest.raises(NotCertified, match=r"airframe 'crazyflie-2\.1', not 'split-s-racer'"):
        flight.export(team, cert, out, vehicle="split-s-racer", force=True)
    broken = dataclasses.replace(cert, claims=(Claim("limits.speed", "fails", "too fast."),))
    with pytest.raises(NotCertified, match=r"limits\.speed"):
        flight.export(team, broken, out, force=True)
    assert not out.exists()


def test_an_airframe_that_is_no_crazyflie_does_not_fit(certified, tmp_path):
    team, cert = certified
    other = dataclasses.replace(cert, mission=cert.mission.model_copy(update={"vehicle": load_vehicle("split-s-racer")}))
    for name in ("crazyswarm2", "crazyflie"):
        with pytest.raises(DoesNotFit, match="no Crazyflie"):
            flight.export(team, other, tmp_path, format=name, force=True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"format": "crazyswarm"}, "Did you mean 'crazyswarm2'"),
        ({"rate": 3}, "not an option"),
        ({"uris": {"quad9": "x"}}, "quad9"),
        ({"format": "crazyflie", "trajectory_ids": {"quad9": 1}}, "quad9"),
        ({"format": "px4", "rate": 1.0}, "rate"),
        ({"format": "px4", "origin": (1, 2)}, "origin"),
        ({"format": "ros2", "rate": 9999}, "rate"),
    ],
)
def test_unknown_formats_and_options_are_refused(certified, tmp_path, options, message):
    with pytest.raises(BadInput, match=message):
        flight.export(*certified, tmp_path, **options, force=True)


def test_nothing_of_somebody_elses_is_overwritten(certified, tmp_path):
    for name in ("README.txt", "quad0.csv"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).write_text("years of work")
        with pytest.raises(BadInput, match=f"ltlplan did not write it .it holds {name}"):
            flight.export(*certified, folder, force=True)
        assert [path.name for path in folder.iterdir()] == [name]
        assert (folder / name).read_text() == "years of work"
    for _ in range(3):
        flight.export(*certified, tmp_path / "mine", force=True)
        (tmp_path / "mine" / "notes.txt").write_text("kept")
    assert (tmp_path / "mine" / "notes.txt").read_text() == "kept"
    addresses = tmp_path / "mine" / "crazyflies.yaml"
    addresses.write_text(addresses.read_text().replace("E7E7E7E701", "E7E7E7E7AA"))
    with pytest.raises(BadInput, match=r"crazyflies\.yaml is yours, or was changed since ltlplan wrote it"):
        flight.export(*certified, tmp_path / "mine", force=True)
    assert "E7E7E7E7AA" in addresses.read_text()


def test_an_export_that_fails_half_way_leaves_nothing(certified, tmp_path):
    out = tmp_path / "out"
    flight.export(*certified, out, force=True)
    before = {path.name: path.read_bytes() for path in out.rglob("*") if path.is_file()}

    def full(_path: Path, _content: bytes) -> int:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        with pytest.raises(BadInput, match="cannot be written: No space left"):
            flight.export(*certified, out, force=True)
    assert {path.name: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    assert list(tmp_path.iterdir()) == [out]


def test_an_upload_that_reaches_nobody_is_told_in_words(certified, tmp_path, capfd):
    pytest.importorskip("cflib", reason="cflib is not installed")
    flight.export(*certified, tmp_path / "out", format="crazyflie", force=True)
    uris = {"quad0": "nowhere://0/80/2M/E7E7E7E701", "quad1": "nowhere://0/80/2M/E7E7E7E702"}
    with pytest.raises(
        BadInput, match=r"quad0 at nowhere://.* cannot be sent to: .*; no robot has been sent its trajectory so far"
    ):
        flight.upload(tmp_path / "out", uris)
    assert capfd.readouterr() == ("", "")


def test_the_firmwares_limits_are_refused_with_their_numbers(certified, tmp_path):
    plan, team = made_flight()
    long = {**team, "quad0": hover(32)}
    for name in ("crazyswarm2", "crazyflie"):
        with pytest.raises(DoesNotFit, match=r"32 pieces.*31"):
            flight.export(long, stand_in(plan, long), tmp_path, format=name, force=True)
    full = {**team, "quad0": hover(31)}
    flight.export(full, stand_in(plan, full), tmp_path, format="crazyflie", force=True)
    with pytest.raises(DoesNotFit, match="id 31 is out of range"):
        flight.export(*certified, tmp_path, format="crazyflie", trajectory_ids={"quad0": 31}, force=True)
    with pytest.raises(DoesNotFit, match="multiple of 4"):
        flight.export(*certified, tmp_path, format="crazyflie", offset=130, force=True)
    with pytest.raises(DoesNotFit, match="has 96 left"):
        flight.export(*certified, tmp_path, format="crazyflie", offset=4000, force=True)
    rough = {**team, "quad0": Trajectory([1 / 3], hover().coefficients)}
    with pytest.raises(DoesNotFit, match="float32"):
        flight.export(rough, stand_in(plan, rough), tmp_path, format="crazyflie", force=True)


def test_compressed_limits_are_refused_with_their_numbers(tmp_path):
    with pytest.raises(DoesNotFit, match=r"33 m.*32\.767"):
        flight.quantised({"q": hover(1, (33.0, 0.0, 1.0))})
    with pytest.raises(DoesNotFit, match=r"heading of 3437\.7.*3276\.7"):
        flight.quantised({"q": rest_to_rest([(0, 0, 1), (1, 0, 1)], [2.0], yaw=60.0)})
    around = hover(2).coefficients.copy()
    around[:, 3, :2] = [[0.0, np.pi], [np.pi, np.pi]]
    with pytest.raises(DoesNotFit, match="turns around once a lap"):
        flight.quantised({"q": Trajectory([1.0, 1.0], around, cycle=0)})
    assert COMPRESSED.prepare is not None
    COMPRESSED.prepare({"q": rest_to_rest([(0, 0, 1), (1, 0, 1)], [2.0], yaw=np.radians(33.4))}, 1)
    with pytest.raises(DoesNotFit, match=r"q starts with a heading of 33\.37 degrees, .* write 33\.4 in its `yaw_deg`"):
        COMPRESSED.prepare({"q": rest_to_rest([(0, 0, 1), (1, 0, 1)], [2.0], yaw=np.radians(33.37))}, 1)
    with pytest.raises(DoesNotFit, match=r"70 s.*65\.535"):
        compressed_bytes("q", hover(1, duration=70.0))
    plan, team = made_flight()
    smooth = {**team, "quad0": hoop6()}
    with pytest.raises(DoesNotFit, match=r"certify `flight\.quantised"):
        flight.export(smooth, stand_in(plan, smooth), tmp_path, format="crazyflie-compressed", force=True)
    with pytest.raises(BadInput, match="step"):
        flight.quantised({"q": hover()}, step=0.0)
    for data in (b"", b"\0" * 8, b"\0" * 11, b"\0" * 8 + b"\xff\x01\x00\x02"):
        with pytest.raises(BadInput):
            compressed_trajectory(data)
