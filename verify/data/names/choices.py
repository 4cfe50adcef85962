"""The names that a mission file may choose from where other packages can add one: planning methods and cost terms.

Only names are read here; the objects belong to the planner, which finds them by these tables. What is only judged names methods
and terms that need not be installed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from verify.data.names.registry import Registry

Function = Callable[..., Any]  # of any type: each choice has its own
"""What is registered are functions; their types are said where they are called (`ltlplan.allocation`, `ltlplan.paths.costs`)."""

PLANNING_METHODS: Registry[Function] = Registry(
    "a planning method",
    "ltlplan.planning_methods",
    {
        "exact": "ltlplan.paths.k_best_words:exact",
        "mtac-e": "ltlplan.mtac.offline:mtac_e",
        "online-mtac-e": "ltlplan.online_mtac.planning_method:online_mtac_e",
    },
    Callable,  # type: ignore[arg-type]  # a class for `isinstance`, though no class for type checkers
)
"""What `planner.method` may name: functions from a mission and a context to an allocation."""

COST_TERMS: Registry[Function] = Registry(
    "a cost term",
    "ltlplan.cost_terms",
    {name: f"ltlplan.paths.cost_terms:{name}" for name in ("length", "effort", "time", "snap", "energy")},
    Callable,  # type: ignore[arg-type]
)
"""What `planner.cost` may weigh: functions from sampled paths to one number a path."""
