"""Links on real sockets and a real pseudo-terminal; every wait has a limit."""

from __future__ import annotations

import errno
import os
import select
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links import Link, LinkKind, open_link, parse_url
from mavlink_vehicle.io.links.tcp import TcpInLink
from mavlink_vehicle.io.links.udp import MAX_PEERS, PEER_QUIET_S, UdpLink
from mavlink_vehicle.io.tlog import TlogWriter
from tests.support.processes import patient_s

LIMIT_S = patient_s(10.0)


def until(condition: Callable[[], bool], *links: Link) -> None:
    """Let the links work until something holds."""
    limit_s = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < limit_s, "it did not come about in time"
        numbers = [number for link in links for number in link.filenos()]
        select.select(numbers, [], [], 0.01)
        for link in links:
            link.poll(time.monotonic())


def collect(link: Link, wanted: bytes, *others: Link) -> bytes:
    """Receive until everything wanted has come."""
    received = b""

    def done() -> bool:
        nonlocal received
        received += b"".join(data for data, _ in link.receive())
        return len(received) >= len(wanted)

    until(done, link, *others)
    return received


@pytest.fixture
def opened() -> Iterator[Callable[..., Link]]:
    links: list[Link] = []

    def opener(url: str, *reports: Callable[[str], None]) -> Link:
        links.append(open_link(url, *reports))
        return links[-1]

    yield opener
    for link in links:
        link.close()
        link.close()  # twice is harmless
        assert link.filenos() == ()
        link.send(b"after the end")
        assert link.receive() == []


# URLs


@pytest.mark.parametrize(
    ("mavsdk", "pymavlink", "kind", "host", "port"),
    [
        ("udpin://0.0.0.0:14550", "udpin:0.0.0.0:14550", LinkKind.UDP_IN, "0.0.0.0", 14550),
        ("udp://127.0.0.1:14540", "udp:127.0.0.1:14540", LinkKind.UDP_IN, "127.0.0.1", 14540),
        ("udpout://10.0.0.2:14550", "udpout:10.0.0.2:14550", LinkKind.UDP_OUT, "10.0.0.2", 14550),
        ("tcp://localhost:5760", "tcp:localhost:5760", LinkKind.TCP_OUT, "localhost", 5760),
        ("tcpout://127.0.0.1:5760", "tcpout:127.0.0.1:5760", LinkKind.TCP_OUT, "127.0.0.1", 5760),
        ("tcpin://127.0.0.1:5760", "tcpin:127.0.0.1:5760", LinkKind.TCP_IN, "127.0.0.1", 5760),
        ("udpin://[::1]:14550", "UDPIN:[::1]:14550", LinkKind.UDP_IN, "::1", 14550),
        ("udpin://:14550", "udpin::14550", LinkKind.UDP_IN, "127.0.0.1", 14550),
    ],
)
def test_both_ways_of_writing_network_links(
    mavsdk: str, pymavlink: str, kind: LinkKind, host: str, port: int
) -> None:
    url = parse_url(mavsdk)
    assert parse_url(pymavlink) == url
    assert (url.kind, url.host, url.port) == (kind, host, port)
    assert parse_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "path", "baud"),
    [
        ("serial:///dev/ttyACM0:57600", "/dev/ttyACM0", 57600),
        ("serial:///dev/ttyACM0:921600", "/dev/ttyACM0", 921600),
        ("serial:///dev/ttyACM0", "/dev/ttyACM0", 57600),
        ("/dev/ttyUSB0,115200", "/dev/ttyUSB0", 115200),
        ("/dev/ttyUSB0", "/dev/ttyUSB0", 57600),
        ("/dev/serial/by-id/usb-Holybro_1:2", "/dev/serial/by-id/usb-Holybro_1", 2),
        ("COM3,57600", "COM3", 57600),
    ],
)
def test_both_ways_of_writing_serial_links(text: str, path: str, baud: int) -> None:
    url = parse_url(text)
    assert (url.kind, url.path, url.baud) == (LinkKind.SERIAL, path, baud)
    assert parse_url(str(url)) == url


@pytest.mark.parametrize(
    "text",
    [
        "", "   ", "udpin", "udpin:", "udpin://", "udpin://host", "udpin://host:port",
        "udpout://:14550", "tcp://:5760", "udpout://127.0.0.1:0", "udpin://127.0.0.1:70000",
        "http://127.0.0.1:80", "tlog:", "serial:", "serial:///dev/ttyACM0:0", "flight.tlog",
        "udpin://a b:1",
    ],
)  # fmt: skip
def test_what_is_not_a_link_gets_a_sentence_with_right_ones(text: str) -> None:
    with pytest.raises(LinkError, match=r"udpin://127\.0\.0\.1:14550") as error:
        open_link(text)
    assert repr(text) in str(error.value)


