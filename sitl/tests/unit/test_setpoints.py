"""The real ArduCopter's observed response to each kind of setpoint."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCELERATION,
    ACCEPTED,
    BRAKE,
    GUIDED,
    LAND,
    LOITER,
    POSITION,
    POSITION_VELOCITY,
    POSITION_VELOCITY_ACCELERATION,
    RTL,
    VELOCITY,
    YAW,
    YAW_RATE,
    GroundStation,
    copter,
    flying,
)

Vector = tuple[float, float, float]


@pytest.fixture
def hover() -> GroundStation:
    """A copter that hovers 10 m above home in GUIDED, nose where it was at start."""
    return flying(10.0)


def heading(station: GroundStation) -> float:
    return math.degrees(station.vehicle.snapshot().motion.yaw_rad)


# Taking off.


def test_streaming_position_setpoints_before_takeoff_defeats_it() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    station.arm()
    armed_s = station.now_s

    def send() -> None:
        station.setpoint(POSITION, (10.0, 0.0, -8.0))

    station.stream(2.0, 5.0, send)
    assert station.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == ACCEPTED
    station.stream(10.0, 5.0, send)
    assert station.position == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    assert not station.vehicle.firmware.armed
    disarmed_s = next(t for t, m in station.log if getattr(m, "text", "") == "Disarming motors")
    assert disarmed_s - armed_s == pytest.approx(10.0, abs=0.3)


def test_a_climb_rate_on_the_ground_does_nothing() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    station.arm()
    station.stream(5.0, 5.0, lambda: station.setpoint(VELOCITY, velocity=(0.0, 0.0, -1.0)))
    assert station.position[2] == pytest.approx(0.0, abs=0.01)


def test_a_takeoff_cut_by_a_mode_change_is_not_resumed() -> None:
    station = copter().ready()
    station.mode(GUIDED)
    station.arm()
    station.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 15)
    station.run(6.0)
    station.mode(LOITER)
    station.send(mav.MAVLink_rc_channels_override_message(1, 1, 0, 0, 1500, 0, 0, 0, 0, 0))
    station.run(2.0)
    station.mode(GUIDED)
    station.run(2.0)
    height = -station.position[2]
    assert 2.0 < height < 10.0
    station.run(3.0)
    assert -station.position[2] == pytest.approx(height, abs=0.2)


# Positions.


def test_one_position_setpoint_is_enough_and_never_times_out(hover: GroundStation) -> None:
    hover.setpoint(POSITION, (60.0, 0.0, -10.0))
    hover.run(30.0)
    assert hover.position == pytest.approx((60.0, 0.0, -10.0), abs=0.3)


@pytest.mark.parametrize("frame", [8, 9])
def test_body_frames_are_forward_right_down_of_the_vehicle(
    hover: GroundStation, frame: int
) -> None:
    hover.setpoint(POSITION - YAW, (0.0, 0.0, -10.0), yaw=math.pi / 2)
    hover.run(4.0)
    hover.setpoint(POSITION, (5.0, 2.0, 1.0), frame=frame)
    hover.run(10.0)
    assert hover.position == pytest.approx((-2.0, 5.0, -9.0), abs=0.4)


def test_local_offset_is_from_where_the_vehicle_is(hover: GroundStation) -> None:
    hover.setpoint(POSITION, (10.0, 0.0, -10.0))
    hover.run(12.0)
    hover.setpoint(POSITION, (0.0, 5.0, -2.0), frame=mav.MAV_FRAME_LOCAL_OFFSET_NED)
    hover.run(10.0)
    assert hover.position == pytest.approx((10.0, 5.0, -12.0), abs=0.4)


@pytest.mark.parametrize("frame", [0, 2, 3, 12, 13, 200])
def test_other_frames_are_silently_ignored(hover: GroundStation, frame: int) -> None:
    assert hover.setpoint(POSITION, (20.0, 0.0, -10.0), frame=frame) == []
    hover.run(5.0)
    assert hover.position == pytest.approx((0.0, 0.0, -10.0), abs=0.2)


def test_a_position_below_ground_is_accepted_and_it_descends(hover: GroundStation) -> None:
    hover.setpoint(POSITION, (0.0, 0.0, 5.0))
    hover.run(5.0)
    assert hover.velocity[2] > 0.5
    hover.run(25.0)
    assert hover.position[2] == pytest.approx(0.0, abs=0.05)


def test_a_position_100_km_away_is_accepted(hover: GroundStation) -> None:
    hover.setpoint(POSITION, (100_000.0, 0.0, -10.0))
    hover.run(20.0)
    assert hover.velocity[0] == pytest.approx(10.0, abs=0.5), "WPNAV_SPEED"


def test_position_target_echoes_the_setpoint(hover: GroundStation) -> None:
    hover.setpoint(POSITION, (4.0, 5.0, -10.0))
    hover.run(0.2)
    target = hover.last("POSITION_TARGET_LOCAL_NED")
    assert (target.coordinate_frame, target.type_mask) == (1, 0x0DF8)
    assert (target.x, target.y, target.z) == (4.0, 5.0, -10.0)
    hover.setpoint(VELOCITY, velocity=(1.0, 2.0, 0.0))
    hover.run(0.2)
    target = hover.last("POSITION_TARGET_LOCAL_NED")
    assert (target.type_mask, target.vx, target.vy) == (0x0C07, 1.0, 2.0)


@pytest.mark.parametrize("mode", [LOITER, BRAKE, LAND, RTL])
def test_position_target_is_not_sent_outside_guided(hover: GroundStation, mode: int) -> None:
    hover.mode(mode)
    since = hover.now_s + 0.05
    hover.run(1.0)
    assert hover.messages("POSITION_TARGET_LOCAL_NED", since) == []


# Velocities.


def test_a_velocity_continues_for_3_s_after_the_last_message_then_it_brakes(
    hover: GroundStation,
) -> None:
    hover.stream(5.0, 10.0, lambda: hover.setpoint(VELOCITY, velocity=(0.0, 2.0, 0.0)))
    last_message_east = hover.position[1] - 0.1 * hover.velocity[1]
    texts = len(hover.texts())
    hover.run(2.8)
    assert hover.velocity[1] == pytest.approx(2.0, abs=0.15)
    hover.run(5.0)
    assert hover.velocity[1] == pytest.approx(0.0, abs=0.1)
    assert hover.position[1] - last_message_east == pytest.approx(7.9, abs=0.4), "as recorded"
    assert len(hover.texts()) == texts, "no STATUSTEXT"


def test_a_body_velocity_is_turned_by_the_yaw(hover: GroundStation) -> None:
    hover.setpoint(POSITION - YAW, (0.0, 0.0, -10.0), yaw=math.pi / 2)
    hover.run(4.0)
    hover.stream(
        3.0,
        10.0,
        lambda: hover.setpoint(VELOCITY, velocity=(1.0, 0.0, 0.0), frame=mav.MAV_FRAME_BODY_NED),
    )
    assert hover.velocity[:2] == pytest.approx((0.0, 1.0), abs=0.15)


def test_a_velocity_with_acceleration(hover: GroundStation) -> None:
    mask = VELOCITY & ~0x1C0
    hover.setpoint(mask, velocity=(1.0, 0.0, 0.0), acceleration=(0.5, 0.0, 0.0))
    hover.run(2.5)
    assert hover.velocity[0] == pytest.approx(1.0 + 0.5 * 2.5, abs=0.4)


def test_an_acceleration_continues_for_3_s_too(hover: GroundStation) -> None:
    """2 s of 1 m/s2: recorded to drift on for 18 m."""
    hover.stream(2.0, 10.0, lambda: hover.setpoint(ACCELERATION, acceleration=(1.0, 0.0, 0.0)))
    north = hover.position[0]
    assert hover.velocity[0] == pytest.approx(1.83, abs=0.15)
    hover.run(8.0)
    assert hover.position[0] - north == pytest.approx(18.0, abs=0.7)
    assert math.hypot(*hover.velocity) < 0.3


def test_guid_timeout_is_a_parameter(hover: GroundStation) -> None:
    hover.send(mav.MAVLink_param_set_message(1, 1, b"GUID_TIMEOUT", 1.0, 9))
    hover.setpoint(VELOCITY, velocity=(2.0, 0.0, 0.0))
    hover.run(6.0)
    assert hover.position[0] < 4.0


# Positions with velocities.


def test_a_position_with_velocity_moves_on_until_the_timeout(hover: GroundStation) -> None:
    hover.setpoint(POSITION_VELOCITY, (0.0, 0.0, -10.0), velocity=(2.0, 0.0, 0.0))
    hover.run(12.0)
    assert hover.position == pytest.approx((6.0, 0.0, -10.0), abs=0.3)
    assert math.hypot(*hover.velocity) < 0.2


def jerk_limited(time_s: float) -> tuple[float, float, float]:
    """40 m at up to 4 m/s, 1.5 m/s2, 1.5 m/s3: distance, speed, acceleration."""
    jerk, ramp, steady = 1.5, 1.0, 4.0 / 1.5 - 1.0
    cruise = (40.0 - 4.0 * (2 * ramp + steady)) / 4.0
    spans = (ramp, steady, ramp, cruise, ramp, steady, ramp)
    jerks = (jerk, 0.0, -jerk, 0.0, -jerk, 0.0, jerk)
    s = v = a = 0.0
    for span, j in zip(spans, jerks, strict=True):
        t = min(time_s, span)
        s += v * t + a * t * t / 2 + j * t**3 / 6
        v += a * t + j * t * t / 2
        a += j * t
        time_s -= t
    return s, v, a


@pytest.mark.night
def test_a_20_hz_trajectory_is_followed_closely_without_overspeed(hover: GroundStation) -> None:
    """Position, velocity, acceleration and yaw, as the navigation server sends them."""
    hover.setpoint(POSITION - YAW, (0.0, 0.0, -10.0), yaw=0.9)
    hover.run(6.0)
    begin_s = hover.now_s
    worst = fastest = 0.0
    while hover.now_s - begin_s < 18.0:
        s, v, a = jerk_limited(hover.now_s - begin_s)
        hover.setpoint(
            POSITION_VELOCITY_ACCELERATION - YAW,
            (0.6 * s, 0.8 * s, -10.0),
            (0.6 * v, 0.8 * v, 0.0),
            (0.6 * a, 0.8 * a, 0.0),
            yaw=0.9,
        )
        hover.run(0.05)
        s, _, _ = jerk_limited(hover.now_s - begin_s)
        worst = max(worst, math.dist(hover.position[:2], (0.6 * s, 0.8 * s)))
        fastest = max(fastest, math.hypot(*hover.velocity[:2]))
    assert worst < 0.4
    assert fastest < 4.0 * 1.025
    assert hover.position == pytest.approx((24.0, 32.0, -10.0), abs=0.2)


# Yaw.


@pytest.mark.parametrize("degrees", [0.0, 90.0, 179.0, -90.0, -135.0])
def test_position_with_yaw(hover: GroundStation, degrees: float) -> None:
    hover.setpoint(POSITION - YAW, (0.0, 0.0, -10.0), yaw=math.radians(degrees))
    hover.run(6.0)
    assert math.cos(math.radians(heading(hover) - degrees)) > 0.999


def test_without_a_yaw_it_looks_where_it_flies(hover: GroundStation) -> None:
    hover.setpoint(POSITION, (0.0, -30.0, -10.0))
    hover.run(4.0)
    assert heading(hover) == pytest.approx(-90.0, abs=4.0)
    hover.run(12.0)
    assert heading(hover) == pytest.approx(-90.0, abs=4.0), "and keeps looking there"


def test_a_yaw_rate_needs_streaming_and_stops_after_3_s(hover: GroundStation) -> None:
    hover.stream(
        4.0, 10.0, lambda: hover.setpoint(VELOCITY - YAW_RATE, velocity=(0, 0, 0), yaw_rate=0.5)
    )
    assert hover.last("ATTITUDE").yawspeed == pytest.approx(0.5, abs=0.03)
    hover.run(5.0)
    assert hover.last("ATTITUDE").yawspeed == pytest.approx(0.0, abs=0.03)


def test_a_yaw_with_a_rate_turns_on_with_the_rate_and_holds_when_it_times_out(
    hover: GroundStation,
) -> None:
    """AutoYaw's ANGLE_RATE; GUID_TIMEOUT ends the turn."""
    fields = POSITION_VELOCITY - YAW - YAW_RATE
    hover.setpoint(fields, (0.0, 0.0, -10.0), velocity=(0, 0, 0), yaw=0.2, yaw_rate=0.3)
    hover.run(2.5)
    assert hover.last("ATTITUDE").yawspeed == pytest.approx(0.3, abs=0.03)
    assert math.radians(heading(hover)) == pytest.approx(0.2 + 0.3 * 2.5, abs=0.05)
    hover.run(4.0)
    assert hover.last("ATTITUDE").yawspeed == pytest.approx(0.0, abs=0.03)
    held = heading(hover)
    assert math.radians(held) == pytest.approx(0.2 + 0.3 * 3.0, abs=0.15)
    hover.run(2.0)
    assert heading(hover) == pytest.approx(held, abs=1.0)


