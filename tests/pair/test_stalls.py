"""The machine hangs while the vehicle flies on: nothing that commands leaves on old knowledge.

In simulated time: the vehicle continues, and what it sends waits in the buffers of the machine.
When the server runs again, it reads a few of those messages at a time, as its driver does.
"""

from __future__ import annotations

from collections import deque

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import OperationResult, StoodStill
from navigation_bridge.clients.service_requests import Service
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.vehicle_pair import VehiclePair

pytestmark = pytest.mark.wide


SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
TICK_S = 0.01


class StallingFlight(SimulatedFlight):
    """A flight whose server can hang, and reads a bounded number of datagrams in each turn."""

    def __init__(self, autopilot: str, datagrams_a_turn: int) -> None:
        self._datagrams_a_turn = datagrams_a_turn
        self._waiting: deque[bytes] = deque()
        self.modes: list[tuple[float, str]] = []
        self.heartbeats_s: list[float] = []
        simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
        super().__init__(simulated=simulated)
        read = self.simulation.link.read_datagrams

        def read_some() -> list[bytes]:
            self._waiting.extend(read())
            count = min(self._datagrams_a_turn, len(self._waiting))
            return [self._waiting.popleft() for _ in range(count)]

        self.simulation.link.read_datagrams = read_some  # type: ignore[method-assign]

    def tick(self) -> None:
        super().tick()
        self._note_mode()
        beat_s = self.vehicle.state.last_heartbeat_s
        if beat_s is not None and beat_s not in self.heartbeats_s[-1:]:
            self.heartbeats_s.append(beat_s)

    def stall(self, seconds: float) -> None:
        """Let the vehicle fly on without the server."""
        end_s = self.now + seconds
        while self.now < end_s:
            self.now += TICK_S
            self.simulation.run_for(TICK_S)
            self._note_mode()

    def commanding(self, since_s: float) -> list[tuple[float, Message]]:
        """Return what was sent since a time that makes a vehicle do something."""
        return [
            (time_s, message)
            for time_s, message in self.sent
            if time_s > since_s
            and (
                message.get_type() in ("SET_POSITION_TARGET_LOCAL_NED", "SET_MODE")
                or (message.get_type() == "COMMAND_LONG" and message.command not in (511, 512))
            )
        ]

    def _note_mode(self) -> None:
        name = self.simulation.vehicles[0].firmware.mode.spec.name
        if not self.modes or self.modes[-1][1] != name:
            self.modes.append((self.now, name))


def under_way(autopilot: str, datagrams_a_turn: int, phase_s: float = 0.0) -> StallingFlight:
    """Fly towards a goal far away; the phase is against the HEARTBEATs of the vehicle."""
    flight = StallingFlight(autopilot, datagrams_a_turn)
    flight.ready()
    flight.fly_up()
    flight.send(60.0, 0.0, 3.0)
    flight.run_for(8.0 + phase_s)
    assert flight.truth()[1] > 2.0
    return flight


@pytest.mark.parametrize("datagrams_a_turn", [8, 1000])
@pytest.mark.parametrize("phase_s", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("stall_s", [1.1, 2.6])
def test_a_px4_that_left_offboard_while_we_hung_is_not_brought_back(
    stall_s: float, phase_s: float, datagrams_a_turn: int
) -> None:
    flight = under_way("px4", datagrams_a_turn, phase_s)
    flight.stall(stall_s)
    assert flight.modes[-1][1] != "OFFBOARD", "the firmware's failsafe did not act"
    hung_until_s, changes = flight.now, len(flight.modes)
    flight.run_for(8.0)
    assert flight.commanding(hung_until_s) == []
    assert len(flight.modes) == changes, flight.modes
    (end,) = flight.ends(f"{2:032x}")
    assert end.state.name == "ABORTED"
    assert any("was suspended" in str(line) for _, line in flight.outputs)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_short_hang_does_not_end_a_goal(autopilot: str) -> None:
    flight = under_way(autopilot, 4)
    flight.stall(0.6)
    end = flight.run_to_end(f"{2:032x}")
    assert end.code.value == "SUCCESS", end.message
    assert [name for _, name in flight.modes].count("OFFBOARD") <= 2


def test_a_pilot_who_took_over_while_we_hung_is_left_alone() -> None:
    flight = under_way("ardupilot", 2)
    flight.stall(1.3)
    flight.set_mode_as_pilot("LOITER")
    flight.stall(1.3)
    hung_until_s = flight.now
    flight.run_for(5.0)
    assert flight.commanding(hung_until_s) == []
    assert flight.modes[-1][1] == "LOITER"
    (end,) = flight.ends(f"{2:032x}")
    assert end.code.value == "PILOT_OVERRIDE"


def test_a_vehicle_that_is_still_ours_flies_on_once_its_mode_is_seen() -> None:
    flight = under_way("ardupilot", 2, 0.2)
    flight.stall(2.6)
    hung_until_s = flight.now
    beat_s = flight.vehicle.state.last_heartbeat_s
    flight.run_until(lambda: bool(flight.commanding(hung_until_s)), 3.0)
    assert flight.vehicle.state.last_heartbeat_s != beat_s
    assert not flight.vehicle.own_gap.is_open
    end = flight.run_to_end(f"{2:032x}")
    assert end.code.value == "SUCCESS", end.message


def test_a_service_that_is_called_right_after_a_hang_waits_for_the_mode() -> None:
    flight = under_way("ardupilot", 4, 0.2)
    flight.stall(2.6)
    hung_until_s = flight.now
    done = flight.serve(Service.HOLD)
    assert done.success, done.message
    (first_s, first), *_ = flight.commanding(hung_until_s)
    assert (first.get_type(), first.command) == ("COMMAND_LONG", SET_MODE)
    beats = [s for s in flight.heartbeats_s if hung_until_s < s <= first_s]
    assert beats, "nothing showed the mode before the command"


def lose(data: bytes, datagram: bool = True) -> None:
    """Lose what is sent."""


def test_a_command_without_an_answer_is_not_repeated_after_a_hang() -> None:
    """A pilot may have changed the mode meanwhile, and be heard only later."""
    pair = VehiclePair().ready()
    pair.simulation.link.write = lose  # type: ignore[method-assign]
    operation_id = pair.vehicle.change_mode("GUIDED", pair.now)
    pair.flush()
    pair.simulation.run_for(1.3)
    assert pair.copter.pilot_mode_change("LOITER")
    pair.simulation.run_for(1.3)
    begin = len(pair.sent)
    pair.run_for(3.0)
    sent = [m for _, m in pair.sent[begin:] if m.get_type() == "COMMAND_LONG"]
    assert SET_MODE not in [m.command for m in sent]
    assert pair.finish(operation_id).result is OperationResult.CANCELLED
    assert [event.gap_s for event in pair.all(StoodStill)] == [pytest.approx(2.6, abs=0.05)]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("phase_s", [0.0, 0.3, 0.6, 0.9])
def test_the_mode_is_seen_soon_after_a_hang_and_not_only_with_the_next_second(
    autopilot: str, phase_s: float
) -> None:
    flight = under_way(autopilot, 1000, phase_s)
    flight.stall(1.9)
    hung_until_s = flight.now
    flight.tick()
    assert flight.vehicle.own_gap.is_open
    flight.run_until(lambda: not flight.vehicle.own_gap.is_open, 2.0)
    assert flight.now - hung_until_s < 0.5
