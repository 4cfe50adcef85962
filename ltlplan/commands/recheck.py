"""`ltlplan recheck`: prove a certificate again, from the files alone."""

from __future__ import annotations

import typer

from ltlplan.commands.certify import below_asked
from ltlplan.commands.support.options import FolderArgument, JsonOption


def command(folder: FolderArgument, json: JsonOption = False) -> None:
    """Prove the certificate of a folder again from its files; name the file that was changed, if one was."""
    import json as json_text

    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.report.summary import claim_lines, proof_data, soft_sentences, tracking_sentences, with_clocks
    from verify.checked_claims import proof_sentences
    from verify.run_folder import proved_run

    with progress_bar(quiet=json) as progress:
        progress("proving all claims again, and checking the proof", 0.0)
        again = proved_run(folder)
    certificate, proof = again.certificate, again.proof
    if json:
        print_json({**json_text.loads(certificate.to_json()), "proof": None if proof is None else proof_data(proof)})
        return
    for line in (*claim_lines(certificate), *tracking_sentences(certificate), *soft_sentences(certificate)):
        typer.echo(line)
    margin = f"{certificate.margin:g} m{below_asked(certificate)}{with_clocks(certificate)}"
    typer.echo(f"{folder}: every claim is proved again at margin {margin}, tube {certificate.tube}, from the files alone")
    for sentence in proof_sentences(certificate.claims, certificate.kernel):
        typer.echo(f"{folder}: {sentence}")
