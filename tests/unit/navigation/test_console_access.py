"""Access to the console: requests, control, messages."""

from __future__ import annotations

import contextlib
import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from drone_navigation.console.access import TOKEN_LENGTH_MIN, Access
from drone_navigation.console.lease import SILENCE_S, Leases
from drone_navigation.console.messages import (
    MESSAGE,
    Alive,
    Cancel,
    Hold,
    PageCommand,
    PageFollow,
    PageGoal,
    PagePhoto,
    PagePoint,
    RateLimit,
    RejectedError,
    Take,
    parse,
)
from drone_navigation.console.options import TokenError, make_parser, token_of
from tests.support.messages.random_console_messages import FLY, FOLLOW, MOVING, WAYPOINT, broken

TOKEN = "a" * 32
HOME = "127.0.0.1:8800"
HERE = f"http://{HOME}"
ACCESS = Access(TOKEN, "127.0.0.1", 8800)


def denied(
    path: str = f"/socket?token={TOKEN}",
    hosts: tuple[str, ...] = (HOME,),
    origins: tuple[str, ...] = (HERE,),
) -> str:
    found = ACCESS.check(path, hosts, origins, token=True, origin=True)
    return "" if found is None else found.kind


def test_the_page_itself_is_served() -> None:
    assert denied() == ""
    assert denied(hosts=("localhost:8800",), origins=("http://localhost:8800",)) == ""


@pytest.mark.parametrize(
    "hosts",
    [
        (), ("",), ("127.0.0.1",), ("127.0.0.1:8801",), ("evil.example:8800",), ("evil.example",),
        ("127.0.0.1:8800.evil.example",), (HOME, HOME), (f" {HOME}",), ("LOCALHOST:8800",),
        ("0.0.0.0:8800",), ("[::1]:8800",), (f"user@{HOME}",),
    ],
)  # fmt: skip
def test_a_host_that_is_not_exactly_this_one_is_denied(hosts: tuple[str, ...]) -> None:
    assert denied(hosts=hosts) == "host"


@pytest.mark.parametrize(
    "origins",
    [
        (), ("null",), ("https://127.0.0.1:8800",), ("http://127.0.0.1",), ("http://evil.example",),
        (HERE, HERE), (f"{HERE}/",), ("http://127.0.0.1:8800.evil.example",), ("file://",),
    ],
)  # fmt: skip
def test_an_origin_that_is_not_exactly_this_one_is_denied(origins: tuple[str, ...]) -> None:
    assert denied(origins=origins) == "origin"


def test_a_page_opened_from_nowhere_needs_no_origin_but_a_foreign_one_is_denied() -> None:
    assert ACCESS.check(f"/?token={TOKEN}", [HOME], [], token=True, origin=False) is None
    foreign = ACCESS.check("/map.js", [HOME], ["http://evil.example"], token=False, origin=False)
    assert foreign is not None
    assert foreign.kind == "origin"


@pytest.mark.parametrize(
    "query", ["", "?token=", "?token=old", f"?token={TOKEN}b", f"?token={TOKEN}&token={TOKEN}",
              f"?Token={TOKEN}", "?token=ä"]
)  # fmt: skip
def test_a_missing_or_old_token_is_denied(query: str) -> None:
    assert denied(f"/socket{query}") == "token"


def test_another_host_is_the_only_one_that_is_served() -> None:
    access = Access(TOKEN, "192.0.2.7", 80)
    path = f"/?token={TOKEN}"
    assert access.check(path, ["192.0.2.7:80"], [], token=True, origin=False) is None
    assert access.check(path, ["127.0.0.1:80"], [], token=True, origin=False) is not None


# --- the token ------------------------------------------------------------------------------


def token(*arguments: str) -> str:
    return token_of(make_parser().parse_args(list(arguments)))


def test_each_start_has_a_token_of_its_own() -> None:
    assert len(token()) >= TOKEN_LENGTH_MIN
    assert token() != token()


def test_another_host_than_loopback_needs_a_token_in_a_file_of_ones_own(tmp_path: Path) -> None:
    file = tmp_path / "token"
    with pytest.raises(TokenError, match="needs --token-file"):
        token("--host", "192.0.2.7")
    file.write_text("b" * TOKEN_LENGTH_MIN + "\n")
    file.chmod(0o644)
    with pytest.raises(TokenError, match="read by others"):
        token("--host", "192.0.2.7", "--token-file", str(file))
    file.chmod(0o600)
    assert token("--host", "192.0.2.7", "--token-file", str(file)) == "b" * TOKEN_LENGTH_MIN
    with pytest.raises(TokenError, match="machine's addresses"):
        token("--host", "0.0.0.0", "--token-file", str(file))
    for text in ("short", "with a space, however long it is", "b" * 30 + "&"):
        file.write_text(text)
        with pytest.raises(TokenError, match="no token"):
            token("--token-file", str(file))
    with pytest.raises(TokenError, match="No such file"):
        token("--token-file", str(tmp_path / "none"))


# --- control --------------------------------------------------------------------------------


def test_one_page_has_control_until_another_takes_it_knowingly() -> None:
    leases = Leases()
    assert leases.take("/", 1, 0.0, over=False)
    assert not leases.take("/", 2, 1.0, over=False)
    assert leases.holder("/") == 1
    assert leases.take("/other", 2, 1.0, over=False)
    assert leases.take("/", 2, 1.0, over=True)
    assert not leases.holds("/", 1, 1.0)
    leases.give(1)
    assert leases.holds("/", 2, 1.0)
    leases.give(2, "/")
    assert leases.holder("/") is None
    assert leases.holder("/other") == 2


