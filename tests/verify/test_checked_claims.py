"""Words of claims: checked, judged or not covered, of every combination of what checker and kernel say."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import ltlplan
from verify import Trajectory
from verify.checked_claims import checked_certificate, checked_of, proof_sentences, word_of, worded
from verify.claims.claim import Claim
from verify.kernel.checking import Checked
from verify.proofs.proof_folder import ProofVerdict


def claim(name: str, *robots: str, outcome: str = "holds") -> Claim:
    return Claim(name, outcome, "Says so.", *robots)  # pyright: ignore[reportArgumentType]


def verdict(*claims: tuple[str, tuple[str, ...], str]) -> ProofVerdict:
    return ProofVerdict(
        tuple(Checked(name, robots, "" if missing else "It is.", missing) for name, robots, missing in claims), 1
    )


def words(claims: list[Claim], *said: tuple[str, tuple[str, ...], str]) -> list[tuple[str, str]]:
    return [(one.proof, one.missing) for one in worded(claims, verdict(*said))]


def test_a_claim_is_checked_where_the_kernel_checked_it() -> None:
    pair = [claim("separation", "b", "a"), claim("visits", "a")]
    assert words(pair, ("separation", ("a", "b"), ""), ("visits", ("a",), "no marks")) == [
        ("checked", ""),
        ("judged", "no marks"),
    ]


@pytest.mark.parametrize(
    ("claims", "said", "word"),
    [
        ([claim("speed", "a")], [], "not covered"),
        ([claim("speed", "a")], [("speed", ("b",), "")], "not covered"),
        ([claim("legs", "a"), claim("legs", "a")], [("legs", ("a",), ""), ("legs", ("a",), "")], "checked"),
        ([claim("legs", "a"), claim("legs", "a")], [("legs", ("a",), ""), ("legs", ("a",), "no marks")], "judged"),
        ([claim("legs", "a"), claim("legs", "a")], [("legs", ("a",), "")], "judged"),
        ([claim("legs", "a")], [("legs", ("a",), ""), ("legs", ("a",), "")], "judged"),
        ([claim("speed", "a", outcome="fails")], [("speed", ("a",), "")], "judged"),
        ([claim("speed", "a", outcome="undecided")], [("speed", ("a",), "")], "judged"),
    ],
)
def test_nothing_else_is(claims: list[Claim], said: list[tuple[str, tuple[str, ...], str]], word: str) -> None:
    assert {word for word, _ in words(claims, *said)} == {word}


def test_without_a_proof_all_claims_are_judged() -> None:
    (one,) = worded(worded([claim("speed", "a")], verdict(("speed", ("a",), ""))), None)
    assert (one.proof, one.missing) == ("judged", "")
    assert proof_sentences([one], None) == ("all claims are judged: there is no proof for the kernel",)


def test_what_is_missing_is_said_once_for_claims_that_are_alike() -> None:
    pairs = [claim("separation", "a", "b"), claim("separation", "a", "c"), claim("speed", "a"), claim("abort")]
    said = worded(
        pairs, verdict(("separation", ("a", "b"), "no marks"), ("separation", ("a", "c"), "no marks"), ("speed", ("a",), ""))
    )
    assert proof_sentences(said, 1) == (
        "separation of a and b, and 1 more like it: judged, not checked: no marks",
        "abort: not covered, not checked: the kernel has no such claim",
        "the kernel checks each limit; the bounds beside it are the checker's own",
        "1 of 4 claims checked by the kernel",
    )
    assert (word_of(said[:2]), word_of(said[1:3]), checked_of(said)) == ("judged", "1 of 2 checked", "1 of 4")


def test_all_claims_of_a_shipped_flight_are_checked_and_its_digest_stays(shipped_run: Callable[[str], ltlplan.Result]) -> None:
    run = shipped_run("firefighting")
    made = checked_certificate(run.plan, run.team, run.certificate)
    assert made.certificate.checked == len(run.certificate.claims) == made.verdict.checked
    assert made.certificate.digest() == run.certificate.digest()
    assert made.certificate.claims == run.certificate.claims, "words are no part of a claim"
    moved = Trajectory(run.team["quad2"].durations * 2, run.team["quad2"].coefficients)
    other = checked_certificate(run.plan, {**run.team, "quad2": moved}, run.certificate).certificate
    assert {claim.robot for claim in other.claims if claim.proof != "checked"} >= {"quad2"}
