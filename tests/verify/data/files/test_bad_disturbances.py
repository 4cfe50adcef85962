"""What people mistype in `disturbance` and `margin`: one sentence each, with what would be right."""

from __future__ import annotations

import pytest

from tests.helpers.motion.flights import small_mission
from verify.data import parse_mission
from verify.data.files.mission_file import mission_to_yaml
from verify.data.validation.faults import MissionError

PLAIN = mission_to_yaml(small_mission("F a", margin=0.05))


def said(disturbance: str, margin: str = "0.05") -> str:
    with pytest.raises(MissionError) as error:
        parse_mission(PLAIN.replace("margin: 0.05\n", f"margin: {margin}\ndisturbance: {disturbance}\n"))
    assert len(error.value.faults) == 1
    return str(error.value)


@pytest.mark.parametrize(
    ("told", "says"),
    [
        ("wnd: 0.05", "disturbance.wnd: unknown key. Did you mean 'wind'?"),
        ("latncy: [0.0, 0.001]", "Did you mean 'latency'?"),
        ("rest: {sped: 0.1}", "disturbance.rest.sped: unknown key. Did you mean 'speed'?"),
        ("setpoints: {ages: [0.0, 0.01]}", "Did you mean 'age'?"),
        ("latency: [0.0, 15.0]", "less than or equal to 0.02, not 15.0 (s, age of what it is given: least and most)"),
        ("latency: 0.001", "must be a list, such as [1, 2], not 0.001"),
        ("latency: [0.01, 0.001]", "the least comes first"),
        ("mass: 2", "less than or equal to 0.3, not 2 (share by which the mass may differ)"),
        ("wind: -0.1", "greater than or equal to 0, not -0.1 (m/s, of the air in any direction"),
        ("wind: 0.05 m/s", "should be a valid number, not '0.05 m/s'"),
        ("battery: 0.3", "greater than 0.5, not 0.3 (least share of the rotors' greatest speed"),
    ],
)
def test_a_wrong_disturbance_is_told_with_what_would_be_right(told: str, says: str) -> None:
    message = said(f"{{airframe: crazyflie-2.1, {told}}}")
    assert says in message


@pytest.mark.parametrize("told", ["[0.05]", "0.05", "crazyflie-2.1"])
def test_a_disturbance_that_is_no_table_is_told_so_beside_margin_auto(told: str) -> None:
    message = said(told, margin="auto")
    assert "disturbance: must be a table of keys" in message


def test_a_margin_in_other_words_is_told_of_auto() -> None:
    message = said("{airframe: crazyflie-2.1}", margin="automatic")
    assert "margin: must be a number, in m, or `auto` beside `disturbance`, not 'automatic'" in message
