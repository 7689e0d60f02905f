"""Loss of the link, of the server and of the vehicle while a goal is flown."""

from __future__ import annotations

import math
import signal

import pytest
from action_msgs.msg import GoalStatus

from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_link")]


@pytest.fixture
def hovering(flight: Flight) -> Flight:
    """The vehicle at 4 m, and a server, whatever the test before has left."""
    assert flight.server is not None
    if flight.server.returncode is not None:
        restart(flight)
    result = flight.wait_for_result(flight.send(navigate_goal(0.0, 0.0, 4.0)))
    assert result.success, result.message
    return flight


def restart(flight: Flight) -> None:
    flight.server = flight.start_server()
    flight.server.wait_for("Position valid", READY_TIMEOUT_S)
    flight.renew_client()


@pytest.mark.night
def test_a_short_silence_is_reported_and_flown_through(hovering: Flight) -> None:
    flight = hovering
    record = flight.send(navigate_goal(30.0, 0.0, 4.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.relay.cut()
    flight.wait_for_status(record, "LINK_LOST")
    flight.relay.join()
    flight.wait_for_status(record, "NAVIGATING")
    result = flight.wait_for_result(record)
    assert result.success, result.message


@pytest.mark.night
def test_a_long_silence_ends_the_goal_and_does_not_revive_it(hovering: Flight) -> None:
    flight = hovering
    record = flight.send(navigate_goal(-30.0, 0.0, 4.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.relay.cut()
    result = flight.wait_for_result(record, 25.0)
    assert record.status == GoalStatus.STATUS_ABORTED
    assert result.message.startswith("LINK_LOST: ")

    rejected = flight.send(navigate_goal(0.0, 0.0, 4.0))
    assert rejected.accepted is False
    flight.wait(lambda: bool(flight.rejections), 5.0, "the reason of the rejection")
    assert flight.rejections[-1].startswith("NO_VEHICLE: ")

    sent = len(flight.relay.from_server("SET_POSITION_TARGET_LOCAL_NED"))
    flight.relay.join()
    flight.spin_for(3.0)
    assert len(flight.relay.from_server("SET_POSITION_TARGET_LOCAL_NED")) == sent
    again = flight.wait_for_result(flight.send(navigate_goal(0.0, 0.0, 4.0)))
    assert again.success, again.message


def test_a_killed_server_leaves_a_vehicle_that_stops_by_itself(hovering: Flight) -> None:
    flight = hovering
    record = flight.send(navigate_goal(60.0, 0.0, 4.0, speed=4.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.spin_for(3.0)
    assert flight.server is not None
    flight.server.signal(signal.SIGKILL)
    flight.server.stop()
    # docs/autopilots.md: ArduCopter follows the last velocity for 3 s and then stops.
    # Where the vehicle comes to rest it sways a little; on a busy machine it flies late, too.
    speeds_m_s = [math.inf]
    for _ in range(30):
        flight.spin_for(1.0)
        latest = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-5:]
        speeds_m_s = [math.hypot(each.vx, each.vy) / 100.0 for each in latest]
        if max(speeds_m_s) < 0.3:
            break
    assert max(speeds_m_s) < 0.3
    last = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1]
    assert last.relative_alt / 1000.0 == pytest.approx(4.0, abs=1.0)
    assert record.result is None

    restart(flight)
    again = flight.wait_for_result(flight.send(navigate_goal(5.0, 0.0, 4.0)))
    assert again.success, again.message


def test_a_stopped_server_stops_the_vehicle_and_ends_the_goal(hovering: Flight) -> None:
    flight = hovering
    record = flight.send(navigate_goal(-40.0, 0.0, 4.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.spin_for(2.0)
    assert flight.server is not None
    flight.server.signal(signal.SIGTERM)
    result = flight.wait_for_result(record, 20.0)
    assert record.status == GoalStatus.STATUS_ABORTED
    assert result.message.startswith("SHUTTING_DOWN: ")
    assert flight.server.wait(10.0) == 0
    left = flight.server.lines[-1]
    assert "[WARN]" in left
    assert "Vehicle left in the air, armed, in mode " in left
    last = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1]
    assert math.hypot(last.vx, last.vy) / 100.0 < 0.4
