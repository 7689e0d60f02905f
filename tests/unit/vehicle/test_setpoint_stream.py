from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.positions.frames import Vector3
from mavlink_vehicle.profiles import GENERIC, Profile
from mavlink_vehicle.profiles.ardupilot import COPTER, PLANE, ROVER
from mavlink_vehicle.profiles.px4 import COPTER as PX4_COPTER
from mavlink_vehicle.profiles.px4 import PLANE as PX4_PLANE
from mavlink_vehicle.profiles.px4 import ROVER as PX4_ROVER
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.streams.setpoint_stream import (
    IGNORE_YAW_RATE,
    SetpointNed,
    SetpointStream,
    legal_setpoint,
)

ADDRESS = Address(1, 191, 1, 1)
HERE: Vector3 = (1.0, 2.0, -3.0)


def open_stream() -> SetpointStream:
    stream = SetpointStream()
    stream.start(0.0)
    stream.open(0.0)
    return stream


def offer(stream: SetpointStream, setpoint: SetpointNed, now: float = 0.0) -> None:
    stream.offer(setpoint, now, profile=COPTER, address=ADDRESS, time_boot_ms=5)


def test_a_closed_stream_takes_nothing() -> None:
    stream = SetpointStream()
    with pytest.raises(SetpointError, match="closed; open it"):
        offer(stream, SetpointNed(position_ned_m=HERE))
    stream.open(0.0)
    stream.open(0.0)
    offer(stream, SetpointNed(position_ned_m=HERE))
    stream.close()
    stream.close()
    assert not stream.messages_to_send()  # what waited is dropped
    with pytest.raises(SetpointError):
        offer(stream, SetpointNed(position_ned_m=HERE))


STOP = SetpointNed(velocity_ned_m_s=(1e-3, 0.0, 0.0))


@pytest.mark.parametrize(
    ("offered", "stops"),
    [
        ([STOP], True),
        ([SetpointNed(velocity_ned_m_s=HERE), STOP], True),
        ([STOP, SetpointNed(velocity_ned_m_s=HERE)], False),
        ([SetpointNed(position_ned_m=HERE)], False),
        ([SetpointNed(position_ned_m=HERE, velocity_ned_m_s=(0.0, 0.0, 0.0))], False),
        ([], False),
    ],
)
def test_a_stop_is_still_sent_by_a_stream_that_ends(
    offered: list[SetpointNed], stops: bool
) -> None:
    stream = open_stream()
    for setpoint in offered:
        offer(stream, setpoint)
    stream.end()
    with pytest.raises(SetpointError, match="closed"):
        offer(stream, STOP)
    sent = stream.messages_to_send()
    assert [message.vx for message in sent] == pytest.approx([1e-3] * stops)


def test_nothing_is_sent_by_a_stream_that_is_closed_after_its_end() -> None:
    stream = open_stream()
    offer(stream, STOP)
    stream.end()
    stream.close()
    assert not stream.messages_to_send()


@pytest.mark.parametrize(
    ("setpoint", "mask"),
    [
        (SetpointNed(position_ned_m=HERE), 0x0DF8),  # as the real ArduCopter echoes it
        (SetpointNed(velocity_ned_m_s=HERE), 0x0DC7),
        (SetpointNed(velocity_ned_m_s=HERE, yaw_ned_rad=0.0), 0x09C7),
        (SetpointNed(position_ned_m=HERE, velocity_ned_m_s=HERE, yaw_ned_rad=1.0), 0x09C0),
        (SetpointNed(velocity_ned_m_s=HERE, yaw_rate_rad_s=0.1), 0x05C7),
        (SetpointNed(acceleration_ned_m_s2=HERE), 0x0C3F),
    ],
)
def test_masks_say_what_is_given(setpoint: SetpointNed, mask: int) -> None:
    assert setpoint.type_mask() == mask
    stream = open_stream()
    offer(stream, setpoint)
    (message,) = stream.messages_to_send()
    assert message.type_mask == mask
    assert message.coordinate_frame == 1


