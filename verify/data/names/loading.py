"""Lazy loading of a package's names at their first use: a caller that needs one name does not wait for all.

Type checkers read the package's imports, which stand under `TYPE_CHECKING`; a test holds the two together. It is twenty lines, which
the packages that do this (`lazy_loader`) need a second file of names for.
"""

from __future__ import annotations

import importlib
import sys

from verify.data.names.former_names import warn_former

TYPE_CHECKING = False  # type checkers take it for True; `typing` takes long to load for what must be quick to begin
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def loaded_at_first_use(
    package: str, homes: Mapping[str, tuple[str, ...]], **former: str
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return a package's `__getattr__` and `__dir__` (PEP 562).

    Args:
        package: Its name.
        homes: The names that each module brings.
        former: The present name of each former one, which goes on with a warning.
    """
    home_of = {name: home for home, names in homes.items() for name in names}
    own = vars(sys.modules[package])

    def get(name: str) -> object:
        if name in former:
            warn_former(f"{package}.{name}", f"{package}.{former[name]}")
            return get(former[name])
        if name not in home_of:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        found = own[name] = getattr(importlib.import_module(home_of[name]), name)
        return found

    def names() -> list[str]:
        return sorted({*own, *home_of})

    return get, names
