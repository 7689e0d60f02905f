"""Several hosts on one ROS domain, each with its server: what a cut cable does, and what not."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drone_navigation.processes import ros_environment
from tests.support.links.hosts import Host, Network, NoNamespacesError, networked
from tests.support.processes import Process

# A host that is cut off must stay so for longer than DDS remembers it: 20 s.
pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_hosts")]

# The network of these hosts is their own.
DOMAIN = 1
READY_S, FLIGHT_S = 40.0, 90.0
# At 10 Hz and the 2 m/s of STEADY two feedbacks are 0.2 m apart; ten lost ones would be 2 m.
STEADY = ("--speed", "2")
STRIDE_MAX_M = 1.5


# The settings of `pair`. Vehicles that keep apart wait when their servers' hosts are cut off from
# each other (test_traffic_hosts.py).
PAIR = """
navigation_server:
  ros__parameters:
    {vehicles: [a, d], link_url: "udpin://127.0.0.1:14550", separation: disabled}
/a/navigation_server: {ros__parameters: {target_system: 1}}
/d/navigation_server: {ros__parameters: {target_system: 2}}
"""


class Fleet:
    """Hosts with servers: `pair` flies a and d, `base` flies b, which is at `field`; and `desk`."""

    def __init__(self, network: Network, folder: Path) -> None:
        self._environment = networked(ros_environment(DOMAIN))
        self._processes: list[Process] = []
        self.network = network
        self.pair, self.base, self.field, self.desk = network.hosts
        try:
            settings = folder / "pair.yaml"
            settings.write_text(PAIR, encoding="utf-8")
            own = ["-r", "__ns:=/b"]
            for setting in (
                "heartbeat_timeout_s:=1.5", "link_lost_abort_s:=4.0", "separation:=disabled",
            ):  # fmt: skip
                own += ["-p", setting]
            link = f"udpin://{self.base.address}:14550"
            self.servers = {
                "a": self._server(self.pair, "--config", str(settings)),
                "b": self._server(self.base, "--link", link, "--ros-args", *own),
            }
            self._vehicles(self.pair, "127.0.0.1", 2)
            self._vehicles(self.field, self.base.address, 1)
            for name, vehicle in (("a", "a"), ("a", "d"), ("b", "b")):
                position = f"{vehicle}.navigation_server]: Position valid"
                self.servers[name].wait_for(position, READY_S)
        except BaseException:
            self.close()
            raise

    def _start(self, host: Host, name: str, *arguments: str, peers: str = "") -> Process:
        environment = {**self._environment, "ROS_STATIC_PEERS": peers}
        process = host.process(name, ["python", "-m", *arguments], environment)
        self._processes.append(process)
        return process

    def _server(self, host: Host, *options: str) -> Process:
        return self._start(
            host, "server", "drone_navigation.navigation_server", "--arming", "auto", *options
        )

    def _vehicles(self, host: Host, server: str, count: int) -> None:
        link = f"udpout://{server}:14550"
        options = ("--link", link, "--ready-after", "0.5", "--count", str(count))
        self._start(host, "vehicles", "mavlink_sitl", *options)

    def fly(self, name: str, *options: str, peers: str = "") -> Process:
        """Send vehicle ``name`` somewhere, from the desk."""
        module = "drone_navigation.navigation_client"
        words = ("--json", "--vehicle", name, *options)
        return self._start(self.desk, f"client of {name}", module, *words, peers=peers)

    def close(self) -> None:
        for process in reversed(self._processes):
            process.stop(1.0)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    try:
        network = Network("pair", "base", "field", "desk")
    except NoNamespacesError as error:
        pytest.skip(f"No network namespaces of one's own here: {error}")
    try:
        fleet = Fleet(network, tmp_path_factory.mktemp("hosts"))
        yield fleet
        fleet.close()
    finally:
        network.close()


def east(metres: float) -> tuple[str, ...]:
    """Return a goal at 3 m height."""
    return ("--goal", f"{metres:g}", "0", "3")


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
    assert "Server silent" not in said(client)
    way = [
        each["position_enu_m"]
        for each in told(client)
        if each["event"] == "feedback" and each["status"] == "NAVIGATING"
    ]
    assert len(way) > 20
    assert max(math.dist(*pair) for pair in itertools.pairwise(way)) < STRIDE_MAX_M


def test_where_multicast_is_dropped_peers_that_are_named_are_found(fleet: Fleet) -> None:
    # The first test: servers go on to announce themselves to a client whose goodbye was lost.
    here = east(0.0)
    fleet.network.drop_multicast(True)
    try:
        lost = fleet.fly("b", *here, "--server-timeout", "3")
        found = fleet.fly("b", *here, peers=fleet.base.address)
        assert lost.wait(READY_S) == 5, lost.text
        assert "No server offers" in said(lost)
        assert found.wait(FLIGHT_S) == 0, found.text
    finally:
        fleet.network.drop_multicast(False)


@pytest.mark.night
def test_a_host_that_is_cut_off_flies_on_and_reports_the_ends_later(fleet: Fleet) -> None:
    # The one that is not cut off flies longer than DDS remembers the one that is: 20 s.
    other = fleet.fly("b", *east(46.0), *STEADY)
    cut = [fleet.fly(name, *east(12.0), *STEADY, "--lost-timeout", "120") for name in ("a", "d")]
    for client in (other, *cut):
        wait_for_flight(client)
    fleet.pair.unplug()
    try:
        fleet.servers["a"].wait_for("ended: SUCCESS", FLIGHT_S)
        cut[0].wait_for("Server silent for 5 s", READY_S)
        assert_never_noticed(other)
        assert [end(client) for client in cut] == ["", ""]
    finally:
        fleet.pair.plug()
    for client in cut:
        assert client.wait(READY_S) == 0, client.text
        assert end(client) == "SUCCESS"
        assert "The server responds again" in said(client)
    again = fleet.fly("a", *east(0.0))
    assert again.wait(FLIGHT_S) == 0, again.text


def test_a_vehicle_that_is_cut_off_ends_its_goal_and_no_other(fleet: Fleet) -> None:
    other = fleet.fly("a", *east(20.0), *STEADY)
    # West: away from 0 and 46 m, where b is without and with the test before.
    cut = fleet.fly("b", *east(-30.0), *STEADY)
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
    again = fleet.fly("b", *east(40.0))
    assert again.wait(FLIGHT_S) == 0, again.text


def test_a_client_that_is_cut_off_gives_up_in_time_and_the_vehicle_arrives(fleet: Fleet) -> None:
    line = len(fleet.servers["b"].lines)
    cut = fleet.fly("b", *east(28.0), *STEADY, "--lost-timeout", "6")
    wait_for_flight(cut)
    fleet.desk.unplug()
    try:
        assert cut.wait(READY_S) == 5, cut.text
        fleet.servers["b"].wait_for("ended: SUCCESS", FLIGHT_S, after=line)
    finally:
        fleet.desk.plug()
    assert end(cut) == ""
    assert "Server lost: silent for 6 s. If only the network is down" in said(cut)
