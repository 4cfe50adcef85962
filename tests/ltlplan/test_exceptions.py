"""The exceptions that callers may want to catch are names of `ltlplan`."""

import inspect

import ltlplan
import verify.data


def test_every_public_exception_is_exported() -> None:
    for name in verify.data.__all__:
        found = getattr(verify.data, name)
        if inspect.isclass(found) and issubclass(found, Exception):
            assert getattr(ltlplan, name) is found
            assert issubclass(found, ltlplan.LtlplanError)
