"""Serial devices and usual ports of this machine, for a link on which nothing was heard."""

from __future__ import annotations

import os
import selectors
import socket
import time
from contextlib import ExitStack, suppress

from serial.tools.list_ports import comports

from mavlink_vehicle.io.links import LinkKind, LinkUrl

__all__ = ["links_with_mavlink", "serial_devices"]

UDP_PORTS = (14550, 14540, 14551)
"""Ground stations (ArduPilot, PX4), offboard programs (PX4), MAVProxy's second output"""
TCP_PORTS = (5760, 5762)
"""ArduPilot's SITL: its first and second serial port"""
_LOOPBACK, _ALL = "127.0.0.1", "0.0.0.0"
_LISTEN_S = 1.5
_SIZE_BYTES = 2048
_MAGIC = (0xFE, 0xFD)
"""First byte of a frame of MAVLink 1 and 2"""


def serial_devices() -> list[str]:
    """Return the serial devices of this machine: "/dev/ttyACM0 (may not be opened)"."""
    found = []
    # Ports of the mainboard are listed whether or not anything is there.
    for port in sorted(comports(), key=lambda each: each.device):
        if port.hwid in ("n/a", "PNP0501"):
            continue
        usable = os.access(port.device, os.R_OK | os.W_OK)
        about = port.description if usable else f"{port.description}; this user may not open it"
        found.append(f"{port.device} ({about})")
    return found


def links_with_mavlink(
    url: LinkUrl, udp_ports: tuple[int, ...] = UDP_PORTS, tcp_ports: tuple[int, ...] = TCP_PORTS
) -> list[str]:
    """Return other links on which MAVLink comes; sends nothing, and takes about a second.

    It listens on loopback; for a link that listens on all interfaces, on all of them.

    Args:
        url: the link on which nothing was heard.
        udp_ports: ports to listen on.
        tcp_ports: ports of this machine to connect to.
    """
    host = _ALL if url.kind is LinkKind.UDP_IN and url.is_exposed else _LOOPBACK
    found: set[str] = set()
    with ExitStack() as on_exit, selectors.DefaultSelector() as waiting:
        for port in udp_ports:
            probe = on_exit.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with suppress(OSError):  # another program has it
                probe.bind((host, port))
                waiting.register(probe, selectors.EVENT_READ, f"udpin://{host}:{port}")
        for port in tcp_ports:
            probe = on_exit.enter_context(socket.socket(socket.AF_INET, socket.SOCK_STREAM))
            with suppress(OSError):  # nobody listens there
                probe.connect((_LOOPBACK, port))
                waiting.register(probe, selectors.EVENT_READ, f"tcp://{_LOOPBACK}:{port}")
        until_s = time.monotonic() + _LISTEN_S
        while waiting.get_map() and (left_s := until_s - time.monotonic()) > 0.0:
            for key, _ in waiting.select(left_s):
                data = b""
                with suppress(OSError):
                    data = key.fileobj.recv(_SIZE_BYTES)  # type: ignore[union-attr]
                # A stream may begin in the middle of a frame; a datagram begins with one.
                if (data[:1] and data[0] in _MAGIC) or any(magic in data for magic in _MAGIC):
                    found.add(key.data)
                waiting.unregister(key.fileobj)
    return sorted(found - {str(url)})
