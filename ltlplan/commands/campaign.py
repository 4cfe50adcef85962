"""`ltlplan campaign`: the same flight many times in simulation."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Annotated

import typer

from ltlplan.commands.support import flight_options, machines, options
from ltlplan.commands.support.simulation import Outcome, certified, simulating, written
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight import Campaign


# a parameter for each of the command's options
def command(
    source: flight_options.TeamArgument,
    runs: Annotated[int, typer.Option("--runs", min=1, help="Number of flights.")] = 100,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes (default: 1); results do not depend on it.")
    ] = None,
    dask: machines.DaskOption = None,
    out: flight_options.OutOption = None,
    seed: options.SeedOption = None,
    wind: flight_options.WindOption = None,
    noise: flight_options.NoiseOption = None,
    model: flight_options.ModelOption = flight_options.FULL,
    controller: flight_options.FollowerOption = None,
    estimator: flight_options.EstimatorOption = None,
    latency: flight_options.LatencyOption = None,
    mass: flight_options.MassOption = None,
    json: options.JsonOption = False,
) -> None:
    """Fly a certified mission many times in simulation: the proportion of flights that stayed in the tube and satisfied the formula.

    Controllers and conditions are those of `fly`, whose flight with the same options and seed is one of them.
    """
    from flight import campaign
    from flight.condition_options import Said
    from ltlplan.output import CAMPAIGN_FILES, write_campaign

    said = Said(wind, noise, model, controller, estimator, latency, mass)
    said.require_sense()
    with simulating(out, CAMPAIGN_FILES, quiet=json) as progress:
        with nullcontext(workers or 1) if dask is None else machines.cluster_at(dask, workers) as those:
            plan, team, certificate = certified(source, part_of(progress, 0.0, 0.5))
            conditions = said.conditions(plan.mission)
            found = campaign(
                plan, team, certificate, runs=runs, seed=plan.seed if seed is None else seed, conditions=conditions, workers=those,
                progress=part_of(progress, 0.5, 1.0),
            )  # fmt: skip
        files = written(out, lambda folder: write_campaign(plan, found, folder))
    _outcome(found, conditions.sentence).show(files, as_json=json)


def _outcome(found: Campaign, flown: str) -> Outcome:
    """Say what was found, and by whom and in what was flown."""
    refusal = None
    if found.contradictions:
        refusal = f"Seeds {found.contradictions[:5]} flew inside the tube and broke the formula: a bug of the certificate."
    return Outcome([*found.sentences, flown], {**found.to_dict(), "conditions": flown}, refusal)
