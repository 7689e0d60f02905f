"""Required parameters: requested until they arrive, decoded, and kept up to date."""

from __future__ import annotations

import struct
from typing import Any

import pytest

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.parameters import ParameterReader, decode_value
from tests.support.messages.autopilot_messages import AutopilotMessages

ADDRESS = Address(1, 191, 1, 1)
INT32, INT8, REAL32 = (
    mavlink.MAV_PARAM_TYPE_INT32,
    mavlink.MAV_PARAM_TYPE_INT8,
    mavlink.MAV_PARAM_TYPE_REAL32,
)
say = AutopilotMessages()


def value(name: str, number: float, kind: int = REAL32) -> Any:
    return say("PARAM_VALUE", param_id=name, param_value=number, param_type=kind)


def unknown(name: str) -> Any:
    return say("PARAM_ERROR", param_id=name, error=mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)


def reader(*names: str, bytewise: bool = False) -> ParameterReader:
    made = ParameterReader()
    made.start(0.0)
    made.resume(ADDRESS, names, bytewise, 0.0)
    return made


def asked(made: ParameterReader) -> list[str]:
    return [message.param_id.rstrip("\0") for message in made.messages_to_send()]


def test_every_name_is_asked_for_until_it_is_answered() -> None:
    made = reader("A", "B")
    assert asked(made) == ["A", "B"]
    made.receive(value("A", 3.0), 0.1)
    made.handle_timer(1.0)
    assert asked(made) == ["B"]
    made.receive(value("B", 4.0), 1.1)
    assert not made.reading
    assert dict(made.values) == {"A": 3.0, "B": 4.0}


def test_a_name_without_an_answer_is_given_up_and_asked_for_again_later() -> None:
    """Neither firmware answers for a parameter that it does not have."""
    made = reader("NONE")
    for _ in range(8):
        assert asked(made) == ["NONE"]
        deadline = made.deadline_s
        assert deadline is not None
        made.handle_timer(deadline)
    assert asked(made) == []
    assert not made.reading
    assert "NONE" not in made.values
    again = made.deadline_s
    assert again is not None
    made.handle_timer(again)
    assert asked(made) == ["NONE"]


RENAMED = {"RTL_ALT": ("RTL_ALT_M", 100.0)}


@pytest.mark.parametrize(
    ("has", "number"), [("RTL_ALT", 1500.0), ("RTL_ALT_M", 15.0)], ids=["older", "newer"]
)
def test_a_renamed_parameter_is_known_by_its_former_name_and_unit(has: str, number: float) -> None:
    made = ParameterReader()
    made.start(0.0)
    made.resume(ADDRESS, ("RTL_ALT",), False, 0.0, RENAMED)
    assert asked(made) == ["RTL_ALT"]
    made.handle_timer(1.0)
    assert asked(made) == ["RTL_ALT", "RTL_ALT_M"]
    made.receive(value(has, number), 1.1)
    assert not made.reading
    assert dict(made.values) == {"RTL_ALT": 1500.0}
    made.refresh(31.0)
    assert asked(made) == [has], "the release is known by now"
    made.forget()
    made.refresh(32.0)
    assert asked(made) == ["RTL_ALT"], "it restarted, perhaps with another one"


def test_a_parameter_error_has_the_newer_name_asked_for_at_once() -> None:
    made = ParameterReader()
    made.start(0.0)
    made.resume(ADDRESS, ("RTL_ALT", "FENCE_TYPE"), False, 0.0, RENAMED)
    made.messages_to_send()
    for name in ("FENCE_TYPE", "RTL_ALT", "RTL_ALT_M"):
        made.receive(unknown(name), 0.1)
    assert asked(made) == ["RTL_ALT_M"]
    made.receive(value("RTL_ALT_M", 15.0), 0.2)
    assert dict(made.values) == {"RTL_ALT": 1500.0}
    made.receive(
        say("PARAM_ERROR", param_id="RTL_ALT", error=mavlink.MAV_PARAM_ERROR_READ_ONLY), 0.3
    )
    assert asked(made) == []


def test_a_renamed_parameter_is_read_for_others_too() -> None:
    made = ParameterReader()
    made.start(0.0)
    made.resume(ADDRESS, ("OTHER",), False, 0.0, RENAMED)
    made.messages_to_send()
    assert made.read(("RTL_ALT",), 1.0) == [None]
    assert asked(made) == ["RTL_ALT"]
    assert made.read(("RTL_ALT",), 2.0) == [None]
    assert asked(made) == ["RTL_ALT", "RTL_ALT_M"]
    made.receive(value("RTL_ALT_M", 20.0), 2.1)
    assert made.read(("RTL_ALT",), 2.2) == [2000.0]
    assert "RTL_ALT" not in made.values


def test_a_change_that_somebody_else_made_is_taken_over() -> None:
    made = reader("A")
    made.receive(value("A", 1.0), 0.1)
    made.receive(value("A", 2.0), 5.0)
    assert made.values["A"] == 2.0
    made.receive(value("OTHER", 2.0), 5.0)
    assert "OTHER" not in made.values


def test_values_are_read_again_and_known_meanwhile() -> None:
    made = reader("A")
    made.receive(value("A", 1.0), 0.1)
    asked(made)
    deadline = made.deadline_s
    assert deadline is not None
    made.handle_timer(deadline)
    assert asked(made) == ["A"]
    assert made.values["A"] == 1.0
    made.forget()
    assert dict(made.values) == {}


def test_nothing_is_asked_for_while_the_link_is_silent() -> None:
    made = reader("A")
    made.pause()
    assert asked(made) == []
    assert made.deadline_s is None


@pytest.mark.parametrize("number", [0, 1, 5, 300, 70000])
def test_integers_of_px4_stand_in_the_float_as_their_bytes(number: int) -> None:
    (seen,) = struct.unpack("<f", struct.pack("<i", number))
    assert decode_value(value("GF_ACTION", seen, INT32), bytewise=True) == number
    assert decode_value(value("GF_MAX_HOR_DIST", 250.5), bytewise=True) == 250.5


def test_integers_of_ardupilot_are_the_float() -> None:
    assert decode_value(value("FENCE_TYPE", 7.0, INT8), bytewise=False) == 7.0


def test_others_are_read_once_for_whoever_asks_and_decide_nothing() -> None:
    made = reader("A")
    made.receive(value("A", 1.0), 0.1)
    made.messages_to_send()
    made.ask(["A", "B"], 1.0)
    assert asked(made) == ["B"], "A is read anyway"
    assert made.value("B") is None
    made.ask(["B"], 1.5)
    assert asked(made) == [], "too soon"
    made.ask(["B"], 2.1)
    assert asked(made) == ["B"]
    made.receive(value("B", 3.0), 2.2)
    assert (made.value("A"), made.value("B")) == (1.0, 3.0)
    assert dict(made.values) == {"A": 1.0}
    made.ask(["B"], 20.0)
    assert asked(made) == []
    made.ask(["B"], 40.0)
    assert asked(made) == ["B"], "it may have been changed"
    made.forget()
    assert made.value("B") is None


def test_without_a_vehicle_nobody_is_asked() -> None:
    made = ParameterReader()
    made.ask(["B"], 0.0)
    assert asked(made) == []
    made = reader("A")
    made.pause()
    made.ask(["B"], 1.0)
    assert asked(made) == []
