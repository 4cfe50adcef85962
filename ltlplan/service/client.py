"""A service from afar, under the library's names: `Client(url).run(mission)` for `ltlplan.run(mission)`.

What comes back are the library's own values, and errors of its own classes with the same words. A certificate that comes over a network
is no proof: `run`, `recheck` and `Submitted.result` fetch the files and prove them again, here, by the library's own judge.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ltlplan.service.client_parts.derived_client import DerivedClient, recording_form
from ltlplan.service.client_parts.flights_client import FlightsClient
from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.client_parts.missions_client import YAML
from ltlplan.service.client_parts.people_client import PeopleClient
from ltlplan.service.client_parts.stored_client import StoredClient
from ltlplan.service.client_parts.studies_client import StudiesClient
from ltlplan.service.client_parts.transport import checked, job_of, segment, unpacked
from ltlplan.service.models import Job, State, Whose
from verify.data import BadInput, Mission, Plan, mission_to_yaml
from verify.data.names.former_names import former_arguments
from verify.data.progress import Progress

if TYPE_CHECKING:
    from flight import RecordingOptions
    from ltlplan.pipeline import Asked
    from ltlplan.result import Result
    from verify import Certificate, ProofVerdict, TeamVerdict, Verdict
    from verify.data.sections import TeamReading
    from verify.trace_checking.word_verdict import Letters


class Client(DerivedClient, FlightsClient, PeopleClient, StoredClient, StudiesClient):
    """A service, by its address.

    Use it in a `with` statement, or call `close` at the end.
    """

    # The library's names

    def plan(
        self,
        mission: Asked,
        *,
        seed: int | None = None,
        pace: float | str | None = None,
        progress: Progress | None = None,
    ) -> Plan:
        """Plan a mission; as `ltlplan.plan`. The job goes on there, so that `run` finds it.

        Args:
            mission: What is asked: a mission, or the path or name that `ltlplan.load_mission` reads one by.
            seed: Source of every draw, instead of the mission's own.
            pace: Instead of `planner.pace`: a share of the fastest flight, above 0 up to 1, or "nominal".
            progress: Receives a sentence and the share of the whole job done, 0 to 1.

        Raises:
            LtlplanError: As `ltlplan.plan`, or what the service refused.
        """
        return self.submit(mission, seed=seed, pace=pace).plan(progress=progress)

    def run(
        self,
        mission: Asked,
        out: str | os.PathLike[str] | None = None,
        *,
        seed: int | None = None,
        pace: float | str | None = None,
        progress: Progress | None = None,
    ) -> Result:
        """Plan, refine, certify and fly a mission there; as `ltlplan.run`. Everything is proved again here.

        Args:
            mission: What is asked: a mission, or the path or name that `ltlplan.load_mission` reads one by.
            out: Folder to write, as `ltlplan.run` writes it.
            seed: Source of every draw, instead of the mission's own.
            pace: Instead of `planner.pace`: a share of the fastest flight, above 0 up to 1, or "nominal".
            progress: Receives a sentence and the share done, 0 to 1.

        Raises:
            LtlplanError: As `ltlplan.run`, or what the service refused.
        """
        return self.submit(mission, seed=seed, pace=pace).result(out, progress=progress)

    def check_word(self, formula: str, word: Letters | str, cycle: Iterable[Iterable[str]] | None = None) -> Verdict:
        """Decide whether a word satisfies a formula; as `verify.check_word`.

        Args:
            formula: LTL in Spot's syntax.
            word: A word, sets of names, or Spot's notation.
            cycle: Letters that are repeated for ever.

        Raises:
            BadInput: Formula or word cannot be read.
        """
        from ltlplan.service.client_parts.words import notation, verdict_of

        told = self._wire.ask("POST", "/api/words/check", json={"formula": formula, "words": [notation(word, cycle)]}).json()
        return verdict_of(told["word"])

    @former_arguments(reading="team")
    def check_team(self, formula: str, words: Mapping[str, Letters | str], team: TeamReading = "own") -> TeamVerdict:
        """Decide what a team's words satisfy without regard to times; as `verify.check_team`.

        Args:
            formula: LTLf in Spot's syntax.
            words: Each robot's word.
            team: "own": each robot's letters by themselves; "joint": their unions.

        Raises:
            BadInput: The formula or a word cannot be read.
        """
        from ltlplan.service.client_parts.words import notation, verdict_of
        from verify import TeamVerdict

        asked = {name: notation(word) for name, word in words.items()}
        told = self._wire.ask("POST", "/api/words/check", json={"formula": formula, "words": asked, "reading": team}).json()
        return TeamVerdict(verdict_of(told["sequential"]), verdict_of(told["parallel"]))

    # as many parameters as `ltlplan.judge_flight` has
    def judge_flight(
        self,
        source: Submitted | str | os.PathLike[str],
        recording: str | os.PathLike[str],
        *,
        max_speed: float | None = None,
        error: float = 0.0,
        start: float | None = None,
        told: RecordingOptions | None = None,
        pauses: Sequence[float] = (),
    ) -> dict[str, Any]:
        """Check a recorded flight there, claim by claim; what `ltlplan certify --flight` prints as JSON.

        Args:
            source: What it was to do: a job (or its id), or a run's folder here.
            recording: The flight: a file, a bag or a folder of those kinds that `flight.read_flown` reads.
            max_speed: Bound on every robot's speed, m/s.
            error: Bound on a position's error, m.
            start: When the flight began on the recording's clock, s.
            told: More that the files do not say, `start` included.
            pauses: How long the team hovered between the parts of a flight in parts, s each.

        Raises:
            LtlplanError: It cannot be checked, and why.
        """
        part, data = recording_form(recording, max_speed=max_speed, error=error, told=told, pauses=pauses, start=start)
        parts = [part]
        if isinstance(source, Submitted):
            data["job"] = source.id
        elif Path(source).is_dir():
            names = sorted(path for path in Path(source).iterdir() if path.suffix in (".yaml", ".json", ".csv"))
            kept = (path for path in names if path.name not in ("flight.csv", "manifest.json"))
            parts += [("files", (path.name, path.read_bytes(), "application/octet-stream")) for path in kept]
        else:
            data["job"] = str(source)
        return self._wire.ask("POST", "/api/flights/judge", data=data, files=parts).json()

    def recheck(self, job: Submitted | str) -> Certificate:
        """Prove a job's certificate again, here, from its files alone, and have the kernel check its proof; as `verify.recheck`.

        Args:
            job: A job, or its id.

        Raises:
            NotCertified: A file is not the one that was certified, or a claim is not proved.
        """
        from verify import recheck

        with tempfile.TemporaryDirectory() as scratch:
            return recheck(self._of(job).download(Path(scratch) / "run"))

    def check_proof(self, job: Submitted | str) -> ProofVerdict:
        """Fetch a job's proof, and have the kernel check it here; as `verify.check_proof`.

        Args:
            job: A job, or its id.

        Raises:
            NotFound: It has no proof.
            BadInput: The proof cannot be read.
        """
        from verify import check_proof

        with tempfile.TemporaryDirectory() as scratch:
            return check_proof(self._of(job).download_proof(Path(scratch) / "proof"))

    # as many parameters as `flight.export` has
    @former_arguments(anyway="force")
    def export(
        self,
        job: Submitted | str,
        out: str | os.PathLike[str],
        format: str = "crazyswarm2",  # noqa: A002  # the name that users type
        *,
        vehicle: str | None = None,
        robots: Collection[str] | None = None,
        rate: float | None = None,
        force: bool = False,
    ) -> tuple[Path, ...]:
        """Write a job's certified flight for a vehicle; as `flight.export`.

        Args:
            job: A job, or its id.
            out: Folder to write.
            format: What for; `exports` lists them.
            vehicle: Name of the airframe that will fly, where it is to be compared with the certificate's.
            robots: Names of those that are written, where others of the team fly from another export; None for all.
            rate: px4, ros2: setpoints a second.
            force: Write without a simulated flight that stayed in its tube, with a warning in every file that has room for words.

        Raises:
            NotCertified: The certificate is not proved again, or the flight left its tube in simulation.
            DoesNotFit: The vehicle or its format cannot hold the flight.
            LtlplanError: There is no such job or format, or the folder cannot be written.
        """
        from flight.storage.folders import write_files
        from ltlplan.service.client_parts.exported import exported

        options = {
            "vehicle": vehicle,
            "robots": None if robots is None else ",".join(robots),
            "rate": rate,
            "anyway": force or None,
        }
        given = {name: value for name, value in options.items() if value is not None}
        return write_files(out, unpacked(exported(self._wire, self._id(job), format, given)))

    def exports(self) -> tuple[str, ...]:
        """Return the names of what flights can be written for."""
        return tuple(each["name"] for each in self._wire.ask("GET", "/api/exports").json())

    # Jobs

    def submit(
        self, mission: Asked, *, seed: int | None = None, pace: float | str | None = None, project: str | None = None
    ) -> Submitted:
        """Submit a mission: when this returns, it will be done, whatever happens to the service meanwhile.

        Args:
            mission: What is asked: a mission, or the path or name that `ltlplan.load_mission` reads one by.
            seed: Source of every draw, instead of the mission's own.
            pace: Instead of `planner.pace`: a share of the fastest flight, above 0 up to 1, or "nominal".
            project: Project to put it into; private until it is shared.

        Raises:
            MissionError: All faults of the mission.
            LtlplanError: What else the service refused.
        """
        if isinstance(mission, str | os.PathLike):
            mission = self.load_mission(mission)
        if not isinstance(mission, Mission):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers may not check
            raise BadInput(f"A mission is a Mission, a path, or the name of a shipped mission, not {type(mission).__name__}.")
        return self.submit_text(mission_to_yaml(mission), seed=seed, pace=pace, project=project)

    def submit_text(
        self, text: str, *, seed: int | None = None, pace: float | str | None = None, project: str | None = None
    ) -> Submitted:
        """Submit a mission's file as it is; faults have its lines.

        Args:
            text: YAML or JSON.
            seed: Source of every draw, instead of the mission's own.
            pace: Instead of `planner.pace`: a share of the fastest flight, above 0 up to 1, or "nominal".
            project: Project to put it into; private until it is shared.

        Raises:
            MissionError: All faults of the mission.
            LtlplanError: What else the service refused.
        """
        given = {name: value for name, value in (("seed", seed), ("pace", pace), ("project", project)) if value is not None}
        told = self._wire.ask("POST", "/api/jobs", content=text.encode(), headers=YAML, params=given)
        return Submitted(self._wire, job_of(told.content))

    def jobs(
        self,
        *,
        state: State | None = None,
        limit: int = 50,
        before: str | None = None,
        whose: Whose = "visible",
        project: str | None = None,
        search: str | None = None,
    ) -> tuple[Submitted, ...]:
        """Return jobs, the newest first.

        Args:
            state: Only those in this state.
            limit: At most so many.
            before: Only those submitted before the job of this id.
            whose: "visible": yours and those of shared projects; "mine"; "all": everybody's, for admins.
            project: Only of this project.
            search: Only those that have these letters in name, formula, id, owner or project.
        """
        asked = {"state": state, "limit": limit, "before": before, "whose": whose, "project": project, "search": search}
        told = self._wire.ask("GET", "/api/jobs", params={name: value for name, value in asked.items() if value is not None})
        return tuple(Submitted(self._wire, checked(Job, each)) for each in told.json())

    def job(self, id: str) -> Submitted:  # noqa: A002  # the name that users type
        """Return a job by its id.

        Raises:
            BadInput: There is no such job.
        """
        return Submitted(self._wire, job_of(self._wire.ask("GET", f"/api/jobs/{segment(id)}").content))

    def cancel(self, job: Submitted | str) -> Submitted:
        """End a job at once; one that has ended stays as it is.

        Raises:
            Conflict: Others of the service have it too: `delete` takes it off your list.
        """
        return Submitted(self._wire, job_of(self._wire.ask("POST", f"/api/jobs/{segment(self._id(job))}/cancel").content))

    def stop_search(self, job: Submitted | str) -> Submitted:
        """End a job's search with the best plan so far, which is refined and certified as any other; the job's sentence has its bound.

        Raises:
            Conflict: It does not search, or others of the service have it too.
        """
        return Submitted(self._wire, job_of(self._wire.ask("POST", f"/api/jobs/{segment(self._id(job))}/stop").content))

    def delete(self, job: Submitted | str) -> None:
        """Take a job off your list; one that nobody else has is deleted with its files.

        Raises:
            BadInput: There is no such job, or it has not ended and nobody else has it.
        """
        self._wire.ask("DELETE", f"/api/jobs/{segment(self._id(job))}")

    def _of(self, job: Submitted | str) -> Submitted:
        return job if isinstance(job, Submitted) else self.job(job)

    def _id(self, job: Submitted | str) -> str:
        return job.id if isinstance(job, Submitted) else job
