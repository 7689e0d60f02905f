"""A simulated flight that is recorded as the server records: both directions, and the notes."""

from __future__ import annotations

import math
from pathlib import Path

from mavlink_vehicle.codec import Codec, with_source
from mavlink_vehicle.io.tlog import TlogWriter
from navigation_bridge import notes
from navigation_bridge.goals.goal import Annotation
from tests.support.flights.simulated_flight import SimulatedFlight

EPOCH_S = 1_700_000_000.0
"""When the simulated recorder's clock began."""


BULK = {
    "ATTITUDE", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "EXTENDED_SYS_STATE", "SYS_STATUS",
    "BATTERY_STATUS", "GPS_RAW_INT", "CURRENT_MODE", "VFR_HUD", "TERRAIN_REPORT", "HOME_POSITION",
    "MISSION_CURRENT", "EKF_STATUS_REPORT", "ESTIMATOR_STATUS", "TIMESYNC", "SYSTEM_TIME",
    "SET_POSITION_TARGET_LOCAL_NED", "OBSTACLE_DISTANCE", "PARAM_VALUE",
}  # fmt: skip
"""Messages that come again and again; a small recording has them more rarely"""

IDLE = {
    "ODOMETRY", "SERVO_OUTPUT_RAW", "ATTITUDE_QUATERNION", "ALTITUDE", "HIGHRES_IMU", "RAW_IMU",
    "SCALED_PRESSURE", "RC_CHANNELS", "NAV_CONTROLLER_OUTPUT", "ATTITUDE_TARGET", "VIBRATION",
    "POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT", "WIND_COV", "DISTANCE_SENSOR",
}  # fmt: skip
"""Telemetry that nobody here listens to: every ten seconds is enough."""


class Recorder:
    """Writes what one flight says from now on, at the flight's time.

    With ``bulk_hz``, each kind of telemetry at most so often, as on a slow link.
    """

    def __init__(self, flight: SimulatedFlight, path: Path, bulk_hz: float = math.inf) -> None:
        """Begin; :meth:`close` must follow."""
        self._flight = flight
        self._writer = TlogWriter(path)
        self._notes = Codec(1, notes.COMPONENT_ID)
        self._bulk_s = 1.0 / bulk_hz
        self._next_s: dict[object, float] = {}
        flight.codec.frame_observer = self.write
        flight.on_sent = self.write
        flight.on_output = self._note

    def close(self) -> None:
        """End the recording."""
        self._writer.close()

    def write(self, frame: bytes) -> None:
        """Write a packet, unless one like it was written just before."""
        (message,) = Codec(255, 190).decode(frame) or (None,)
        now = self._flight.now
        if message is not None and self._bulk_s > 0.0 and message.get_type() in BULK | IDLE:
            values = message.to_dict()
            name = values.get("name", values.get("param_id"))
            kind = (message.get_srcComponent(), message.get_type(), name)
            if now < self._next_s.get(kind, 0.0):
                return
            self._next_s[kind] = now + (10.0 if message.get_type() in IDLE else self._bulk_s)
        self._writer.write(frame, EPOCH_S + now)

    def _note(self, output: object) -> None:
        if isinstance(output, Annotation):
            system_id = self._flight.vehicle.state.system_id or 1
            note = with_source(output.message, system_id, notes.COMPONENT_ID)
            self.write(self._notes.encode(note))
