"""The status of this computer from the server's vehicle to a simulated one, which flies on."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import common

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.io.this_computer import ComputerReader
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_status_each_second_reaches_the_vehicle_and_disturbs_no_flight(autopilot: str) -> None:
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    frames: list[bytes] = []
    flight.on_sent = frames.append
    reader, sender = ComputerReader(), flight.vehicle.computer_status
    sender.offer(reader.read())
    flight.tick()
    flight.ready()
    goal_id, began_s, offered = flight.send(5.0, 0.0, 4.0), flight.now, 0
    while not flight.ends(goal_id):
        assert flight.now < began_s + 120.0
        sender.offer(reader.read())
        offered += 1
        flight.run_for(1.0)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS"
    parser = common.MAVLink(None)
    kind = common.MAVLink_onboard_computer_status_message
    messages = [each for frame in frames for each in parser.parse_buffer(frame) or ()]
    arrived = [each for each in messages if isinstance(each, kind)]
    assert len(arrived) == offered
    uptimes_ms = [message.uptime for message in arrived]
    assert uptimes_ms == sorted(uptimes_ms)
    assert uptimes_ms[0] > 0
