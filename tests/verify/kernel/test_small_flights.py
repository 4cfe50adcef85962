"""Small flights, one for each kind of claim: the kernel checks all that the judge claims of them."""

from tests.helpers.few import few_of
from tests.helpers.kernel.proofs import checked, missing, tables
from tests.helpers.motion.small_flights import FLIGHTS, small_flight
from verify import judge
from verify.proofs.finder import prove


@few_of(6, "name", FLIGHTS)
def test_all_claims_are_checked(name):
    plan, team = small_flight(name)
    certificate = judge(plan, team, largest=False)
    proof = prove(plan, team, certificate)
    claims = checked(proof.statement, proof.evidence, tables(plan, team))
    assert missing(claims) == set()
    assert len(claims) == len(certificate.claims)
