"""The vehicle's state as standard ROS messages.

Frames are those of REP-103 and REP-105: positions in ``map`` (ENU), velocities of an odometry
in ``base_link`` (FLU). A value that the vehicle does not report is NaN or the message's "unknown",
never a number that looks measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geographic_msgs.msg import GeoPoseStamped
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus

from custom_interfaces.msg import GoalRejected as GoalRejectedMessage
from custom_interfaces.msg import HomePosition, VehicleStatus
from drone_navigation.server.conversions import code_number, pose_stamped
from drone_navigation.server.frame_names import PLAIN, FrameNames
from mavlink_vehicle.positions import frames
from mavlink_vehicle.state.health import battery_is_low, estimator_faults
from mavlink_vehicle.state.reducer import VehicleState
from mavlink_vehicle.state.telemetry import Battery, GpsFix
from navigation_bridge.bridge import Bridge
from navigation_bridge.goals.goal import GoalRejected
from navigation_bridge.vehicle.link_health import LinkHealth
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_bridge.vehicle.station_health import StationHealth
from navigation_bridge.vehicle.takeover import failsafe_code
from navigation_core.geometry import Vector3
from navigation_core.safety.late_setpoints import LATE_S, TOO_LATE_S, WINDOW_S

# MAVLink's GPS_FIX_TYPE.
_FIX_3D, _FIX_DGPS, _FIX_RTK_FLOAT = 3, 4, 5
# Standard deviations assumed where the vehicle does not report its accuracy: of a GPS receiver
# without corrections, and of the attitude and rates of a small autopilot.
_POSITION_M, _HEIGHT_M, _VELOCITY_M_S = 2.5, 4.0, 0.3
_TILT_RAD, _YAW_RAD, _RATE_RAD_S = math.radians(2.0), math.radians(5.0), math.radians(2.0)
# Error of a receiver's range, by which its dilution of precision is multiplied.
_RANGE_ERROR_M = 2.0


def odometry(
    pose: MapPose, state: VehicleState, stamp: Time, names: FrameNames = PLAIN
) -> Odometry:
    """Return pose in ``map`` and velocity in ``base_link``.

    The position's covariance is what the estimator says of its accuracy (ESTIMATOR_STATUS), or
    else what the GPS receiver says, which the estimator is about as good as; that of the velocity
    is the receiver's. Where the vehicle says nothing, it is an assumption on the safe side, never
    zero, which filters take for certainty.
    """
    message = Odometry()
    message.header.stamp = stamp
    message.header.frame_id = names.map
    message.child_frame_id = names.base_link
    message.pose.pose = pose_stamped(pose, stamp).pose
    horizontal_m, vertical_m, _ = _accuracy_m(state.gps)
    if state.estimator is not None:
        horizontal_m = state.estimator.horizontal_accuracy_m or horizontal_m
        vertical_m = state.estimator.vertical_accuracy_m or vertical_m
    speed_m_s = None if state.gps is None else state.gps.speed_accuracy_m_s
    deviations = (horizontal_m, horizontal_m, vertical_m, _TILT_RAD, _TILT_RAD, _YAW_RAD)
    rates = (speed_m_s or _VELOCITY_M_S,) * 3 + (_RATE_RAD_S,) * 3
    for index in range(6):
        message.pose.covariance[7 * index] = deviations[index] ** 2
        message.twist.covariance[7 * index] = rates[index] ** 2
    position = state.global_position
    if position is not None:
        linear = message.twist.twist.linear
        linear.x, linear.y, linear.z = _into_body(
            frames.ned_to_enu(position.velocity_ned_m_s), pose.orientation_xyzw
        )
    if state.attitude is not None:
        rate = state.attitude.rates_frd_rad_s
        angular = message.twist.twist.angular
        angular.x, angular.y, angular.z = rate[0], -rate[1], -rate[2]
    return message


def _into_body(vector_enu: Vector3, orientation_xyzw: tuple[float, float, float, float]) -> Vector3:
    """Turn a vector of the map frame into the body's axes (FLU)."""
    x, y, z, w = orientation_xyzw
    turned = frames.quaternion_multiply(
        (w, -x, -y, -z), frames.quaternion_multiply((0.0, *vector_enu), (w, x, y, z))
    )
    return turned[1], turned[2], turned[3]


