"""Two programs of ours at one simulated autopilot, over a bad link: each gets what is its own.

One is the computer on board, the other speaks as a ground station. Both ask for telemetry,
parameters, the fence and the time all the while, hear every answer that the autopilot gives, and
overhear what the other one sends.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from mavlink_sitl import LinkFaults, Simulation
from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.codec import Codec, mavlink
from mavlink_vehicle.events import (
    OperationFinished,
    OperationResult,
    StationAct,
    StationActed,
    VehicleEvent,
)
from mavlink_vehicle.mission_items import RELATIVE_ALT, MissionItem
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.flights.vehicle_pair import TICK_S

pytestmark = pytest.mark.wide


FAULTS = LinkFaults(loss=0.1, duplicate=0.1, delay_s=0.05, jitter_s=0.2)
ON_BOARD, ON_GROUND = (1, 191), (255, 190)
ACHIEVED = OperationResult.ACHIEVED


def items(count: int, z: float) -> list[MissionItem]:
    commands = [mavlink.MAV_CMD_NAV_TAKEOFF, *[mavlink.MAV_CMD_NAV_WAYPOINT] * (count - 1)]
    return [
        MissionItem(command, RELATIVE_ALT, x=473_977_420, y=85_455_940, z=z + number)
        for number, command in enumerate(commands)
    ]


class Station:
    """One program: its vehicle, its codec and what it was told."""

    def __init__(self, address: tuple[int, int]) -> None:
        self.vehicle = Vehicle(VehicleConfig(source_system=address[0], source_component=address[1]))
        self.codec = Codec(*address)
        self.events: list[VehicleEvent] = []
        self.vehicle.start(0.0)

    @property
    def acts(self) -> list[StationActed]:
        return [event for event in self.events if isinstance(event, StationActed)]

    def end(self, operation_id: int) -> OperationFinished | None:
        ends = [event for event in self.events if isinstance(event, OperationFinished)]
        return next((event for event in ends if event.operation_id == operation_id), None)


class Network:
    """A simulated autopilot and both stations on its link."""

    def __init__(self, autopilot: str, seed: int) -> None:
        config = SimulatedVehicleConfig(autopilot=autopilot, ready_after_s=1.0, faults=FAULTS)
        self.simulation = Simulation([config], seed=seed)
        self.board, self.ground = Station(ON_BOARD), Station(ON_GROUND)
        self.run_until(self._is_ready)

    def _is_ready(self) -> bool:
        return all(
            vehicle.state.prearm_ok is True
            and vehicle.state.position_valid
            and vehicle.state.mission is not None
            and vehicle.state.home is not None
            for vehicle in (self.board.vehicle, self.ground.vehicle)
        )

    def tick(self) -> None:
        self.simulation.run_for(TICK_S)
        now = self.simulation.time_s
        stations = (self.board, self.ground)
        for datagram in self.simulation.link.read_datagrams():
            for station in stations:
                for message in station.codec.decode(datagram):
                    station.vehicle.receive(message, now)
        for station, other in (stations, stations[::-1]):
            deadline = station.vehicle.next_deadline()
            if deadline is not None and deadline <= now:
                station.vehicle.handle_timer(now)
            for message in station.vehicle.messages_to_send():
                frame = station.codec.encode(message)
                self.simulation.link.write(frame)
                for heard in other.codec.decode(frame):
                    other.vehicle.overhear(heard, now)
            while (event := station.vehicle.next_event()) is not None:
                station.events.append(event)

    def run_until(self, condition: Callable[[], object], timeout_s: float = 90.0) -> None:
        end_s = self.simulation.time_s + timeout_s
        while not condition():
            assert self.simulation.time_s < end_s, (self.board.events[-5:], self.ground.events[-5:])
            self.tick()

    def finish(self, board: int, ground: int) -> tuple[OperationFinished, OperationFinished]:
        """Continue until both operations have ended."""
        self.run_until(lambda: self.board.end(board) and self.ground.end(ground))
        ends = self.board.end(board), self.ground.end(ground)
        assert ends[0] is not None
        assert ends[1] is not None
        return ends[0], ends[1]

    @property
    def now(self) -> float:
        return self.simulation.time_s


@pytest.fixture(params=["ardupilot", "px4"])
def network(request: pytest.FixtureRequest) -> Network:
    return Network(request.param, seed=7)


def test_both_read_the_same_mission_at_once(network: Network) -> None:
    board, ground = network.board.vehicle, network.ground.vehicle
    stored = items(6, 12.0)
    upload = board.missions.upload(stored, network.now)
    network.run_until(lambda: network.board.end(upload))
    assert network.board.end(upload).result is ACHIEVED  # type: ignore[union-attr]
    ends = network.finish(
        board.missions.download(network.now), ground.missions.download(network.now)
    )
    assert [end.result for end in ends] == [ACHIEVED, ACHIEVED], ends
    assert board.missions.stored == ground.missions.stored
    assert len(board.missions.stored or ()) == len(stored)
    assert board.stations.mission_change == ""


def test_the_same_command_at_once_is_confirmed_to_both(network: Network) -> None:
    board, ground = network.board.vehicle, network.ground.vehicle
    ends = network.finish(board.arm(network.now), ground.arm(network.now))
    assert [end.result for end in ends] == [ACHIEVED, ACHIEVED], ends


def test_both_get_the_parameters_the_fence_and_the_time(network: Network) -> None:
    vehicles = (network.board.vehicle, network.ground.vehicle)
    network.run_until(
        lambda: all(
            vehicle.timesync.round_trip_s is not None
            and vehicle.stored_lists.fence is not None
            and len(vehicle.parameters.values) > 2
            for vehicle in vehicles
        )
    )
    # Ten milliseconds of each tick there and back, and what the link adds.
    assert all(0.1 <= (vehicle.timesync.round_trip_s or 0.0) <= 0.6 for vehicle in vehicles)


def test_two_uploads_at_once_are_reported_by_their_results(network: Network) -> None:
    """A station whose mission is reported as stored has it stored; the second replaces it."""
    board, ground = network.board, network.ground
    ours, theirs = items(5, 12.0), items(3, 30.0)
    ends = network.finish(
        board.vehicle.missions.upload(ours, network.now),
        ground.vehicle.missions.upload(theirs, network.now),
    )
    assert ACHIEVED in [end.result for end in ends], ends
    for station, end, sent in ((board, ends[0], ours), (ground, ends[1], theirs)):
        if end.result is ACHIEVED:
            stored = station.vehicle.missions.stored
            assert [item.z for item in stored or ()] == [item.z for item in sent]
        else:
            assert station.vehicle.stations.mission_change == ""
    told = {act.act for act in board.acts}
    assert told <= {StationAct.REPLACED_MISSION, StationAct.CHANGED_ITEM}
    assert all(act.station == ON_GROUND for act in board.acts)
    assert all(act.station == ON_BOARD for act in ground.acts)


def test_who_replaces_our_mission_is_named_once(network: Network) -> None:
    board, ground = network.board, network.ground
    upload = board.vehicle.missions.upload(items(5, 12.0), network.now)
    network.run_until(lambda: board.end(upload))
    fresh_s = network.now
    network.run_until(lambda: board.vehicle.state.mission.time_s > fresh_s)  # type: ignore[union-attr]
    board.events.clear()
    replace = ground.vehicle.missions.upload(items(3, 30.0), network.now)
    network.run_until(lambda: ground.end(replace) and board.vehicle.stations.mission_change)
    acts = [act for act in board.acts if act.act is StationAct.REPLACED_MISSION]
    assert [act.station for act in acts] == [ON_GROUND]
    assert "3 items instead of 5" in board.vehicle.stations.mission_change
    board.events.clear()
    ground.vehicle.missions.clear(network.now)
    network.run_until(lambda: board.acts)
    assert [act.act for act in board.acts] == [StationAct.CLEARED_MISSION]
