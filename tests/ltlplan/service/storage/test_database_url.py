"""Where the database's URL comes from, and that its password is in no command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from ltlplan.service.job_queue.database import prepare, url_of
from ltlplan.service.settings import Settings
from ltlplan.service.storage.database_url import VARIABLE, database_url, has_password
from verify.data import BadInput

URL = "postgresql://alice:s3cret@127.0.0.1:1/jobs"


@pytest.mark.parametrize(
    "url", [URL, "postgresql://h/jobs?user=alice&password=s3cret", "postgresql://h/jobs?sslmode=x&password=s3cret"]
)
def test_a_password_on_the_command_line_is_noted_and_not_repeated(url: str) -> None:
    found, notes = database_url(url, None, {})
    assert found == url
    assert [VARIABLE in note and "--db-file" in note and "passfile" in note for note in notes] == [True]
    assert "s3cret" not in notes[0]


@pytest.mark.parametrize("url", ["postgresql://alice@h/jobs", "postgresql:///jobs", "not a URL", "postgresql://[/"])
def test_a_url_without_a_password_is_taken_as_it_is(url: str) -> None:
    assert database_url(url, None, {}) == (url, ())
    assert not has_password(url)


def test_no_process_that_is_started_has_the_variable() -> None:
    environment = {VARIABLE: URL, "OTHER": "1"}
    assert database_url(None, None, environment) == (URL, ())
    assert environment == {"OTHER": "1"}
    environment = {VARIABLE: "postgresql://other/jobs"}
    assert database_url("postgresql://h/jobs", None, environment)[0] == "postgresql://h/jobs"
    assert environment == {}
    assert database_url(None, None, {}) == (None, ())


def test_a_file_holds_it(tmp_path: Path) -> None:
    file = tmp_path / "url"
    file.write_text(f"{URL}\n")
    file.chmod(0o600)
    assert database_url(None, file, {}) == (URL, ())
    file.chmod(0o644)
    assert "chmod 600" in database_url(None, file, {})[1][0]
    file.write_text("\n")
    with pytest.raises(BadInput, match="is empty"):
        database_url(None, file, {})
    with pytest.raises(BadInput):
        database_url(None, tmp_path / "nothing", {})
    with pytest.raises(BadInput, match="Both --db and --db-file"):
        database_url(URL, file, {})


def test_what_is_said_of_a_database_has_no_password(tmp_path: Path) -> None:
    assert "s3cret" not in repr(Settings(data=tmp_path, database=URL))
    for url in (URL, "postgresql://127.0.0.1:1/jobs?password=s3cret"):
        with pytest.raises(BadInput, match="cannot be used") as refused:
            prepare(url_of(tmp_path, url), "folder", tables=1)
        assert "s3cret" not in str(refused.value)
    with pytest.raises(BadInput, match="no URL") as refused:
        url_of(tmp_path, "postgresql://alice:s3cret@host:port/jobs")
    assert "s3cret" not in str(refused.value)
