"""Sends one vehicle's usual telemetry to a UDP port, at its pace: ``PORT SECONDS``."""

from __future__ import annotations

import socket
import sys
import time

from mavlink_vehicle.codec import Codec, Message, make
from mavlink_vehicle.vehicle import DEFAULT_RATES_HZ

_VALUES: dict[str, dict[str, object]] = {
    "GLOBAL_POSITION_INT": {
        "lat": 473977420, "lon": 85455940, "alt": 488000, "relative_alt": 10000,
        "vx": 110, "vy": 220, "vz": -3, "hdg": 9000,
    },
    "LOCAL_POSITION_NED": {"x": 1.5, "y": 2.5, "z": -10.0, "vx": 1.1, "vy": 2.2, "vz": -0.03},
    "ATTITUDE": {"roll": 0.01, "pitch": 0.02, "yaw": 1.5, "rollspeed": 0.1, "pitchspeed": 0.1},
    "BATTERY_STATUS": {
        "voltages": [12600] + [65535] * 9, "current_battery": 2500, "battery_remaining": 87,
    },
    "SYS_STATUS": {
        "onboard_control_sensors_present": 0x1FFFFFFF,
        "onboard_control_sensors_health": 0x1FFFFFFF,
        "voltage_battery": 12600, "current_battery": 2500, "battery_remaining": 87,
    },
    "EXTENDED_SYS_STATE": {"landed_state": 2},
    "GPS_RAW_INT": {"fix_type": 6, "lat": 473977420, "lon": 85455940, "eph": 80, "epv": 90},
    "EKF_STATUS_REPORT": {"flags": 0x33F},
    "SYSTEM_TIME": {},
    "HOME_POSITION": {"latitude": 473977420, "longitude": 85455940, "altitude": 478000},
    "HEARTBEAT": {"type": 2, "autopilot": 3, "base_mode": 209, "custom_mode": 4},
}  # fmt: skip
_TIMED = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE", "SYSTEM_TIME")


def telemetry(seconds: int) -> list[tuple[float, bytes]]:
    """Return (time in seconds, frame) of one vehicle at the usual rates."""
    rates_hz = {"HEARTBEAT": 1.0, **DEFAULT_RATES_HZ}
    schedule = sorted(
        (number / rate_hz, name)
        for name, rate_hz in rates_hz.items()
        if name in _VALUES
        for number in range(int(seconds * rate_hz))
    )
    codec = Codec(1, 1)
    return [(time_s, codec.encode(_message(name, time_s))) for time_s, name in schedule]


def _message(name: str, time_s: float) -> Message:
    fields = dict(_VALUES[name])
    if name in _TIMED:
        fields["time_boot_ms"] = 10_000 + int(time_s * 1e3)
    return make(name, **fields)


def main() -> None:
    """Send."""
    port, seconds = int(sys.argv[1]), int(sys.argv[2])
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    frames = telemetry(seconds)
    start_s = time.monotonic()
    for time_s, frame in frames:
        time.sleep(max(0.0, start_s + time_s - time.monotonic()))
        sender.sendto(frame, ("127.0.0.1", port))
    sender.close()


if __name__ == "__main__":
    main()
