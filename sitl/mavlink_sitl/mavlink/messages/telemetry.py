"""Maps each telemetry message to the function that makes it."""

from __future__ import annotations

from mavlink_sitl.mavlink.messages import payload_messages as payload
from mavlink_sitl.mavlink.messages import position_messages as position
from mavlink_sitl.mavlink.messages import range_messages as ranges
from mavlink_sitl.mavlink.messages import sensor_messages as sensors
from mavlink_sitl.mavlink.messages import status_messages as status
from mavlink_sitl.mavlink.messages.kind_messages import OWN
from mavlink_sitl.mavlink.messages.snapshot import Builder

_EVERY_KIND: dict[int, Builder] = {
    0: status.heartbeat,
    1: status.sys_status,
    2: status.system_time,
    24: position.gps_raw_int,
    27: sensors.raw_imu,
    29: sensors.scaled_pressure,
    30: position.attitude,
    31: position.attitude_quaternion,
    32: position.local_position_ned,
    33: position.global_position_int,
    34: sensors.rc_channels_scaled,
    36: status.servo_output_raw,
    42: status.mission_current,
    49: position.gps_global_origin,
    62: position.nav_controller_output,
    65: status.rc_channels,
    74: position.vfr_hud,
    116: sensors.scaled_imu2,
    125: status.power_status,
    129: sensors.scaled_imu3,
    132: ranges.distance_sensor,
    136: position.terrain_report,
    137: sensors.scaled_pressure2,
    147: status.battery_status,
    148: status.autopilot_version,
    152: sensors.meminfo,
    162: status.fence_status,
    163: sensors.ahrs,
    164: position.simstate,
    168: position.wind,
    178: sensors.ahrs2,
    180: payload.camera_feedback,
    193: status.ekf_status_report,
    241: status.vibration,
    242: position.home_position,
    245: status.extended_sys_state,
    259: payload.camera_information,
    260: payload.camera_settings,
    262: payload.camera_capture_status,
    280: payload.gimbal_manager_information,
    281: payload.gimbal_manager_status,
    285: payload.gimbal_device_attitude_status,
    295: sensors.airspeed,
    330: ranges.obstacle_distance,
    11020: sensors.aoa_ssa,
}
BUILDERS = {kind: {**_EVERY_KIND, **own} for kind, own in OWN.items()}
"""By vehicle type and message id: what can be streamed and requested"""
