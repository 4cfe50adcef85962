"""Words of claims: checked by the kernel, judged by the checker alone, or not covered by the kernel. This is the one place that decides them.

A certificate is proved by the checker; its proof is written down for the kernel, which checks it. `checked_certificate` does both for a
flight, `rechecked` for a folder, and `worded` says of each claim what came of it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from verify.certificate import Certificate
from verify.claims.claim import Claim
from verify.data.errors import NotCertified
from verify.data.files.trajectory_csv import write_csv
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.proofs.proof_folder import PROOF_FILES, ProofVerdict, check_proof, proof_files, recheck_proof

PROOF_FOLDER = "proof"
"""Folder of an export that holds the proof, with the trajectories that it is of: what an export writes for a vehicle may be in other forms."""

NOT_COVERED = "judged, not covered by the kernel"
"""Of what the checker says beside its claims: braking to a hover, soft specifications."""

NO_PROOF = "all claims are judged: there is no proof for the kernel"
BOUNDS = "the kernel checks each limit; the bounds beside it are the checker's own"

_NO_CLAIM = "the kernel has no such claim"
_REFUTED = "the checker does not prove it"
_OTHERS = "the kernel counts other claims of this kind"


@dataclass(frozen=True, eq=False, slots=True)
class CheckedCertificate:
    """A certificate whose proof the kernel has checked.

    Attributes:
        certificate: It says of each claim whether the kernel checked it.
        verdict: What the kernel says.
        files: The proof, by file name.
    """

    certificate: Certificate
    verdict: ProofVerdict
    files: Mapping[str, bytes]


def checked_certificate(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate) -> CheckedCertificate:
    """Write down the proof of a certificate, and have the kernel check the files as they are written.

    Args:
        plan: What was planned.
        team: The trajectories that were certified.
        certificate: What was proved of them.
    """
    files = proof_files(plan, team, certificate)
    tables = {f"{name}.csv": write_csv(path, plan.mission.spec.repeat).encode() for name, path in team.items()}
    verdict = checked_files({**files, **tables})
    return CheckedCertificate(with_words(certificate, verdict), verdict, files)


def checked_files(files: Mapping[str, bytes]) -> ProofVerdict:
    """Have the kernel check a proof with its trajectories, by file name.

    Raises:
        BadInput: There is no proof among them, or it cannot be read.
    """
    with tempfile.TemporaryDirectory() as scratch:
        for name, content in files.items():
            (Path(scratch) / name).write_bytes(content)
        return check_proof(scratch)


def rechecked(folder: Path, plan: Plan, certificate: Certificate) -> tuple[Certificate, ProofVerdict | None]:
    """Have the kernel check the proof in a folder, or in the folder of a proof in it; return the certificate with its words.

    Args:
        folder: A run's, or an export's whose paths were certified anew.
        plan: What was planned.
        certificate: As it was proved now.

    Returns:
        The certificate, and what the kernel says; None where there is no proof.

    Raises:
        NotCertified: A file of the proof is not of this certificate.
        BadInput: The proof cannot be read.
    """
    place = folder
    if not any((folder / name).exists() for name in PROOF_FILES) and (folder / PROOF_FOLDER).is_dir():
        place = folder / PROOF_FOLDER
        for name in plan.robots:
            table = place / f"{name}.csv"
            if not table.exists() or table.read_bytes() != (folder / table.name).read_bytes():
                raise NotCertified(f"{table} was changed: it is not the trajectory that was certified.")
    verdict = recheck_proof(place, plan, certificate)
    return with_words(certificate, verdict), verdict


def with_words(certificate: Certificate, verdict: ProofVerdict | None) -> Certificate:
    """Return a certificate that says of each claim by whom it is proved.

    Args:
        certificate: What was proved.
        verdict: Of the kernel on its proof; None where there is none.
    """
    kernel = None if verdict is None else verdict.kernel
    return replace(certificate, claims=worded(certificate.claims, verdict), kernel=kernel)


def worded(claims: Sequence[Claim], verdict: ProofVerdict | None) -> tuple[Claim, ...]:
    """Return claims that say by whom they are proved.

    A claim is checked where it holds and the kernel checked all claims of its name and robots, which are as many as there are here.

    Args:
        claims: What the checker says.
        verdict: Of the kernel on their proof; None where there is none.
    """
    if verdict is None:
        return tuple(replace(claim, proof="judged", missing="") for claim in claims)
    known: dict[_Key, list[str]] = {}
    for one in verdict.claims:
        known.setdefault((one.name, *sorted(one.robots)), []).append(one.missing)
    counts: dict[_Key, int] = {}
    for claim in claims:
        counts[_key(claim)] = counts.get(_key(claim), 0) + 1

    def word(claim: Claim) -> Claim:
        rows = known.get(_key(claim), ())
        return with_word(claim, rows if len(rows) in (0, counts[_key(claim)]) else (*rows, _OTHERS))

    return tuple(map(word, claims))


def with_word(claim: Claim, missing: Sequence[str]) -> Claim:
    """Return a claim that says by whom it is proved.

    Args:
        claim: What the checker says.
        missing: Of each claim of the kernel that this one comes to, what it lacks to be checked; nothing where it is checked.
    """
    if not missing:
        return replace(claim, proof="not covered", missing=_NO_CLAIM)
    lacks = next(filter(None, missing), "")
    is_checked = claim.outcome == "holds" and not lacks
    return replace(claim, proof="checked" if is_checked else "judged", missing=lacks)


_Key = tuple[str, ...]


def _key(claim: Claim) -> _Key:
    return (claim.name, *sorted(name for name in (claim.robot, claim.other) if name is not None))


def word_of(claims: Sequence[Claim]) -> str:
    """Return one word for claims of one kind, at least one: theirs, or how many of them are checked."""
    words = {claim.proof for claim in claims}
    return words.pop() if len(words) == 1 else f"{_checked(claims)} of {len(claims)} checked"


def proof_sentences(claims: Sequence[Claim], kernel: int | None) -> tuple[str, ...]:
    """Return what the kernel says of claims, for a person: what it did not check and why, and last how many it checked.

    Args:
        claims: With their words.
        kernel: Its version; None where there is no proof.
    """
    if kernel is None:
        return (NO_PROOF,)
    return (*_unchecked(claims), *([BOUNDS] if _checked(claims) else []), f"{checked_of(claims)} claims checked by the kernel")


def checked_of(claims: Sequence[Claim]) -> str:
    """Return how many claims are checked, of how many: "23 of 23"."""
    return f"{_checked(claims)} of {len(claims)}"


def _checked(claims: Sequence[Claim]) -> int:
    return sum(claim.proof == "checked" for claim in claims)


def _unchecked(claims: Sequence[Claim]) -> Iterator[str]:
    """Yield which claims are not checked, a sentence for each reason."""
    found: dict[tuple[str, str, str], list[Claim]] = {}
    for claim in claims:
        if claim.proof != "checked":
            found.setdefault((claim.name, claim.proof, claim.missing), []).append(claim)
    for (name, word, missing), alike in found.items():
        robots = " and ".join(filter(None, (alike[0].robot, alike[0].other)))
        more = f", and {len(alike) - 1} more like it" if len(alike) > 1 else ""
        yield f"{name}{f' of {robots}' if robots else ''}{more}: {word}, not checked: {missing or _REFUTED}"
