"""Earlier place of `ltlplan.service.execution.batches`."""

import warnings

from ltlplan.service.execution.batches import *  # noqa: F403  # whatever was imported from here

warnings.warn(f"{__name__} is ltlplan.service.execution.batches now.", DeprecationWarning, stacklevel=2)
