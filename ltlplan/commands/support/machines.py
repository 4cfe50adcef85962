"""Workers of a command: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ltlplan.service.execution.clusters import Cluster

DaskOption = Annotated[
    str | None,
    typer.Option(
        "--dask", metavar="ADDRESS", help="Compute by the workers of a Dask cluster: its scheduler's tcp://HOST:PORT."
    ),
]


def cluster_at(address: str, workers: int | None) -> Cluster:
    """Return the cluster that a command names, instead of processes of this machine.

    Args:
        address: Of its scheduler.
        workers: What `--workers` says, if anything.

    Raises:
        BadInput: Both are named, or the cluster cannot be used.
    """
    from ltlplan.service.execution.clusters import Cluster
    from verify.data import BadInput

    if workers is not None:
        raise BadInput("--workers are processes of this machine, --dask names other machines; leave one of them out.")
    return Cluster(address)
