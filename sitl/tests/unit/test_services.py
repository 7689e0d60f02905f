"""Signing, MANUAL_CONTROL, AVAILABLE_MODES and the other requests of a ground station."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.px4.safety_systems import PARACHUTE
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.mavlink.messages.known_messages import BY_KIND
from mavlink_sitl.mavlink.messages.telemetry import BUILDERS
from sitl_support.ground_station import ALT_HOLD, GroundStation, copter
from sitl_support.px4_station import flying_px4, ready_px4

KEY = bytes(range(32))
NOW = 35_000_000_000_000
"""Units of 10 microseconds since 2015"""


def signing_station(key: bytes = KEY, timestamp: int = NOW) -> mav.MAVLink:
    """A ground station's encoder that signs."""
    signer = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    signer.signing.secret_key = key
    signer.signing.sign_outgoing = True
    signer.signing.timestamp = timestamp
    return signer


def ping(station: GroundStation, frame: bytes) -> int:
    """How many TIMESYNC requests are answered."""
    station.vehicle.link.write(frame)
    return len([m for m in station.read() if m.get_type() == "TIMESYNC" and m.tc1])


def request(signer: mav.MAVLink) -> bytes:
    return bytes(mav.MAVLink_timesync_message(0, 77).pack(signer))


@pytest.fixture
def station() -> GroundStation:
    return copter().ready()


def test_with_a_key_only_signed_frames_are_taken_and_ours_are_signed(
    station: GroundStation,
) -> None:
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, NOW))
    unsigned = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    assert ping(station, request(unsigned)) == 0
    signer = signing_station()
    station.vehicle.link.write(request(signer))
    (frame,) = station.vehicle.link.read_datagrams()
    receiver = mav.MAVLink(None)
    receiver.signing.secret_key = KEY
    assert receiver.decode(bytearray(frame)).get_type() == "TIMESYNC"
    assert frame[2] & 1


def test_a_replayed_and_a_forged_frame_are_rejected(station: GroundStation) -> None:
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, NOW))
    signer = signing_station()
    first = request(signer)
    assert ping(station, first) == 1
    assert ping(station, first) == 0, "the same again"
    forger = signing_station(bytes(32 * [9]), NOW + 10**9)
    assert ping(station, request(forger)) == 0
    assert ping(station, request(signer)) == 1, "the forger's time has shut nobody out"
    late = signing_station(timestamp=NOW - 7_000_000)
    late.signing.link_id = 5
    assert ping(station, request(late)) == 0, "more than a minute behind"


def test_signing_outlives_a_reboot_and_ends_with_zeros(station: GroundStation) -> None:
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, NOW))
    station.vehicle.power_cycle()
    station.run(5.0)
    signer = signing_station()
    assert ping(station, request(mav.MAVLink(None, 255, 190))) == 0
    assert ping(station, request(signer)) == 1
    off = mav.MAVLink_setup_signing_message(1, 1, bytes(32), 0)
    station.vehicle.link.write(bytes(off.pack(signer)))
    assert ping(station, request(mav.MAVLink(None, 255, 190))) == 1


def test_the_key_is_not_changed_while_armed(station: GroundStation) -> None:
    station.mode(4)
    station.arm()
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, NOW))
    assert ping(station, request(mav.MAVLink(None, 255, 190))) == 1


@pytest.mark.parametrize(("firmware", "answered"), [("px4-1.18", 1), ("px4-1.17", 0)])
def test_a_px4_takes_another_key_while_armed_up_to_1_17(firmware: str, answered: int) -> None:
    station = flying_px4(firmware=firmware)
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, NOW))
    assert ping(station, request(mav.MAVLink(None, 255, 190))) == answered


def test_a_px4_1_18_with_a_key_hears_unsigned_heartbeats_and_no_unsigned_key() -> None:
    station = ready_px4(firmware="px4-1.18")
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, NOW))
    unsigned = mav.MAVLink(None, srcSystem=1, srcComponent=161)
    parachute = mav.MAVLink_heartbeat_message(mav.MAV_TYPE_PARACHUTE, 8, 0, 0, 4, 3)
    station.vehicle.link.write(bytes(parachute.pack(unsigned)))
    station.send(mav.MAVLink_setup_signing_message(1, 1, bytes(32), 0))
    firmware = station.vehicle.firmware
    assert isinstance(firmware, Px4Vehicle)
    assert firmware.systems.is_well(PARACHUTE)
    assert ping(station, request(mav.MAVLink(None, 255, 190))) == 0
    assert ping(station, request(signing_station())) == 1


def test_a_time_that_no_signature_can_hold_is_rejected(station: GroundStation) -> None:
    station.send(mav.MAVLink_setup_signing_message(1, 1, KEY, 2**64 - 1))
    assert ping(station, request(mav.MAVLink(None, 255, 190))) == 1


def test_manual_control_moves_the_sticks(station: GroundStation) -> None:
    station.take_off(10)
    station.mode(ALT_HOLD)
    station.stream(
        4.0, 5.0, lambda: station.send(mav.MAVLink_manual_control_message(1, 0, 0, 900, 0, 0))
    )
    assert station.velocity[2] < -1.0
    station.interval(65, 5.0)
    station.stream(
        1.0, 5.0, lambda: station.send(mav.MAVLink_manual_control_message(1, 200, 32767, 500, 0, 0))
    )
    channels = station.last("RC_CHANNELS")
    assert (channels.chan1_raw, channels.chan2_raw, channels.chan3_raw) == (1500, 1400, 1500)
    stranger = GroundStation(station.simulation, system=9)
    stranger.send(mav.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0))
    station.run(0.5)
    assert station.last("RC_CHANNELS").chan3_raw == 1500


def test_available_modes_are_all_modes_or_one(station: GroundStation) -> None:
    assert station.command(512, 435, 0) == 0
    modes = station.messages("AVAILABLE_MODES")
    assert [m.mode_index for m in modes] == list(range(1, modes[0].number_modes + 1))
    named = {m.custom_mode: m.mode_name for m in modes}
    assert (named[4], named[9]) == ("GUIDED", "LAND")
    assert station.command(512, 435, 3) == 0
    assert station.last("AVAILABLE_MODES").mode_index == 3
    assert station.command(512, 435, 99) == 4


@pytest.mark.parametrize("message_id", sorted(BY_KIND["copter"] & set(BUILDERS["copter"])))
def test_every_message_can_be_requested(message_id: int) -> None:
    """Accepted; and it comes, unless the vehicle has nothing to say."""
    station = copter(parameters={"FENCE_ENABLE": 1.0}).ready()
    station.take_off(5)
    station.setpoint(0xDF8, (5.0, 0.0, -5.0))
    begin = len(station.log)
    assert station.command(512, message_id) == 0
    came = {m.get_msgId() for _, m in station.log[begin:]}
    missing = {132: "no range sensor", 295: "no airspeed", 191: "no calibration", 192: "none"}
    missing |= dict.fromkeys((180, 259, 260, 262), "no camera")
    missing |= dict.fromkeys((280, 281, 285), "no gimbal")
    assert message_id in came or message_id in missing
