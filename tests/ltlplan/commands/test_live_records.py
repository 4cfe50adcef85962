"""What vehicles flew is kept, whatever is flown or written next."""

import json
from pathlib import Path

import pytest

from flight.storage.folders import write_files
from ltlplan.commands.support.live_flight import flown_over, keep_record
from verify.data import BadInput


def test_a_record_says_over_which_link_it_was_flown_and_only_a_simulated_one_makes_room(tmp_path: Path) -> None:
    for kind in ("simulated", "crazyflie", "mavlink"):
        texts = flown_over(kind, {"live.json": '{"starts": {}}', "poses.csv": "t"})
        assert json.loads(texts["live.json"]) == {"link": kind, "starts": {}}
        write_files(tmp_path / kind, {name: text.encode() for name, text in texts.items()})
    keep_record(None)
    keep_record(tmp_path / "nothing")
    keep_record(tmp_path / "simulated")
    for kind in ("crazyflie", "mavlink"):
        with pytest.raises(BadInput, match="record of a live flight, which would be lost; name another folder"):
            keep_record(tmp_path / kind)


@pytest.mark.parametrize("text", ["{}", "[]", '{"starts": {}}'])
def test_a_record_that_does_not_say_it_is_kept(tmp_path: Path, text: str) -> None:
    (tmp_path / "live.json").write_text(text)
    with pytest.raises(BadInput, match="would be lost"):
        keep_record(tmp_path)