def geo_pose(
    pose: MapPose,
    state: VehicleState,
    geoid_m: float | None,
    stamp: Time,
    names: FrameNames = PLAIN,
) -> GeoPoseStamped:
    """Return the geodetic pose; its orientation is that in ``map``.

    Args:
        pose: in the map.
        state: with the global position.
        geoid_m: height of mean sea level above the ellipsoid. The autopilot reports altitudes
            above mean sea level; without it the altitude is NaN.
        stamp: of the position.
        names: of the frames.
    """
    message = GeoPoseStamped()
    message.header.stamp = stamp
    message.header.frame_id = names.map
    place, position = message.pose.position, state.global_position
    place.latitude = place.longitude = place.altitude = math.nan
    if position is not None:
        place.latitude, place.longitude = position.latitude_deg, position.longitude_deg
        place.altitude = position.altitude_amsl_m + (math.nan if geoid_m is None else geoid_m)
    message.pose.orientation = pose_stamped(pose, stamp).pose.orientation
    return message


def nav_sat_fix(state: VehicleState, stamp: Time, names: FrameNames = PLAIN) -> NavSatFix:
    """Return the GPS fix; its altitude is above the ellipsoid, or NaN."""
    message = NavSatFix()
    message.header.stamp = stamp
    message.header.frame_id = names.gps
    message.status.service = NavSatStatus.SERVICE_GPS
    gps = state.gps
    fix_type = 0 if gps is None else gps.fix_type
    if fix_type < _FIX_3D:
        message.status.status = NavSatStatus.STATUS_NO_FIX
    elif fix_type >= _FIX_RTK_FLOAT:
        message.status.status = NavSatStatus.STATUS_GBAS_FIX
    elif fix_type == _FIX_DGPS:
        message.status.status = NavSatStatus.STATUS_SBAS_FIX
    else:
        message.status.status = NavSatStatus.STATUS_FIX
    message.latitude = message.longitude = message.altitude = math.nan
    if gps is None:
        return message
    message.latitude = _or_nan(gps.latitude_deg)
    message.longitude = _or_nan(gps.longitude_deg)
    message.altitude = _or_nan(gps.altitude_ellipsoid_m)
    horizontal_m, vertical_m, measured = _accuracy_m(gps)
    if fix_type < _FIX_3D and not measured:
        return message
    message.position_covariance[0] = message.position_covariance[4] = horizontal_m**2
    message.position_covariance[8] = vertical_m**2
    message.position_covariance_type = (
        NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
        if measured
        else NavSatFix.COVARIANCE_TYPE_APPROXIMATED
    )
    return message


def _accuracy_m(gps: GpsFix | None) -> tuple[float, float, bool]:
    """Return horizontal and vertical standard deviation, and whether the receiver reports them."""
    if gps is not None and gps.horizontal_accuracy_m is not None:
        vertical_m = gps.vertical_accuracy_m or gps.horizontal_accuracy_m
        return gps.horizontal_accuracy_m, vertical_m, True
    if gps is None:
        return _POSITION_M, _HEIGHT_M, False
    horizontal_m = _POSITION_M if gps.hdop is None else max(gps.hdop, 0.1) * _RANGE_ERROR_M
    vertical_m = _HEIGHT_M if gps.vdop is None else max(gps.vdop, 0.1) * _RANGE_ERROR_M
    return horizontal_m, vertical_m, False


def goal_rejected(rejected: GoalRejected, stamp: Time) -> GoalRejectedMessage:
    """Return why a goal was rejected, in parts."""
    message = GoalRejectedMessage()
    message.header.stamp = stamp
    message.goal_id = rejected.goal_id
    message.error_code = code_number(rejected.rejection.code)
    message.code = rejected.rejection.code.value
    message.message = rejected.rejection.message
    return message


