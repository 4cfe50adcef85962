"""An export from afar: asked for, followed while it is written, fetched."""

from __future__ import annotations

from collections.abc import Mapping

from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.client_parts.transport import Wire, job_of, segment


def exported(wire: Wire, job: str, target: str, options: Mapping[str, object]) -> bytes:
    """Return the archive of a job's flight, written for a vehicle.

    Args:
        wire: The service's connection.
        job: The job's id.
        target: Name of the format.
        options: The route's own.

    Raises:
        LtlplanError: The flight is not written, and why.
    """
    given = {**options, "wait": min(10.0, wire.patience / 2)}
    answer = wire.ask("GET", f"/api/jobs/{segment(job)}/exports/{segment(target)}", params=given)
    if answer.status_code != 202:
        return answer.content
    made = Submitted(wire, job_of(answer.content)).wait()
    return made.file(made.files[0].name)
