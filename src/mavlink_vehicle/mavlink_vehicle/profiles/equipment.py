"""A firmware's commands for cameras, gimbals, grippers and servo outputs.

https://mavlink.io/en/messages/common.html#mav_commands. The differences between the firmwares were
observed on ArduCopter 4.7 and PX4 1.17.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from mavlink_vehicle.codec import mavlink

__all__ = ["EquipmentCommand", "EquipmentRules"]

_HORIZON = mavlink.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | mavlink.GIMBAL_MANAGER_FLAGS_PITCH_LOCK
_LOCKED = _HORIZON | mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK
_NEUTRAL = mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL
_AS_IT_IS = math.nan
_ITSELF, _RELEASE = -2.0, -3.0
_REPORT_US = 200_000.0
# DO_SET_ACTUATOR has -1 to 1 for the same pulses.
_MIDDLE_US, _HALF_RANGE_US = 1500.0, 500.0


@dataclass(frozen=True)
class EquipmentCommand:
    """A command, sent at once or stored in a mission.

    Attributes:
        command: MAV_CMD.
        params: param1 to param7, or their beginning.
        place: latitude and longitude in degrees and altitude above mean sea level in metres, in
            place of param5 to param7.
        to_camera: it is for the camera that is a component of its own, if there is one.
        older: what an older firmware knows instead, for a command that is sent.
        needs_answer: without an answer to it the commands after it are not sent.
    """

    command: int
    params: tuple[float, ...] = ()
    place: tuple[float, float, float] | None = None
    to_camera: bool = False
    older: EquipmentCommand | None = None
    needs_answer: bool = False


@dataclass(frozen=True)
class EquipmentRules:
    """The commands that a firmware expects for its equipment.

    Attributes:
        absent: by what may be missing ("camera", "gimbal", "gripper") the parameter that says so,
            and its value then. It is read and kept up to date.
        actuators: the outputs are those of DO_SET_ACTUATOR, not of DO_SET_SERVO. A mission has no
            NaN for the fifth and the sixth, so that it is not stored there.
        channel_max: the highest output.
        whole_degrees: a mission stores angles of a gimbal in whole degrees, and no rates.
        controlled_missions: a mission turns the gimbal only after it has taken the control of it.
        own_camera: photos are asked of the camera's own component, where one is heard; the
            autopilot does not pass them on.
        open_end: of several acts after the last waypoint of a mission only the first is done.
    """

    absent: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    actuators: bool = False
    channel_max: int = 32
    whole_degrees: bool = False
    controlled_missions: bool = False
    own_camera: bool = False
    open_end: bool = False

    def photo(self, number: int = 0) -> EquipmentCommand:
        """Take one photo; a number above 0 keeps a repeated command from taking another."""
        older = EquipmentCommand(mavlink.MAV_CMD_DO_DIGICAM_CONTROL, (0.0, 0.0, 0.0, 0.0, 1.0))
        params = (0.0, 0.0, 1.0, float(number))
        command = mavlink.MAV_CMD_IMAGE_START_CAPTURE
        return EquipmentCommand(command, params, to_camera=self.own_camera, older=older)

    def trigger_distance(self, distance_m: float) -> EquipmentCommand:
        """Take a photo now and each time that a distance was flown; 0 ends that."""
        params = (distance_m, 0.0, 1.0 if distance_m > 0.0 else 0.0)
        return EquipmentCommand(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, params)

    def control_gimbal(self, system: int, component: int) -> EquipmentCommand:
        """Take the primary control of the gimbal, without which a PX4 does not turn it.

        A PX4 that has no gimbal is silent to this, but accepts to point at a place.
        """
        params = (float(system), float(component), -1.0, -1.0)
        command = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
        return EquipmentCommand(command, params, needs_answer=True)

    def control_by_mission(self) -> EquipmentCommand:
        """Give the primary control of the gimbal to the autopilot, in whose name a mission acts."""
        params = (_ITSELF, _ITSELF, -1.0, -1.0)
        return EquipmentCommand(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, params)

    def point_angle(
        self, pitch_deg: float, yaw_deg: float, *, locked: bool, stored: bool = False
    ) -> EquipmentCommand:
        """Point the gimbal.

        Args:
            pitch_deg: above the horizon.
            yaw_deg: clockwise, from the nose, or from north.
            locked: whether the yaw is from north.
            stored: whether it is for a mission.
        """
        rate_deg_s = _AS_IT_IS
        if stored and self.whole_degrees:
            pitch_deg, yaw_deg, rate_deg_s = float(round(pitch_deg)), float(round(yaw_deg)), 0.0
        flags = float(_LOCKED if locked else _HORIZON)
        mode = float(mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING)
        mount = (pitch_deg, 0.0, yaw_deg, 0.0, 0.0, 0.0, mode)
        older = EquipmentCommand(mavlink.MAV_CMD_DO_MOUNT_CONTROL, mount)
        params = (pitch_deg, yaw_deg, rate_deg_s, rate_deg_s, flags)
        command = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
        return EquipmentCommand(command, params, older=None if locked else older)

    def point_position(self, place: tuple[float, float, float]) -> EquipmentCommand:
        """Point the gimbal at a place (latitude and longitude, degrees; altitude AMSL, m)."""
        return EquipmentCommand(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, place=place)

    def point_vehicle(self, system: int) -> EquipmentCommand:
        """Point the gimbal at another vehicle, by its MAVLink system."""
        return EquipmentCommand(mavlink.MAV_CMD_DO_SET_ROI_SYSID, (float(system),))

    def release_gimbal(self) -> EquipmentCommand:
        """Give the control of the gimbal back."""
        params = (_RELEASE, _RELEASE, -1.0, -1.0)
        return EquipmentCommand(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, params)

    def report_gimbal(self) -> EquipmentCommand:
        """Report the angles of the gimbal five times a second."""
        params = (float(mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS), _REPORT_US)
        return EquipmentCommand(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, params)

    def end_position(self) -> EquipmentCommand:
        """Point the gimbal at no place any more."""
        return EquipmentCommand(mavlink.MAV_CMD_DO_SET_ROI_NONE)

    def point_neutral(self, *, stored: bool = False) -> EquipmentCommand:
        """Return the gimbal to its own default."""
        rate_deg_s = 0.0 if stored and self.whole_degrees else _AS_IT_IS
        mount = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, float(mavlink.MAV_MOUNT_MODE_NEUTRAL))
        older = EquipmentCommand(mavlink.MAV_CMD_DO_MOUNT_CONTROL, mount)
        params = (0.0, 0.0, rate_deg_s, rate_deg_s, float(_NEUTRAL))
        return EquipmentCommand(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, params, older=older)

    def gripper(self, *, grabs: bool) -> EquipmentCommand:
        """Close the first gripper, or open it."""
        action = mavlink.GRIPPER_ACTION_GRAB if grabs else mavlink.GRIPPER_ACTION_RELEASE
        return EquipmentCommand(mavlink.MAV_CMD_DO_GRIPPER, (1.0, float(action)))

    def servo(self, channel: int, pulse_us: int) -> EquipmentCommand:
        """Set an output, counted from 1, to a pulse width."""
        if not self.actuators:
            return EquipmentCommand(mavlink.MAV_CMD_DO_SET_SERVO, (float(channel), float(pulse_us)))
        values = [_AS_IT_IS] * 6
        values[channel - 1] = min(max((pulse_us - _MIDDLE_US) / _HALF_RANGE_US, -1.0), 1.0)
        return EquipmentCommand(mavlink.MAV_CMD_DO_SET_ACTUATOR, (*values, 0.0))

    def wait(self, time_s: float) -> EquipmentCommand:
        """Hold for a time, in a mission."""
        return EquipmentCommand(mavlink.MAV_CMD_NAV_DELAY, (time_s, -1.0, -1.0, -1.0))
