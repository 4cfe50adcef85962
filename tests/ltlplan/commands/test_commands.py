"""Every command used as a person would, on one run's folder."""

import html
import json
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import ltlplan.missions
from ltlplan.cli import app
from ltlplan.commands.support.terminal import open_page
from tests.helpers.pages import MOST_BYTES
from verify.data import BadInput, NotCertified, mission_to_yaml

runner = CliRunner()

SMALL = """
format: 1
name: small
spec: {formula: F a}
regions: {a: {center: [0.5, 0, 1], radii: [0.2, 0.2, 0.2]}, b: {center: [0.5, 1, 1], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [-0.2, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
planner: {pace: nominal}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, shipped_folder: Callable[[str], Path]) -> Path:
    """Return a run's folder that may be changed."""
    out = tmp_path_factory.mktemp("commands") / "firefighting"
    shutil.copytree(shipped_folder("firefighting"), out)
    return out


@pytest.fixture(scope="module")
def small_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the run of a mission that takes little work, which may be changed."""
    out = tmp_path_factory.mktemp("small")
    ltlplan.run(ltlplan.parse_mission(SMALL), out / "run")
    return out / "run"


def ok(*arguments: str) -> str:
    done = runner.invoke(app, list(arguments), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """Return the file of a mission that takes little work."""
    file = tmp_path / "small.yaml"
    file.write_text(SMALL)
    return file


def test_run_sums_up_what_holds(small: Path, tmp_path: Path) -> None:
    text = ok("run", str(small), "--out", str(tmp_path / "run"), "--verbose")
    for says in ("quad0", "word", "cost", "Certified for all t", "limits.speed", "worst tracking error", "certificate.json"):
        assert says in text


def test_run_ends_with_a_screen_and_opens_the_report(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("typer.launch", opened.append)
    monkeypatch.setenv("DISPLAY", ":0")
    out = tmp_path / "run of mine"
    said = ok("run", str(small), "--out", str(out), "--open").splitlines()
    lines = [line for line in said if not re.match(r"\[ *\d+%\]", line)]  # without progress
    assert len(lines) <= 24
    assert f"next    open {out / 'report.html'}" in lines
    assert any(line.endswith("claims checked by the kernel") for line in lines)
    assert opened == [str(out / "report.html")]
    command = next(line.strip() for line in lines if "check.pyz" in line).partition(": ")[0]
    assert Path(shlex.split(command)[1]) == out / "check.pyz"


def test_a_page_is_not_opened_where_there_is_no_desktop(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("typer.launch", opened.append)
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    open_page(Path("run/report.html"))
    assert opened == []
    assert capsys.readouterr().err == "There is no desktop here to open it on; take run/report.html to one.\n"
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    open_page(Path("run/report.html"))
    assert opened == [str(Path("run/report.html").absolute())]


def test_a_run_that_does_not_hold_prints_one_document(shipped_run, monkeypatch: pytest.MonkeyPatch) -> None:
    from ltlplan import pipeline
    from ltlplan.report import summary

    made = shipped_run("firefighting")  # by the real function, which waits for nobody
    monkeypatch.setattr(pipeline, "run", lambda *_, **__: made)
    monkeypatch.setattr(summary, "holds", lambda _result: False)
    done = runner.invoke(app, ["run", "firefighting", "--json"])
    assert done.exit_code == NotCertified.exit_code
    assert json.loads(done.stdout)["holds"] is False
    with pytest.raises(NotCertified, match="is not the certified one"):
        runner.invoke(app, ["run", "firefighting"], catch_exceptions=False)


def test_recheck_proves_it_again(small_run: Path) -> None:
    assert "every claim is proved again" in ok("recheck", str(small_run))


def test_a_margin_of_zero_is_certified_but_not_flown(small_run: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(small_run, copy)
    assert "certified at margin 0 m" in ok("certify", str(copy), "--margin", "0")
    ours = tmp_path / "none.yaml"
    ours.write_text(SMALL + "margin: 0.0\n")
    assert "quad0" in ok("plan", str(ours))
    for command in (
        ["run", "firefighting", "--margin", "0", "--out", str(tmp_path / "run")],
        ["run", str(ours), "--out", str(tmp_path / "run")],
        ["fly", str(ours)],
        ["fly", str(copy)],
        ["campaign", str(copy), "--runs", "2"],
        ["online", str(ours), "--certified"],
    ):
        with pytest.raises(BadInput, match="A margin of 0 m leaves no tube to fly in"):
            runner.invoke(app, command, catch_exceptions=False)
    assert not (tmp_path / "run").exists()


def test_certify_demands_a_margin(small_run: Path) -> None:
    assert "certified at margin 0.06 m" in ok("certify", str(small_run), "--margin", "0.06")
    with pytest.raises(NotCertified, match="The largest margin that holds"):
        ok("certify", str(small_run), "--margin", "0.2")
    assert "certified at margin 0.05 m" in ok("certify", str(small_run))


def test_a_recorded_flight_is_judged(small_run: Path) -> None:
    flight = str(small_run / "flight.csv")
    assert "satisfied" in ok("certify", str(small_run), "--flight", flight, "--max-speed", "1.2")
    with pytest.raises(BadInput, match="without a speed bound"):
        ok("certify", str(small_run), "--flight", flight)


@pytest.mark.slow
def test_a_table_of_motion_capture_is_judged(folder: Path, tmp_path: Path) -> None:
    """Times with all their digits say how well they are known; with zeros left out they may as well be rounded to 10 ms."""
    rows = [row.split(",")[:5] for row in (folder / "flight.csv").read_text().splitlines()[1:]]
    table = tmp_path / "capture.csv"
    table.write_text("time,body,x,y,z\n" + "".join(f"{float(t):.4f},{','.join(rest)}\n" for t, *rest in rows))
    assert "satisfied" in ok("certify", str(folder), "--flight", str(table), "--max-speed", "1.2")
    table.write_text("time,body,x,y,z\n" + "".join(",".join(row) + "\n" for row in rows))
    done = runner.invoke(app, ["certify", str(folder), "--flight", str(table), "--max-speed", "1.2"])
    assert done.exit_code == 5
    assert "No time is off by more than 0.005 s, for which 0.006 m of that stand" in done.output


def test_fly_once_and_many_times(folder: Path, small: Path, tmp_path: Path) -> None:
    assert "worst tracking error" in ok("fly", str(folder), "--wind", "0.3", "--out", str(tmp_path / "once"))
    assert (tmp_path / "once" / "flight.csv").exists()
    text = ok("campaign", str(small), "--runs", "3", "--noise", "0.001", "--out", str(tmp_path / "many"))
    assert "3 of 3" in text
    assert "flown by the controller mellinger in still air, with motion capture" in text  # as `fly` with these options
    assert json.loads((tmp_path / "many" / "campaign.json").read_text())
    assert "<html" in (tmp_path / "many" / "campaign.html").read_text()


@pytest.mark.slow
def test_a_rehearsal_of_a_run_stands_in_its_report(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    before = (copy / "report.html").read_text()
    few = ("--runs", "1", "--controller", "geometric", "--mass", "1", "--latency", "0.01", "--wind", "0")
    assert f"wrote {copy / 'report.html'}" in ok("rehearse", str(copy), *few)
    page = (copy / "report.html").read_text()
    assert "<h2>Rehearsal of 1 cell of 1 flight</h2>" in page
    assert page.split("</section><!-- end of rehearsal -->\n</main>")[1] == before.split("</main>")[1]
    ok("rehearse", str(copy), *few[2:], "--runs", "2")
    again = (copy / "report.html").read_text()
    assert "of 1 flight</h2>" not in again
    assert again.count("Rehearsal of") == 1
    ok("recheck", str(copy))
    (copy / "report.html").write_text(before + "mine")
    assert "The report does not show it: " in ok("rehearse", str(copy), *few)
    assert (copy / "report.html").read_text() == before + "mine"


@pytest.mark.slow
def test_a_live_flight_over_the_simulated_link_is_watched_and_judged(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "live"
    text = ok("fly", str(folder), "--link", "simulated", "--out", str(out))
    assert "flight: " in text
    assert "On board when the link is gone" in text
    record = json.loads((out / "live.json").read_text())
    assert list(record["starts"]) == ["climb", "way", "flight", "landing"]
    judged = ok(
        "certify",
        str(folder),
        "--flight",
        str(out / "live.csv"),
        "--start",
        "0",
        "--max-speed",
        "1.5",
        "--json",
    )
    claims = {row["name"]: row["outcome"] for row in json.loads(judged)["claims"]}
    assert claims["formula"] == "holds", judged
    with pytest.raises(BadInput, match=r"write NAME=x,y,z"):
        ok("fly", str(folder), "--link", "simulated", "--place", "quad0=1,2")
    with pytest.raises(BadInput, match=r"go with --link"):
        ok("fly", str(folder), "--place", "quad0=1,2,0")


@pytest.mark.slow
def test_export_after_proving_again(folder: Path, tmp_path: Path) -> None:
    text = ok("export", str(folder), "--format", "crazyswarm2", "--out", str(tmp_path / "swarm"))
    assert "quad0.csv" in text
    copy = tmp_path / "changed"
    shutil.copytree(folder, copy)
    (copy / "quad0.csv").write_text((folder / "quad2.csv").read_text())
    with pytest.raises(NotCertified, match=r"quad0\.csv"):
        ok("export", str(copy), "--out", str(tmp_path / "nothing"))
    assert not (tmp_path / "nothing").exists()


@pytest.mark.slow
def test_a_flight_of_crazyflies_is_written_for_px4_anyway_only(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "px4"
    refused = runner.invoke(app, ["export", str(folder), "--format", "px4", "--out", str(out)])
    assert isinstance(refused.exception, NotCertified)
    assert refused.exception.exit_code == 5
    assert "meant for the controller 'mellinger', and vehicles of px4 run 'px4'" in str(refused.exception)
    assert not out.exists()
    assert "not rehearsed with this vehicle's controller" in ok(
        "export", str(folder), "--format", "px4", "--force", "--out", str(out)
    )
    for name in ("README.txt", "flight.json", "stream_setpoints.py", "flying/px4.py"):
        assert "not rehearsed with this vehicle's controller" in (out / name).read_text(), name


@pytest.mark.slow
def test_a_run_says_why_crazyflies_have_no_export(tmp_path: Path) -> None:
    """Their profile names no controller, so that the flight is `geometric`'s, which no Crazyflie runs."""
    mission = ltlplan.load_mission("hoops-sequence")
    own = mission.vehicle.changed(name="own", controller=None, autopilot=None)
    (tmp_path / "own.yaml").write_text(mission_to_yaml(mission.changed(vehicle=own)))
    text = ok("run", str(tmp_path / "own.yaml"), "--out", str(tmp_path / "run"))
    assert "note: crazyswarm2 leaves out quad0: flown by 'geometric', which Crazyflies do not run" in text
    assert not (tmp_path / "run" / "crazyswarm2").exists()


