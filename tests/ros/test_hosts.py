"""Several hosts on one ROS domain, each with its server: what a cut cable does, and what not."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from typing import Any

import pytest

from drone_navigation.processes import Process, ros_environment
from tests.support.hosts import Host, Network, NoNamespacesError, networked

# What is cut off must stay so for longer than DDS remembers it: 20 s.
pytestmark = [pytest.mark.xdist_group("ros_hosts"), pytest.mark.timeout(180)]

# Nobody else is in these hosts' network.
DOMAIN = 1
READY_S, FLIGHT_S = 40.0, 90.0
# At 10 Hz and the 2 m/s of STEADY two feedbacks are 0.2 m apart; ten lost ones would be 2 m.
STEADY = ("--speed", "2")
STRIDE_MAX_M = 1.5


class Fleet:
    """Hosts `alone` and `base`, each with a server; `field` with the vehicle of `base`; `desk`."""

    def __init__(self, network: Network) -> None:
        self._environment = networked(ros_environment(DOMAIN))
        self._processes: list[Process] = []
        self.alone, self.base, self.field, self.desk = network.hosts
        try:
            self.servers = {
                "a": self._server(self.alone, "a", "127.0.0.1"),
                "b": self._server(self.base, "b", self.base.address),
            }
            self._vehicle(self.alone, "127.0.0.1")
            self._vehicle(self.field, self.base.address)
            for server in self.servers.values():
                server.wait_for("Position valid", READY_S)
        except BaseException:
            self.close()
            raise

    def _start(self, host: Host, name: str, *arguments: str) -> Process:
        process = host.process(name, ["python", "-m", *arguments], self._environment)
        self._processes.append(process)
        return process

    def _server(self, host: Host, name: str, address: str) -> Process:
        return self._start(
            host, "server", "drone_navigation.navigation_server",
            "--link", f"udpin://{address}:14550", "--arming", "auto",
            "--ros-args", "-r", f"__ns:=/{name}",
            "-p", "heartbeat_timeout_s:=1.5", "-p", "link_lost_abort_s:=4.0",
        )  # fmt: skip

    def _vehicle(self, host: Host, server: str) -> None:
        link = f"udpout://{server}:14550"
        self._start(host, "vehicle", "mavlink_sitl", "--link", link, "--ready-after", "0.5")

    def fly(self, name: str, east_m: float, *options: str) -> Process:
        """Send vehicle ``name`` to a point in the east, from the desk."""
        return self._start(
            self.desk, f"client of {name}", "drone_navigation.navigation_client", "--json",
            "--goal", f"{east_m:g}", "0", "3", *options, "--ros-args", "-r", f"__ns:=/{name}",
        )  # fmt: skip

    def close(self) -> None:
        for process in reversed(self._processes):
            process.stop(1.0)


@pytest.fixture(scope="module")
def fleet() -> Iterator[Fleet]:
    try:
        network = Network("alone", "base", "field", "desk")
    except NoNamespacesError as error:
        pytest.skip(f"No network namespaces of one's own here: {error}")
    try:
        fleet = Fleet(network)
        yield fleet
        fleet.close()
    finally:
        network.close()


def told(client: Process) -> list[dict[str, Any]]:
    return [json.loads(line) for line in client.lines if line.startswith("{")]


def said(client: Process) -> str:
    return "\n".join(each["text"] for each in told(client) if each["event"] == "said")


def end(client: Process) -> str:
    """Return the code of the goal's end; empty if none was told."""
    return "".join(each["code"] for each in told(client) if each["event"] == "ended")


def wait_for_flight(client: Process) -> None:
    client.wait_for('"status": "NAVIGATING"', READY_S)


def assert_never_noticed(client: Process) -> None:
    """It arrived, heard no silence and missed no part of the way."""
    assert client.wait(FLIGHT_S) == 0, client.text
    assert "No word" not in said(client)
    way = [
        each["position_enu_m"]
        for each in told(client)
        if each["event"] == "feedback" and each["status"] == "NAVIGATING"
    ]
    assert len(way) > 20
    assert max(math.dist(*pair) for pair in itertools.pairwise(way)) < STRIDE_MAX_M


def test_a_host_that_is_cut_off_flies_on_and_tells_the_end_later(fleet: Fleet) -> None:
    # The one that is not cut off flies longer than DDS remembers the one that is: 20 s.
    other = fleet.fly("b", 46.0, *STEADY)
    cut = fleet.fly("a", 12.0, *STEADY, "--lost-timeout", "120")
    wait_for_flight(other)
    wait_for_flight(cut)
    fleet.alone.unplug()
    try:
        fleet.servers["a"].wait_for("SUCCEEDED", FLIGHT_S)
        assert end(cut) == ""
        cut.wait_for("No word from the server for 5 s", READY_S)
        assert_never_noticed(other)
    finally:
        fleet.alone.plug()
    assert cut.wait(READY_S) == 0, cut.text
    assert end(cut) == "SUCCESS"
    assert "The server is heard again" in said(cut)
    again = fleet.fly("a", 0.0)
    assert again.wait(FLIGHT_S) == 0, again.text


def test_a_vehicle_that_is_cut_off_ends_its_goal_and_no_other(fleet: Fleet) -> None:
    other = fleet.fly("a", 20.0, *STEADY)
    cut = fleet.fly("b", 0.0, *STEADY)
    wait_for_flight(other)
    wait_for_flight(cut)
    fleet.field.unplug()
    try:
        cut.wait_for('"status": "LINK_LOST"', READY_S)
        assert cut.wait(READY_S) == 1, cut.text
        assert end(cut) == "LINK_LOST"
    finally:
        fleet.field.plug()
    assert_never_noticed(other)
    again = fleet.fly("b", 40.0)
    assert again.wait(FLIGHT_S) == 0, again.text


def test_a_client_that_is_cut_off_gives_up_in_time_and_the_vehicle_arrives(fleet: Fleet) -> None:
    line = len(fleet.servers["b"].lines)
    cut = fleet.fly("b", 28.0, *STEADY, "--lost-timeout", "6")
    wait_for_flight(cut)
    fleet.desk.unplug()
    try:
        assert cut.wait(READY_S) == 5, cut.text
        fleet.servers["b"].wait_for("SUCCEEDED", FLIGHT_S, after=line)
    finally:
        fleet.desk.plug()
    assert end(cut) == ""
    assert "The server is gone: no word from it for 6 s. If only the network is cut" in said(cut)