def home_position(
    bridge: Bridge, state: VehicleState, stamp: Time, names: FrameNames = PLAIN
) -> HomePosition:
    """Return the launch point, which must be known."""
    assert state.home is not None
    message = HomePosition()
    message.header.stamp = stamp
    message.header.frame_id = names.map
    message.latitude, message.longitude = state.home.latitude_deg, state.home.longitude_deg
    message.altitude_amsl = state.home.altitude_amsl_m
    place = bridge.map_frame.home_enu_m(state) or (math.nan, math.nan, math.nan)
    message.position.x, message.position.y, message.position.z = place
    return message


def is_same_home(before: HomePosition, now: HomePosition) -> bool:
    """Return whether two messages have the same position; their stamps differ."""
    return (
        before.latitude == now.latitude
        and before.longitude == now.longitude
        and before.altitude_amsl == now.altitude_amsl
        and math.isnan(before.position.x) == math.isnan(now.position.x)
    )


_TECHNOLOGIES = {
    1: BatteryState.POWER_SUPPLY_TECHNOLOGY_LIPO,
    2: BatteryState.POWER_SUPPLY_TECHNOLOGY_LIFE,
    3: BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
    4: BatteryState.POWER_SUPPLY_TECHNOLOGY_NIMH,
}
"""By MAV_BATTERY_TYPE."""
_CHARGING, _FAILED, _UNHEALTHY = 7, 5, 6
_FAULT_OVER_TEMPERATURE = 16


def battery_state(battery: Battery | None, stamp: Time) -> BatteryState:
    """Return a battery; current is negative while it discharges, as the message defines."""
    message = BatteryState()
    message.header.stamp = stamp
    message.voltage = message.temperature = message.current = message.charge = math.nan
    message.capacity = message.design_capacity = message.percentage = math.nan
    message.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN
    if battery is None:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_UNKNOWN
        return message
    message.present = True
    message.power_supply_status = (
        BatteryState.POWER_SUPPLY_STATUS_CHARGING
        if battery.charge_state == _CHARGING
        else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    )
    message.power_supply_health = _battery_health(battery)
    message.power_supply_technology = _TECHNOLOGIES.get(
        battery.chemistry, BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN
    )
    message.location = str(battery.battery_id)
    message.cell_voltage = list(battery.cell_voltages_v)
    message.temperature = _or_nan(battery.temperature_c)
    message.voltage = _or_nan(battery.voltage_v)
    message.current = math.nan if battery.current_a is None else -battery.current_a
    message.percentage = _or_nan(battery.remaining)
    return message


def _battery_health(battery: Battery) -> int:
    if battery.faults & _FAULT_OVER_TEMPERATURE:
        return int(BatteryState.POWER_SUPPLY_HEALTH_OVERHEAT)
    if battery.faults or battery.charge_state in (_FAILED, _UNHEALTHY):
        return int(BatteryState.POWER_SUPPLY_HEALTH_UNSPEC_FAILURE)
    good = battery.charge_state != 0
    return int(
        BatteryState.POWER_SUPPLY_HEALTH_GOOD if good else BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN
    )


def path(points_enu_m: Sequence[Vector3], stamp: Time, names: FrameNames = PLAIN) -> Path:
    """Return the planned path, in ``map``."""
    message = Path()
    message.header.stamp = stamp
    message.header.frame_id = names.map
    for point in points_enu_m:
        pose = PoseStamped()
        pose.header = message.header
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = point
        message.poses.append(pose)
    return message