def test_show_draws_a_page(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    ok("show", "hoops-sequence", "--out", str(page))
    text = page.read_text()
    assert len(text.encode()) <= MOST_BYTES
    for heading in ("control points", "motion primitives", "sampled paths", "optimised path"):
        assert heading in text


def test_check_and_plan(tmp_path: Path) -> None:
    assert "word: holds" in ok("check", "F a & G(b -> c)", "1; a; b & c")
    broken = runner.invoke(app, ["check", "G !b", "a; b"])
    assert broken.exit_code == 5
    assert "fails" in broken.output
    text = ok(
        "plan", "hoops-sequence", "--sequence", "hoop0F hoop1R", "--cost", "length=1,effort=0.5", "--out", str(tmp_path / "p")
    )
    assert "hoop0F hoop1R" in text
    assert (tmp_path / "p" / "plan.json").exists()


@pytest.mark.slow
def test_an_online_flight_says_what_it_is(tmp_path: Path) -> None:
    out = tmp_path / "online"
    text = ok("online", "firefighting", "--event", "3 quad0 fails", "--out", str(out))
    note = "in simulation only: nothing about this flight was certified beforehand, and it cannot be exported"
    page = (out / "report.html").read_text()
    header = html.unescape(re.sub(r"<[^>]*>", " ", page[page.index("<header>") : page.index("</header>")]))
    for said in (text, (out / "summary.txt").read_text(), header):
        assert note in said
        assert "Verdict on the flown words: holds" in said
        assert "paper" not in said, "whose experiment took another time"
        assert "quad0 fails and lands" in said
    # the folder holds the world as it changed, and so its own log is judged as it was in flight
    assert json.loads((out / "events.json").read_text())["events"][0]["robot"] == "quad0"
    assert "satisfied" in ok("certify", str(out), "--flight", str(out / "flight.csv"), "--max-speed", "1.2")
    # there is no certificate, and so nothing to export
    with pytest.raises((BadInput, NotCertified)):
        ok("export", str(out), "--format", "crazyflie", "--out", str(tmp_path / "sent"))
    assert not (tmp_path / "sent").exists()


def test_an_online_flight_that_does_not_hold_ends_with_five_and_says_so_on_its_page(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "online"
    done = runner.invoke(app, ["online", str(small), "--event", "0.3 formula G b", "--out", str(out), "--json"])
    assert done.exit_code == 5
    told = json.loads(done.stdout)
    assert told["holds"] is False
    assert told["verdict"] == "fails"
    assert "in simulation only" in told["note"]
    page = (out / "report.html").read_text()
    assert "Verdict on the flown words: fails." in page[: page.index("</header>")]
    assert not (out / "certificate.json").exists()


def test_the_library_takes_names_and_paths_as_the_command_line_does(tmp_path: Path) -> None:
    by_name = ltlplan.plan("firefighting")
    file = tmp_path / "mine.yaml"
    file.write_text(ltlplan.missions.shipped_mission_text("firefighting"))
    assert by_name == ltlplan.plan(file) == ltlplan.plan(ltlplan.load_mission("firefighting"))
    with pytest.raises(BadInput, match="Did you mean 'firefighting'"):
        ltlplan.run("firefightin")
    with pytest.raises(BadInput, match="A mission is a Mission, a path, or the name of a shipped mission, not int"):
        ltlplan.plan(3)  # type: ignore[arg-type]


def test_a_page_that_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no folder that can be written to"):
        ok("show", "hoops-sequence", "--out", str(tmp_path / "nowhere" / "page.html"))


@pytest.mark.parametrize("event", ["fails", "x quad0 fails", "3 quad0 explodes", "3 water moves 1,2", "3 quad9 joins here"])
def test_events_that_cannot_be_read(event: str) -> None:
    with pytest.raises(BadInput, match="no event"):
        ok("online", "firefighting", "--event", event)


@pytest.mark.slow
def test_compressed_exports_have_a_certificate_of_their_own(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "compressed"
    arguments = ["--upload", "quad0=radio://0/80/2M/E7E7E7E701", "--upload", "quad1=radio://0/80/2M/E7E7E7E702"]
    arguments += ["--upload", "quad2=radio://0/80/2M/E7E7E7E703", "--dry-run"]
    text = ok("export", str(folder), "--format", "crazyflie-compressed", "--out", str(out), *arguments)
    assert f"would send {(out / 'quad0.bin').stat().st_size} bytes to quad0" in text
    assert f"wrote {out / 'certificate.json'}" in text
    assert "every claim is proved again" in ok("recheck", str(out))
    own = json.loads((out / "certificate.json").read_text())
    assert own["trajectories"] != json.loads((folder / "certificate.json").read_text())["trajectories"]
    with pytest.raises(BadInput, match="ROBOT=URI"):
        ok("export", str(folder), "--format", "crazyflie", "--out", str(out), "--upload", "quad0")
