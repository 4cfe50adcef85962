"""The judge: what will fly satisfies the formula for all times, or the reason why that is not proved.

`verify` imports nothing of the planner, of refinement or of flight, and shares with them only the plain data of
`verify.data`.
"""

from verify.asked import Asked, asked_of
from verify.certificate import ActionInstant, Certificate, certify, judge
from verify.claims import Claim
from verify.data import NotCertified, Trajectory, Witness
from verify.flight_log import Samples, load_flight_log
from verify.recheck import recheck
from verify.recorded import FlightVerdict, check_flight
from verify.samples import check_recording, check_samples
from verify.teams import check_team
from verify.verdict import TeamVerdict, Verdict
from verify.words import check_word

__all__ = [
    "ActionInstant",
    "Asked",
    "Certificate",
    "Claim",
    "FlightVerdict",
    "NotCertified",
    "Samples",
    "TeamVerdict",
    "Trajectory",
    "Verdict",
    "Witness",
    "asked_of",
    "certify",
    "check_flight",
    "check_recording",
    "check_samples",
    "check_team",
    "check_word",
    "judge",
    "load_flight_log",
    "recheck",
]
