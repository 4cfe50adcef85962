"""Modules that the fork server loads: a worker then begins in milliseconds, with everything there.

Loaded by nobody else. Each worker computes in one thread, so that as many as there are processors do not fight for them, and so that
nothing is running in other threads when it is forked.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import os

gc.disable()  # nearly all that modules make stays

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):  # before the numerics read them
    os.environ[_name] = "1"

for _name in (
    "networkx",  # by what needs it only, as the next one
    "scipy.optimize",
    "ltlplan.service.execution.worker_main",
    "ltlplan.service.execution.stages",
    "ltlplan.online.live.executors",
    "ltlplan.pipeline",
    "ltlplan.search.exact",
    "ltlplan.search.exact",
    "ltlplan.search.explanations.max_weight_subset",
    "ltlplan.mtac.offline",
    "ltlplan.paths.nominal",
    "ltlplan.paths.improvement",
    "ltlplan.paths.k_best_words",
    "ltlplan.report.run_page",
    "ltlplan.output",
    "ltlplan.recorded",
    "ltlplan.service.views.recorded",
    "ltlplan.service.views.watching",
    "refine.solvers.nlp",
    "refine.solvers.qp",
    "refine.team",
    "flight.flights",
    "flight.exports.crazyflies.crazyswarm",
    "flight.model.compiled",
    "verify.certification",
    "verify.trace_checking.team_verdict",
    "verify.logic.spot_opinion",
):
    importlib.import_module(_name)

with contextlib.suppress(Exception):  # a stage that needs it says that it is not there
    importlib.import_module("ltlplan.logic.spot_engine").engine()

with contextlib.suppress(Exception):  # ruamel.yaml and the scene load much at first use only, which is while somebody types
    from ltlplan.missions import shipped_mission_text
    from ltlplan.service.page.missions.checking import check_text

    check_text(shipped_mission_text("firefighting"), lambda _sentence, _share: None)

with contextlib.suppress(Exception):  # every report carries it, packed, which takes longer than the rest of a small one
    importlib.import_module("ltlplan.report.inline").plotly_script()

gc.freeze()  # workers then look for garbage among what they made themselves, and leave these pages shared
gc.enable()