def vehicle_status(bridge: Bridge, stamp: Time) -> VehicleStatus:
    """Return the state of the vehicle, without that of the server.

    Args:
        bridge: of the vehicle.
        stamp: of the message.
    """
    vehicle, state = bridge.vehicle, bridge.vehicle.state
    message = VehicleStatus()
    message.header.stamp = stamp
    message.connected = vehicle.heartbeats.alive
    message.autopilot = "" if vehicle.profile is None else vehicle.profile.name
    message.firmware_version = state.firmware_version or ""
    message.mode = vehicle.mode_name
    message.armed = state.armed
    message.in_control = vehicle.in_control_mode
    message.landed_state = int(state.landed_state)
    message.position_valid = bridge.pose is not None
    message.failsafe = "" if state.failsafe is None else failsafe_code(state.failsafe).value
    message.active_goal = bridge.goals.active_id or ""
    goal = bridge.goals.active
    message.goal_notes = [] if goal is None else list(goal.notes)
    message.battery_for_return = bridge.battery_for_return
    message.battery_reserve = bridge.config.safety.battery_reserve
    message.last_status_text = state.status_texts[-1].text if state.status_texts else ""
    return message


def diagnostic_status(
    name: str,
    hardware_id: str,
    judged: tuple[bytes, str],
    values: Mapping[str, str] | None = None,
) -> DiagnosticStatus:
    """Return a diagnostic: level and sentence, and what they were judged by."""
    message = DiagnosticStatus(name=name, hardware_id=hardware_id)
    message.level, message.message = judged
    message.values = [KeyValue(key=key, value=value) for key, value in (values or {}).items()]
    return message


def diagnostic(bridge: Bridge, health: LinkHealth, name: str, hardware_id: str) -> DiagnosticStatus:
    """Return the state of the link to the vehicle."""
    return diagnostic_status(
        f"{name}: vehicle link", hardware_id, _level(bridge, health), health.values
    )


def station_diagnostic(health: StationHealth, name: str, url: str) -> DiagnosticStatus:
    """Return the state of a ground station link."""
    level = DiagnosticStatus.WARN if health.trouble else DiagnosticStatus.OK
    title = f"{name}: ground station link {url}"
    return diagnostic_status(title, url, (level, health.message), health.values)


def obstacle_diagnostic(
    bridge: Bridge, name: str, hardware_id: str, now: float
) -> DiagnosticStatus:
    """Return the state of the obstacle sensors."""
    feed = bridge.obstacles
    age_s = feed.age_s(now)
    if not feed.has_sensor:
        judged = DiagnosticStatus.OK, "No obstacle sensor data"
    elif age_s > feed.timeout_s:
        judged = DiagnosticStatus.STALE, f"An obstacle sensor has been silent for {age_s:.1f} s"
    else:
        judged = DiagnosticStatus.OK, "Obstacle sensors active"
    values = {f"{kind} age": f"{age_s:.1f} s" for kind, age_s in feed.ages_s(now).items()}
    around = feed.look()
    values["known obstacles"] = str(len(around.known))
    values["sensed obstacles"] = str(len(around.sensed))
    values["ignored messages"] = str(bridge.vehicle.range_sensors.reader.ignored)
    return diagnostic_status(f"{name}: obstacle sensors", hardware_id, judged, values)


def loop_diagnostic(bridge: Bridge, name: str, hardware_id: str, now: float) -> DiagnosticStatus:
    """Return the state of the control loop."""
    lateness = bridge.lateness_watch
    recent_s, age_s = lateness.recent_s(now), lateness.data_age_s
    if recent_s >= TOO_LATE_S:
        judged = DiagnosticStatus.ERROR, "Overrun: the vehicle is stopped"
    elif recent_s >= LATE_S:
        judged = DiagnosticStatus.WARN, "Late: the vehicle is slowed down"
    else:
        judged = DiagnosticStatus.OK, "Setpoints are on time"
    values = {
        f"worst delay in the last {WINDOW_S:g} s": f"{recent_s:.3f} s",
        "worst delay": f"{lateness.worst_s:.3f} s",
        f"delays of {LATE_S:g} s or more": str(lateness.count),
        "age of the vehicle's data": "unknown" if age_s is None else f"{age_s:.3f} s",
    }
    return diagnostic_status(f"{name}: control loop", hardware_id, judged, values)


