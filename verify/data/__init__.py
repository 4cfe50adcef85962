"""The plain data that planner, refinement, flight and checker share, and the vocabulary of the claim.

Read `mission` (of `sections`, `shapes` and `language`, under `validation`), `plan`, `trajectory` and `witness`: what travels between
the packages; `files` and `storage` are how it is kept. `value`, `errors` and `progress` are what all are made with. `names` holds the
names that other packages may bring, and former ones. `events` are what may change in flight, `vehicle` what flies, `uncertain` what is not
known of it, `airframe` lag, drag and gains, `disturbance` what may disturb a flight. `arrays` are types for signatures. `obstruction` says why no flight was found. `frame` places a mission in the laboratory,
`autopilot` reads what on-board software is tuned to. `helper_process` asks a process of one's own, once more where it was killed.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from verify.data.errors import (
        BadInput,
        DoesNotFit,
        Infeasible,
        InternalError,
        LtlplanError,
        MissingEngine,
        NotCertified,
        Unsatisfiable,
        did_you_mean,
    )
    from verify.data.files.mission_file import load_mission_file, mission_to_yaml, parse_mission
    from verify.data.language.formula import Formula
    from verify.data.language.formula_error import FormulaError
    from verify.data.language.formula_reader import parse_formula
    from verify.data.language.sequence import Passage, Sequence, SequenceError, parse_sequence
    from verify.data.language.word import Letter, Word
    from verify.data.mission import Mission, check_mission
    from verify.data.plan import Plan, RobotPlan, Visit, Waypoint, check_plan, load_plan
    from verify.data.trajectory import Trajectory, check_trajectories
    from verify.data.validation.faults import MissionError
    from verify.data.vehicle import GRAVITY, Vehicle, load_vehicle, shipped_vehicles
    from verify.data.witness import Witness

__all__ = [
    "GRAVITY",
    "BadInput",
    "DoesNotFit",
    "Formula",
    "FormulaError",
    "Infeasible",
    "InternalError",
    "Letter",
    "LtlplanError",
    "MissingEngine",
    "Mission",
    "MissionError",
    "NotCertified",
    "Passage",
    "Plan",
    "RobotPlan",
    "Sequence",
    "SequenceError",
    "Trajectory",
    "Unsatisfiable",
    "Vehicle",
    "Visit",
    "Waypoint",
    "Witness",
    "Word",
    "check_mission",
    "check_plan",
    "check_trajectories",
    "did_you_mean",
    "load_mission_file",
    "load_plan",
    "load_vehicle",
    "mission_to_yaml",
    "parse_formula",
    "parse_mission",
    "parse_sequence",
    "shipped_vehicles",
]

if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them
    __getattr__, __dir__ = loaded_at_first_use(
        __name__,
        {
            "verify.data.errors": (
                "BadInput",
                "DoesNotFit",
                "Infeasible",
                "InternalError",
                "LtlplanError",
                "MissingEngine",
                "NotCertified",
                "Unsatisfiable",
                "did_you_mean",
            ),
            "verify.data.language.formula": ("Formula",),
            "verify.data.language.formula_error": ("FormulaError",),
            "verify.data.language.formula_reader": ("parse_formula",),
            "verify.data.language.sequence": ("Passage", "Sequence", "SequenceError", "parse_sequence"),
            "verify.data.language.word": ("Letter", "Word"),
            "verify.data.mission": ("Mission", "check_mission"),
            "verify.data.files.mission_file": ("load_mission_file", "mission_to_yaml", "parse_mission"),
            "verify.data.plan": ("Plan", "RobotPlan", "Visit", "Waypoint", "check_plan", "load_plan"),
            "verify.data.validation.faults": ("MissionError",),
            "verify.data.trajectory": ("Trajectory", "check_trajectories"),
            "verify.data.vehicle": ("GRAVITY", "Vehicle", "load_vehicle", "shipped_vehicles"),
            "verify.data.witness": ("Witness",),
        },
    )
