"""Tokens and sessions: who holds one, how long it lasts, and damaged files of them."""

from __future__ import annotations

import json
import stat
import threading
from pathlib import Path

import pytest

from ltlplan.service.security import sessions as session_module
from ltlplan.service.security.sessions import FILE as SESSIONS
from ltlplan.service.security.sessions import MOST_OF_ONE, Sessions
from ltlplan.service.security.tokens import FILE, Tokens
from verify.data import BadInput


def test_a_token_is_known_until_it_is_revoked_and_stands_in_no_file(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    assert not tokens.needed
    token = tokens.new("alice")
    assert tokens.needed
    assert tokens.owner(token) == Tokens(tmp_path).owner(token) == "alice"
    assert tokens.owner(token[:-1]) is tokens.owner("") is tokens.owner("\udcff") is None
    for path in tmp_path.iterdir():
        assert token not in path.read_text(errors="replace")
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    tokens.revoke("alice")
    assert tokens.owner(token) is None


def test_what_another_process_changes_counts_at_once(tmp_path: Path) -> None:
    ours, theirs = Tokens(tmp_path), Tokens(tmp_path)
    token = theirs.new("bob")
    assert ours.owner(token) == "bob"
    theirs.revoke("bob")
    assert ours.owner(token) is None


def test_tokens_made_at_the_same_time_are_all_kept(tmp_path: Path) -> None:
    threads = [threading.Thread(target=Tokens(tmp_path).new, args=(f"robot-{i}",)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(Tokens(tmp_path).names()) == [f"robot-{i}" for i in range(8)]


@pytest.mark.parametrize("name", ["", "a b", "../x", "a:b", "x" * 61, "é"])
def test_names_of_tokens(name: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot name a token"):
        Tokens(tmp_path).new(name)


def test_a_name_that_is_taken_and_one_that_is_not_there(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    with pytest.raises(BadInput, match="already"):
        tokens.new("alice")
    with pytest.raises(BadInput, match="Did you mean 'alice'"):
        tokens.revoke("alise")


@pytest.mark.parametrize("text", ["", "{}", '{"format": 2, "tokens": []}', '{"format": 1, "tokens": [{"name": 1}]}', "[1]"])
def test_a_file_of_tokens_that_is_none_opens_nothing(text: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(BadInput):
        Tokens(tmp_path).owner("x")


def test_a_session_holds_no_token_outlives_a_restart_and_lapses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tokens = Tokens(tmp_path)
    token = tokens.new("alice")
    sessions = Sessions(tokens)
    session = sessions.begin("alice")
    kept = (tmp_path / SESSIONS).read_text()
    assert token not in session
    assert session not in kept
    assert stat.S_IMODE((tmp_path / SESSIONS).stat().st_mode) == 0o600
    assert sessions.owner(session) == Sessions(Tokens(tmp_path)).owner(session) == "alice"
    for forged in ("", "alice", session[:-1], f"{session}x", "\udcff", json.loads(kept)["sessions"].popitem()[0]):
        assert sessions.owner(forged) is None
    now = session_module.time.time()
    monkeypatch.setattr(session_module.time, "time", lambda: now + session_module.SESSION_SECONDS + 1)
    assert sessions.owner(session) is None


def test_a_session_ends_by_itself_and_with_its_token(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    sessions = Sessions(tokens)
    first, second = sessions.begin("alice"), sessions.begin("alice")
    sessions.end(first)
    sessions.end("nonsense")
    assert (sessions.owner(first), sessions.owner(second)) == (None, "alice")
    Tokens(tmp_path).revoke("alice")  # by another process
    assert sessions.owner(second) is None
    with pytest.raises(BadInput, match="no token 'alice'"):
        sessions.begin("alice")
    tokens.new("alice")
    assert sessions.owner(second) is None, "a new token of an old name takes no old session up again"


def test_of_an_owner_with_many_sessions_the_first_ends(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    tokens.new("bob")
    sessions = Sessions(tokens)
    bobs = sessions.begin("bob")
    begun = [sessions.begin("alice") for _ in range(MOST_OF_ONE + 1)]
    assert [sessions.owner(each) for each in (begun[0], begun[1], begun[-1], bobs)] == [None, "alice", "alice", "bob"]


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"format": 1, "sessions": {"x": 1}}', '{"format": 1, "sessions": [1]}'])
def test_a_damaged_file_of_sessions_lets_nobody_in_and_is_replaced(text: str, tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    (tmp_path / SESSIONS).write_text(text)
    sessions = Sessions(tokens)
    assert sessions.owner("x") is None
    assert Sessions(tokens).owner(sessions.begin("alice")) == "alice"