def test_a_turn_is_as_fast_as_recorded(hover: GroundStation) -> None:
    """About 62 degrees a second."""
    hover.setpoint(POSITION - YAW, (0.0, 0.0, -10.0), yaw=math.radians(170.0))
    hover.run(1.5)
    assert math.degrees(hover.last("ATTITUDE").yawspeed) == pytest.approx(61.0, abs=3.0)


# Setpoints without a valid target.


@pytest.mark.parametrize("mask", [0x0FFF, 0x0DF9, 0x0DFA, 0x0DFC, 0x0DFF, 0x0C38])
def test_masks_without_a_whole_target_stop_the_vehicle(hover: GroundStation, mask: int) -> None:
    """Silently; in the recording `copter_setpoints` the target becomes "no velocity"."""
    hover.setpoint(POSITION, (50.0, 0.0, -10.0))
    hover.run(4.0)
    texts = len(hover.texts())
    assert hover.setpoint(mask, (80.0, 80.0, -10.0)) == []
    hover.run(0.2)
    assert hover.last("POSITION_TARGET_LOCAL_NED").type_mask == 0x0C07
    hover.run(8.0)
    assert hover.position[0] < 35.0
    assert math.hypot(*hover.velocity) < 0.2
    assert len(hover.texts()) == texts


NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("mask", "position", "velocity", "acceleration", "yaw", "rate"),
    [
        (POSITION, (NAN, 0, -10), (0, 0, 0), (0, 0, 0), 0, 0),
        (POSITION, (0, INF, -10), (0, 0, 0), (0, 0, 0), 0, 0),
        (POSITION, (0, 0, -INF), (0, 0, 0), (0, 0, 0), 0, 0),
        (POSITION, (3e38, 0, -10), (0, 0, 0), (0, 0, 0), 0, 0),
        (POSITION_VELOCITY, (0, 0, -10), (0, NAN, 0), (0, 0, 0), 0, 0),
        (VELOCITY, (0, 0, 0), (NAN, 0, 0), (0, 0, 0), 0, 0),
        (ACCELERATION, (0, 0, 0), (0, 0, 0), (0, 0, NAN), 0, 0),
        (POSITION - YAW, (0, 0, -10), (0, 0, 0), (0, 0, 0), NAN, 0),
        (VELOCITY - YAW_RATE, (0, 0, 0), (0, 0, 0), (0, 0, 0), 0, NAN),
    ],
)
def test_nan_is_rejected_with_a_text_and_never_stops_the_simulator(
    hover: GroundStation,
    mask: int,
    position: Vector,
    velocity: Vector,
    acceleration: Vector,
    yaw: float,
    rate: float,
) -> None:
    """The real simulator aborts here; that is the one thing not to copy."""
    hover.setpoint(mask, position, velocity, acceleration, yaw, rate)
    assert hover.texts()[-1].startswith("Setpoint ignored: ")
    hover.run(3.0)
    assert hover.position == pytest.approx((0.0, 0.0, -10.0), abs=0.2)