def test_golden_bytes_of_the_usual_setpoint() -> None:
    """Position, velocity and yaw, mask 0x09C0, frame LOCAL_NED, as it goes over the wire."""
    stream = open_stream()
    setpoint = SetpointNed((1.0, 2.0, -3.0), (0.5, -0.25, 0.125), yaw_ned_rad=0.75)
    offer(stream, setpoint)
    frame = Codec(1, 191).encode(stream.messages_to_send()[0])
    assert frame[10:-2].hex() == (
        "05000000"  # time_boot_ms 5
        "0000803f00000040000040c0"  # x y z
        "0000003f000080be0000003e"  # vx vy vz
        "000000000000000000000000"  # afx afy afz
        "0000403f00000000"  # yaw, yaw_rate
        "c009010101"  # mask, target, component, frame
    )  # fmt: skip


@pytest.mark.parametrize("profile", [COPTER, PX4_COPTER])
def test_a_copter_is_sent_a_yaw_with_its_rate(profile: Profile) -> None:
    turning = SetpointNed.of_enu(HERE, HERE, HERE, 0.0, 0.3)
    sent = legal_setpoint(turning, profile)
    assert sent.yaw_ned_rad == pytest.approx(0.5 * math.pi)
    assert sent.yaw_rate_rad_s == -0.3
    assert sent.type_mask() == 0
    assert SetpointNed.of_enu(HERE, HERE, HERE, 0.0).type_mask() == IGNORE_YAW_RATE


@pytest.mark.parametrize("profile", [ROVER, PX4_ROVER])
def test_a_rover_is_sent_neither(profile: Profile) -> None:
    sent = legal_setpoint(SetpointNed.of_enu(None, HERE, None, 0.0, 0.3), profile)
    assert sent.yaw_rate_rad_s is None


BAD = [math.nan, math.inf, -math.inf, 2e6]


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("name", ["position_ned_m", "velocity_ned_m_s", "acceleration_ned_m_s2"])
def test_what_is_not_finite_never_leaves(bad: float, axis: int, name: str) -> None:
    values = [0.0, 0.0, 0.0]
    values[axis] = bad
    stream = open_stream()
    fields = {"velocity_ned_m_s": (0.0, 0.0, 0.0), name: tuple(values)}
    with pytest.raises(SetpointError, match=f"{name} is .*three finite numbers"):
        offer(stream, SetpointNed(**fields))  # type: ignore[arg-type]
    assert not stream.messages_to_send()
    assert stream.statistics.sent == 0


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_yaw_and_its_rate_must_be_finite(bad: float) -> None:
    with pytest.raises(SetpointError, match="yaw_ned_rad is"):
        legal_setpoint(SetpointNed(HERE, yaw_ned_rad=bad), COPTER)
    with pytest.raises(SetpointError, match="yaw_rate_rad_s is"):
        legal_setpoint(SetpointNed(HERE, yaw_rate_rad_s=bad), COPTER)


@pytest.mark.parametrize(
    ("profile", "sent"),
    [
        # The parts of P, V, PV, A, PA, VA and PVA that are sent; "-" is rejected.
        (COPTER, ["P", "V", "PV", "A", "-", "VA", "PVA"]),
        (PX4_COPTER, ["P", "V", "PV", "A", "PA", "VA", "PVA"]),
        (ROVER, ["-", "V", "V", "-", "-", "V", "V"]),
        (PX4_ROVER, ["-", "V", "V", "-", "-", "V", "V"]),
        (PLANE, ["-"] * 7),
        (PX4_PLANE, ["-"] * 7),
        (GENERIC, ["-"] * 7),
    ],
)
def test_a_setpoint_is_reduced_to_its_vehicles_form(profile: Profile, sent: list[str]) -> None:
    results = []
    for given_groups in ("P", "V", "PV", "A", "PA", "VA", "PVA"):
        position, velocity, acceleration = (HERE if n in given_groups else None for n in "PVA")
        setpoint = SetpointNed(position, velocity, acceleration, yaw_ned_rad=0.5)
        try:
            reduced = legal_setpoint(setpoint, profile)
        except SetpointError as error:
            assert f"{profile.name} does not follow" in str(error)  # noqa: PT017
            results.append("-")
            continue
        left = (reduced.position_ned_m, reduced.velocity_ned_m_s, reduced.acceleration_ned_m_s2)
        results.append("".join(n for n, v in zip("PVA", left, strict=True) if v is not None))
        assert (reduced.yaw_ned_rad is None) == (profile in (ROVER, PX4_ROVER))
    assert results == sent