@given(st.text(max_size=30))
def test_no_text_does_more_than_that(text: str) -> None:
    try:
        url = parse_url(text)
    except LinkError:
        return
    assert parse_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("udpin://0.0.0.0:14550", ("beyond this machine", "Use 127.0.0.1")),
        ("udp://0.0.0.0:14550", ("udpin://0.0.0.0:14550 listens beyond this machine",)),
        ("tcpin://192.168.1.2:5760", ("beyond this machine",)),
        ("udpin://[::]:14550", ("beyond this machine",)),
        (
            "udp://:14550",
            (
                "udpin://127.0.0.1:14550 listens on this machine only.",
                "write udpin://0.0.0.0:14550.",
            ),
        ),
        ("udpin://:14550", ("this machine only", "udpin://0.0.0.0:14550")),
        ("tcpin://localhost:5760", ("this machine only", "tcpin://0.0.0.0:5760")),
        ("udpin://[::1]:14550", ("this machine only", "udpin://[::]:14550")),
    ],
)
def test_where_a_link_listens_is_recorded(text: str, words: tuple[str, ...]) -> None:
    note = parse_url(text).note
    assert note is not None
    for part in words:
        assert part in note


@pytest.mark.parametrize(
    "text", ["udpout://192.168.1.2:14550", "tcp://127.0.0.1:5760", "/dev/ttyACM0", "tlog:a.tlog"]
)
def test_a_link_that_does_not_listen_has_no_note(text: str) -> None:
    assert parse_url(text).note is None


