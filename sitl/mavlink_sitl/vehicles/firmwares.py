"""Maps each personality to its firmware class. Part of `simulation` (the same layer)."""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane
from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
from mavlink_sitl.autopilot.px4.plane.plane import Px4Plane
from mavlink_sitl.autopilot.px4.rover.rover import Px4Rover
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.mavlink.codec import Encoder
from mavlink_sitl.mavlink.logs.dataflash import DataFlashLog
from mavlink_sitl.mavlink.logs.logbook import Logbook
from mavlink_sitl.mavlink.logs.ulog import ULog
from mavlink_sitl.mavlink.px4.server import Px4Server
from mavlink_sitl.mavlink.server import MavlinkServer, PoweredUp

_CLASSES: dict[str, type[Commander]] = {
    "copter": Copter,
    "px4copter": Px4Copter,
    "rover": Rover,
    "boat": Rover,
    "plane": Plane,
    "px4rover": Px4Rover,
    "px4boat": Px4Rover,
    "px4plane": Px4Plane,
}


def firmware_class(personality: Personality) -> type[Commander]:
    """The firmware that goes with a personality."""
    return _CLASSES[personality.kind]


def make_logbook(personality: Personality) -> Logbook:
    """Storage for the firmware's own logs."""
    return Logbook(ULog if issubclass(firmware_class(personality), Px4Vehicle) else DataFlashLog)


def make_servers(
    served: PoweredUp, encoders: Sequence[Encoder], roles: Sequence[str]
) -> list[MavlinkServer]:
    """The MAVLink side: one for all links, or with PX4 one for each of them."""
    firmware = served.firmware
    if not isinstance(firmware, Px4Vehicle):
        return [MavlinkServer(served, encoders)]
    servers = [
        Px4Server(served, firmware, encoder, role)
        for encoder, role in zip(encoders, roles, strict=True)
    ]
    for server in servers:
        server.peers = servers
    return list(servers)