def gps_diagnostic(state: VehicleState, name: str, hardware_id: str) -> DiagnosticStatus:
    """Return the state of the GPS."""
    title, gps = f"{name}: GPS", state.gps
    if gps is None:
        judged = DiagnosticStatus.STALE, "No GPS_RAW_INT received"
        return diagnostic_status(title, hardware_id, judged)
    has_fix = gps.fix_type >= _FIX_3D
    judged = (DiagnosticStatus.OK, "3D fix") if has_fix else (DiagnosticStatus.ERROR, "No 3D fix")
    horizontal_m, vertical_m, _ = _accuracy_m(gps)
    values = {
        "GPS_FIX_TYPE": str(gps.fix_type),
        "satellites": _or_unknown(gps.satellites, "d"),
        "HDOP": _or_unknown(gps.hdop, ".2f"),
        "horizontal accuracy": f"{horizontal_m:.2f} m",
        "vertical accuracy": f"{vertical_m:.2f} m",
    }
    return diagnostic_status(title, hardware_id, judged, values)


def estimator_diagnostic(bridge: Bridge, name: str, hardware_id: str) -> DiagnosticStatus:
    """Return the state of the estimator."""
    state = bridge.vehicle.state
    faults = estimator_faults(state)
    if state.estimator is None and bridge.pose is None:
        judged = DiagnosticStatus.STALE, "No data received"
    elif faults:
        judged = DiagnosticStatus.ERROR, "; ".join(faults)
    elif bridge.pose is None:
        judged = DiagnosticStatus.WARN, "No valid position yet"
    else:
        judged = DiagnosticStatus.OK, "Position valid"
    values = {"flags": "unknown" if state.estimator is None else f"{state.estimator.flags:#06x}"}
    return diagnostic_status(f"{name}: estimator", hardware_id, judged, values)


def battery_diagnostic(state: VehicleState, name: str, hardware_id: str) -> DiagnosticStatus:
    """Return the state of the battery, as judged by the autopilot."""
    title, battery = f"{name}: battery", state.battery
    if battery is None:
        return diagnostic_status(title, hardware_id, (DiagnosticStatus.STALE, "No data received"))
    judged = DiagnosticStatus.OK, "Not low"
    if battery_is_low(battery):
        judged = DiagnosticStatus.WARN, "Low, as reported by the autopilot"
    percent = None if battery.remaining is None else 100.0 * battery.remaining
    values = {
        "remaining": _or_unknown(percent, ".0f", " %"),
        "voltage": _or_unknown(battery.voltage_v, ".2f", " V"),
        "current": _or_unknown(battery.current_a, ".2f", " A"),
        "consumed": _or_unknown(battery.consumed_ah, ".2f", " Ah"),
    }
    for each in state.batteries if len(state.batteries) > 1 else ():
        share = None if each.remaining is None else 100.0 * each.remaining
        values[f"battery {each.battery_id}"] = (
            f"{_or_unknown(share, '.0f', ' %')}, {_or_unknown(each.voltage_v, '.2f', ' V')}, "
            f"charge state {each.charge_state}, faults {each.faults}"
        )
    return diagnostic_status(title, hardware_id, judged, values)


def _or_unknown(value: float | None, form: str, unit: str = "") -> str:
    return "unknown" if value is None else f"{value:{form}}{unit}"


def _level(bridge: Bridge, health: LinkHealth) -> tuple[bytes, str]:
    if bridge.vehicle.profile is None:
        return DiagnosticStatus.ERROR, "No autopilot found yet"
    if not bridge.vehicle.heartbeats.alive:
        return DiagnosticStatus.STALE, "No HEARTBEAT"
    if bridge.vehicle.twins.reason:
        return DiagnosticStatus.ERROR, "Two autopilots with one MAVLink system id"
    if bridge.vehicle.answers.one_way:
        return DiagnosticStatus.ERROR, "One way: telemetry arrives, but nothing is answered"
    if health.loss_share > health.LOSS_WARNING:
        return DiagnosticStatus.WARN, f"{100.0 * health.loss_share:.0f} % of the messages are lost"
    return DiagnosticStatus.OK, "Connected"


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
