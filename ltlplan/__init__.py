"""The front door: missions in, certified flights out.

Names are loaded at first use, so that `import ltlplan` and `ltlplan --help` stay quick.

Read `pipeline`, then `planner`, which asks a method (`search`, `mtac`, `online_mtac`; what one returns is in `allocation`) and lays
`paths`; below are `systems` and `logic`. What is tried where no flight keeps a plan is in `replanning`. `online` flies while sharing, `report` and `output` show and write, `commands` ask.
`free_space` holds paths among obstacles, `precedences` the waits that counterexamples ask for, and `result` what a run makes. `missions` reads
mission files; `recorded` and `recording_options` lead from a recording to a verdict. `transfers` and `live_phases` are what comes before and
after a certified flight. `service` plans over HTTP; `start` and `cli` are the command line.
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False  # type checkers take it for True; `typing` takes long to load for what must be quick to begin
if TYPE_CHECKING:
    from ltlplan.logic.automaton import Automaton
    from ltlplan.logic.decomposition import decomposition_set
    from ltlplan.logic.translation import translate
    from ltlplan.missions import load_mission
    from ltlplan.pipeline import plan, run
    from ltlplan.recorded import judge_flight
    from ltlplan.result import Result
    from ltlplan.service.client import Client
    from ltlplan.transfers import Transfer, to_ground, to_starts
    from verify.data import (
        BadInput,
        DoesNotFit,
        FormulaError,
        Infeasible,
        InternalError,
        LtlplanError,
        MissingEngine,
        Mission,
        MissionError,
        NotCertified,
        Plan,
        SequenceError,
        Trajectory,
        Unsatisfiable,
        Vehicle,
        Word,
        load_plan,
        load_vehicle,
        parse_mission,
    )

_HOMES = {
    "Automaton": "ltlplan.logic.automaton",
    "BadInput": "verify.data",
    "Client": "ltlplan.service.client",
    "DoesNotFit": "verify.data",
    "FormulaError": "verify.data",
    "Infeasible": "verify.data",
    "InternalError": "verify.data",
    "LtlplanError": "verify.data",
    "MissingEngine": "verify.data",
    "Mission": "verify.data",
    "MissionError": "verify.data",
    "NotCertified": "verify.data",
    "Plan": "verify.data",
    "Result": "ltlplan.result",
    "SequenceError": "verify.data",
    "Trajectory": "verify.data",
    "Transfer": "ltlplan.transfers",
    "Unsatisfiable": "verify.data",
    "Vehicle": "verify.data",
    "Word": "verify.data",
    "decomposition_set": "ltlplan.logic.decomposition",
    "judge_flight": "ltlplan.recorded",
    "load_mission": "ltlplan.missions",
    "load_plan": "verify.data",
    "load_vehicle": "verify.data",
    "parse_mission": "verify.data",
    "plan": "ltlplan.pipeline",
    "run": "ltlplan.pipeline",
    "to_ground": "ltlplan.transfers",
    "to_starts": "ltlplan.transfers",
    "translate": "ltlplan.logic.translation",
}

__version__ = "0.2.0"

__all__ = [
    "Automaton",
    "BadInput",
    "Client",
    "DoesNotFit",
    "FormulaError",
    "Infeasible",
    "InternalError",
    "LtlplanError",
    "MissingEngine",
    "Mission",
    "MissionError",
    "NotCertified",
    "Plan",
    "Result",
    "SequenceError",
    "Trajectory",
    "Transfer",
    "Unsatisfiable",
    "Vehicle",
    "Word",
    "decomposition_set",
    "judge_flight",
    "load_mission",
    "load_plan",
    "load_vehicle",
    "parse_mission",
    "plan",
    "run",
    "to_ground",
    "to_starts",
    "translate",
]


if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them

    def __getattr__(name: str) -> object:
        if name not in _HOMES:
            raise AttributeError(f"module 'ltlplan' has no attribute '{name}'")
        return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
