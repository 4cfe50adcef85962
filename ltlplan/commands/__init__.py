"""Commands of the command line, one module each: parse, call the library, show the results.

A command has as many parameters as users have options: its signature is what `--help` shows. From a mission to files: `plan`, `run`, `batch`, `show`,
`automaton`, `missions`. Proofs: `certify`, `recheck`, `check`, `audit`. Flights: `fly`, `campaign`, `rehearse`, `identify`, `online`, `export`.
`reproduce` computes the papers anew. `serve` starts the service, `submit` hands it a mission, `accounts` says who may use it, `backup` and `restore`
keep its data. `doctor` says what is installed; `support` holds what several commands share.
"""