def test_a_silent_page_loses_control_and_does_not_get_it_back_by_speaking() -> None:
    leases = Leases()
    leases.take("/", 1, 0.0, over=False)
    leases.hear(1, SILENCE_S)
    assert leases.holds("/", 1, 2 * SILENCE_S)
    assert not leases.holds("/", 1, 2 * SILENCE_S + 0.1)
    leases.hear(1, 2 * SILENCE_S + 0.1)
    assert leases.holder("/") is None
    assert leases.take("/", 2, 2 * SILENCE_S + 0.2, over=False)


# --- messages -------------------------------------------------------------------------------


def test_good_messages_are_read() -> None:
    assert parse('{"type": "alive"}') == Alive()
    assert parse('{"type": "take", "vehicle": "/a", "over": true}') == Take("/a", True)
    assert parse('{"type": "hold", "vehicle": "/"}') == Hold("/")
    assert parse('{"type": "cancel", "vehicle": "/"}') == Cancel("/")
    flown = parse(json.dumps(FLY))
    assert isinstance(flown, PageGoal)
    assert flown.waypoints[0].position_enu_m == (5.0, 1.0, 4.0)
    for message in MOVING:
        kinds = (PageGoal, PageCommand, PageFollow, PagePhoto, PagePoint)
        assert isinstance(parse(json.dumps(message)), kinds)


@pytest.mark.parametrize("confirmed", ["click", "", None, True, 1])
def test_what_starts_something_has_to_be_confirmed(confirmed: Any) -> None:
    for message in MOVING:
        if "confirmed" not in message:
            continue
        with pytest.raises(RejectedError, match="confirmed"):
            parse(json.dumps({**message, "confirmed": confirmed}))


@pytest.mark.parametrize(
    "changes",
    [
        {"waypoints": []}, {"waypoints": [WAYPOINT] * 501}, {"waypoints": {}}, {"waypoints": [[]]},
        {"waypoints": [{**WAYPOINT, "x": 1e7}]}, {"waypoints": [{**WAYPOINT, "hold": -1}]},
        {"waypoints": [{**WAYPOINT, "z": "4"}]}, {"laps": 0}, {"laps": 1.5}, {"laps": 101},
        {"speed": -1}, {"speed": 1000}, {"speed": True}, {"avoid": 1}, {"vehicle": 3},
        {"vehicle": "v" * 1000}, {"radius": "8"}, {"radius": 1e6},
        {"radius": 8, "waypoints": [WAYPOINT] * 2},
    ],
)  # fmt: skip
def test_what_is_out_of_range_is_rejected(changes: dict[str, Any]) -> None:
    with pytest.raises(RejectedError):
        parse(json.dumps({**FLY, **changes}))


@pytest.mark.parametrize(
    "changes",
    [
        {"source": "gps"}, {"target": ""}, {"target": " "}, {"target": "x" * 201}, {"target": 7},
        {"source": "system", "target": "0"}, {"source": "system", "target": "256"},
        {"source": "system", "target": "one"}, {"ahead": 1e4}, {"least": -1}, {"speed": -1},
    ],
)  # fmt: skip
def test_a_target_that_cannot_be_followed_is_rejected(changes: dict[str, Any]) -> None:
    with pytest.raises(RejectedError):
        parse(json.dumps({**FOLLOW, **changes}))


def test_ten_thousand_broken_messages_are_rejected() -> None:
    for data in broken(16, 10_000):
        with pytest.raises(RejectedError):
            parse(data)


def test_the_schema_of_the_messages_agrees_with_their_reader() -> None:
    jsonschema.Draft202012Validator.check_schema(MESSAGE.schema)
    validator = jsonschema.Draft202012Validator(MESSAGE.schema)
    for message in MOVING:
        assert validator.is_valid(message), message
    judged = 0
    for data in broken(5, 400):
        with contextlib.suppress(ValueError, RecursionError):
            document = json.loads(data, parse_constant=float)
            if document == document and "NaN" not in str(data):
                assert not validator.is_valid(document), data
                judged += 1
    assert judged > 100


def test_an_unknown_member_is_answered_with_the_closest_one() -> None:
    for changes, said in (
        ({"sped": 1.0}, "sped is unknown; did you mean 'speed'?"),
        ({"waypoints": [{**WAYPOINT, "x": True}]}, "waypoints[0].x must be a number, not True."),
        ({"laps": 101}, "laps is 101; it must be between 1 and 100."),
        (
            {"radius": 8, "waypoints": [WAYPOINT] * 2},
            "A circle goes around one waypoint.",
        ),
        ({"type": "flee"}, "type is 'flee'; it must be one of alive, take, "),
        ({"x" * 500: 1}, "xxx' is unknown; known are vehicle, waypoints, "),
    ):
        with pytest.raises(RejectedError, match=re.escape(said)) as caught:
            parse(json.dumps({**FLY, **changes}))
        assert len(str(caught.value)) < 200


def test_a_page_has_a_pace() -> None:
    rate_limit = RateLimit(10.0, 5.0, 0.0)
    assert [rate_limit.allows(0.0) for _ in range(6)] == [True] * 5 + [False]
    assert rate_limit.allows(0.1)
    assert not rate_limit.allows(0.1)
    assert [rate_limit.allows(100.0) for _ in range(6)] == [True] * 5 + [False]
