"""Two servers on two hosts keep their vehicles apart, also when the network between them is cut."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from drone_navigation.processes import ros_environment
from tests.support.links.hosts import Host, Network, NoNamespacesError, networked
from tests.support.processes import Process

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_hosts")]
DOMAIN = 1
READY_S, FLIGHT_S = 60.0, 120.0
TRIES = 3


class TwoServers:
    """Host `west` flies a, host `east` flies b, whose homes are 12 m apart."""

    def __init__(self, network: Network) -> None:
        self._environment = networked(ros_environment(DOMAIN))
        self.west, self.east = network.hosts
        self.processes: list[Process] = []
        self.server_of: dict[str, Process] = {}
        # 12 m on a parallel at 35 degrees south.
        for host, name, longitude in ((self.west, "a", 149.165230), (self.east, "b", 149.165362)):
            self._start(
                host, "vehicle", "mavlink_sitl", "--link", "udpout://127.0.0.1:14550",
                "--ready-after", "0.5", "--param", "GUID_TIMEOUT=1",
                "--home", f"-35.363261,{longitude},584,0",
            )  # fmt: skip
            self.serve(host, name)

    def serve(self, host: Host, name: str) -> None:
        """Start a vehicle's server."""
        peer = "b" if name == "a" else "a"
        server = self._start(
            host, "server", "drone_navigation.navigation_server", "--arming", "auto",
            "--link", "udpin://127.0.0.1:14550", "--ros-args", "-r", f"__ns:=/{name}",
            "-p", f"traffic_peers:=[/{peer}/navigation_server]",
        )  # fmt: skip
        server.wait_for("Position valid", READY_S)
        self.server_of[name] = server

    def _start(self, host: Host, name: str, *arguments: str) -> Process:
        process = host.process(name, ["python", "-m", *arguments], self._environment)
        self.processes.append(process)
        return process

    def fly(self, host: Host, name: str, east_m: float) -> Process:
        """Send a vehicle somewhere, from its own host; again if the machine had stood still."""
        for _ in range(TRIES):
            client = self._start(
                host, f"client of {name}", "drone_navigation.navigation_client", "--json",
                "--vehicle", name, "--goal", f"{east_m:g}", "0", "5",
            )  # fmt: skip
            sending = client.wait_for('"sending"', FLIGHT_S)
            after = client.lines.index(sending) + 1
            if '"NO_POSITION"' not in client.wait_for('"goal": 1', FLIGHT_S, after=after):
                break
        return client

    def close(self) -> None:
        for process in reversed(self.processes):
            process.stop(1.0)


@pytest.fixture
def servers() -> Iterator[TwoServers]:
    try:
        network = Network("west", "east")
    except NoNamespacesError as error:
        pytest.skip(f"No network namespaces of one's own here: {error}")
    two = None
    try:
        two = TwoServers(network)
        yield two
    finally:
        if two is not None:
            two.close()
        network.close()


@pytest.mark.night
def test_who_would_stand_on_another_waits_until_the_network_is_back_and_it_has_left(
    servers: TwoServers,
) -> None:
    # b goes up and stands; a is to stand 2 m from there, and waits.
    first = servers.fly(servers.east, "b", 0.0)
    first.wait_for('"SUCCESS"', FLIGHT_S)
    second = servers.fly(servers.west, "a", 10.0)
    second.wait_for("WAITING_FOR_TRAFFIC", FLIGHT_S)
    # Cut off, b goes nowhere that a has not agreed to, and a stays where it is.
    servers.east.unplug()
    third = servers.fly(servers.east, "b", 40.0)
    third.wait_for("WAITING_FOR_TRAFFIC", FLIGHT_S)
    assert not any('"SUCCESS"' in line for line in second.lines)
    servers.east.plug()
    third.wait_for('"SUCCESS"', FLIGHT_S)
    second.wait_for('"SUCCESS"', FLIGHT_S)


def test_nobody_enters_the_volume_of_a_killed_server_until_another_leads_its_vehicle_away(
    servers: TwoServers,
) -> None:
    first = servers.fly(servers.east, "b", 0.0)
    first.wait_for('"SUCCESS"', FLIGHT_S)
    servers.server_of["b"].signal(signal.SIGKILL)
    servers.server_of["b"].wait(10.0)
    second = servers.fly(servers.west, "a", 10.0)
    second.wait_for("WAITING_FOR_TRAFFIC", FLIGHT_S)
    servers.serve(servers.east, "b")
    assert not any('"SUCCESS"' in line for line in second.lines)
    third = servers.fly(servers.east, "b", 40.0)
    third.wait_for('"SUCCESS"', FLIGHT_S)
    second.wait_for('"SUCCESS"', FLIGHT_S)
