"""Lines of files that grow and of named pipes, as they come."""

import os

import pytest

from ltlplan.online.event_sources.files import FollowedFile
from verify.data import BadInput
from verify.data.events import HoopMoves, NewFormula, RobotLeaves


def test_a_file_that_grows_is_followed_line_by_line(tmp_path):
    path = tmp_path / "events"
    path.write_text("12.5 one fails\n# said\n\nleft mov")
    followed = FollowedFile(str(path))
    assert followed() == [RobotLeaves(time=12.5, robot="one")]
    assert followed() == []
    with path.open("a") as file:
        file.write("es 0.3,-0.7,0.9\nnonsense\nformula F left\n")
    moved, fault, asked = followed()
    assert moved == HoopMoves(time=0.0, region="left", center=(0.3, -0.7, 0.9))
    assert fault.startswith("Not done: 'nonsense' is no event")
    assert asked == NewFormula(time=0.0, formula="F left")
    followed.close()


def test_a_named_pipe_is_followed_whoever_writes_into_it(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    followed = FollowedFile(str(path))
    assert followed() == []
    for line in ("one fails", "two leaves"):
        with path.open("w") as file:
            file.write(f"{line}\n")
        (event,) = followed()
        assert str(event) == f"{line} and lands"
    assert followed() == []
    followed.close()


def test_a_line_without_an_end_does_not_fill_the_memory(tmp_path):
    path = tmp_path / "events"
    path.write_text("x" * 200_000)
    followed = FollowedFile(str(path))
    said = [text for _ in range(5) for text in followed()]
    assert all("too long" in text for text in said)
    assert said
    followed.close()


def test_a_file_that_is_not_there_is_said_with_what_to_do(tmp_path):
    with pytest.raises(BadInput, match="mkfifo"):
        FollowedFile(str(tmp_path / "nothing"))
