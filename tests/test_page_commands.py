"""Commands and Python of pages that are no walks: each runs in a folder that holds what the page speaks of.

Commands that need a radio or another page's service do not.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from ltlplan import Client
from tests.helpers.motion.fleets import show_of, trajectory_of, write_show
from tests.helpers.serving.services import serving
from tests.test_site import BLOCK, DOCS, EXTENDING, FIRST, PAGES, ROOT, WALKS, WATCHING, Reader, named_commands

RADIO = re.compile(r"--link (crazyflie|mavlink)")
"""Of a command that needs vehicles: it is parsed only."""
SHORTER = {" RUN ": " run ", " LOG ": " run/flight.csv ", "--runs 1000": "--runs 3"}
"""What stands for placeholders of a page, and for what takes minutes."""
ELSEWHERE: Mapping[str, str] = {
    "service.md": "tests/ltlplan/service",
    "identify.md": "tests/flight/identification",
    EXTENDING: "tests/test_extending.py",
    "how-to/watch-flights.md": "tests/test_page_commands.py",
}
"""Where the commands of other pages run."""
SCRIPTS: Mapping[str, str] = {"library.md": "tests/test_readme.py", EXTENDING: "tests/test_extending.py"}
"""Where the Python of other pages runs."""
SERVICE = "http://127.0.0.1:8000"
"""A service, as pages have it."""
HALL = """
format: 1
name: hall
spec: {formula: F site}
workspace: {min: [-2, -2, 0], max: [2, 2, 2]}
regions:
  site: {center: [1, 0, 1], radii: [0.3, 0.3, 0.3]}
  smoke: {center: [0, 1.5, 1], radii: [0.3, 0.3, 0.3]}
agents: {quad0: {start: [-1, 0, 1]}, quad1: {start: [-1, -1, 1]}}
vehicle: crazyflie-2.1
separation: 0.3
margin: 0.02
"""


def a_run(reader: Reader) -> None:
    """Leave a run of the fire-fighting mission."""
    reader.type("ltlplan run firefighting --out run")


def flights_of_others(reader: Reader) -> None:
    """Leave a folder of trajectories, a hall, and a show with settings of its own."""
    (reader.folder / "hall.yaml").write_text(HALL, encoding="utf-8")
    reader.type("ltlplan run hall.yaml --out run && mkdir flights && cp run/crazyswarm2/*.csv flights")
    up = trajectory_of([[0, [0, 0, 0], []], [5, [0, 0, 5]]])
    beside = trajectory_of([[0, [0, 6, 0], []], [5, [0, 6, 5]]])
    settings = {"validation": {"maxAltitude": 6, "minDistance": 3}}
    write_show(reader.folder / "show.skyc", show_of([("a", up), ("b", beside)], settings=settings))


def nothing(reader: Reader) -> None:
    """Leave an empty folder."""


PREPARED: Mapping[str, Callable[[Reader], None]] = {
    "audit.md": flights_of_others,
    "live.md": nothing,
    "on-board.md": a_run,
    "px4.md": nothing,
    "recordings.md": a_run,
    "tracking.md": a_run,
}


def with_commands() -> set[str]:
    """Return the pages that name commands of ours and are no walks."""
    others = (page for page in PAGES[:-1] if page not in (*WALKS, FIRST) and named_commands(page))
    return {str(page.relative_to(DOCS)) for page in others}


def test_the_commands_of_each_page_run_somewhere() -> None:
    assert with_commands() == {*PREPARED, *ELSEWHERE}
    assert [place for place in ELSEWHERE.values() if not (ROOT / place).exists()] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", PREPARED)
def test_commands_of_a_page_run(name: str, tmp_path: Path) -> None:
    """A verdict may be no; what is bad input, a bug of ours or beyond a vehicle is not what a page shows."""
    reader = Reader(tmp_path, Path(sys.executable).parent, str(ROOT))
    PREPARED[name](reader)
    for line in named_commands(DOCS / name):
        if not RADIO.search(line):
            command = line
            for text, other in SHORTER.items():
                command = command.replace(text, other)
            printed = reader.type(f"{command}\necho ended with $?")
            assert re.search(r"ended with [05]$", printed.strip(), re.MULTILINE), printed


def scripts(page: Path) -> list[str]:
    """Return a page's blocks of Python."""
    return [text for language, _, text in BLOCK.findall(page.read_text(encoding="utf-8")) if language == "python"]


def run_scripts(reader: Reader, texts: list[str]) -> str:
    """Return what scripts print, each run by itself and to its end."""
    printed = ""
    for text in texts:
        (reader.folder / "script.py").write_text(text, encoding="utf-8")
        printed += reader.type("python script.py; echo ended with $?")
        assert printed.endswith("ended with 0\n"), printed
    return printed


