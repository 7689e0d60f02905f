"""The parts of a vehicle's state, one per message.

Named tuples, because several of them are made for every position that arrives, and a frozen
dataclass takes three times as long to make.
"""

from __future__ import annotations

from typing import NamedTuple

from mavlink_vehicle.positions.frames import Vector3


class GlobalPosition(NamedTuple):
    """GLOBAL_POSITION_INT.

    Attributes:
        time_s: when it came.
        time_boot_ms: the vehicle's time of it.
        latitude_deg: WGS-84.
        longitude_deg: WGS-84.
        altitude_amsl_m: above mean sea level.
        relative_altitude_m: above home.
        velocity_ned_m_s: ground velocity, north, east, down.
        heading_ned_rad: heading of the nose, 0 north, clockwise, in (-pi, pi].
    """

    time_s: float
    time_boot_ms: int
    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    relative_altitude_m: float
    velocity_ned_m_s: Vector3
    heading_ned_rad: float | None


class LocalPosition(NamedTuple):
    """LOCAL_POSITION_NED: about the vehicle's local origin."""

    time_s: float
    time_boot_ms: int
    position_ned_m: Vector3
    velocity_ned_m_s: Vector3


class Attitude(NamedTuple):
    """ATTITUDE: FRD body against NED; rates about the body's axes."""

    time_s: float
    time_boot_ms: int
    roll_rad: float
    pitch_rad: float
    yaw_ned_rad: float
    rates_frd_rad_s: Vector3


class Battery(NamedTuple):
    """BATTERY_STATUS of one battery, or what SYS_STATUS says.

    Attributes:
        time_s: when it came.
        remaining: fraction 0 to 1, None when unknown, as all that may be None.
        voltage_v: of the whole pack.
        current_a: positive when discharging.
        consumed_ah: charge used.
        charge_state: MAV_BATTERY_CHARGE_STATE, 0 when unknown.
        from_summary: it came from SYS_STATUS.
        battery_id: the autopilot's number, from 0.
        function: MAV_BATTERY_FUNCTION, 0 when unknown.
        chemistry: MAV_BATTERY_TYPE, 0 when unknown.
        cell_voltages_v: of the cells that are measured one by one; else empty.
        temperature_c: in degrees Celsius.
        time_remaining_s: as the autopilot expects it.
        mode: MAV_BATTERY_MODE; 0 in normal use.
        faults: MAV_BATTERY_FAULT.
    """

    time_s: float
    remaining: float | None
    voltage_v: float | None
    current_a: float | None
    consumed_ah: float | None = None
    charge_state: int = 0
    from_summary: bool = False
    battery_id: int = 0
    function: int = 0
    chemistry: int = 0
    cell_voltages_v: tuple[float, ...] = ()
    temperature_c: float | None = None
    time_remaining_s: float | None = None
    mode: int = 0
    faults: int = 0


class Home(NamedTuple):
    """HOME_POSITION; `position_ned_m` (about the local origin) is None until it is known."""

    time_s: float
    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    position_ned_m: Vector3 | None


class Origin(NamedTuple):
    """GPS_GLOBAL_ORIGIN: where the local origin lies."""

    time_s: float
    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


class MissionProgress(NamedTuple):
    """MISSION_CURRENT, and MISSION_ITEM_REACHED.

    Attributes:
        time_s: when MISSION_CURRENT came.
        current: number of the item that is under way, as sent: on ArduPilot home is 0.
        total: number of items, home not counted; None when the firmware doesn't report it.
        state: MISSION_STATE; 0 when the firmware doesn't report it.
        mission_id: PX4's number for what is stored; 0 when there is none.
        reached: the items that were reached, in order, since the last upload of ours. One
            that is reported repeatedly (PX4: once a second for 10 s) is there once.
        fence_id: PX4's number for the fence that is stored; 0 when there is none.
        rally_id: the same for the rally points.
    """

    time_s: float
    current: int
    total: int | None
    state: int
    mission_id: int
    reached: tuple[int, ...] = ()
    fence_id: int = 0
    rally_id: int = 0


class GpsFix(NamedTuple):
    """GPS_RAW_INT.

    Attributes:
        time_s: when it came.
        fix_type: GPS_FIX_TYPE (3 = 3D).
        satellites: None when unknown, as for all that follow.
        hdop: horizontal dilution of precision.
        vdop: vertical dilution of precision.
        latitude_deg: WGS-84.
        longitude_deg: WGS-84.
        altitude_ellipsoid_m: above the WGS-84 ellipsoid, not above mean sea level.
        horizontal_accuracy_m: standard deviation, as the receiver estimates it.
        vertical_accuracy_m: the same, upwards.
        speed_accuracy_m_s: standard deviation of the speed, as the receiver estimates it.
        altitude_amsl_m: above mean sea level.
        time_boot_ms: the vehicle's time of it; None if it counts from 1970, or not at all.
    """

    time_s: float
    fix_type: int
    satellites: int | None
    hdop: float | None
    vdop: float | None
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    altitude_ellipsoid_m: float | None = None
    horizontal_accuracy_m: float | None = None
    vertical_accuracy_m: float | None = None
    speed_accuracy_m_s: float | None = None
    altitude_amsl_m: float | None = None
    time_boot_ms: int | None = None


class EstimatorReport(NamedTuple):
    """EKF_STATUS_REPORT or ESTIMATOR_STATUS.

    Attributes:
        time_s: when it came.
        flags: as sent.
        horizontal_position_ok: an absolute horizontal position is estimated.
        rejects_position: the horizontal position that is measured fails the estimator's test:
            its ratio is above 1.
        horizontal_accuracy_m: standard deviation that the estimator gives its position, of
            ESTIMATOR_STATUS; None where it gives none. EKF_STATUS_REPORT has only ratios.
        vertical_accuracy_m: the same, upwards.
    """

    time_s: float
    flags: int
    horizontal_position_ok: bool
    rejects_position: bool = False
    horizontal_accuracy_m: float | None = None
    vertical_accuracy_m: float | None = None
