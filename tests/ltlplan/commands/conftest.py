"""The command line for all tests of a worker."""

from collections.abc import Iterator

import pytest

from tests.helpers.commands import Command, command_server


@pytest.fixture(scope="session")
def ltlplan(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Command]:
    """Call the command line in a process of its own."""
    with command_server(tmp_path_factory.mktemp("printed")) as call:
        yield call
