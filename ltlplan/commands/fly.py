"""`ltlplan fly`: simulate a flight, a campaign of many, or online task sharing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ltlplan.commands.options import JsonOption, SeedOption, read_mission

if TYPE_CHECKING:
    from ltlplan.commands.progress import Progress
    from verify import Certificate
    from verify.data import Plan, Trajectory


def command(
    source: Annotated[
        str, typer.Argument(help="A folder that `ltlplan run` wrote, a mission file, or a shipped mission.", show_default=False)
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder to write the flight's log (or the campaign's findings) to.")
    ] = None,
    seed: SeedOption = None,
    wind: Annotated[
        str | None, typer.Option("--wind", help="m/s: 1.5 (along x), 1,0.5,0, or either with gusts: 1.5+0.4.")
    ] = None,
    noise: Annotated[
        str | None, typer.Option("--noise", help="Motion capture with this standard deviation of a position, m.")
    ] = None,
    runs: Annotated[int, typer.Option("--runs", min=1, help="A campaign of this many flights.")] = 1,
    workers: Annotated[
        int, typer.Option("--workers", min=1, help="Processes of a campaign; findings do not depend on it.")
    ] = 1,
    model: Annotated[str, typer.Option("--model", help="full or paper.")] = "full",
    controller: Annotated[str, typer.Option("--controller", help="geometric or paper.")] = "geometric",
    reaction: Annotated[
        str | None, typer.Option("--reaction", help="carry_on, hold or land, instead of the mission's.")
    ] = None,
    online: Annotated[
        bool, typer.Option("--online", help="Share tasks while flying (simulation only, not certified in advance).")
    ] = False,
    certified: Annotated[bool, typer.Option("--certified", help="With --online: fly only pieces that are certified.")] = False,
    event: Annotated[
        list[str] | None,
        typer.Option("--event", help="With --online: such as '12.5 quad1 fails' or '8 water moves 0.3,-0.7,0.9'."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Fly a mission in simulation; exit code 5 where the flight left its tube or broke its formula."""
    from ltlplan.commands.progress import progress_bar
    from verify.data import BadInput

    if (certified or event) and not online:
        raise BadInput("--certified and --event go with --online.")
    with progress_bar(quiet=json) as progress:
        if online:
            finish = _online(source, out, seed, wind, noise, certified, event or [], progress)
        elif runs > 1:
            finish = _campaign(source, out, seed, wind, noise, runs, workers, model, controller, progress)
        else:
            finish = _single(source, out, seed, wind, noise, model, controller, reaction, progress)
    finish.show(json)


class _Finish:
    """What is shown when the progress bar is gone: lines or data, then perhaps a refusal."""

    def __init__(self, lines: list[str], data: dict[str, Any], refusal: str | None, files: tuple[Path, ...]) -> None:
        self.lines, self.data, self.refusal, self.files = lines, data, refusal, files

    def show(self, as_json: bool) -> None:
        from ltlplan.commands.terminal import print_json
        from verify.data import NotCertified

        if as_json:
            print_json({**self.data, "holds": self.refusal is None, "files": [str(path) for path in self.files]})
        else:
            for line in (*self.lines, *(f"wrote {path}" for path in self.files)):
                typer.echo(line)
        if self.refusal is not None:
            if as_json:
                raise typer.Exit(NotCertified.exit_code)
            raise NotCertified(self.refusal)


def _check(out: Path | None, files: tuple[str, ...]) -> None:
    """Refuse a folder that cannot be written, before minutes of work."""
    from verify.data.storage.folders import check_folder

    if out is not None:
        check_folder(out, files)


def _team(source: str, progress: Progress) -> tuple[Plan, dict[str, Trajectory], Certificate]:
    """Return a certified team: from a run's folder, proved again, or by planning the mission."""
    if Path(source).is_dir():
        from verify import recheck
        from verify.run_folder import read_folder

        progress("proving the folder's certificate again", 0.0)
        certificate = recheck(source)
        plan, team = read_folder(source)
        return plan, team, certificate
    from flight.certified import require_tube
    from ltlplan.pipeline import certified_team, plan

    mission = read_mission(source)
    require_tube(mission.margin)
    made = plan(mission, progress=lambda sentence, share: progress(sentence, 0.3 * share))
    done = certified_team(made, progress=lambda sentence, share: progress(sentence, 0.3 + 0.2 * share))
    return done.plan, done.team, done.certificate


