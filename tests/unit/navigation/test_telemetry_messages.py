"""Telemetry as standard messages: units, signs, frames, and "unknown" where it is unknown."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus

from custom_interfaces.msg import GoalCode
from drone_navigation.server.publishing import telemetry_messages as messages
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.state.reducer import VehicleState
from mavlink_vehicle.state.telemetry import (
    Attitude,
    Battery,
    EstimatorReport,
    GlobalPosition,
    GpsFix,
    Home,
    LocalPosition,
    Origin,
)
from navigation_bridge.configuration.sensor_poses import turn
from navigation_bridge.goals.goal import GoalRejected
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose
from navigation_bridge.vehicle.station_health import StationHealth
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

STAMP = Time(sec=12)
NORTH = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))


def _moving(*velocity_ned_m_s: float) -> VehicleState:
    position = GlobalPosition(0.0, 0, 47.0, 8.0, 500.0, 10.0, velocity_ned_m_s, 0.0)  # type: ignore[arg-type]
    return VehicleState(
        global_position=position, attitude=Attitude(0.0, 0, 0.0, 0.0, 0.0, (0.1, 0.2, 0.3))
    )


def test_velocity_is_in_the_body_frame_forward_left_up() -> None:
    facing_north = MapPose((1.0, 2.0, 3.0), math.pi / 2, NORTH)
    message = messages.odometry(facing_north, _moving(4.0, 1.0, -0.5), STAMP)
    linear = message.twist.twist.linear
    assert (linear.x, linear.y, linear.z) == pytest.approx((4.0, -1.0, 0.5))
    angular = message.twist.twist.angular
    assert (angular.x, angular.y, angular.z) == pytest.approx((0.1, -0.2, -0.3))
    assert (message.header.frame_id, message.child_frame_id) == ("map", "base_link")


def test_velocity_follows_roll_and_pitch_too() -> None:
    nose_up = (0.0, -math.sin(math.pi / 8), 0.0, math.cos(math.pi / 8))  # 45 degrees, facing east
    message = messages.odometry(
        MapPose((0.0, 0.0, 0.0), 0.0, nose_up), _moving(0.0, 2.0, 0.0), STAMP
    )
    linear = message.twist.twist.linear
    assert (linear.x, linear.y, linear.z) == pytest.approx(
        (2.0 * math.sqrt(0.5), 0.0, -2.0 * math.sqrt(0.5)), abs=1e-9
    )


def test_a_covariance_is_that_of_the_receiver_and_never_zero() -> None:
    pose = MapPose((0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0, 1.0))
    unknown = messages.odometry(pose, _moving(0.0, 0.0, 0.0), STAMP)
    for covariance in (unknown.pose.covariance, unknown.twist.covariance):
        assert all(covariance[7 * index] > 0.0 for index in range(6))
    coarse = GpsFix(0.0, 3, 9, 3.0, None)
    assert messages.odometry(pose, VehicleState(gps=coarse), STAMP).pose.covariance[0] == 36.0
    gps = GpsFix(0.0, 3, 9, 0.8, 1.2, 47.0, 8.0, 547.0, 0.5, 2.0)
    known: Odometry = messages.odometry(
        pose, VehicleState(gps=gps, global_position=_moving(0.0, 0.0, 0.0).global_position), STAMP
    )
    assert [known.pose.covariance[i] for i in (0, 7, 14)] == pytest.approx([0.25, 0.25, 4.0])


def test_a_covariance_of_the_estimator_goes_before_that_of_the_receiver() -> None:
    pose = MapPose((0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0, 1.0))
    gps = GpsFix(0.0, 3, 9, 0.8, 1.2, 47.0, 8.0, 547.0, 0.5, 2.0, speed_accuracy_m_s=0.4)
    estimator = EstimatorReport(0.0, 0, True, False, 0.3, 0.1)
    state = VehicleState(gps=gps, estimator=estimator)
    message = messages.odometry(pose, state, STAMP)
    assert [message.pose.covariance[i] for i in (0, 7, 14)] == pytest.approx([0.09, 0.09, 0.01])
    assert [message.twist.covariance[i] for i in (0, 7, 14)] == pytest.approx([0.16] * 3)


@pytest.mark.parametrize(
    ("roll", "pitch", "heading"),
    [(0.0, 0.0, 0.0), (0.4, 0.0, 1.0), (0.0, -0.6, 2.0), (-0.3, 0.5, -2.5), (3.0, 0.2, 3.1)],
)
def test_rep_103_holds_at_any_attitude(roll: float, pitch: float, heading: float) -> None:
    velocity_ned, rates_frd = np.array([4.0, -2.0, 1.0]), (0.1, 0.2, -0.3)
    place = GlobalPosition(0.0, 0, 47.0, 8.0, 500.0, 10.0, tuple(velocity_ned), None)
    state = VehicleState(
        autopilot=mavlink.MAV_AUTOPILOT_PX4,
        global_position=place,
        local_position=LocalPosition(0.0, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        attitude=Attitude(0.0, 0, roll, pitch, heading, rates_frd),
        origin=Origin(0.0, 47.0, 8.0, 500.0),
        estimator=EstimatorReport(0.0, 0, True),
    )
    frame = MapFrame()
    frame.update(state)
    pose = frame.pose(state)
    assert pose is not None
    message = messages.odometry(pose, state, STAMP)
    # MAVLink's own definition, as matrices: yaw, then pitch, then roll, from NED to FRD.
    frd_to_ned = turn(roll, pitch, heading)
    flip = np.diag([1.0, -1.0, -1.0])
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    found = [linear.x, linear.y, linear.z]
    assert found == pytest.approx((flip @ frd_to_ned.T @ velocity_ned).tolist())
    assert [angular.x, angular.y, angular.z] == pytest.approx(flip @ rates_frd)
    x, y, z, w = pose.orientation_xyzw
    forward_enu = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
    north, east, down = frd_to_ned[:, 0]
    assert forward_enu == pytest.approx([east, north, -down])
    up_enu = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    north, east, down = -frd_to_ned[:, 2]
    assert up_enu == pytest.approx([east, north, -down])


def test_a_fix_has_its_altitude_above_the_ellipsoid() -> None:
    gps = GpsFix(0.0, 6, 20, 0.5, 0.7, 47.0, 8.0, 547.0, 0.02, 0.03)
    message = messages.nav_sat_fix(VehicleState(gps=gps), STAMP)
    assert (message.latitude, message.longitude, message.altitude) == (47.0, 8.0, 547.0)
    assert message.status.status == NavSatStatus.STATUS_GBAS_FIX
    assert message.position_covariance_type == NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
    assert message.position_covariance[8] == pytest.approx(0.0009)


def test_a_fix_without_an_accuracy_has_an_approximate_one() -> None:
    gps = GpsFix(0.0, 3, 9, 1.5, 2.0, 47.0, 8.0, 547.0)
    message = messages.nav_sat_fix(VehicleState(gps=gps), STAMP)
    assert message.position_covariance_type == NavSatFix.COVARIANCE_TYPE_APPROXIMATED
    assert [message.position_covariance[i] for i in (0, 4, 8)] == pytest.approx([9.0, 9.0, 16.0])


def test_without_a_fix_nothing_is_invented() -> None:
    for state in (VehicleState(), VehicleState(gps=GpsFix(0.0, 1, 3, None, None))):
        message = messages.nav_sat_fix(state, STAMP)
        assert message.status.status == NavSatStatus.STATUS_NO_FIX
        assert all(map(math.isnan, (message.latitude, message.longitude, message.altitude)))
        assert message.position_covariance_type == NavSatFix.COVARIANCE_TYPE_UNKNOWN


def test_a_discharging_battery_has_a_negative_current() -> None:
    battery = Battery(0.0, 0.42, 11.9, 15.0)
    message = messages.battery_state(battery, STAMP)
    assert message.percentage == pytest.approx(0.42)
    assert message.voltage == pytest.approx(11.9)
    assert message.current == pytest.approx(-15.0)
    assert math.isnan(message.capacity)
    assert message.present


def test_an_unknown_battery_is_nan() -> None:
    message = messages.battery_state(None, STAMP)
    assert math.isnan(message.percentage)
    assert math.isnan(message.voltage)
    assert math.isnan(message.current)
    assert message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_UNKNOWN
    assert not message.present


def test_trouble_with_ground_stations_is_a_warning_of_their_link() -> None:
    health, statistics = StationHealth(), LinkStatistics(frames=1)
    health.update(statistics)
    status = messages.station_diagnostic(health, "navigation_server", "udpin://127.0.0.1:1")
    assert status.name == "navigation_server: ground station link udpin://127.0.0.1:1"
    assert (status.level, status.message) == (DiagnosticStatus.OK, "Ground stations connected")
    statistics.spoofed += 1
    health.update(statistics)
    status = messages.station_diagnostic(health, "navigation_server", "udpin://127.0.0.1:1")
    assert (status.level, status.message) == (DiagnosticStatus.WARN, health.trouble)
    assert {value.key: value.value for value in status.values} == health.values


def test_a_rejection_is_published_in_fields() -> None:
    rejected = GoalRejected(Rejection(OutcomeCode.BELOW_GROUND, "Too low."))
    message = messages.goal_rejected(rejected, STAMP)
    assert (message.code, message.message) == ("BELOW_GROUND", "Too low.")
    assert message.error_code == GoalCode.BELOW_GROUND
    assert message.header.stamp == STAMP


def _bridge(**members: Any) -> Any:
    state = members.pop("state", VehicleState())
    return SimpleNamespace(vehicle=SimpleNamespace(state=state), pose=None, **members)


def _at_home(home_enu_m: Vector3 | None) -> Any:
    return _bridge(map_frame=SimpleNamespace(home_enu_m=lambda _: home_enu_m))


def test_home_is_published_with_its_map_position_once_known() -> None:
    state = VehicleState(home=Home(0.0, 47.0, 8.0, 500.0, None))
    before = messages.home_position(_at_home(None), state, STAMP)
    assert (before.latitude, before.longitude, before.altitude_amsl) == (47.0, 8.0, 500.0)
    assert math.isnan(before.position.x)
    later = messages.home_position(_at_home((1.0, 2.0, 3.0)), state, Time(sec=13))
    assert (later.position.x, later.position.y, later.position.z) == (1.0, 2.0, 3.0)
    assert later.header.frame_id == "map"
    assert not messages.is_same_home(before, later)
    again = messages.home_position(_at_home((1.0, 2.0, 3.0)), state, Time(sec=14))
    assert messages.is_same_home(later, again)


@pytest.mark.parametrize(
    ("gps", "level"),
    [
        (None, DiagnosticStatus.STALE),
        (GpsFix(0.0, 1, 3, None, None), DiagnosticStatus.ERROR),
        (GpsFix(0.0, 3, 9, 0.8, 1.2), DiagnosticStatus.OK),
    ],
)
def test_the_gps_is_diagnosed(gps: GpsFix | None, level: bytes) -> None:
    status = messages.gps_diagnostic(VehicleState(gps=gps), "navigation_server", "1/1")
    assert (status.name, status.level) == ("navigation_server: GPS", level)
    if gps is not None:
        values = {value.key: value.value for value in status.values}
        assert values["satellites"] == str(gps.satellites)


@pytest.mark.parametrize(
    ("battery", "level"),
    [
        (None, DiagnosticStatus.STALE),
        (Battery(0.0, 0.1, 10.5, 15.0, 3.0, mavlink.MAV_BATTERY_CHARGE_STATE_LOW), b"\x01"),
        (Battery(0.0, 0.9, 12.5, 15.0, 0.3, mavlink.MAV_BATTERY_CHARGE_STATE_OK), b"\x00"),
    ],
)
def test_the_battery_is_diagnosed(battery: Battery | None, level: bytes) -> None:
    status = messages.battery_diagnostic(VehicleState(battery=battery), "navigation_server", "1/1")
    assert (status.name, status.level) == ("navigation_server: battery", level)


@pytest.mark.parametrize(
    ("state", "pose", "level"),
    [
        (VehicleState(), None, DiagnosticStatus.STALE),
        (
            VehicleState(estimator=EstimatorReport(0.0, 0, False)),
            None,
            DiagnosticStatus.ERROR,
        ),
        (
            VehicleState(estimator=EstimatorReport(0.0, 0x3FF, True)),
            None,
            DiagnosticStatus.WARN,
        ),
        (
            VehicleState(estimator=EstimatorReport(0.0, 0x3FF, True)),
            object(),
            DiagnosticStatus.OK,
        ),
    ],
)
def test_the_estimator_is_diagnosed(state: VehicleState, pose: object, level: bytes) -> None:
    bridge = _bridge(state=state)
    bridge.pose = pose
    status = messages.estimator_diagnostic(bridge, "navigation_server", "1/1")
    assert (status.name, status.level) == ("navigation_server: estimator", level)


def test_a_battery_with_cells_faults_and_a_temperature() -> None:
    cells = (4.1, 4.0, 3.9)
    battery = Battery(
        1.0, 0.5, 12.0, 3.0, charge_state=1, battery_id=2, chemistry=1, cell_voltages_v=cells,
        temperature_c=25.5, faults=16,
    )  # fmt: skip
    message = messages.battery_state(battery, STAMP)
    assert message.location == "2"
    assert list(message.cell_voltage) == pytest.approx(cells)
    assert message.temperature == pytest.approx(25.5)
    assert message.power_supply_health == message.POWER_SUPPLY_HEALTH_OVERHEAT
    assert message.power_supply_technology == message.POWER_SUPPLY_TECHNOLOGY_LIPO
