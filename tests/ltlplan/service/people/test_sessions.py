"""Sessions of browsers: how long they last, what ends them, and those of version 0.2.0."""

from __future__ import annotations

import json
import stat
import time
from pathlib import Path

import pytest

from ltlplan.service.people import sessions as session_module
from ltlplan.service.people.database import EARLIER_SESSIONS, FILE
from ltlplan.service.people.people import People
from ltlplan.service.people.sessions import MOST_OF_ONE
from ltlplan.service.security.tokens import Tokens, digest_of
from verify.data import BadInput


def _people(folder: Path) -> People:
    return People(Tokens(folder))


def _user(people: People, session: str) -> str | None:
    found = people.of_session(session)
    return None if found is None else found.user


def test_a_session_holds_no_token_outlives_a_restart_and_lapses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    people = _people(tmp_path)
    token = people.tokens.new("alice")
    session = people.sessions.begin("alice")
    assert token not in session
    people.close()
    kept = (tmp_path / FILE).read_bytes()
    assert session.encode() not in kept
    assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600
    assert _user(people, session) == _user(_people(tmp_path), session) == "alice"
    for forged in ("", "alice", session[:-1], f"{session}x", "\udcff", digest_of(session)):
        assert _user(people, forged) is None
    now = time.time()
    monkeypatch.setattr(session_module.time, "time", lambda: now + session_module.SESSION_SECONDS + 1)
    assert _user(people, session) is None


def test_a_session_ends_by_itself_and_with_its_token(tmp_path: Path) -> None:
    people = _people(tmp_path)
    people.tokens.new("alice")
    first, second = people.sessions.begin("alice"), people.sessions.begin("alice")
    people.sessions.end(first)
    people.sessions.end("nonsense")
    assert (_user(people, first), _user(people, second)) == (None, "alice")
    Tokens(tmp_path).revoke("alice")  # by another process
    assert _user(people, second) is None
    with pytest.raises(BadInput, match="no token 'alice'"):
        people.sessions.begin("alice")
    people.tokens.new("alice")
    assert _user(people, second) is None, "a new token of an old name takes no old session up again"


def test_of_an_owner_with_many_sessions_the_first_ends(tmp_path: Path) -> None:
    people = _people(tmp_path)
    people.tokens.new("alice")
    people.tokens.new("bob")
    bobs = people.sessions.begin("bob")
    begun = [people.sessions.begin("alice") for _ in range(MOST_OF_ONE + 1)]
    assert [_user(people, each) for each in (begun[0], begun[1], begun[-1], bobs)] == [None, "alice", "alice", "bob"]


def test_sessions_of_version_0_2_0_are_taken_over_and_their_file_goes(tmp_path: Path) -> None:
    people = _people(tmp_path)
    people.tokens.new("alice")
    kept = {"owner": "alice", "token": people.tokens.digest("alice"), "ends": time.time() + 60}
    lapsed = {**kept, "ends": time.time() - 60}
    written = {"format": 1, "sessions": {digest_of("mine"): kept, digest_of("old"): lapsed}}
    (tmp_path / EARLIER_SESSIONS).write_text(json.dumps(written))
    assert (_user(people, "mine"), _user(people, "old")) == ("alice", None)
    assert not (tmp_path / EARLIER_SESSIONS).exists()


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"format": 1, "sessions": {"x": 1}}', '{"format": 1, "sessions": [1]}'])
def test_a_damaged_file_of_sessions_lets_nobody_in_and_goes(text: str, tmp_path: Path) -> None:
    (tmp_path / EARLIER_SESSIONS).write_text(text)
    people = _people(tmp_path)
    people.tokens.new("alice")
    assert _user(people, "x") is None
    assert _user(people, people.sessions.begin("alice")) == "alice"
    assert not (tmp_path / EARLIER_SESSIONS).exists()


@pytest.mark.parametrize("content", [b"nonsense" * 100, b""])
def test_a_damaged_file_of_people_lets_nobody_in(content: bytes, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(content)
    people = _people(tmp_path)
    if content:
        with pytest.raises(BadInput, match="cannot be used"):
            people.of_session("x")
    else:
        assert people.of_session("x") is None


def test_a_newer_file_of_people_is_rejected(tmp_path: Path) -> None:
    people = _people(tmp_path)
    with people.database.changing() as run:
        run.execute("PRAGMA user_version = 99")
    people.close()
    with pytest.raises(BadInput, match="newer ltlplan"):
        _people(tmp_path).of_session("x")
