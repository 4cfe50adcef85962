"""What crazyflies.yaml tells the firmware, and where addresses and weights come from."""

from __future__ import annotations

import json

import pytest
from ruamel.yaml import YAML

import flight
from verify.data import BadInput, DoesNotFit


def robots_of(folder):
    return YAML(typ="safe", pure=True).load((folder / "crazyflies.yaml").read_text())["robots"]


def test_the_firmware_is_told_what_the_margin_assumes(certified, tmp_path) -> None:
    team, cert = certified
    flight.export(team, cert, tmp_path, force=True)
    for name, row in robots_of(tmp_path).items():
        told = row["firmware_params"]
        assert told["stabilizer"]["controller"] == 2
        assert told["ctrlMel"]["mass"] == cert.mission.vehicle_of(name).mass
        assert told["locSrv"] == {"extPosStdDev": 0.001, "extQuatStdDev": 0.05}


def test_addresses_and_weights_come_from_the_users_file_and_it_stays_as_it_is(certified, tmp_path) -> None:
    team, cert = certified
    file = tmp_path / "crazyflies.yaml"
    text = (
        "# mine\nrobots:\n  quad1: {uri: 'radio://1/90/2M/E7E7E7E799', mass: 0.0341, enabled: false, initial_position: [0, 0, 0]}\n"
        "  other: {uri: 'radio://1/90/2M/E7E7E7E798'}\n"
    )
    file.write_text(text)
    done = flight.export(team, cert, tmp_path / "out", inventory=file, force=True)
    assert file.read_text() == text
    found = robots_of(tmp_path / "out")
    assert set(found) == set(team)
    assert found["quad1"]["uri"] == "radio://1/90/2M/E7E7E7E799"
    assert found["quad1"]["firmware_params"]["ctrlMel"]["mass"] == 0.0341
    assert found["quad0"]["firmware_params"]["ctrlMel"]["mass"] == 0.033
    assert any("quad1 weighs 34.1 g, its limits are certified for 33.0 g" in note for note in done.notes)
    with pytest.raises(BadInput, match=r"crazyflies\.yaml"):  # the folder with the user's own file is not written into
        flight.export(team, cert, tmp_path, inventory=file, force=True)
    assert file.read_text() == text
    flight.export(team, cert, tmp_path / "both", inventory=file, uris={"quad1": "radio://2/1/2M/E7E7E7E701"}, force=True)
    assert robots_of(tmp_path / "both")["quad1"]["uri"] == "radio://2/1/2M/E7E7E7E701"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("robots: {quad0: {uri: 5}}", r"quad0\.uri must be an address"),
        ("robots: {quad0: {mass: -1}}", r"quad0\.mass must be a number of kg"),
        ("robots: {quad0: {mass: .nan}}", r"quad0\.mass must be a number of kg"),
        ("robots: {quad0: {mas: 0.03}}", r"quad0\.mas: unknown key.*mass"),
        ("robots: {quad0: {id: 0}}", r"quad0\.id must be a MAVLink system of 1 to 255, not 0"),
        ("robots: {quad0: {id: 1.0}}", r"quad0\.id must be a MAVLink system"),
        ("robots: {quad0: {uri: '0.0.0.0'}}", r"quad0\.uri must be an address such as radio://.* or udpin:"),
        ("robots: {quad0: 5}", "must be a table"),
        ("robots: {quad0: {uri: 'radio://0'}, quad1: {uri: 'radio://0'}}", "quad0 and quad1 have one address"),
        (
            "robots: {quad0: {uri: 'radio://0/80/2M/E7E7E7E7E1'}, quad1: {uri: 'radio://0/080/2M/e7e7e7e7e1'}}",
            "quad0 and quad1 have one address",
        ),
        (
            "robots: {quad0: {uri: 'radio://0/80/2M/E7E7E7E7O1'}}",
            r"quad0\.uri: radio://0/80/2M/E7E7E7E7O1 is no address: write radio://",
        ),
        ("robots: {quad0: {uri: 'radio://0/126/2M/E7E7E7E701'}}", r"quad0\.uri: .* a channel of 0 to 125"),
        ("robots: {cf1: {uri: 'radio://0'}}", "no robot of the mission"),
        ("- 5", "needs a table"),
        ("robots: [", "no YAML"),
    ],
)
def test_a_bad_inventory_is_refused_with_its_place(certified, tmp_path, text, says) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    with pytest.raises(BadInput, match=says):
        flight.export(*certified, tmp_path / "out", inventory=file, force=True)
    assert not (tmp_path / "out").exists()


def test_addresses_of_more_radios_than_the_skew_was_reckoned_for_are_refused(certified, tmp_path) -> None:
    team, cert = certified
    uris = {"quad0": "radio://0/80/2M/E7E7E7E701", "quad1": "radio://1/80/2M/E7E7E7E702"}
    with pytest.raises(BadInput, match=r"those of 2 radios.*counts on 1"):
        flight.export(team, cert, tmp_path, uris=uris, force=True)
    flight.export(team, cert, tmp_path, uris={**uris, "quad1": "radio://0/80/2M/E7E7E7E702"}, force=True)
    assert (tmp_path / "README.txt").exists()


def test_a_robot_that_weighs_much_more_is_another_airframe(certified, tmp_path) -> None:
    with pytest.raises(DoesNotFit, match=r"quad0 weighs 40\.0 g, and was certified as 33\.0 g"):
        flight.export(*certified, tmp_path, inventory={"quad0": {"mass": 0.040}}, force=True)


def test_px4_vehicles_have_the_systems_that_the_inventory_says(certified, tmp_path) -> None:
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    team, cert = certified
    mine = {"quad0": {"id": 7, "uri": "udpin:0.0.0.0:14540"}, "other": {"id": 7}}
    done = flight.export(team, cert, tmp_path / "out", format="px4", inventory=mine, force=True)
    told = json.loads((tmp_path / "out" / "flight.json").read_text())["robots"]
    assert {name: row["system"] for name, row in told.items()} == {name: k + 1 if k else 7 for k, name in enumerate(team)}
    assert any("quad0 is system 7" in note for note in done.notes)
    with pytest.raises(BadInput, match="quad0 and quad1 are both MAVLink system 2; write `id` of each"):
        flight.export(team, cert, tmp_path / "no", format="px4", inventory={"quad0": {"id": 2}}, force=True)
