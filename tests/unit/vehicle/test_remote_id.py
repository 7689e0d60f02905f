"""OPEN_DRONE_ID_* has the identity that is set, at its rates; a transponder reports its state."""

from __future__ import annotations

import math
from typing import Any

import pytest

from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.protocols.streams.remote_id import (
    OperatorFix,
    RemoteId,
    TransponderStatus,
    fix_fault,
)
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_values import ConfigurationError
from tests.unit.vehicle.test_services import connected

IDENTITY = RemoteId("1ABCD2345678901234XY", "FIN87astrdge12k8", "survey", (47.4, -8.5, 530.5))
UNIX_S = 1_546_300_800.0 + 250_000_000.25
NAMES = ("BASIC_ID", "OPERATOR_ID", "SELF_ID", "SYSTEM")


def sent(vehicle: Vehicle, identity: RemoteId, unix_s: float = UNIX_S) -> dict[str, Any]:
    """Return what leaves, as it arrives, by name."""
    vehicle.remote_id.offer(identity, unix_s)
    codec = Codec(1, 191)
    frames = [codec.encode(message) for message in vehicle.messages_to_send()]
    messages = [message for frame in frames for message in Codec(1, 1).decode(frame)]
    return {message.get_type().removeprefix("OPEN_DRONE_ID_"): message for message in messages}


def from_transponder(vehicle: Vehicle, now: float, status: int, error: str = "") -> None:
    message = make("OPEN_DRONE_ID_ARM_STATUS", status=status, error=error)
    for received in Codec(1, 236).decode(Codec(1, 236).encode(message)):
        vehicle.receive(received, now)


def test_the_identity_arrives_as_it_is_set() -> None:
    messages = sent(connected(), IDENTITY)
    assert tuple(messages) == NAMES
    assert {(each.target_system, each.target_component) for each in messages.values()} == {(1, 1)}
    basic, system = messages["BASIC_ID"], messages["SYSTEM"]
    assert bytes(basic.uas_id) == b"1ABCD2345678901234XY"
    assert (basic.id_type, basic.ua_type) == (1, 2), "a serial number, of a multirotor"
    assert messages["OPERATOR_ID"].operator_id == "FIN87astrdge12k8"
    assert messages["SELF_ID"].description == "survey"
    assert (system.operator_latitude, system.operator_longitude) == (474000000, -85000000)
    assert (system.operator_altitude_geo, system.timestamp) == (530.5, 250_000_000)


def test_the_position_is_sent_each_second_and_what_does_not_change_each_third() -> None:
    vehicle = connected()
    turns = [tuple(sent(vehicle, IDENTITY)) for _ in range(7)]
    assert turns == [NAMES, ("SYSTEM",), ("SYSTEM",)] * 2 + [NAMES]


def test_what_is_not_set_is_not_sent_and_nothing_to_a_vehicle_that_is_not_heard() -> None:
    assert tuple(sent(connected(), RemoteId(operator_id="FIN87"))) == ("OPERATOR_ID",)
    assert sent(Vehicle(), IDENTITY) == {}


def test_a_clock_that_was_never_set_gives_no_time() -> None:
    assert sent(connected(), IDENTITY, unix_s=12.0)["SYSTEM"].timestamp == 0


def test_a_transponder_reports_what_it_lacks_until_it_is_ready() -> None:
    vehicle = connected()
    assert vehicle.remote_id.status is None
    from_transponder(vehicle, 3.0, 1, "missing operator location")
    assert vehicle.remote_id.status == TransponderStatus("missing operator location", 3.0)
    from_transponder(vehicle, 4.0, 0)
    assert vehicle.remote_id.status == TransponderStatus("", 4.0)


def test_a_measured_position_of_the_operator_is_sent_instead_of_the_fixed_one() -> None:
    vehicle = connected()
    assert sent(vehicle, IDENTITY)["SYSTEM"].operator_location_type == 2, "fixed"
    vehicle.remote_id.operator = OperatorFix(-35.25, 149.125, 602.5, 7.0)
    system = sent(vehicle, IDENTITY)["SYSTEM"]
    assert system.operator_location_type == 1, "live"
    assert (system.operator_latitude, system.operator_longitude) == (-352500000, 1491250000)
    assert system.operator_altitude_geo == 602.5
    vehicle.remote_id.operator = OperatorFix(-35.25, 149.125, math.nan, 8.0)
    assert sent(vehicle, RemoteId("1ABCD"))["SYSTEM"].operator_altitude_geo == -1000.0, "unknown"


@pytest.mark.parametrize("place", [(math.nan, 1.0), (91.0, 1.0), (1.0, math.inf), (1.0, -181.0)])
def test_a_fix_that_is_no_position_has_a_sentence(place: tuple[float, float]) -> None:
    assert fix_fault(*place).endswith("is no position.")
    assert fix_fault(47.0, -8.0) == ""


def test_the_parameters_make_the_identity() -> None:
    config = make_config(
        {
            "remote_id_serial_number": IDENTITY.serial_number,
            "remote_id_operator_id": IDENTITY.operator_id,
            "remote_id_description": IDENTITY.description,
            "remote_id_operator_position": "47.4 -8.5 530.5",
        }
    )
    assert config.remote_id == IDENTITY
    assert make_config({}).remote_id.is_empty


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("remote_id_serial_number", "x" * 21),
        ("remote_id_serial_number", "1ABC\n"),
        ("remote_id_operator_id", "Käpt'n"),
        ("remote_id_description", "x" * 24),
        ("remote_id_operator_position", "47.4 8.5"),
        ("remote_id_operator_position", "91 8.5 500"),
        ("remote_id_operator_position", "nan 8.5 500"),
    ],
)
def test_a_parameter_that_cannot_be_sent_is_rejected_with_a_sentence(name: str, value: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"Parameter {name} is .*; give .*\.$"):
        make_config({name: value})
