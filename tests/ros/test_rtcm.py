"""RTCM corrections from a topic to the vehicle's link."""

from __future__ import annotations

import pytest
from std_msgs.msg import UInt8MultiArray

from tests.support.ros.ros_flight import Flight
from tests.unit.vehicle.test_rtcm import rtcm

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_rtcm")]


def test_corrections_of_the_topic_reach_the_link_and_others_are_rejected(flight: Flight) -> None:
    publisher = flight.advertise(UInt8MultiArray, "navigation_server/rtcm", 10)
    flight.wait(lambda: publisher.get_subscription_count() > 0, 20.0, "a subscription")
    publisher.publish(UInt8MultiArray(data=rtcm(400)))
    flight.wait(
        lambda: len(flight.relay.from_server("GPS_RTCM_DATA")) == 3, 10.0, "three fragments"
    )
    pieces = flight.relay.from_server("GPS_RTCM_DATA")
    assert b"".join(bytes(piece.data[: piece.len]) for piece in pieces) == rtcm(400)
    publisher.publish(UInt8MultiArray(data=b"not RTCM"))
    assert flight.server is not None
    flight.server.wait_for("RTCM corrections ignored: Byte 0 of 8", 10.0)
    assert len(flight.relay.from_server("GPS_RTCM_DATA")) == 3
