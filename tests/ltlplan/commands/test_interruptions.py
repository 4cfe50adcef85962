"""What a run leaves behind when it is interrupted, killed, piped into `head`, or has nowhere to write."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from flight.storage.folders import write_folder
from ltlplan.reproduction.published_missions import office_grid
from tests.helpers.few import few_of
from verify import recheck
from verify.data import BadInput
from verify.data.files.mission_file import mission_to_yaml

ROOT = Path(__file__).parents[3]
SLOW_WRITER = """
import sys, time
from pathlib import Path
from ltlplan.start import end_cleanly_on_sigterm
from flight.storage.folders import write_folder
from ltlplan.reproduction.published_missions import office_grid
end_cleanly_on_sigterm()
def write(folder):
    (folder / "mission.yaml").write_text("half")
    print("writing", flush=True)
    time.sleep(60)
write_folder(Path(sys.argv[1]), write)
"""


def heed_interrupts() -> None:
    """Let a child hear Ctrl-C though it may be ignored here, as under `nohup`."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def write_mark(folder: Path) -> None:
    (folder / "mission.yaml").write_text("whole")


def start(target: Path) -> subprocess.Popen[str]:
    """Return a process that is in the middle of writing `target`."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    writer = subprocess.Popen(
        [sys.executable, "-c", SLOW_WRITER, str(target)],
        preexec_fn=heed_interrupts,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert writer.stdout is not None
    assert writer.stdout.readline() == "writing\n"
    return writer


@few_of(1, "how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_writer_clears_up(how: signal.Signals, tmp_path: Path) -> None:
    writer = start(tmp_path / "run")
    writer.send_signal(how)
    writer.communicate(timeout=300)
    assert writer.returncode != 0
    assert list(tmp_path.iterdir()) == []


def test_the_next_writer_clears_up_after_a_killed_one_and_leaves_a_living_one_alone(tmp_path: Path) -> None:
    killed, living = start(tmp_path / "run"), start(tmp_path / "run")
    try:
        killed.kill()
        killed.communicate(timeout=300)
        assert len(list(tmp_path.iterdir())) == 2, "each writes beside the target"
        assert write_folder(tmp_path / "run", write_mark) == (
            tmp_path / "run" / "mission.yaml",
            tmp_path / "run" / "manifest.json",
        )
        assert len([path for path in tmp_path.iterdir() if path.name != "run"]) == 1, "only the dead one's is gone"
        assert living.poll() is None
    finally:
        living.terminate()
        living.communicate(timeout=300)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_folder_that_a_killed_writer_had_moved_away_comes_back(tmp_path: Path) -> None:
    left = tmp_path / ".run.ltlplan-abc"
    (left / "old").mkdir(parents=True)
    (left / "lock").touch()
    (left / "old" / "mission.yaml").write_text("the last run")
    (left / "old" / "notes.txt").write_text("mine")

    def fail(_folder: Path) -> None:
        raise BadInput("no")

    with pytest.raises(BadInput, match="no"):
        write_folder(tmp_path / "run", fail)
    assert (tmp_path / "run" / "mission.yaml").read_text() == "the last run"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def ltlplan(*arguments: str, cwd: Path, **options: object) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    told = {"preexec_fn": heed_interrupts, **options}
    return subprocess.Popen([sys.executable, "-m", "ltlplan", *arguments], cwd=cwd, env=environment, text=True, **told)  # type: ignore[call-overload]


@pytest.mark.parametrize("delay", [*(pytest.param(delay, marks=pytest.mark.slow) for delay in (0.0, 0.1, 0.2, 0.6)), 0.38])
def test_ctrl_c_is_no_bug(delay: float, tmp_path: Path) -> None:
    """Neither in the work nor while a library is being loaded, which may make of it an ImportError or a death by signal."""
    running = ltlplan("run", "firefighting", cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert running.stderr is not None
    assert "searching" in running.stderr.readline()
    time.sleep(delay)
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=300)
    assert running.returncode == 130
    assert said.endswith("interrupted; no file was left half-written.\n")
    assert "Traceback" not in said
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@few_of(1, "arguments", [("automaton", "F a"), ("plan", "nowhere", "--json"), ("check", "G !b", "b")])
def test_a_reader_that_has_gone(arguments: tuple[str, ...], tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    running = ltlplan(*arguments, cwd=tmp_path, stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    _, said = running.communicate(timeout=300)
    assert (running.returncode, said) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, a disk without room")
def test_an_output_without_room(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        running = ltlplan("automaton", "F a", "--json", cwd=tmp_path, stdout=full, stderr=subprocess.PIPE)
        _, said = running.communicate(timeout=300)
    assert (running.returncode, said) == (2, "bad input: The output cannot be read or written: No space left on device.\n")


def interrupted(code: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Return how a process ended that runs a piece of code which interrupts itself."""
    return subprocess.run(
        [sys.executable, "-c", code], cwd=cwd, env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=heed_interrupts, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip


INTERRUPTED_WHILE_LOADING = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
from ltlplan.start import main
sys.argv[1:] = ["missions"]
main()
"""


@few_of(2, "module", ["ltlplan.cli", "typer", "ltlplan.commands.missions", "verify.data", "numpy"])
def test_ctrl_c_while_the_command_line_itself_is_loaded(module: str, tmp_path: Path) -> None:
    running = interrupted(INTERRUPTED_WHILE_LOADING.replace("sys.argv[1]", repr(module)), tmp_path)
    assert (running.returncode, running.stderr) == (130, "interrupted; no file was left half-written.\n")


INTERRUPTED_UNHEARD = """
import os, signal, sys, weakref

class Dropping:
    def find_spec(self, name, path=None, target=None):
        if name == "scipy":
            thing = Dropping()
            if HOW == "callback":
                watch = weakref.ref(thing, interrupt)
                del thing
            else:
                try:
                    interrupt()
                except BaseException:
                    pass

def interrupt(*_):
    os.kill(os.getpid(), signal.SIGINT)
    sum(range(1000))

sys.meta_path.insert(0, Dropping())
from ltlplan.start import main
sys.argv[1:] = ["run", "firefighting"]
main()
"""


@few_of(1, "how", ["callback", "try"])
def test_ctrl_c_that_a_library_drops_is_raised_again(how: str, tmp_path: Path) -> None:
    running = interrupted(INTERRUPTED_UNHEARD.replace("HOW", repr(how)), tmp_path)
    assert (running.returncode, running.stderr.splitlines()[-1:]) == (130, ["interrupted; no file was left half-written."])
    assert "Traceback" not in running.stderr
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_until_interrupts_are_seen_to_nothing_is_loaded_that_takes_time() -> None:
    code = "import sys; before = {*sys.modules}; import ltlplan.start; print(*({*sys.modules} - before))"
    loaded = subprocess.run(
        [sys.executable, "-S", "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"typer", "typing", "re", "inspect", "logging", "numpy", "verify"} & set(loaded)


@pytest.mark.slow
def test_where_interrupts_are_ignored_the_work_goes_on(tmp_path: Path) -> None:
    """As under `nohup`, or in the background of a script."""

    def ignore() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    running = ltlplan("plan", "firefighting", cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=ignore)
    assert running.stderr is not None
    assert "searching" in running.stderr.readline()
    running.send_signal(signal.SIGINT)
    told, _ = running.communicate(timeout=300)
    assert running.returncode == 0
    assert "cost" in told


SMALL = """
format: 1
name: small
spec: {formula: F a}
regions: {a: {center: [0.5, 0, 1], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [-0.2, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
"""


def closing(*streams: int) -> Callable[[], None]:
    return lambda: [os.close(stream) for stream in streams] and None


@pytest.mark.parametrize(
    "arguments", [("missions",), ("automaton", "F a", "--json"), ("--help",), ("plan", "nowhere"), ("nothing",)]
)
def test_a_closed_output_is_told_before_the_work(arguments: tuple[str, ...], tmp_path: Path) -> None:
    running = ltlplan(*arguments, cwd=tmp_path, stderr=subprocess.PIPE, preexec_fn=closing(1))
    _, said = running.communicate(timeout=300)
    assert (running.returncode, said) == (
        2,
        "bad input: Standard output is closed; send it to a file, a program or /dev/null.\n",
    )
    running = ltlplan(*arguments, cwd=tmp_path, preexec_fn=closing(0, 1, 2))
    assert running.wait(timeout=300) == 2


@pytest.mark.slow
def test_nothing_is_printed_into_the_files_where_streams_are_closed(tmp_path: Path) -> None:
    """The first file that is opened would else be standard error, and progress would go into it."""
    (tmp_path / "small.yaml").write_text(SMALL)
    with (tmp_path / "told").open("w") as told:
        running = ltlplan("run", "small.yaml", "--out", "run", cwd=tmp_path, stdout=told, preexec_fn=closing(0, 2))
        assert running.wait(timeout=300) == 0
    assert recheck(tmp_path / "run").holds


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, a disk without room")
@few_of(
    1,
    ("standard_error", "arguments", "code"),
    [
        ("full", ("plan", "small.yaml"), 0),
        ("deserted", ("plan", "nowhere"), 2),
        pytest.param("full", ("plan", "nowhere"), 2, marks=pytest.mark.slow),
        pytest.param("deserted", ("plan", "small.yaml"), 0, marks=pytest.mark.slow),
    ],
)
def test_a_full_or_deserted_standard_error_ends_no_work(
    standard_error: str, arguments: tuple[str, ...], code: int, tmp_path: Path
) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    reading, writing = os.pipe()
    os.close(reading)
    with Path("/dev/full").open("w") as full:
        stream = full if standard_error == "full" else writing
        running = ltlplan(*arguments, cwd=tmp_path, stdout=subprocess.PIPE, stderr=stream)
        running.communicate(timeout=300)
    os.close(writing)
    assert running.returncode == code


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.0, 0.2, 0.8, 2.0, 4.0])
def test_ctrl_c_in_a_terminal_ends_a_campaign_and_its_processes_in_silence(delay: float, tmp_path: Path) -> None:
    """A terminal interrupts all processes of the command at once."""

    def alone() -> None:
        heed_interrupts()
        os.setsid()

    made = ltlplan("run", "hoops-published", "--out", "run", cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    made.communicate(timeout=300)
    assert made.returncode == 0
    arguments = ("campaign", "run", "--runs", "100000", "--noise", "0.001", "--workers", "2", "--out", "campaign")
    running = ltlplan(*arguments, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=alone)
    assert running.stderr is not None
    while "simulating" not in running.stderr.readline():
        pass
    time.sleep(delay)
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=300)  # ends when the processes' standard errors are closed, too
    *before, last = said.splitlines()
    assert (running.returncode, last) == (130, "interrupted; no file was left half-written.")
    assert all(line.startswith("[") for line in before), "nothing but how far it had come"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.slow
def test_ctrl_backslash_takes_the_best_plan_so_far(tmp_path: Path) -> None:
    mission = tmp_path / "office.yaml"
    asked = ("n0_7", "n5_5", "n9_3", "n13_7", "n3_3", "n12_1", "n6_0", "n10_6")
    formula = " & ".join(f"F({a} & F {b})" for a, b in zip(asked, (*asked[1:], asked[0]), strict=True))
    mission.write_text(mission_to_yaml(office_grid(f"{formula} & (!n9_3 U n10_6)")))
    planning = subprocess.Popen(
        [sys.executable, "-m", "ltlplan", "plan", str(mission)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert planning.stderr is not None
    while "no words cost less than" not in planning.stderr.readline():
        assert planning.poll() is None
    planning.send_signal(signal.SIGQUIT)
    told, errors = planning.communicate(timeout=300)
    assert planning.returncode == 0, errors
    assert "The search was stopped on request after " in told
    assert "the bound is " in told
