"""Command `ltlplan check`: a word, or the words of a team, against a formula."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from ltlplan.commands.support.options import JsonOption

NOT_PROVED = 5


def command(
    formula: Annotated[str, typer.Argument(help="LTL in Spot's syntax, such as 'F a & G(b -> c)'.", show_default=False)],
    words: Annotated[
        list[str],
        typer.Argument(
            help="One word a robot in Spot's notation, such as '1; a; b & c' or 'a; cycle{b; 1}'; propositions that are not named are false.",
            show_default=False,
        ),
    ],
    team: Annotated[
        Literal["own", "joint"], typer.Option("--team", help="Team letters: each robot's own, or the union of all.")
    ] = "own",
    json: JsonOption = False,
) -> None:
    """Check one word, or the words of a team one after another and interleaved; exit code 5 where a claim is not proved."""
    from ltlplan.commands.support.terminal import print_json
    from verify.trace_checking.team_verdict import check_team
    from verify.trace_checking.word_verdict import check_word, parse_word

    given = [parse_word(word) for word in words]
    if len(given) == 1:
        verdicts = {"word": check_word(formula, given[0])}
    else:
        both = check_team(formula, {f"quad{i}": word for i, word in enumerate(given)}, team)
        verdicts = {"sequential": both.sequential, "parallel": both.parallel}
    if json:
        print_json({"formula": formula, "words": list(map(str, given)), **{n: v.to_dict() for n, v in verdicts.items()}})
    else:
        from verify.logic.verdict import show_readings

        for name, verdict in verdicts.items():
            typer.echo(f"{name}: {verdict.outcome}. {verdict.sentence}")
            if len(given) > 1 and verdict.counterexample is not None:
                typer.echo(f"  counterexample: {show_readings(verdict.readings())}")
    if not all(verdicts.values()):
        raise typer.Exit(NOT_PROVED)
