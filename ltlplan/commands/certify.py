"""`ltlplan certify`: prove the trajectories of a folder, or judge a recorded flight."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ltlplan.commands.support.options import FolderArgument, JsonOption, MarginOption
from ltlplan.recording_options import told_of

if TYPE_CHECKING:
    from ltlplan.recorded import Recorded
    from verify import Certificate


# a parameter for each of the command's options
def command(
    folder: FolderArgument,
    margin: MarginOption = None,
    clock_error: Annotated[
        float | None,
        typer.Option(
            "--clock-error", min=0.0, help="Between robots' clocks, in s (default: as in certificate.json, or the mission's)."
        ),
    ] = None,
    flight: Annotated[
        Path | None,
        typer.Option(
            "--flight", help="A recorded flight to check instead of trajectories: a table, a ROS 2 bag, a PX4 log, or a folder."
        ),
    ] = None,
    max_speed: Annotated[
        float | None, typer.Option("--max-speed", help="With --flight: bound on every robot's speed, m/s.")
    ] = None,
    error: Annotated[float, typer.Option("--error", min=0.0, help="With --flight: bound on a position's error, m.")] = 0.0,
    start: Annotated[
        str | None,
        typer.Option(
            "--start",
            help="With --flight: start of the flight on the recording's clock, s; or on each robot's: quad0=3.2,quad1=5.7",
        ),
    ] = None,
    start_error: Annotated[float, typer.Option("--start-error", min=0.0, help="With --flight: error of --start, s.")] = 0.0,
    rename: Annotated[
        list[str] | None,
        typer.Option(
            "--rename",
            help="With --flight: the recording's name of a robot or a column: quad0=cf231, t='Frame time' (again for more).",
        ),
    ] = None,
    axes: Annotated[
        str | None,
        typer.Option(
            "--axes", help="With --flight: the mission's x, y, z in the recording's axes: x,-z,y where its y points up."
        ),
    ] = None,
    origin: Annotated[
        list[str] | None,
        typer.Option(
            "--origin",
            help="With --flight: where the recording's origin is in the mission, m: 1.5,0,0 or quad0=1.5,0,0 (again for more).",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", help="With --flight: a page (.html) of the flown path in its tube, claim by claim."),
    ] = None,
    pauses: Annotated[
        str | None,
        typer.Option(
            "--pauses", help="With --flight: s that the team hovered between parts, as fly_mission.py prints them: 4.2,3.9"
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Prove that the trajectories in a folder satisfy its mission and plan, and write certificate.json there."""
    if flight is not None:
        from ltlplan.recorded import judge_flight

        told = told_of(start, start_error, rename or (), axes, origin or ())
        judge = partial(judge_flight, folder, flight, max_speed=max_speed, error=error, told=told, pauses=_seconds(pauses))
        _judge_recording(judge, flight, report=report, as_json=json)
        return
    import json as json_text

    from flight.storage.folders import PROOF
    from flight.storage.single_files import replace_listed
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.report.summary import claim_lines, proof_data, soft_sentences, tracking_sentences, with_clocks
    from verify import certify
    from verify.checked_claims import checked_certificate, proof_sentences
    from verify.run_folder import read_folder

    plan, team = read_folder(folder)
    error_of_clocks = _clock_error_before(folder) if clock_error is None else clock_error
    with progress_bar(quiet=json) as progress:
        progress("proving all claims", 0.0)
        certificate = certify(plan, team, margin=margin, clock_error=error_of_clocks)
        progress("writing the proof", 0.9)
        proved = checked_certificate(plan, team, certificate)
    certificate = proved.certificate
    written = replace_listed(folder, PROOF, certificate.to_json())
    for name, content in proved.files.items():
        replace_listed(folder, name, content)
    if json:
        print_json({**json_text.loads(certificate.to_json()), "proof": proof_data(proved.verdict)})
        return
    for line in (*claim_lines(certificate), *tracking_sentences(certificate), *soft_sentences(certificate)):
        typer.echo(line)
    typer.echo(
        f"certified at margin {certificate.margin:g} m{below_asked(certificate)}{with_clocks(certificate)}, tube {certificate.tube}; wrote {written}"
    )
    for sentence in proof_sentences(certificate.claims, certificate.kernel):
        typer.echo(sentence)


def _clock_error_before(folder: Path) -> float | None:
    """Return the clock error of the folder's certificate, so that proving again does not drop it; None without one."""
    from flight.storage.folders import PROOF
    from verify.certificate_file import read_certificate

    path = folder / PROOF
    return float(read_certificate(path, earlier=True)["clock_error"]) if path.exists() else None


def below_asked(certificate: Certificate) -> str:
    """Say that a certificate has a smaller margin than its mission asks for; nothing where it has not."""
    asked = certificate.mission.margin
    return f" (the mission asks for {asked:g} m)" if certificate.margin < asked else ""


def _seconds(text: str | None) -> tuple[float, ...]:
    """Read numbers of seconds with commas between them."""
    from verify.data import BadInput

    if text is None:
        return ()
    try:
        return tuple(float(each) for each in text.split(","))
    except ValueError:
        raise BadInput(f"--pauses is {text[:40]!r}; it must be seconds with commas between them, such as 4.2,3.9.") from None


def _judge_recording(judge: Callable[..., Recorded], recording: Path, *, report: Path | None, as_json: bool) -> None:
    """Judge a recorded flight of the folder's mission, claim by claim, for all times between its samples too.

    Args:
        judge: Takes `progress`.
        recording: The flight's file.
        report: A page to write.
        as_json: One JSON document instead of text.
    """
    from flight.storage.single_files import check_page, replace_page
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.report.summary import recorded_lines
    from verify.data import NotCertified

    if report is not None:
        check_page(report)
    with progress_bar(quiet=as_json) as progress:
        judged = judge(progress=progress)
    if report is not None:
        from ltlplan.report.recorded_page import recorded_html

        replace_page(report, recorded_html(judged.asked, judged.samples, judged.verdict, source=recording.name))
    if as_json:
        print_json({"mission": judged.mission, "flight": str(recording), **judged.verdict.to_dict()})
    else:
        for line in recorded_lines(judged.verdict):
            typer.echo(line)
        if report is not None:
            typer.echo(f"wrote {report}")
    if not judged.verdict:
        raise typer.Exit(NotCertified.exit_code)