def test_a_stream_of_nan_is_complained_about_once_a_second(hover: GroundStation) -> None:
    since = hover.now_s
    hover.stream(3.0, 20.0, lambda: hover.setpoint(POSITION, (NAN, 0.0, -10.0)))
    assert 3 <= len(hover.texts(since)) <= 4


def test_nan_in_ignored_fields_does_not_matter(hover: GroundStation) -> None:
    nans = (NAN, NAN, NAN)
    hover.setpoint(POSITION, (5.0, 0.0, -10.0), nans, nans, NAN, NAN)
    hover.run(8.0)
    assert hover.position == pytest.approx((5.0, 0.0, -10.0), abs=0.3)


@pytest.mark.parametrize("mode", [LOITER, BRAKE, LAND, RTL])
def test_setpoints_in_other_modes_are_silently_ignored(hover: GroundStation, mode: int) -> None:
    hover.vehicle.pilot_throttle(1500)
    hover.mode(mode)
    hover.run(1.0)
    before = hover.position
    assert hover.setpoint(POSITION, (50.0, 50.0, -10.0)) == []
    hover.run(3.0)
    assert hover.position[:2] == pytest.approx(before[:2], abs=0.3)
    assert hover.vehicle.firmware.mode.spec.number == mode


def test_entering_guided_in_flight_stops_and_takes_up_no_old_setpoint(
    hover: GroundStation,
) -> None:
    hover.vehicle.pilot_throttle(1500)
    hover.setpoint(POSITION, (80.0, 0.0, -10.0))
    hover.run(4.0)
    hover.mode(LOITER)
    hover.mode(GUIDED)
    hover.run(8.0)
    stopped = hover.position
    assert stopped[0] < 45.0
    hover.run(4.0)
    assert hover.position == pytest.approx(stopped, abs=0.2)


