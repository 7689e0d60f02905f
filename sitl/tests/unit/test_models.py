"""The models behind the simulator: dynamics, battery, geodesy, profiles, arithmetic."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mavlink_sitl.array_ops import ArrayOps, Ops, ops_for
from mavlink_sitl.autopilot.control.controller import sqrt_approach
from mavlink_sitl.autopilot.control.straight_profile import LineProfile
from mavlink_sitl.autopilot.parameters import (
    Parameters,
    ParameterSpec,
    ParameterTable,
    ParameterType,
    UnknownParameterError,
)
from mavlink_sitl.dynamics import at_rest, battery, quadrotor
from mavlink_sitl.exchange import GRAVITY_M_S2
from mavlink_sitl.geodesy import ARDUPILOT, PX4, GeoPoint, LocalFrame, Projection
from mavlink_sitl.mavlink.messages.streams import NEVER_US, StreamSchedule
from sitl_support.tlogs import read_records

SCALAR = Ops()
MODEL = quadrotor.QuadrotorModel()
DT_S = 0.01
CALM = (0.0, 0.0, 0.0)


def flown(
    command: quadrotor.QuadrotorCommand,
    seconds: float,
    state: quadrotor.QuadrotorState | None = None,
    wind: tuple[float, float, float] = CALM,
) -> quadrotor.QuadrotorState:
    """A quadrotor that does one thing for a while, far above ground."""
    if state is None:
        state = at_rest(quadrotor.QuadrotorState, 0.0, SCALAR)._replace(
            down_m=-1000.0, on_ground=False, thrust_m_s2=GRAVITY_M_S2
        )
    for _ in range(round(seconds / DT_S)):
        state = quadrotor.step(state, command, wind, 0.0, DT_S, MODEL, SCALAR)
    return state


def level(thrust: float = GRAVITY_M_S2) -> quadrotor.QuadrotorCommand:
    return quadrotor.QuadrotorCommand(0.0, 0.0, thrust, 0.0)


# Dynamics.


def test_thrust_of_one_weight_hovers() -> None:
    state = flown(level(), 10.0)
    assert state.down_m == pytest.approx(-1000.0, abs=1e-6)


def test_free_fall_ends_at_terminal_speed() -> None:
    state = flown(level(0.0), 60.0)
    v = state.velocity_down_m_s
    drag = MODEL.drag_linear_1_s * v + MODEL.drag_quadratic_1_m * v * v
    assert drag == pytest.approx(GRAVITY_M_S2, rel=0.01)


@pytest.mark.parametrize(("degrees", "speed_m_s"), [(3.8, 2.05), (22.5, 9.0)])
def test_steady_speed_at_a_lean(degrees: float, speed_m_s: float) -> None:
    """3.8 degrees at 2.05 m/s were recorded."""
    lean = math.tan(math.radians(degrees))
    thrust = GRAVITY_M_S2 * math.hypot(1.0, lean)
    state = flown(quadrotor.QuadrotorCommand(lean, 0.0, thrust, 0.0), 40.0)
    assert state.velocity_north_m_s == pytest.approx(speed_m_s, rel=0.06)
    assert state.down_m == pytest.approx(-1000.0, abs=1.0)


def test_the_lean_is_limited() -> None:
    state = flown(quadrotor.QuadrotorCommand(3.0, 4.0, 9.8, 0.0), 3.0)
    assert math.hypot(state.lean_north, state.lean_east) == pytest.approx(MODEL.max_lean, abs=0.01)
    assert state.lean_east / state.lean_north == pytest.approx(4.0 / 3.0, rel=0.01)


def test_the_attitude_follows_within_half_a_second() -> None:
    """As on ArduCopter, whose speed overshoots by as much when an acceleration ends."""
    state = flown(quadrotor.QuadrotorCommand(0.3, 0.0, 9.8, 0.0), 0.2)
    assert 0.1 < state.lean_north < 0.2
    state = flown(quadrotor.QuadrotorCommand(0.3, 0.0, 9.8, 0.0), 0.5)
    assert state.lean_north == pytest.approx(0.3, abs=0.03)


def test_thrust_is_limited_to_what_the_motors_have() -> None:
    state = flown(level(1000.0), 2.0)
    assert state.thrust_m_s2 == pytest.approx(MODEL.max_thrust_m_s2, rel=1e-6)


def test_wind_carries_along_and_drag_ends_with_it() -> None:
    state = flown(level(), 60.0, wind=(0.0, 5.0, 0.0))
    assert state.velocity_east_m_s == pytest.approx(5.0, abs=0.05)


def test_yaw_turns_clockwise_and_wraps() -> None:
    # 4 s at three quarters of what is asked for, less one time constant.
    state = flown(quadrotor.QuadrotorCommand(0.0, 0.0, 9.8, 4.0 / 3.0), 4.0)
    assert state.yaw_rad == pytest.approx(3.8 - 2 * math.pi, abs=0.05)


def test_the_ground_holds_and_remembers_the_impact() -> None:
    state = at_rest(quadrotor.QuadrotorState, 0.0, SCALAR)
    state = state._replace(down_m=-5.0, on_ground=False)
    state = flown(level(0.0), 3.0, state)
    assert state.down_m == 0.0
    assert state.on_ground
    assert 8.0 < state.impact_m_s < math.sqrt(2 * 9.81 * 5.0)
    moved = flown(quadrotor.QuadrotorCommand(0.5, 0.0, 5.0, 1.0), 3.0, state)
    assert (moved.north_m, moved.yaw_rad) == (state.north_m, state.yaw_rad)
    risen = flown(level(12.0), 1.0, state)
    assert not risen.on_ground
    assert risen.impact_m_s == 0.0


# One arithmetic.


@given(
    st.lists(
        st.tuples(*[st.floats(-50.0, 50.0) for _ in range(6)], st.floats(-0.6, 0.6)),
        min_size=2,
        max_size=5,
    )
)
def test_an_array_of_vehicles_moves_like_each_alone(
    rows: list[tuple[float, float, float, float, float, float, float]],
) -> None:
    many: Ops = ArrayOps(len(rows))
    columns = [many.pack(list(column)) for column in zip(*rows, strict=True)]

    def begin(o: Ops, c: list[object]) -> quadrotor.QuadrotorState:
        return at_rest(quadrotor.QuadrotorState, o.full(0.5), o)._replace(
            north_m=c[0],
            east_m=c[1],
            down_m=c[2],
            velocity_north_m_s=c[3],
            velocity_east_m_s=c[4],
            velocity_down_m_s=c[5],
        )

    def end(o: Ops, c: list[object]) -> quadrotor.QuadrotorState:
        state = begin(o, c)
        for _ in range(20):
            command = quadrotor.QuadrotorCommand(c[6], o.full(0.1), o.full(10.0), o.full(0.2))
            wind = (o.full(1.0), o.full(-2.0), o.full(0.0))
            state = quadrotor.step(state, command, wind, o.full(0.0), DT_S, MODEL, o)
        return state

    together = end(many, columns)
    for index, row in enumerate(rows):
        alone = end(SCALAR, list(row))
        for ours, theirs in zip(alone, together, strict=True):
            assert float(ours) == pytest.approx(float(theirs[index]), abs=1e-9)


@given(st.floats(-1e4, 1e4), st.floats(-100, 100), st.floats(0, 100))
def test_scalar_and_array_functions_agree(x: float, low: float, width: float) -> None:
    array: Ops = ArrayOps(1)
    lane = array.pack([x])
    high = low + width
    pairs = [
        (SCALAR.clip(x, low, high), array.clip(lane, low, high)),
        (SCALAR.minimum(x, low), array.minimum(lane, low)),
        (SCALAR.maximum(x, low), array.maximum(lane, low)),
        (SCALAR.where(x > low, x, low), array.where(lane > low, lane, low)),
        (SCALAR.hypot(x, low), array.hypot(lane, low)),
    ]
    for scalar, lanes in pairs:
        assert scalar == pytest.approx(float(lanes[0]))
    wrapped, wrapped_lane = SCALAR.wrap_pi(x), float(array.wrap_pi(lane)[0])
    assert abs(wrapped) <= math.pi + 1e-9
    assert math.cos(wrapped) == pytest.approx(math.cos(x), abs=1e-6)
    assert math.cos(wrapped_lane) == pytest.approx(math.cos(x), abs=1e-6)


def test_one_vehicle_runs_on_floats_and_more_on_arrays() -> None:
    assert isinstance(ops_for(1).full(2.0), float)
    assert ops_for(3).full(2.0).shape == (3,)


# Shaping.


@given(st.floats(0, 1000), st.floats(0.1, 5), st.floats(0.1, 10))
def test_the_approach_never_needs_more_than_the_limit_to_stop(
    error: float, gain: float, limit: float
) -> None:
    speed = float(sqrt_approach(error, gain, limit, SCALAR))
    assert 0.0 <= speed <= gain * error + 1e-9
    step = 1e-4
    slope = (float(sqrt_approach(error + step, gain, limit, SCALAR)) - speed) / step
    assert speed * slope <= limit * 1.01 + 1e-6


PROFILES = st.builds(
    LineProfile,
    st.floats(0.0, 500.0),
    st.floats(0.2, 20.0),
    st.floats(0.2, 10.0),
    st.floats(0.2, 20.0),
)


@given(st.floats(0.0, 500.0), st.floats(0.2, 20.0), st.floats(0.2, 10.0), st.floats(0.2, 20.0))
def test_a_profile_keeps_its_limits_and_arrives_at_rest(
    length: float, speed: float, acceleration: float, jerk: float
) -> None:
    profile = LineProfile(length, speed, acceleration, jerk)
    steps = 200
    previous = (0.0, 0.0, 0.0)
    dt = profile.duration_s / steps
    for number in range(steps + 1):
        s, v, a = profile.at(number * dt)
        assert -1e-6 <= v <= speed * (1 + 1e-6) + 1e-9
        assert abs(a) <= acceleration * (1 + 1e-6) + 1e-9
        assert s >= previous[0] - 1e-6
        assert abs(a - previous[2]) <= jerk * dt * (1 + 1e-6) + 1e-6
        previous = (s, v, a)
    assert previous[0] == pytest.approx(length, abs=1e-5 + 1e-6 * length)
    assert previous[1] == pytest.approx(0.0, abs=1e-4)
    assert profile.at(profile.duration_s + 5.0) == (length, 0.0, 0.0)


def test_the_recorded_return_of_27_m_takes_9_5_s() -> None:
    """WPNAV_JERK 1: peak 5.7 m/s by the book; 5.3 m/s and 9 s recorded in `copter_lowbatt`."""
    profile = LineProfile(27.0, 10.0, 2.5, 1.0)
    assert profile.duration_s == pytest.approx(9.5, abs=0.1)
    assert profile.at(profile.duration_s / 2)[1] == pytest.approx(5.67, abs=0.02)


# Battery.


def test_hover_empties_the_pack_in_25_minutes() -> None:
    pack = battery.BatteryModel()
    state = battery.charged(1.0, pack, SCALAR)
    assert state.voltage_v == pytest.approx(12.6)
    for _ in range(25 * 60):
        state = battery.step(state, 1.0, 1.0, pack, SCALAR)
    assert state.consumed_mah == pytest.approx(27.7 * 25 / 60 * 1000, rel=1e-6)
    assert 0.98 < state.consumed_mah / pack.capacity_mah < 1.0
    assert state.voltage_v < 3 * 3.7
    assert state.consumed_wh == pytest.approx(state.consumed_mah / 1000 * 11.6, rel=0.05)


def test_the_voltage_sags_under_load_and_comes_back() -> None:
    pack = battery.BatteryModel()
    state = battery.charged(0.5, pack, SCALAR)
    loaded = battery.step(state, 2.0, 0.01, pack, SCALAR)
    assert state.voltage_v - loaded.voltage_v > 0.5
    rested = battery.step(loaded, 0.0, 0.01, pack, SCALAR)
    assert rested.voltage_v == pytest.approx(state.voltage_v, abs=0.01)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_charge_is_never_less_voltage(one: float, other: float) -> None:
    assume(one <= other)
    pack = battery.BatteryModel(cells=4)
    low, high = (battery.charged(x, pack, SCALAR).voltage_v for x in (one, other))
    assert 4 * 3.3 - 1e-9 <= low <= high <= 4 * 4.2 + 1e-9


# Geodesy.

PLACES = st.builds(GeoPoint, st.floats(-80, 80), st.floats(-180, 180), st.floats(-100, 5000))


@pytest.mark.parametrize("projection", [ARDUPILOT, PX4])
@given(origin=PLACES, ned=st.tuples(*[st.floats(-5000, 5000) for _ in range(3)]))
def test_local_and_geodetic_are_inverse(
    projection: Projection, origin: GeoPoint, ned: tuple[float, float, float]
) -> None:
    frame = LocalFrame(origin, projection)
    point = frame.to_geodetic(*ned)
    assert abs(point.longitude_deg) <= 180.0
    assert frame.to_local(point) == pytest.approx(ned, abs=1e-4)


def test_each_firmware_has_its_own_length_of_a_degree() -> None:
    origin = GeoPoint(47.0, 8.0, 0.0)
    up = GeoPoint(47.01, 8.0, 0.0)
    assert ARDUPILOT.to_local(origin, up)[0] == pytest.approx(1113.188, abs=0.001)
    assert PX4.to_local(origin, up)[0] == pytest.approx(1111.949, abs=0.001)


def test_one_unit_of_latitude_is_what_was_recorded() -> None:
    origin = GeoPoint(-35.3632610, 149.1652299, 584.0)
    point = GeoPoint(-35.3632611, 149.1652300, 583.99)
    north, east, down = LocalFrame(origin, ARDUPILOT).to_local(point)
    assert north == pytest.approx(-0.011131884530186653, abs=1e-6)
    assert east == pytest.approx(0.009078041650354862, abs=1e-6)
    assert down == pytest.approx(0.01, abs=1e-6)


# Parameters and streams.


def test_parameters_know_their_types_and_names() -> None:
    specs = (ParameterSpec("B", 1.5), ParameterSpec("A", 2.0, ParameterType.INT8))
    parameters = Parameters(ParameterTable(specs), {"A": 3.4})
    assert parameters.names() == ("A", "B")
    assert parameters["A"] == 3.0
    with pytest.raises(UnknownParameterError, match="no parameter 'C'; there are: A, B"):
        parameters.set("C", 1.0)
    with pytest.raises(ValueError, match="finite"):
        parameters.set("B", math.nan)


@given(st.lists(st.integers(3125, 2_000_000), min_size=1, max_size=6), st.integers(1, 40))
def test_streams_are_exact_whatever_the_intervals(intervals: list[int], ticks: int) -> None:
    schedule = StreamSchedule()
    for message_id, interval_us in enumerate(intervals):
        schedule.set(message_id, interval_us, 0)
    counts = [0] * len(intervals)
    end_us = 5_000_000
    for now_us in range(0, end_us + 1, ticks * 1000):
        for message_id in schedule.take_due(now_us):
            counts[message_id] += 1
        assert schedule.next_due_us > now_us
    latest_us = end_us // (ticks * 1000) * ticks * 1000
    for interval_us, count in zip(intervals, counts, strict=True):
        if interval_us >= ticks * 1000:
            assert count == latest_us // interval_us
    for message_id in range(len(intervals)):
        schedule.stop(message_id)
    assert schedule.next_due_us == NEVER_US


# Logs.


def test_a_log_that_is_none_is_named() -> None:
    with pytest.raises(ValueError, match="no MAVLink frame at offset 8"):
        list(read_records(bytes(32)))


def test_a_log_cut_short_gives_what_is_whole() -> None:
    record = bytes(8) + b"\xfe\x01" + bytes(7)
    assert len(list(read_records(record * 2 + record[:-1]))) == 2
