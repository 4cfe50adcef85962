"""Checker of flights: a proof, for all times, that what will fly satisfies the formula, or the reason why that is not proved.

`verify` imports nothing of the planner, of refinement or of flight. It shares with them only the plain data of `verify.data`.

Read `certification` (the entry point; `certificate` is the value) and `claims`, then `motion` (polynomials), `model_checking` (words over time)
and `logic` (semantics of formulas), over `arithmetic`. `tracking` proves that robots stay near their plans under disturbances. `data` holds missions, plans and trajectories, which all packages share.
`run_folder` proves a folder again from its files (`certificate_file`). `trace_checking` checks words alone, `recordings` recorded flights, and
`third_party` flights that other programs planned. `flight_segments` checks flights in changing worlds, `aborts` braking to a hover, and
`exported_parts` uploaded parts against the flight. `proofs` writes down what was proved, and `kernel`, which imports nothing of ours, checks it;
`checked_claims` says of each claim whether it did.
`testing` serves the tests of other projects.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from verify.certificate import ActionInstant, Certificate
    from verify.certification import certify, judge
    from verify.claims.claim import Claim
    from verify.claims.soft_claims import SoftClaim
    from verify.data import NotCertified, Trajectory, Witness
    from verify.logic.verdict import TeamVerdict, Verdict
    from verify.proofs.proof_folder import ProofVerdict, check_proof
    from verify.recordings.flight_log import Samples, load_flight_log
    from verify.recordings.flight_reference import FlightReference, load_reference
    from verify.recordings.flight_verdict import FlightVerdict, check_flight
    from verify.recordings.samples import check_recording, check_samples
    from verify.run_folder import recheck
    from verify.third_party.audit_requirements import AuditLimits
    from verify.third_party.auditing import Audit, audit
    from verify.trace_checking.ordered_verdict import check_ordered
    from verify.trace_checking.planned_order import check_planned_order
    from verify.trace_checking.team_verdict import check_team
    from verify.trace_checking.word_verdict import check_word

__all__ = [
    "ActionInstant",
    "Audit",
    "AuditLimits",
    "Certificate",
    "Claim",
    "FlightReference",
    "FlightVerdict",
    "NotCertified",
    "ProofVerdict",
    "Samples",
    "SoftClaim",
    "TeamVerdict",
    "Trajectory",
    "Verdict",
    "Witness",
    "audit",
    "certify",
    "check_flight",
    "check_ordered",
    "check_planned_order",
    "check_proof",
    "check_recording",
    "check_samples",
    "check_team",
    "check_word",
    "judge",
    "load_flight_log",
    "load_reference",
    "recheck",
]

if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them
    __getattr__, __dir__ = loaded_at_first_use(
        __name__,
        {
            "verify.certificate": ("ActionInstant", "Certificate"),
            "verify.certification": ("certify", "judge"),
            "verify.claims.claim": ("Claim",),
            "verify.claims.soft_claims": ("SoftClaim",),
            "verify.data": ("NotCertified", "Trajectory", "Witness"),
            "verify.third_party.audit_requirements": ("AuditLimits",),
            "verify.third_party.auditing": ("Audit", "audit"),
            "verify.logic.verdict": ("TeamVerdict", "Verdict"),
            "verify.recordings.flight_reference": ("FlightReference", "load_reference"),
            "verify.recordings.flight_log": ("Samples", "load_flight_log"),
            "verify.recordings.flight_verdict": ("FlightVerdict", "check_flight"),
            "verify.recordings.samples": ("check_recording", "check_samples"),
            "verify.proofs.proof_folder": ("ProofVerdict", "check_proof"),
            "verify.run_folder": ("recheck",),
            "verify.trace_checking.ordered_verdict": ("check_ordered",),
            "verify.trace_checking.planned_order": ("check_planned_order",),
            "verify.trace_checking.team_verdict": ("check_team",),
            "verify.trace_checking.word_verdict": ("check_word",),
        },
        Asked="FlightReference",
        asked_of="load_reference",
    )