# Global setpoints.


def send_global(
    station: GroundStation,
    frame: int,
    altitude: float,
    mask: int = POSITION,
    north: float = 20.0,
    velocity: Vector = (0.0, 0.0, 0.0),
) -> None:
    latitude = round(-353632610 + north / 0.011131884502145034)
    station.send(
        mav.MAVLink_set_position_target_global_int_message(
            0, 1, 1, frame, mask, latitude, 1491652300, altitude, *velocity, 0, 0, 0, 0, 0
        )
    )


@pytest.mark.parametrize(
    ("frame", "altitude"),
    [(0, 596.0), (5, 596.0), (3, 12.0), (6, 12.0), (10, 12.0), (11, 12.0)],
)
def test_global_positions_have_their_altitude_by_frame(
    hover: GroundStation, frame: int, altitude: float
) -> None:
    send_global(hover, frame, altitude)
    hover.run(15.0)
    assert hover.position == pytest.approx((20.0, 0.0, -12.0), abs=0.4)


@pytest.mark.parametrize("frame", [1, 2, 8, 200])
def test_local_frames_in_a_global_setpoint_are_ignored(hover: GroundStation, frame: int) -> None:
    send_global(hover, frame, 12.0)
    hover.run(4.0)
    assert hover.position == pytest.approx((0.0, 0.0, -10.0), abs=0.2)


def test_a_latitude_that_is_none_is_ignored(hover: GroundStation) -> None:
    send_global(hover, 6, 12.0, north=2e7)
    hover.run(4.0)
    assert hover.position == pytest.approx((0.0, 0.0, -10.0), abs=0.2)


def test_an_altitude_of_nan_is_rejected(hover: GroundStation) -> None:
    send_global(hover, 6, math.nan)
    assert hover.texts()[-1] == "Setpoint ignored: altitude not usable"


def test_a_global_velocity(hover: GroundStation) -> None:
    send_global(hover, 6, 0.0, mask=VELOCITY, velocity=(1.0, 1.0, 0.0))
    hover.run(2.5)
    assert hover.velocity[:2] == pytest.approx((1.0, 1.0), abs=0.2)
