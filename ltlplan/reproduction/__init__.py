"""Both papers and published problems, element by element, computed anew beside what was published.

An `element` is a definition, equation, algorithm, figure, scenario or problem with a function that computes its quantities: numbers, texts, and checks
that must hold. `elements` lists all of them. `hoops_parts`, `hoops_sequences` and `hoops_flights` are the 2019 paper's; `team_parts`, `team_flights`, `quantile_parts` and `race` the 2022 paper's;
`published` holds the published problems, over `published_missions`.

`running` computes them in processes with pinned linear algebra, and judges each quantity by the reviewed `intervals`, each an `expectation`; `documents`, `page` and `charts` show what came of it.
The command is `ltlplan reproduce`. It computes and compares; nothing else of the package depends on it.
"""
