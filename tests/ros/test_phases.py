"""Cancel and replacement before the vehicle flies."""

from __future__ import annotations

import pytest
from action_msgs.msg import GoalStatus

from tests.support.ros.ros_flight import Flight, GoalRecord, navigate_goal

# Landing by the pilot can come before what a test is about.
pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_phases")]


# How long a phase on the ground lasts hangs on when the next HEARTBEAT comes: it may be over
# before the cancel arrives. The same must hold for all of them.
@pytest.mark.night
@pytest.mark.parametrize("delay_s", [0.0, 0.1, 0.3, 1.0])
def test_a_cancel_on_the_ground_leaves_a_disarmed_vehicle(flight: Flight, delay_s: float) -> None:
    flight.ground()
    record = flight.send(navigate_goal(10.0, 0.0, 5.0))
    flight.spin_for(delay_s)
    flight.cancel(record)
    result = flight.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED, result.message
    assert record.statuses[-1:] != ["NAVIGATING"]
    flight.wait(lambda: not flight.is_armed, 5.0, "disarming")


def _climbing(flight: Flight, x: float, y: float, z: float, height_mm: int) -> GoalRecord:
    """Send a goal from the ground; return it above a height."""
    record = flight.send(navigate_goal(x, y, z))
    flight.wait_for_status(record, "TAKING_OFF")
    flight.wait(
        lambda: flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1].relative_alt > height_mm,
        20.0,
        "climbing",
    )
    return record


@pytest.mark.night
def test_a_cancel_while_climbing_holds_the_height(flight: Flight) -> None:
    flight.ground()
    record = _climbing(flight, 10.0, 0.0, 5.0, 800)
    flight.cancel(record)
    result = flight.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED, result.message
    height_m = result.final_pose.pose.position.z
    assert 0.5 < height_m < 2.6
    flight.spin_for(2.0)
    later_m = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1].relative_alt / 1000.0
    assert later_m == pytest.approx(height_m, abs=0.5)


@pytest.mark.night
def test_no_setpoint_is_sent_during_a_take_off(flight: Flight) -> None:
    flight.ground()
    before = len(flight.relay.from_server("SET_POSITION_TARGET_LOCAL_NED"))
    record = _climbing(flight, 4.0, 0.0, 2.0, 1000)
    assert record.feedback[-1].current_status == "TAKING_OFF"
    assert len(flight.relay.from_server("SET_POSITION_TARGET_LOCAL_NED")) == before
    result = flight.wait_for_result(record)
    assert result.success, result.message


def test_a_cancel_while_settling_is_canceled_or_came_too_late(flight: Flight) -> None:
    record = flight.send(navigate_goal(8.0, 0.0, 2.0))
    flight.wait_for_status(record, "SETTLING")
    answer = flight.cancel(record)
    flight.wait_for_result(record)
    if answer.goals_canceling:
        assert record.status == GoalStatus.STATUS_CANCELED
    else:
        assert record.status == GoalStatus.STATUS_SUCCEEDED
