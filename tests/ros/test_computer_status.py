"""The status of this computer and Remote ID on the vehicle's link, where they are set."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

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
