"""Earlier place of `ltlplan.service.execution`: `batches`, `workers` and `clusters` go on with a warning, until the next release."""
