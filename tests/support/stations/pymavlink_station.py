"""A ground station that is pymavlink's own connection: UDP, signing and all."""

from __future__ import annotations

import os
from typing import Any

from pymavlink import mavutil

# Read by mavutil when it is imported, which others may have done before.
os.environ["MAVLINK20"] = "1"
mavutil.set_dialect(mavutil.current_dialect)


class PymavlinkStation:
    """Speaks to a port of this machine as one system, signed if it has a key."""

    def __init__(self, port: int, key: bytes | None = None, system: int = 254) -> None:
        """Open a socket; the first message makes it known to the peer."""
        self.sent: list[bytes] = []
        self._link: Any = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{port}", source_system=system, source_component=190
        )
        if key is not None:
            self._link.setup_signing(key, sign_outgoing=True, link_id=system)

    def send(self, message: Any) -> None:
        """Send a message of pymavlink's."""
        packer = self._link.mav
        frame = bytes(message.pack(packer))
        packer.seq = (packer.seq + 1) % 256
        self.sent.append(frame)
        self.write(frame)

    def write(self, data: bytes) -> None:
        """Send bytes as they are."""
        self._link.write(data)

    def try_to_hear(self, name: str | list[str], timeout_s: float) -> Any:
        """Wait for a message of these kinds; None if none comes."""
        return self._link.recv_match(type=name, blocking=True, timeout=timeout_s)

    def hear(self, name: str | list[str], timeout_s: float = 10.0) -> Any:
        """Wait for a message of these kinds, which must be rightly signed if there is a key."""
        message = self.try_to_hear(name, timeout_s)
        assert message is not None, f"no {name} came"
        return message

    def upload(self, items: list[Any], mission_type: int = 0) -> None:
        """Store a list, which must be accepted."""
        dialect = mavutil.mavlink
        self.send(dialect.MAVLink_mission_count_message(1, 1, len(items), mission_type))
        while True:
            answer = self.hear(["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"])
            if (
                answer.mission_type != mission_type
                or answer.target_system != self._link.source_system
            ):
                continue
            if answer.get_type() == "MISSION_ACK":
                assert answer.type == dialect.MAV_MISSION_ACCEPTED
                return
            item = items[answer.seq]
            item.seq, item.mission_type = answer.seq, mission_type
            self.send(item)

    def close(self) -> None:
        """Close the socket."""
        self._link.close()