def test_a_nan_is_rejected_even_in_what_would_be_left_out() -> None:
    with pytest.raises(SetpointError, match="position_ned_m"):
        legal_setpoint(SetpointNed((math.nan, 0.0, 0.0), velocity_ned_m_s=HERE), ROVER)


def test_how_long_the_stream_has_run_counts_from_its_last_pause() -> None:
    stream = SetpointStream()
    assert stream.steady_from_s(1.2, 0.0) == math.inf
    stream.open(0.0)
    assert stream.steady_from_s(1.2, 0.0) == math.inf
    offer(stream, SetpointNed(HERE), 1.0)
    offer(stream, SetpointNed(HERE), 1.4)
    assert stream.steady_from_s(1.2, 1.4) == 2.2
    assert stream.steady_from_s(1.2, 2.0) == math.inf
    offer(stream, SetpointNed(HERE), 2.1)
    assert stream.steady_from_s(1.2, 2.1) == 3.3
    stream.close()
    assert stream.steady_from_s(1.2, 2.1) == math.inf


def test_gaps_are_measured() -> None:
    stream = open_stream()
    for now in (1.0, 1.05, 1.10, 1.45, 1.50):
        offer(stream, SetpointNed(HERE), now)
    assert stream.statistics.sent == 5
    assert stream.statistics.max_gap_s == pytest.approx(0.35)
    stream.close()
    stream.open(9.0)
    assert stream.statistics.sent == 0
    assert stream.deadline_s is None


@given(
    st.tuples(*[st.floats(allow_nan=True, allow_infinity=True)] * 3),
    st.floats(allow_nan=True, allow_infinity=True),
)
def test_whatever_is_offered_only_finite_numbers_are_encoded(position: Vector3, yaw: float) -> None:
    stream = open_stream()
    try:
        offer(stream, SetpointNed(position, yaw_ned_rad=yaw))
    except SetpointError:
        assert not stream.messages_to_send()
        return
    (message,) = Codec(1, 1).decode(Codec(1, 191).encode(stream.messages_to_send()[0]))
    values = (message.x, message.y, message.z, message.yaw)
    assert all(math.isfinite(value) for value in values)
    assert abs(message.yaw) <= math.pi + 1e-6


def test_a_speed_along_the_nose_goes_out_in_the_axes_of_the_vehicle() -> None:
    """As observed on ArduRover: BODY_NED, mask 0x05C7, x = -1 reverses."""
    stream = open_stream()
    backwards = SetpointNed(drive_frd_m_s=(-1.0, 0.0, 0.0), yaw_rate_rad_s=0.5)
    stream.offer(backwards, 0.0, profile=ROVER, address=ADDRESS, time_boot_ms=5)
    (message,) = stream.messages_to_send()
    assert (message.coordinate_frame, message.type_mask) == (8, 0x05C7)
    assert (message.vx, message.vy, message.vz, message.yaw_rate) == (-1.0, 0.0, 0.0, 0.5)


@pytest.mark.parametrize("profile", [COPTER, PX4_COPTER, PX4_ROVER], ids=lambda p: p.name)
def test_only_what_follows_turn_rates_gets_them(profile: Profile) -> None:
    drive = SetpointNed(drive_frd_m_s=(1.0, 0.0, 0.0), yaw_rate_rad_s=0.0)
    with pytest.raises(SetpointError, match="turn rate"):
        legal_setpoint(drive, profile)


@pytest.mark.parametrize(
    "setpoint",
    [
        SetpointNed(drive_frd_m_s=(1.0, 0.0, 0.0)),
        SetpointNed(drive_frd_m_s=(1.0, 0.0, 0.0), yaw_rate_rad_s=0.1, velocity_ned_m_s=HERE),
        SetpointNed(drive_frd_m_s=(math.nan, 0.0, 0.0), yaw_rate_rad_s=0.1),
        SetpointNed(drive_frd_m_s=(1.0, 0.0, 0.0), yaw_rate_rad_s=math.inf),
    ],
)
def test_a_speed_along_the_nose_needs_a_turn_rate_and_sound_numbers(setpoint: SetpointNed) -> None:
    with pytest.raises(SetpointError):
        legal_setpoint(setpoint, ROVER)
