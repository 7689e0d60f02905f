"""Links: UDP, TCP, serial, and recordings."""

from __future__ import annotations

from mavlink_vehicle.io.links.link import Link, Peer, Report, no_report
from mavlink_vehicle.io.links.tcp import TcpInLink, TcpOutLink
from mavlink_vehicle.io.links.tlog_replay import TlogLink
from mavlink_vehicle.io.links.udp import UdpLink
from mavlink_vehicle.io.links.url import LinkKind, LinkUrl, parse_url

__all__ = ["Link", "LinkKind", "LinkUrl", "Peer", "Report", "open_link", "parse_url"]


def open_link(url: str, report: Report = no_report, warn: Report | None = None) -> Link:
    """Open a link.

    A UDP port or a listener must be free now; a TCP peer and a serial device may come later
    and go away, and are opened again and again.

    Args:
        url: as MAVSDK writes it (`udpin://127.0.0.1:14550`, `udpout://`, `tcpout://`,
            `tcpin://`, `serial:///dev/ttyACM0:57600`) or as pymavlink does
            (`udpin:127.0.0.1:14550`, `tcp:127.0.0.1:5760`, `/dev/ttyACM0,57600`), or
            `tlog:PATH` to replay a recording.
        report: takes sentences about what happens to the link.
        warn: takes those about a link that is lost or cannot be opened yet; ``report`` if None.

    Raises:
        LinkError: it is badly written or cannot be opened; the sentence says what to do.
    """
    parsed, warn = parse_url(url), warn or report
    if parsed.kind in (LinkKind.UDP_IN, LinkKind.UDP_OUT):
        return UdpLink(parsed, report, warn)
    if parsed.kind is LinkKind.TCP_OUT:
        return TcpOutLink(parsed, report, warn)
    if parsed.kind is LinkKind.TCP_IN:
        return TcpInLink(parsed, report, warn)
    if parsed.kind is LinkKind.SERIAL:
        # pyserial is for those who have such a link.
        from mavlink_vehicle.io.links.serial_port import SerialLink  # noqa: PLC0415

        return SerialLink(parsed, report, warn)
    return TlogLink(parsed, report, warn)
