"""The judge: what will fly satisfies the formula for all times, or the reason why that is not proved.

`verify` imports nothing of the planner, of refinement or of flight, and shares with them only the plain data of
`verify.data`.
"""

from verify.certificate import ActionInstant, Certificate, certify, judge
from verify.claims import Claim
from verify.data import NotCertified, Trajectory, Witness
from verify.recheck import recheck
from verify.samples import check_recording, check_samples
from verify.teams import check_team
from verify.verdict import TeamVerdict, Verdict
from verify.words import check_word

__all__ = [
    "ActionInstant",
    "Certificate",
    "Claim",
    "NotCertified",
    "TeamVerdict",
    "Trajectory",
    "Verdict",
    "Witness",
    "certify",
    "check_recording",
    "check_samples",
    "check_team",
    "check_word",
    "judge",
    "recheck",
]