def _single(
    source: str, out: Path | None, seed: int | None, wind: str | None, noise: str | None, model: Any, controller: Any, reaction: Any,
    progress: Progress,
) -> _Finish:  # fmt: skip
    import flight
    from ltlplan.output import LOG_FILES
    from verify.data.storage.folders import write_folder

    _check(out, LOG_FILES)
    plan, team, certificate = _team(source, progress)
    used = plan.seed if seed is None else seed
    progress("flying in simulation", 0.5)
    log = flight.fly(
        plan, team, certificate, seed=used, wind=wind, noise=noise, model=model, controller=controller, reaction=reaction,
        progress=lambda sentence, share: progress(sentence, 0.5 + 0.5 * share),
    )  # fmt: skip
    margin = 1000 * certificate.margin
    lines = [
        f"{name}: worst tracking error {1000 * log.worst_error(name):.1f} mm, RMS {1000 * log.rms_error(name):.1f} mm (margin {margin:.1f} mm)"
        for name in log.robots
    ]
    lines += [*log.verdicts, *log.notes]
    refusal = None
    if log.satisfied is False:
        refusal = "The flown path breaks the formula."
    elif log.worst_error() > certificate.margin:
        refusal = f"The flight left its tube: {1000 * log.worst_error():.1f} mm against a margin of {margin:.1f} mm."
    files = () if out is None else write_folder(out, lambda folder: _write_log(plan, log.to_csv(), folder))
    data = {
        "mission": plan.mission.name,
        "tracking": {name: {"worst": log.worst_error(name), "rms": log.rms_error(name)} for name in log.robots},
        "margin": certificate.margin,
        "satisfied": log.satisfied,
        "tube": log.tube,
        "sentences": [*log.verdicts, *log.notes],
    }
    return _Finish(lines, data, refusal, files)


def _campaign(
    source: str, out: Path | None, seed: int | None, wind: str | None, noise: str | None, runs: int, workers: int, model: Any,
    controller: Any, progress: Progress,
) -> _Finish:  # fmt: skip
    import json

    from flight.campaigns import campaign
    from ltlplan.output import CAMPAIGN_FILES
    from ltlplan.report.campaign import campaign_html
    from verify.data.storage.folders import write_folder

    _check(out, CAMPAIGN_FILES)
    plan, team, certificate = _team(source, progress)
    found = campaign(
        plan, team, certificate, runs=runs, seed=plan.seed if seed is None else seed, wind=wind, noise=noise, model=model,
        controller=controller, workers=workers, progress=lambda sentence, share: progress(sentence, 0.5 + 0.5 * share),
    )  # fmt: skip

    def write(folder: Path) -> None:
        from ltlplan.output import write_plan_files

        write_plan_files(plan, folder)
        (folder / "campaign.json").write_text(json.dumps(found.to_dict(), indent=1) + "\n", encoding="utf-8")
        (folder / "campaign.html").write_text(campaign_html(found), encoding="utf-8")

    files = () if out is None else write_folder(out, write)
    refusal = None
    if found.contradictions:
        refusal = f"Seeds {found.contradictions[:5]} flew inside the tube and broke the formula: a bug of the certificate."
    return _Finish(list(found.sentences), {"mission": plan.mission.name, **found.to_dict()}, refusal, files)


def _online(
    source: str, out: Path | None, seed: int | None, wind: str | None, noise: str | None, certified: bool, events: list[str],
    progress: Progress,
) -> _Finish:  # fmt: skip
    from ltlplan.commands.events import parse_events
    from ltlplan.online.flight import fly_online
    from ltlplan.output import ONLINE_FILES
    from verify.data.storage.folders import write_folder

    _check(out, ONLINE_FILES)
    mission = read_mission(source)
    flown = fly_online(
        mission, seed=seed, certified=certified, events=parse_events(events), wind=wind, noise=noise, progress=progress
    )
    lines = [
        f"{name}: {' '.join('{' + ', '.join(sorted(letter)) + '}' for letter in word)}" for name, word in flown.words.items()
    ]
    lines += [*flown.log.verdicts, flown.summary()]

    def write(folder: Path) -> None:
        from ltlplan.report.online import online_html
        from verify.data import mission_to_yaml
        from verify.data.events import EVENTS_FILE, events_to_json

        (folder / "mission.yaml").write_text(mission_to_yaml(flown.asked), encoding="utf-8")
        (folder / EVENTS_FILE).write_text(events_to_json(flown.events), encoding="utf-8")
        (folder / "flight.csv").write_text(flown.log.to_csv(), encoding="utf-8")
        (folder / "report.html").write_text(online_html(flown), encoding="utf-8")
        (folder / "summary.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")

    files = () if out is None else write_folder(out, write)
    refusal = None if flown.verdict else f"The flown words do not keep the formula: {flown.verdict.sentence}"
    data = {
        "mission": mission.name,
        "duration": flown.duration,
        "satisfied_at": flown.satisfied_at,
        "verdict": flown.verdict.outcome,
        "sentence": flown.verdict.sentence,
        "note": flown.log.notes[0],
        "certified": flown.certified,
        "certificates": list(flown.certificates),
        "planned_cost": flown.planned_cost,
        "final_cost": flown.final_cost,
        "words": {name: [sorted(letter) for letter in word] for name, word in flown.words.items()},
    }
    return _Finish(lines, data, refusal, files)


def _write_log(plan: Plan, csv: str, folder: Path) -> None:
    from ltlplan.output import write_plan_files

    write_plan_files(plan, folder)
    (folder / "flight.csv").write_text(csv, encoding="utf-8")
