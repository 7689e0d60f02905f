"""A server on a simulated clock that is missing, slow, quick, paused or started again."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock

from custom_interfaces.action import Navigate
from drone_navigation.qos import STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_clock")]

_PERIOD_S = 0.02


class SimulatedClock:
    """Publishes /clock at a rate of our time, beside the test.

    Attributes:
        rate: seconds of it in one of ours; 0: paused.
        now_s: its time.
    """

    def __init__(self, publisher: Any) -> None:
        """Begin to publish."""
        self.rate, self.now_s = 0.0, 1000.0
        self._publisher = publisher
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._publish)
        self._thread.start()

    def _publish(self) -> None:
        last_s = time.monotonic()
        while not self._ends.wait(_PERIOD_S):
            now_s = time.monotonic()
            self.now_s += self.rate * (now_s - last_s)
            last_s = now_s
            message = Clock()
            message.clock.sec = int(self.now_s)
            message.clock.nanosec = int((self.now_s - int(self.now_s)) * 1e9)
            self._publisher.publish(message)

    def close(self) -> None:
        """Stop."""
        self._ends.set()
        self._thread.join()


class Flown:
    """A flight with its odometry's stamps."""

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        self.stamps_s: list[float] = []
        flight.subscribe(Odometry, f"{SERVER_NODE_NAME}/odometry", self._take, STREAM_QOS)

    def _take(self, message: Odometry) -> None:
        stamp = message.header.stamp
        self.stamps_s.append(stamp.sec + 1e-9 * stamp.nanosec)

    def fly(self, north_m: float) -> None:
        """Fly there, with a pause; everything is answered, whatever the clock does."""
        flight = self.flight
        goal = Navigate.Goal()
        goal.target_pose.header.frame_id = "map"
        goal.target_pose.pose.position.y = north_m
        goal.target_pose.pose.position.z = 4.0
        goal.target_pose.pose.orientation.w = 1.0
        self.stamps_s.clear()
        record = flight.send(goal)
        flight.wait_for_status(record, "NAVIGATING")
        assert flight.call("pause").success
        flight.wait_for_status(record, "PAUSED")
        assert flight.call("resume").success
        flight.wait(lambda: record.result is not None, FLIGHT_TIMEOUT_S, "the end")
        assert record.result.message.startswith("SUCCESS"), record.result.message
        assert len(record.feedback) > 5
        assert len(self.stamps_s) > 10


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flown]:
    folder = tmp_path_factory.mktemp("clock")
    flight = Flight(folder, "--ros-args", "-p", "use_sim_time:=true", "--")
    yield Flown(flight)
    flight.close()


def test_goals_are_flown_and_answered_whatever_the_simulated_clock_does(flown: Flown) -> None:
    """Only stamps follow it."""
    flown.fly(4.0)
    assert set(flown.stamps_s) == {0.0}  # nobody publishes it
    clock = SimulatedClock(flown.flight.advertise(Clock, "/clock", 10))
    try:
        for north_m, rate in ((0.0, 0.1), (4.0, 1.0), (0.0, 20.0), (4.0, 0.0)):
            clock.rate = rate
            flown.flight.spin_for(1.0)
            began_s, begun_s = clock.now_s, time.monotonic()
            flown.fly(north_m)
            lasted_s = time.monotonic() - begun_s
            least_s, most_s = min(flown.stamps_s), max(flown.stamps_s)
            # A sample may be measured, and the clock be heard, a little earlier.
            assert began_s - max(rate, 1.0) <= least_s <= most_s <= clock.now_s
            assert most_s - least_s <= rate * lasted_s + 0.5
        clock.now_s, clock.rate = 5.0, 1.0
        flown.flight.spin_for(1.0)
        flown.fly(0.0)
        assert max(flown.stamps_s) < 500.0
    finally:
        clock.close()