@pytest.mark.parametrize(
    ("host", "bound"), [("", "127.0.0.1"), ("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "0.0.0.0")]
)
@pytest.mark.parametrize("scheme", ["udp", "udpin"])
def test_a_link_listens_where_its_note_says(
    opened: Callable[..., Link], scheme: str, host: str, bound: str
) -> None:
    link = opened(f"{scheme}://{host}:0")
    with socket.socket(fileno=os.dup(link.filenos()[0])) as same:
        assert same.getsockname()[0] == bound
    assert link.note is not None
    assert ("this machine only" in link.note) is (bound == "127.0.0.1")


# UDP


def test_udpin_learns_whom_to_answer_and_answers_all(opened: Callable[..., UdpLink]) -> None:
    reports: list[str] = []
    link = opened("udpin://127.0.0.1:0", reports.append)
    assert link.is_open
    assert not link.send(b"nobody hears this")
    peers = [opened(f"udpout://127.0.0.1:{link.port}") for _ in range(2)]
    for number, peer in enumerate(peers):
        peer.send(b"hello%d" % number)
    assert sorted([*collect(link, b"hello0hello1").split(b"hello")]) == [b"", b"0", b"1"]
    assert len(link.peers) == len(reports) == 2
    link.send(b"answer")
    for peer in peers:
        assert collect(peer, b"answer") == b"answer"


def test_udpin_turns_away_whom_it_has_no_room_for_until_somebody_is_silent(
    opened: Callable[..., UdpLink],
) -> None:
    """However many speak, those who spoke before them are still heard."""
    reports: list[str] = []
    link = opened("udpin://127.0.0.1:0", reports.append)
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(MAX_PEERS + 3)]
    for one in sockets:
        one.sendto(b"x", ("127.0.0.1", link.port))
        if len(link.peers) < MAX_PEERS:
            collect(link, b"x")
    assert link.receive() == []
    assert len(link.peers) == MAX_PEERS
    assert sum("rejected: too many peers" in report for report in reports) == 1
    first, last = link.peers[0], sockets[-1].getsockname()
    link.poll(PEER_QUIET_S)
    for one in sockets[1:MAX_PEERS]:
        one.sendto(b"y", ("127.0.0.1", link.port))
        collect(link, b"y")
    sockets[-1].sendto(b"z", ("127.0.0.1", link.port))
    collect(link, b"z")
    assert first not in link.peers
    assert last[1] in [peer[1] for peer in link.peers if peer is not None]
    for one in sockets:
        one.close()


def test_udpout_survives_that_nobody_listens(opened: Callable[..., UdpLink]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    link = opened(f"udpout://127.0.0.1:{port}")
    for _ in range(3):
        link.send(b"x")
        assert link.receive() == []
    listener = opened(f"udpin://127.0.0.1:{port}")
    link.send(b"now")
    assert collect(listener, b"now") == b"now"


def test_datagrams_stay_apart_and_a_flood_comes_in_portions(
    opened: Callable[..., UdpLink],
) -> None:
    link = opened("udpin://127.0.0.1:0")
    peer = opened(f"udpout://127.0.0.1:{link.port}")
    for number in range(100):
        peer.send(b"%03d" % number)
    portions: list[list[bytes]] = []

    def all_came() -> bool:
        portions.append([data for data, _ in link.receive()])
        return sum(map(len, portions)) == 100

    until(all_came, link)
    assert max(map(len, portions)) <= 64
    assert [int(d) for portion in portions for d in portion] == list(range(100))


def test_a_taken_port_and_an_unknown_host_are_said_plainly(
    opened: Callable[..., UdpLink],
) -> None:
    link = opened("udpin://127.0.0.1:0")
    with pytest.raises(LinkError, match=r"Cannot open udpin://127.0.0.1:.*in use"):
        open_link(f"udpin://127.0.0.1:{link.port}")
    with pytest.raises(LinkError, match=r"host 'no.such.host.invalid' is unknown"):
        open_link("udpout://no.such.host.invalid:14550")


# TCP


def test_tcp_passes_a_stream_both_ways_and_to_all(opened: Callable[..., TcpInLink]) -> None:
    listener = opened("tcpin://127.0.0.1:0")
    callers = [opened(f"tcpout://127.0.0.1:{listener.port}") for _ in range(2)]
    assert not callers[0].is_open
    assert not callers[0].send(b"dropped, as it isn't connected yet")
    until(lambda: all(caller.is_open for caller in callers), *callers)
    long = bytes(range(256)) * 40
    callers[0].send(long)
    assert collect(listener, long, *callers) == long
    until(lambda: not listener.receive() and len(listener.filenos()) == 3, listener)
    listener.send(b"to all")
    for caller in callers:
        assert collect(caller, b"to all") == b"to all"


def test_tcp_connects_when_the_peer_comes_and_again_when_it_comes_back(
    opened: Callable[..., TcpInLink],
) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    reports: list[str] = []
    warnings: list[str] = []

    def warn(text: str) -> None:
        reports.append(text)
        warnings.append(text)

    caller = opened(f"tcp:127.0.0.1:{port}", reports.append, warn)
    caller.poll(0.0)
    until(lambda: bool(reports), caller)
    assert "refused; retrying" in reports[0]
    for turn in range(2):
        listener = open_link(f"tcpin://127.0.0.1:{port}")
        until(lambda: caller.is_open, caller)
        caller.send(b"hello")
        assert collect(listener, b"hello", caller) == b"hello"
        listener.close()
        until(lambda: not (caller.receive() or caller.is_open), caller)
        assert reports[-1].endswith("the connection ended; retrying.")
        assert len(reports) <= 3 * (turn + 2)  # not one for each attempt
    assert warnings == [text for text in reports if text.endswith("retrying.")]
    assert any(text.endswith(": connected.") for text in reports)


def test_tcp_drops_whole_frames_when_the_peer_does_not_read(
    opened: Callable[..., TcpInLink],
) -> None:
    listener = opened("tcpin://127.0.0.1:0")
    caller = opened(f"tcpout://127.0.0.1:{listener.port}")
    until(lambda: caller.is_open, caller)
    until(lambda: not listener.receive() and len(listener.filenos()) == 2, listener)
    frame = b"<" + bytes(1022) + b">"
    taken = [listener.send(frame) for _ in range(20_000)]  # 20 MB: more than any buffer holds
    assert taken[0]
    assert not taken[-1]
    received = b""
    quiet = 0
    while quiet < 20:
        pieces = [data for data, _ in caller.receive()]
        received += b"".join(pieces)
        quiet = 0 if pieces else quiet + 1
        listener.send(b"")  # what was kept goes on its way
        select.select(caller.filenos(), [], [], 0.01)
    assert 0 < len(received) < 20_000 * len(frame)
    assert len(received) % len(frame) == 0
    assert received == frame * (len(received) // len(frame))


# Serial


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    master, slave = os.openpty()
    os.set_blocking(master, False)
    yield master, os.ttyname(slave)
    for number in (master, slave):
        try:
            os.close(number)
        except OSError:
            continue


def test_serial_passes_bytes_both_ways(
    opened: Callable[..., Link], terminal: tuple[int, str]
) -> None:
    master, name = terminal
    reports: list[str] = []
    link = opened(f"serial://{name}:57600", reports.append)
    assert link.filenos() == ()
    assert not link.send(b"dropped, as it isn't open yet")
    link.poll(0.0)
    assert link.is_open
    assert reports == [f"serial://{name}:57600: open."]
    os.write(master, b"\xfd\x00\x11\x13\n\r")  # binary: nothing may be translated
    assert collect(link, b"\xfd\x00\x11\x13\n\r") == b"\xfd\x00\x11\x13\n\r"
    link.send(b"\n\r\x03\xff")
    select.select([master], [], [], LIMIT_S)
    assert os.read(master, 100) == b"\n\r\x03\xff"


def test_an_unplugged_serial_port_is_reported_and_tried_again(
    opened: Callable[..., Link], terminal: tuple[int, str]
) -> None:
    master, name = terminal
    reports: list[str] = []
    warnings: list[str] = []
    link = opened(f"{name},115200", reports.append, warnings.append)
    link.poll(0.0)
    os.close(master)
    until(lambda: not (link.receive() or link.is_open), link)
    assert warnings == [f"serial://{name}:115200: the device is gone (cable, power); retrying."]
    assert link.filenos() == ()
    assert link.poll(50.0) is not None or link.is_open


def test_a_device_that_may_not_be_opened_is_one_sentence(
    opened: Callable[..., Link], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root, who may run the tests, may open everything."""
    device = tmp_path / "ttyACM0"
    device.touch()

    def denied(path: str, *_: object) -> int:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), path)

    monkeypatch.setattr("serial.serialposix.os.open", denied)
    reports: list[str] = []
    link = opened(f"serial://{device}:57600", reports.append)
    assert link.poll(0.0) == 1.0
    assert reports == [
        f"serial://{device}:57600: no permission (is the user in the group dialout?); retrying."
    ]


def test_a_missing_device_is_waited_for(opened: Callable[..., Link], tmp_path: Path) -> None:
    reports: list[str] = []
    link = opened(f"serial://{tmp_path}/ttyNONE:57600", reports.append)
    assert link.poll(0.0) == 1.0
    assert link.poll(0.5) == 1.0
    assert link.poll(1.0) == 2.0
    assert len(reports) == 1
    assert "no such device; retrying" in reports[0]


# Recordings


def test_a_recording_is_replayed_at_its_pace(opened: Callable[..., Link], tmp_path: Path) -> None:
    writer = TlogWriter(tmp_path / "flight.tlog")
    packets = [bytes([0xFD, 1, 0, 0, n, 1, 1, 0, 0, 0, 7, 0, 0]) for n in range(4)]
    for packet, time_s in zip(packets, (100.0, 100.0, 100.5, 103.0), strict=True):
        writer.write(packet, time_s)
    writer.close()
    link = opened(f"tlog:{tmp_path}/flight.tlog")
    assert link.filenos() == ()
    assert link.poll(10.0) == 10.0
    assert link.receive() == [(packet, None) for packet in packets[:2]]
    assert link.receive() == []
    assert link.poll(10.1) == pytest.approx(10.5)
    assert link.poll(10.6) == 10.6
    assert link.receive() == [(packet, None) for packet in packets[2:3]]
    assert link.poll(20.0) == 20.0
    assert link.receive() == [(packet, None) for packet in packets[3:]]
    assert link.poll(21.0) is None
    assert not link.is_open


@pytest.mark.parametrize("step_s", [-86_400.0, 86_400.0 * 400.0, -2.0e9])
def test_a_recorder_whose_clock_was_set_is_replayed_on(
    opened: Callable[..., Link], tmp_path: Path, step_s: float
) -> None:
    writer = TlogWriter(tmp_path / "flight.tlog")
    packets = [bytes([0xFD, 1, 0, 0, n, 1, 1, 0, 0, 0, 7, 0, 0]) for n in range(4)]
    for n, packet in enumerate(packets):
        writer.write(packet, 2.0e9 + n + (step_s if n > 1 else 0.0))
    writer.close()
    link = opened(f"tlog:{tmp_path}/flight.tlog")
    heard_s = []
    now: float | None = 10.0
    while now is not None:
        now = link.poll(now)
        heard_s += [now for _ in link.receive()]
    assert len(heard_s) == 4
    # A step back is no time; one forward is a silence, which is shortened.
    assert heard_s == pytest.approx(
        [10.0, 11.0, *((11.0, 12.0) if step_s < 0.0 else (131.0, 132.0))]
    )


def test_what_is_no_recording_is_said_plainly(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"Cannot read .*nothing.tlog: No such file"):
        open_link(f"tlog:{tmp_path}/nothing.tlog")
    (tmp_path / "notes.tlog").write_text("these are only some notes")
    with pytest.raises(LinkError, match="is not a tlog"):
        open_link(f"tlog:{tmp_path}/notes.tlog")
