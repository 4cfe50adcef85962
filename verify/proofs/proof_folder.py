"""Files of a proof, beside a certificate: the statement, the evidence, and the kernel as one file that runs by itself."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from verify.certificate import Certificate
from verify.data.errors import BadInput, NotCertified
from verify.data.plan import Plan
from verify.data.trajectory import Trajectory
from verify.kernel import VERSION
from verify.kernel.__main__ import check_folder, summary
from verify.kernel.checking import Checked
from verify.kernel.statement import FORMAT, Refused
from verify.proofs.finder import prove
from verify.proofs.search import PROOF_FILE
from verify.proofs.statement import STATEMENT_FILE, statement_of

KERNEL_FILE = "check.pyz"
PROOF_FILES = (STATEMENT_FILE, PROOF_FILE, KERNEL_FILE)

_MAIN = "import sys\nfrom kernel.__main__ import main\nsys.exit(main())\n"
_WRITTEN = (1980, 1, 1, 0, 0, 0)
"""The time that files in the archive have, so that its bytes depend on the kernel alone."""


@dataclass(frozen=True, slots=True)
class ProofVerdict:
    """Verdict of the kernel on a folder.

    Attributes:
        claims: Every claim that its statement owes.
        kernel: The kernel's version.
    """

    claims: tuple[Checked, ...]
    kernel: int = VERSION

    def __bool__(self) -> bool:
        return all(not claim.missing for claim in self.claims)

    @property
    def checked(self) -> int:
        """Number of claims that are checked."""
        return sum(not claim.missing for claim in self.claims)

    @property
    def sentence(self) -> str:
        """Number of claims that are checked, of how many, as a sentence."""
        return summary(self.claims)

    @property
    def missing(self) -> tuple[str, ...]:
        """Claims that are not checked, and why, a sentence each."""
        return tuple(
            f"{claim.name}{f' of {robots}' if (robots := ' and '.join(claim.robots)) else ''} is judged, not checked: {claim.missing}."
            for claim in self.claims
            if claim.missing
        )


def proof_files(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate) -> dict[str, bytes]:
    """Return the files of a proof of what a certificate claims, by their names.

    Args:
        plan: What was planned.
        team: The trajectories that were certified.
        certificate: What was proved of them.
    """
    found = prove(plan, team, certificate)
    return {STATEMENT_FILE: found.statement.encode(), PROOF_FILE: found.evidence.encode(), KERNEL_FILE: kernel_archive()}


@cache
def kernel_archive() -> bytes:
    """Return the kernel as a Python archive that needs nothing else: `python check.pyz FOLDER`."""
    content = io.BytesIO(b"#!/usr/bin/env python3\n")
    content.seek(0, io.SEEK_END)
    folder = resources.files("verify") / "kernel"
    sources = {f"kernel/{file.name}": file.read_text("utf-8") for file in folder.iterdir() if file.name.endswith(".py")}
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in sorted({"__main__.py": _MAIN, **sources}.items()):
            archive.writestr(zipfile.ZipInfo(name, _WRITTEN), text, zipfile.ZIP_DEFLATED)
    return content.getvalue()


def check_proof(folder: str | Path) -> ProofVerdict:
    """Have the kernel check the proof in a folder: of statement.json, from proof.json and the robots' CSV files alone.

    That the statement is what mission and plan ask for is for `recheck` to say.

    Raises:
        BadInput: There is no proof, or it cannot be read.
    """
    try:
        return ProofVerdict(tuple(check_folder(Path(folder))[1]))
    except Refused as refused:
        raise BadInput(f"The kernel refuses the proof in {folder}: {refused}") from None


def recheck_proof(folder: str | Path, plan: Plan, certificate: Certificate) -> ProofVerdict | None:
    """Have the kernel check the proof in a folder whose certificate was just proved again; None where the folder has none.

    Args:
        folder: Holds the proof beside the certificate.
        plan: What was planned.
        certificate: As it was proved now.

    Raises:
        NotCertified: The statement is not the one that this certificate proves.
        BadInput: The proof cannot be read, or has another format.
    """
    path = Path(folder) / STATEMENT_FILE
    if not path.exists() and not (Path(folder) / PROOF_FILE).exists():
        return None
    try:
        written = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise BadInput(f"{path} cannot be read: {error}.") from None
    if not written.startswith(f'{{"format":{FORMAT},'):
        raise BadInput(f"{path} is no statement of format {FORMAT}; certify the flight again.")
    if written != statement_of(plan, certificate):
        raise NotCertified(f"{path} was changed: it is not the statement that the certificate proves.")
    return check_proof(folder)