def test_the_python_of_each_page_runs_somewhere() -> None:
    with_python = {str(page.relative_to(DOCS)) for page in PAGES[:-1] if page not in (*WALKS, FIRST) and scripts(page)}
    assert with_python == {"audit.md", "on-board.md", "service.md", "testing.md", "how-to/watch-flights.md", *SCRIPTS}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "prepare", "says"), [("audit.md", flights_of_others, ""), ("on-board.md", nothing, r"0\.0\d+ 0\.\d+\n")]
)
def test_python_of_a_page_runs(name: str, prepare: Callable[[Reader], None], says: str, tmp_path: Path) -> None:
    reader = Reader(tmp_path, Path(sys.executable).parent, str(ROOT))
    prepare(reader)
    printed = run_scripts(reader, scripts(DOCS / name))
    assert re.fullmatch(f"{says}ended with 0\n", printed), printed


@pytest.mark.slow
def test_tests_of_the_page_on_testing_pass(tmp_path: Path) -> None:
    texts = scripts(DOCS / "testing.md")
    for number, text in enumerate(texts):
        (tmp_path / f"test_{number}.py").write_text(text, encoding="utf-8")
    printed = Reader(tmp_path, Path(sys.executable).parent, str(ROOT)).type("python -m pytest -q")
    count = sum(text.count("\ndef test_") for text in texts)
    assert f"{count} passed" in printed, printed


@contextmanager
def in_the_air(service: str, reader: Reader) -> Generator[subprocess.Popen[str]]:
    """Have the fire-fighting team in the air, listening as `lab`."""
    command = [sys.executable, "-m", "ltlplan", "online", "firefighting", "--certified", "--link", "simulated"]
    with subprocess.Popen(
        [*command, "--follow", f"{service}/live/lab"], cwd=reader.folder, env={**os.environ, "PYTHONPATH": reader.paths},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as flight:  # fmt: skip
        assert flight.stdout is not None
        assert any(line.startswith("climb") for line in flight.stdout)
        try:
            yield flight
        finally:
            flight.kill()


@contextmanager
def flying(service: str, reader: Reader) -> Generator[None]:
    """Have the fire-fighting team in the air, as above; it flies to its end, or lands where a late event leaves no way that is proved."""
    with in_the_air(service, reader) as flight:
        yield
        said, _ = flight.communicate(timeout=120)
        assert flight.returncode in (0, 5), said
        assert re.search(r"^the motors of quad0,.* quad2 are stopped\.$", said, re.MULTILINE), (
            said
        )  # quad1 has failed, and may be down


@pytest.mark.slow
def test_python_of_the_service_page_runs(tmp_path: Path) -> None:
    """The recording is the flight of the job that the page asks for; the flight in the air answers as the page says."""
    reader = Reader(tmp_path, Path(sys.executable).parent, str(ROOT))
    with serving(tmp_path / "data", webhook_hosts=["hooks.lab.example"]) as served:
        with Client(served.url) as client:
            (tmp_path / "recording.csv").write_bytes(client.submit("firefighting", seed=2).wait().file("flight.csv"))
        texts = (text.replace(SERVICE, served.url).replace("runs=1000", "runs=3") for text in scripts(DOCS / "service.md"))
        use, *others, live = texts
        assert "1.0 done" in run_scripts(reader, [use])
        reader.finish("ltlplan missions --show firefighting > mission.yaml")
        run_scripts(reader, others)
        assert (tmp_path / "out" / "certificate.json").exists()
        assert any((tmp_path / "exported").iterdir())
        with flying(served.url, reader):
            printed = run_scripts(reader, [live])
    assert "1 quad1 fails True quad1 fails and lands, from " in printed
    assert "2 water moves 0.3,-0.7,0.9 " in printed, "it is answered, whether it comes in time or not"


@pytest.mark.slow
def test_commands_and_python_of_the_page_on_watching_run(tmp_path: Path) -> None:
    """Flights are followed to their ends; one in the air is stopped, and lands."""
    reader = Reader(tmp_path, Path(sys.executable).parent, str(ROOT))
    a_run(reader)
    with serving(tmp_path / "data") as served:
        commands = [line.replace(SERVICE, served.url) for line in named_commands(WATCHING)]
        assert len(commands) == 2
        for command in commands:
            reader.finish(command)
    with serving(tmp_path / "another") as served:
        (stop,) = (text.replace(SERVICE, served.url) for text in scripts(WATCHING))
        with in_the_air(served.url, reader) as flight:
            run_scripts(reader, [stop])
            said, _ = flight.communicate(timeout=120)
    assert "stop" in said, said
