"""The status of this computer and Remote ID on the vehicle's link, where they are set."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.publisher import Publisher
from sensor_msgs.msg import NavSatFix

from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_computer_status")]


@pytest.fixture(scope="module", params=["enabled", "disabled"])
def flight(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Flight, bool]]:
    parameters = [f"onboard_computer_status:={request.param}"]
    if request.param == "enabled":
        parameters += ["remote_id_serial_number:=1ABCD23", "remote_id_operator_position:=47 8 500"]
    options = [word for parameter in parameters for word in ("-p", parameter)]
    flight = Flight(tmp_path_factory.mktemp("computer"), "--ros-args", *options, "--")
    yield flight, request.param == "enabled"
    flight.close()


def test_it_reaches_the_link_where_it_is_enabled(flight: tuple[Flight, bool]) -> None:
    flown, is_enabled = flight

    def heartbeats() -> int:
        return len(flown.relay.from_server("HEARTBEAT"))

    before = heartbeats()
    flown.wait(lambda: heartbeats() >= before + 4, 30.0, "four HEARTBEATs, one a second")
    systems = flown.relay.from_server("OPEN_DRONE_ID_SYSTEM")
    assert len(systems) >= 2 if is_enabled else not systems
    assert all(abs(each.timestamp + 1_546_300_800 - time.time()) < 3600.0 for each in systems)
    assert bool(flown.relay.from_server("OPEN_DRONE_ID_BASIC_ID")) is is_enabled
    statuses = flown.relay.from_server("ONBOARD_COMPUTER_STATUS")
    if not is_enabled:
        assert statuses == []
        return
    assert len(statuses) >= 2
    assert statuses[-1].uptime > statuses[0].uptime > 0
    assert 0 < statuses[-1].ram_usage < statuses[-1].ram_total
    assert any(load <= 100 for load in statuses[-1].cpu_cores)


def test_the_operator_may_move_and_an_old_position_has_its_age(flight: tuple[Flight, bool]) -> None:
    flown, is_enabled = flight
    if not is_enabled:
        return
    statuses: list[DiagnosticStatus] = []
    flown.subscribe(DiagnosticArray, "/diagnostics", lambda m: statuses.extend(m.status), 10)
    publisher = flown.advertise(NavSatFix, f"{SERVER_NODE_NAME}/operator_position", 10)
    flown.wait(lambda: publisher.get_subscription_count() > 0, 20.0, "the subscription")
    fix = NavSatFix(latitude=-35.25, longitude=149.125, altitude=602.5)
    flown.wait(lambda: _sent_after(publisher, fix, flown), 20.0, "the measured position")
    bad = NavSatFix(latitude=math.nan, longitude=149.0, altitude=600.0)
    publisher.publish(bad)
    assert flown.server is not None
    server = flown.server
    flown.wait(lambda: "latitude nan" in server.text, 10.0, "a warning")
    old = "the operator's position is"
    flown.wait(lambda: any(old in each.message for each in statuses), 30.0, "its age")
    system = flown.relay.from_server("OPEN_DRONE_ID_SYSTEM")[-1]
    assert (system.operator_latitude, system.operator_location_type) == (-352500000, 1)


def _sent_after(publisher: Publisher, fix: NavSatFix, flown: Flight) -> bool:
    publisher.publish(fix)
    sent = flown.relay.from_server("OPEN_DRONE_ID_SYSTEM")
    return bool(sent) and sent[-1].operator_location_type == 1
