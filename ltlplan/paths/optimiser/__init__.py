"""Earlier place of `ltlplan.paths.cross_entropy`: `cross_entropy` goes on with a warning, until the next release."""
