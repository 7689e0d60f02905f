"""A pilot's transmitter: what the receiver gives, for vehicles of ArduPilot."""

from __future__ import annotations

from sitl_support.ground_station import GroundStation

ROLL, PITCH, THROTTLE, YAW = 1, 2, 3, 4


class Transmitter:
    """Sticks and switches that stay where they are put."""

    def __init__(self, station: GroundStation) -> None:
        self.station = station

    def put(self, channels: dict[int, int]) -> None:
        """Move channels, by their number from 1."""
        pulses = tuple(channels.get(n, 0) for n in range(1, 17))
        self.station.vehicle.firmware.pilot.receive(pulses)

    def move(self, channels: dict[int, int], seconds: float) -> None:
        """Move channels and let time pass."""
        self.put(channels)
        self.station.run(seconds)

    def hold_yaw(self, raw_us: int, seconds: float = 2.5) -> None:
        """Arm or disarm: the throttle is closed already."""
        self.move({YAW: raw_us}, seconds)
        self.move({YAW: 1500}, 0.2)
