"""Traffic of a vehicle's link and a ROS domain: ``python -m tests.bench.bench_scaling --help``."""

from __future__ import annotations

import argparse
import json
import os
import struct
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import all as dialect

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from navigation_bridge import notes
from tests.bench.limits import READY_S
from tests.bench.rows import row
from tests.support.links.hosts import Host, Network, NoNamespacesError, networked

# A radio of 57,600 baud: ten bits to a byte (8N1).
RADIO_BYTES_S = 5760.0
_SERVER_COMPONENT = 191
_SETTLE_S = 5.0
_DOMAIN = 1
_PROBER = str(Path(__file__).with_name("discovery_prober.py"))
EXIT_NO_NAMESPACES = 3


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Measure the link of one vehicle in flight, with the rates that are set by default."""
    load = link_load(1.0 if short else 3.0, ())
    flown = sum(load["flying"].values()) / load["seconds"]
    return [
        row(
            "bytes on a vehicle's link in flight, both ways",
            (flown, "B/s"),
            ("a radio of 57,600 baud", RADIO_BYTES_S),
            "< 1 radio",
        )
    ]


# --- a vehicle's link --------------------------------------------------------------------


def link_load(seconds: float, parameters: tuple[str, ...]) -> dict[str, Any]:
    """Return the bytes of each message, "> NAME" to the vehicle and "< NAME" from it.

    Args:
        seconds: how long each part lasts.
        parameters: of the server, as NAME:=VALUE.

    Returns:
        ``seconds``, and ``idle`` and ``flying``: bytes by direction and message, in all.
    """
    port = free_udp_port()
    environment = ros_environment(free_domain(os.getpid()))
    given = [word for parameter in parameters for word in ("-p", parameter)]
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        log = Path(folder) / "flight.tlog"

        def start(name: str, *words: str) -> Process:
            process = Process(name, ["python", "-m", *words], environment)
            stack.callback(process.stop)
            return process

        server = start(
            "server", "drone_navigation.navigation_server", "--link", f"udpin://127.0.0.1:{port}",
            "--arming", "auto", "--tlog", str(log), "--ros-args", *given,
        )  # fmt: skip
        start("vehicle", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}")
        server.wait_for("Position valid", READY_S)
        idle = _window(2.0, seconds)
        client = start(
            "client", "drone_navigation.navigation_client", "--plain", "--goal", "200", "0", "5",
        )  # fmt: skip
        client.wait_for("NAVIGATING", READY_S)
        flying = _window(0.5, seconds)
        server.stop()
        frames = list(_frames(log.read_bytes()))
    return {
        "seconds": seconds,
        "idle": _bytes_in(frames, idle),
        "flying": _bytes_in(frames, flying),
    }


def _window(after_s: float, seconds: float) -> tuple[float, float]:
    """Let time pass; return from when to when, as the log counts it."""
    time.sleep(after_s)
    begin_s = time.time()
    time.sleep(seconds)
    return begin_s, begin_s + seconds


def _frames(log: bytes) -> Iterator[tuple[float, int, int, int]]:
    """Yield the time, component, message id and length of each frame of a telemetry log."""
    at = 0
    while at + 18 <= len(log):
        (stamp_us,) = struct.unpack_from(">Q", log, at)
        frame = log[at + 8 : at + 18]
        if frame[0] == 0xFD:
            length = 12 + frame[1] + (13 if frame[2] & 1 else 0)
            component, message = frame[6], int.from_bytes(frame[7:10], "little")
        else:
            length, component, message = 8 + frame[1], frame[4], frame[5]
        yield stamp_us / 1e6, component, message, length
        at += 8 + length


def _bytes_in(
    frames: list[tuple[float, int, int, int]], window: tuple[float, float]
) -> dict[str, int]:
    counts: Counter[str] = Counter()
    for stamp_s, component, message, length in frames:
        if window[0] <= stamp_s < window[1] and component != notes.COMPONENT_ID:
            way = ">" if component == _SERVER_COMPONENT else "<"
            counts[f"{way} {dialect.mavlink_map[message].msgname}"] += length
    return dict(counts)


def _print_link(seconds: float, parameters: tuple[str, ...]) -> None:
    load = link_load(seconds, parameters)
    for phase in ("idle", "flying"):
        rates = {name: count / load["seconds"] for name, count in load[phase].items()}
        for way, text in (("<", "from the vehicle"), (">", "to the vehicle")):
            rate = sum(value for name, value in rates.items() if name.startswith(way))
            print(f"{phase}, {text}: {rate:.0f} B/s, {100 * rate / RADIO_BYTES_S:.0f} % of a radio")
            for name, value in sorted(rates.items(), key=lambda item: -item[1]):
                if name.startswith(way) and value >= 1.0:
                    print(f"    {name[2:]:32} {value:7.0f} B/s")


# --- a domain ----------------------------------------------------------------------------


def domain_load(count: int, vehicles: int, seconds: float) -> dict[str, Any]:
    """Return what it costs a host to join a domain of ``count`` hosts with a server each.

    Args:
        count: of the servers.
        vehicles: of each server.
        seconds: how long the idle domain is looked at.

    Returns:
        ``found_s`` until all are found, ``found_bytes`` that came and went until
        everything has settled, ``idle_bytes_s`` after that, ``endpoints`` of a vehicle.

    Raises:
        NoNamespacesError: there can be no hosts here.
    """
    hosts = [f"s{number}" for number in range(count)]
    names = [f"{host}v{number}" for host in hosts for number in range(vehicles)]
    network = Network(*hosts, "desk")
    environment = networked(ros_environment(_DOMAIN))
    with ExitStack() as stack:
        stack.callback(network.close)
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        servers = []
        for host in network.hosts[:-1]:
            own = [name for name in names if name.startswith(f"{host.name}v")]
            servers.append(_server(host, own, folder, stack, environment))
        for server in servers:
            server.wait_for("ready on", READY_S)
        time.sleep(_SETTLE_S)
        desk = network.hosts[-1]
        before = sum(desk.counted())
        prober = desk.process(
            "prober", ["python", _PROBER, str(2 * _SETTLE_S + seconds), *names], environment
        )
        stack.callback(prober.stop)
        found = json.loads(prober.wait_for("found_s", READY_S))
        time.sleep(_SETTLE_S)
        settled = sum(desk.counted())
        time.sleep(seconds)
        idle = sum(desk.counted())
        endpoints = json.loads(prober.wait_for("endpoints", READY_S))["endpoints"]
    return {
        "found_s": found["found_s"],
        "found_bytes": settled - before,
        "idle_bytes_s": (idle - settled) / seconds,
        "endpoints": max(endpoints.values()),
    }


def goal_load(seconds: float) -> float:
    """Return the bytes per second between a server's host and a client's that flies one goal.

    Raises:
        NoNamespacesError: there can be no hosts here.
    """
    network = Network("s0", "desk")
    environment = networked(ros_environment(_DOMAIN))
    with ExitStack() as stack:
        stack.callback(network.close)
        base, desk = network.hosts
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        server = _server(base, ["a"], folder, stack, environment)
        vehicle = ["python", "-m", "mavlink_sitl", "--link", "udpout://127.0.0.1:14550"]
        stack.callback(base.process("vehicle", vehicle, environment).stop)
        server.wait_for("Position valid", READY_S)
        client = desk.process(
            "client",
            ["python", "-m", "drone_navigation.navigation_client", "--plain", "--goal", "200", "0",
             "5", "--vehicle", "a"],
            environment,
        )  # fmt: skip
        stack.callback(client.stop)
        client.wait_for("NAVIGATING", READY_S)
        before = sum(desk.counted())
        time.sleep(seconds)
        return (sum(desk.counted()) - before) / seconds


def _server(
    host: Host, names: list[str], folder: Path, stack: ExitStack, environment: dict[str, str]
) -> Process:
    settings: dict[str, Any] = {
        f"/{name}/navigation_server": {"ros__parameters": {"target_system": system}}
        for system, name in enumerate(names, 1)
    }
    own = {"vehicles": names, "vehicles_max": max(len(names), 1), "arming": "auto"}
    settings["navigation_server"] = {"ros__parameters": own}
    file = folder / f"{host.name}.yaml"
    file.write_text(json.dumps(settings), encoding="utf-8")  # JSON is YAML, too
    words = ["python", "-m", "drone_navigation.navigation_server", "--config", str(file)]
    process = host.process("server", words, environment)
    stack.callback(process.stop)
    return process


def _print_domain(counts: list[int], vehicles: int, seconds: float) -> None:
    print(f"{vehicles} vehicles a server; the machine has {os.cpu_count()} processors")
    print("servers  found after  to find them  then          endpoints of a vehicle")
    for count in counts:
        load = domain_load(count, vehicles, seconds)
        print(
            f"{count:7}  {load['found_s']:9.2f} s  {load['found_bytes'] / 1e3:9.0f} kB  "
            f"{load['idle_bytes_s']:7.0f} B/s  {load['endpoints']:9}",
            flush=True,
        )


def main() -> int:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True, metavar="PART")
    link = parts.add_parser("link", help="bytes of each message between a server and its vehicle")
    link.add_argument("--seconds", type=float, default=10.0, help="on the ground, and in flight")
    link.add_argument("-p", action="append", default=[], metavar="NAME:=VALUE", dest="parameters")
    domain = parts.add_parser("domain", help="time and bytes until a host has found all servers")
    domain.add_argument("--servers", type=int, nargs="+", default=[1, 2, 4, 8], metavar="N")
    domain.add_argument("--vehicles", type=int, default=1, metavar="N", help="of each server")
    domain.add_argument("--seconds", type=float, default=15.0, help="of the idle domain")
    goal = parts.add_parser("goal", help="bytes between a server's host and that of a client")
    goal.add_argument("--seconds", type=float, default=10.0, help="of the flight")
    options = parser.parse_args()
    try:
        if options.part == "link":
            _print_link(options.seconds, tuple(options.parameters))
        elif options.part == "domain":
            _print_domain(options.servers, options.vehicles, options.seconds)
        else:
            print(f"one goal in flight: {goal_load(options.seconds):.0f} B/s, both ways")
    except NoNamespacesError as error:
        print(f"No network namespaces of one's own here: {error}", file=sys.stderr)
        return EXIT_NO_NAMESPACES
    return 0


if __name__ == "__main__":
    sys.exit(main())
