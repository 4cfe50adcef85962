"""Earlier place of `ltlplan.service.execution.workers`."""

import warnings

from ltlplan.service.execution.workers import *  # noqa: F403  # whatever was imported from here

warnings.warn(f"{__name__} is ltlplan.service.execution.workers now.", DeprecationWarning, stacklevel=2)
