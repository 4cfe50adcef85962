"""Planning from temporal logic to certified flights, with its command line, service and reports.

Names are loaded at first use, so that `import ltlplan` and `ltlplan --help` stay quick.

Read `missions` (files in), `pipeline` (from a mission to a certified flight) and `result` (what it returns). Then `planner`, which calls a
planning method (`search`, `mtac` or `online_mtac`; their return value is `allocation`) and lays `paths`. These stand on `systems`, `logic` and
`free_space` (paths among obstacles); `precedences` are the waits that counterexamples require, and `replanning` chooses the next plan after a
rejected certificate. `following` flies what is certified in simulation, and slows it where it strays. `online` flies while tasks are reassigned. `transfers` and `live_phases` lead to the starts and to the ground.
`recorded` and `recording_options` check recorded flights. `report` and `output` show and write. `commands`, `cli` and `start` are the command
line, `service` the same over HTTP. `reproduction` computes both papers anew, element by element.
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False  # type checkers take it for True; `typing` takes long to load for what must be quick to begin
if TYPE_CHECKING:
    from ltlplan.logic.automaton import Automaton
    from ltlplan.logic.decomposition import decomposition_set
    from ltlplan.logic.translation import translate
    from ltlplan.missions import load_mission
    from ltlplan.pipeline import run
    from ltlplan.recorded import judge_flight
    from ltlplan.replanning.checked_plan import plan
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
    "plan": "ltlplan.replanning.checked_plan",
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
