"""QGroundControl's way to "fully ready", played against the simulator without sockets.

The steps are those of its initial connect state machine, in its order, with its patience: a
request is repeated after a time-out and given up after two repeats. A rejection is an answer;
silence, and an acceptance without the message, are not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import LinkFaults, Simulation, VehicleConfig
from sitl_support.ground_station import GroundStation

Message = Any
LIMIT_S = 3.0
RETRY_S = 0.5
TRIES = 3
# A parameter of the list that did not come is asked for more often than anything else.
PARAMETER_TRIES = 6
IDENTITIES = [
    ("copter", "ardupilot"),
    ("rover", "ardupilot"),
    ("boat", "ardupilot"),
    ("plane", "ardupilot"),
    ("copter", "px4"),
    ("rover", "px4"),
    ("boat", "px4"),
    ("plane", "px4"),
]

CAPABILITIES = (
    mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mav.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
)
REFUSALS = (mav.MAV_RESULT_UNSUPPORTED, mav.MAV_RESULT_DENIED, mav.MAV_RESULT_FAILED)


class QGroundControl(GroundStation):
    """The connect sequence, step by step; a step that is not answered fails the test."""

    def ask(
        self, request: Message, done: Callable[[], bool], what: str, tries: int = TRIES
    ) -> None:
        """Send, repeat, give up."""
        for _ in range(tries):
            self.send(request)
            begin_s = self.now_s
            while self.now_s - begin_s < RETRY_S:
                if done():
                    return
                self.run(0.02, step_s=0.02)
        pytest.fail(f"no answer: {what}")

    def request_message(self, message_id: int, name: str, param2: float = 0.0) -> list[Message]:
        """REQUEST_MESSAGE: what came, or nothing when it was rejected."""
        begin = len(self.log)

        def found(kind: str) -> list[Message]:
            return [m for _, m in self.log[begin:] if m.get_type() == kind]

        def done() -> bool:
            acks = [m for m in found("COMMAND_ACK") if m.command == 512]
            if acks and acks[-1].result in REFUSALS:
                return True
            # pymavlink's classes lack some messages that a vehicle sends.
            return bool(acks) and bool(found(name) or found(f"UNKNOWN_{message_id}"))

        command = mav.MAVLink_command_long_message(1, 1, 512, 0, message_id, param2, 0, 0, 0, 0, 0)
        self.ask(command, done, f"REQUEST_MESSAGE {name}")
        return found(name)

    def parameters(self) -> dict[int, Message]:
        """PARAM_REQUEST_LIST, then each missing one by its index."""

        def by_index() -> dict[int, Message]:
            values = self.messages("PARAM_VALUE")
            return {m.param_index: m for m in values if m.param_index < m.param_count}

        def counted() -> int:
            values = [m for m in self.messages("PARAM_VALUE") if m.param_index < m.param_count]
            assert len({m.param_count for m in values}) <= 1, "the count changes"
            return values[0].param_count if values else -1

        self.ask(mav.MAVLink_param_request_list_message(1, 1), lambda: counted() > 0, "parameters")
        quiet_s, before = self.now_s, -1
        while len(by_index()) < counted() and self.now_s - quiet_s < RETRY_S:
            if len(by_index()) != before:
                quiet_s, before = self.now_s, len(by_index())
            self.run(0.02, step_s=0.02)
        for index in sorted(set(range(counted())) - set(by_index())):

            def arrived(index: int = index) -> bool:
                return index in by_index()

            request = mav.MAVLink_param_request_read_message(1, 1, b"", index)
            self.ask(request, arrived, f"parameter {index}", PARAMETER_TRIES)
        return by_index()

    def plan(self, mission_type: int) -> list[Message]:
        """MISSION_REQUEST_LIST and every item."""

        def counts() -> list[Message]:
            found = self.messages("MISSION_COUNT")
            return [m for m in found if m.mission_type == mission_type]

        request = mav.MAVLink_mission_request_list_message(1, 1, mission_type)
        self.ask(request, lambda: bool(counts()), f"MISSION_COUNT of list {mission_type}")
        items = []
        for seq in range(counts()[-1].count):

            def got(seq: int = seq) -> list[Message]:
                found = self.messages("MISSION_ITEM_INT")
                return [m for m in found if (m.seq, m.mission_type) == (seq, mission_type)]

            request = mav.MAVLink_mission_request_int_message(1, 1, seq, mission_type)

            def arrived(seq: int = seq) -> bool:
                return bool(got(seq))

            self.ask(request, arrived, f"item {seq} of list {mission_type}")
            items.append(got()[-1])
        self.send(mav.MAVLink_mission_ack_message(1, 1, 0, mission_type))
        return items

    def connect(self) -> None:
        """Everything, in order."""
        self.run_until(lambda: bool(self.messages("HEARTBEAT")), LIMIT_S)
        self.heartbeats(True)
        (version, *_) = self.request_message(148, "AUTOPILOT_VERSION")
        assert version.flight_sw_version != 0
        assert version.capabilities & CAPABILITIES == CAPABILITIES
        self.request_message(397, "COMPONENT_METADATA")
        self.all_modes()
        self.request_message(300, "PROTOCOL_VERSION")
        autopilot = self.last("HEARTBEAT").autopilot
        if autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA:
            self.send(mav.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
        self.check_parameters(self.parameters())
        for mission_type in (0, 1, 2):
            self.plan(mission_type)

    def all_modes(self) -> None:
        """AVAILABLE_MODES with param2 = 0: all of them, or a rejection."""
        modes = self.request_message(435, "AVAILABLE_MODES")
        if not modes:
            return
        self.run(0.1)
        for index in range(1, modes[0].number_modes + 1):
            if index not in {m.mode_index for m in self.messages("AVAILABLE_MODES")}:
                self.request_message(435, "AVAILABLE_MODES", float(index))
        one = self.request_message(435, "AVAILABLE_MODES", 1.0)
        assert one[-1].mode_index == 1
        assert self.last("HEARTBEAT").custom_mode in {
            m.custom_mode for m in self.messages("AVAILABLE_MODES")
        }

    def check_parameters(self, values: dict[int, Message]) -> None:
        """By name it is the same one as by index, twice."""
        assert values
        for index in (0, len(values) // 2, len(values) - 1):
            name = values[index].param_id
            begin = len(self.log)

            def arrived(begin: int = begin, name: str = name) -> bool:
                new = (m for _, m in self.log[begin:] if m.get_type() == "PARAM_VALUE")
                return any(m.param_id == name for m in new)

            request = mav.MAVLink_param_request_read_message(1, 1, name.encode(), -1)
            self.ask(request, arrived, f"parameter {name}")
            assert self.last("PARAM_VALUE").param_index in (index, 65535)

    def ready_to_fly(self) -> bool:
        """Whether the main tool bar shows the vehicle as ready to fly."""
        needed = ("GLOBAL_POSITION_INT", "SYS_STATUS", "EXTENDED_SYS_STATE", "BATTERY_STATUS")
        if not all(self.messages(kind) for kind in needed):
            return False
        # PX4 reports the check as healthy without counting it as enabled.
        health = self.last("SYS_STATUS").onboard_control_sensors_health
        return bool(health & mav.MAV_SYS_STATUS_PREARM_CHECK)


@pytest.mark.parametrize(("vehicle", "autopilot"), IDENTITIES, ids=str)
def test_it_is_satisfied_in_under_three_seconds(vehicle: str, autopilot: str) -> None:
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0)
    station = QGroundControl(Simulation([config], seed=1))
    station.connect()
    for message_id in (245, 242):
        station.command(511, message_id, 2e5)
    station.run_until(station.ready_to_fly, LIMIT_S)
    assert station.request_message(242, "HOME_POSITION")
    assert station.now_s < LIMIT_S


@pytest.mark.parametrize(("vehicle", "autopilot"), IDENTITIES, ids=str)
def test_it_gets_there_over_a_bad_link(vehicle: str, autopilot: str) -> None:
    """Repeats bring everything; how long it takes does not matter."""
    faults = LinkFaults(loss=0.05, duplicate=0.05, delay_s=0.02)
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0, faults=faults)
    QGroundControl(Simulation([config], seed=3)).connect()
