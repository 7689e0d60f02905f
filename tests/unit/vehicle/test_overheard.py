"""Actions of other stations are reported once, with the sender; our own never are."""

from __future__ import annotations

import math
from typing import Any

import pytest

from mavlink_vehicle.codec import Codec, Message, mavlink
from mavlink_vehicle.events import StationAct, StationActed
from mavlink_vehicle.mission_items import RELATIVE_ALT, MissionItem
from mavlink_vehicle.protocols.stations.overheard import CROSSED_S, REPEAT_S, UPLOAD_S
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages

QGC = (255, 190)
AUTO, GUIDED, LOITER, BRAKE, RTL = 3, 4, 5, 17, 6
PX4_LOITER, PX4_MISSION, PX4_RTL = 0x03040000, 0x04040000, 0x05040000
VEHICLE: dict[str, Any] = {"target_system": 1, "target_component": 1}
CLEARED, REPLACED = StationAct.CLEARED_MISSION, StationAct.REPLACED_MISSION
PAUSED, CONTINUED = StationAct.PAUSED, StationAct.CONTINUED
MODE, ITEM = StationAct.CHANGED_MODE, StationAct.CHANGED_ITEM
WAYPOINT = mavlink.MAV_CMD_NAV_WAYPOINT
ITEMS = tuple(MissionItem(WAYPOINT, RELATIVE_ALT, x=5, y=number, z=9.0) for number in range(1, 4))


class Network:
    """A vehicle of ours, its autopilot's words, and stations that talk to it."""

    def __init__(self, autopilot: str = "ardupilot") -> None:
        self.px4 = autopilot == "px4"
        self.vehicle = Vehicle(VehicleConfig(message_rates_hz={}, timesync_interval_s=0.0))
        self.autopilot = AutopilotMessages()
        self.stations: dict[tuple[int, int], AutopilotMessages] = {}
        self.now = 0.0
        self.vehicle.start(0.0)
        kind = mavlink.MAV_AUTOPILOT_PX4 if self.px4 else mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        self.answer(self.autopilot.heartbeat(autopilot=kind))

    def message(self, name: str, station: tuple[int, int] = QGC, **fields: Any) -> Message:
        sender = self.stations.setdefault(station, AutopilotMessages(*station))
        return sender(name, **fields)

    def say(self, name: str, station: tuple[int, int] = QGC, **fields: Any) -> list[StationActed]:
        """A station says it to the vehicle; a system 0 is the vehicle's."""
        return self.overhear(self.message(name, station, **{**VEHICLE, **fields}))

    def overhear(self, *messages: Message) -> list[StationActed]:
        for message in messages:
            self.vehicle.overhear(message, self.now)
        return self.acts()

    def command(
        self, command: int, *params: float, station: tuple[int, int] = QGC, **more: Any
    ) -> list[StationActed]:
        named = {f"param{number}": value for number, value in enumerate(params, start=1)}
        return self.say("COMMAND_LONG", station, command=command, **named, **more)

    def answer(self, *messages: Message) -> list[StationActed]:
        for message in messages:
            self.vehicle.receive(message, self.now)
        return self.acts()

    def to_station(
        self, name: str, station: tuple[int, int] = QGC, **fields: Any
    ) -> list[StationActed]:
        """The autopilot answers a station."""
        target = {"target_system": station[0], "target_component": station[1]}
        return self.answer(self.autopilot(name, **target, **fields))

    def current(self, total: int, mission_id: int = 0, state: int = 3) -> Message:
        """MISSION_CURRENT with the number that the dialect lacks."""
        return current(self.autopilot, total, mission_id, state)

    def acts(self) -> list[StationActed]:
        self.vehicle.messages_to_send()
        events = []
        while (event := self.vehicle.next_event()) is not None:
            events.append(event)
        return [event for event in events if isinstance(event, StationActed)]

    def upload(self) -> None:
        """Our own mission is stored, by the conversation that an autopilot has with us."""
        home = () if self.px4 else (MissionItem(WAYPOINT),)
        stored = (*home, *ITEMS)
        us = {"target_system": 1, "target_component": 191}
        say = self.autopilot
        self.vehicle.missions.upload(ITEMS, self.now)
        for seq in range(len(stored)):
            self.answer(say("MISSION_REQUEST_INT", **us, seq=seq))
        self.answer(say("MISSION_ACK", **us, type=0))
        self.answer(say("MISSION_COUNT", **us, count=len(stored)))
        for seq, item in enumerate(stored):
            fields = item.message(seq, (1, 191)).to_dict()
            del fields["mavpackettype"]
            self.answer(say("MISSION_ITEM_INT", **fields))
        if not self.px4:
            self.answer(say.ack(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, 0))
        assert self.vehicle.operations.operation_id is None
        assert self.vehicle.missions.stored == ITEMS


def current(say: AutopilotMessages, total: int, mission_id: int = 0, state: int = 3) -> Message:
    message = say("MISSION_CURRENT", seq=1, total=total, mission_state=state, mission_mode=1)
    frame = bytearray(message.get_msgbuf())
    payload = bytes(frame[10 : 10 + frame[1]]).ljust(6, b"\0") + mission_id.to_bytes(4, "little")
    frame[1] = len(payload)
    extended = bytes(frame[:10]) + payload
    crc = mavlink.x25crc(extended[1:])
    crc.accumulate(bytes([type(message).crc_extra]))
    (decoded,) = Codec(1, 191).decode(extended + crc.crc.to_bytes(2, "little"))
    return decoded


@pytest.fixture
def network() -> Network:
    return Network()


def told(acts: list[StationActed]) -> list[tuple[StationAct, tuple[int, int] | None, str]]:
    return [(act.act, act.station, act.how) for act in acts]


# --- reports ----------------------------------------------------------------------------


@pytest.mark.parametrize("mission_type", [0, 255])
def test_clearing_is_reported_at_first_sight(network: Network, mission_type: int) -> None:
    acts = network.say("MISSION_CLEAR_ALL", mission_type=mission_type)
    assert told(acts) == [(CLEARED, QGC, "MISSION_CLEAR_ALL")]


@pytest.mark.parametrize("mission_type", [1, 2])
def test_clearing_the_fence_or_the_rally_points_leaves_the_mission(
    network: Network, mission_type: int
) -> None:
    assert network.say("MISSION_CLEAR_ALL", mission_type=mission_type) == []


@pytest.mark.parametrize(
    ("command", "params", "what", "how", "mode"),
    [
        (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (0.0,), PAUSED, "DO_PAUSE_CONTINUE 0", None),
        (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (1.0,), CONTINUED, "DO_PAUSE_CONTINUE 1", None),
        (mavlink.MAV_CMD_DO_SET_MODE, (1.0, BRAKE), PAUSED, "DO_SET_MODE BRAKE", BRAKE),
        (mavlink.MAV_CMD_DO_SET_MODE, (1.0, AUTO), CONTINUED, "DO_SET_MODE AUTO", AUTO),
        (mavlink.MAV_CMD_DO_SET_MODE, (1.0, GUIDED), CONTINUED, "DO_SET_MODE GUIDED", GUIDED),
        (mavlink.MAV_CMD_DO_SET_MODE, (1.0, LOITER), MODE, "DO_SET_MODE LOITER", LOITER),
        (mavlink.MAV_CMD_NAV_LOITER_UNLIM, (), MODE, "NAV_LOITER_UNLIM", LOITER),
        (mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, (), MODE, "NAV_RETURN_TO_LAUNCH", RTL),
        (mavlink.MAV_CMD_NAV_LAND, (), MODE, "NAV_LAND", 9),
        (mavlink.MAV_CMD_NAV_TAKEOFF, (), MODE, "NAV_TAKEOFF", None),
        (mavlink.MAV_CMD_MISSION_START, (), CONTINUED, "MISSION_START", None),
        (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (2.0,), ITEM, "DO_SET_MISSION_CURRENT 2", None),
        (
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
            (0.0, 21196.0),
            MODE,
            "COMPONENT_ARM_DISARM 0 (disarming by force)",
            None,
        ),
        (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, (1.0,), MODE, "DO_FLIGHTTERMINATION", None),
        (
            mavlink.MAV_CMD_DO_REPOSITION,
            (-1.0, 1.0, 0.0, math.nan, math.nan, math.nan, math.nan),
            PAUSED,
            "DO_REPOSITION without a position",
            None,
        ),
        (
            mavlink.MAV_CMD_DO_REPOSITION,
            (-1.0, 1.0, 0.0, math.nan, 47.0, 8.0, 500.0),
            MODE,
            "DO_REPOSITION to a position",
            GUIDED,
        ),
    ],
)
def test_commands_are_reported_by_their_meaning(
    network: Network,
    command: int,
    params: tuple[float, ...],
    what: StationAct,
    how: str,
    mode: int | None,
) -> None:
    assert network.command(command, *params) == [StationActed(what, QGC, how, mode, command)]


@pytest.mark.parametrize(
    ("command", "params"),
    [
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (1.0,)),
        (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, (0.0,)),
        (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (7.0,)),
        (mavlink.MAV_CMD_REQUEST_MESSAGE, (33.0,)),
        (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (33.0, 1e5)),
        (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, ()),
    ],
)
def test_what_does_not_touch_the_flight_is_not_reported(
    network: Network, command: int, params: tuple[float, ...]
) -> None:
    assert network.command(command, *params) == []


def test_commands_with_a_place_may_come_as_command_int(network: Network) -> None:
    nowhere = 0x7FFFFFFF
    reposition: dict[str, Any] = {
        "command": mavlink.MAV_CMD_DO_REPOSITION,
        "frame": 6,
        "param2": 1.0,
    }
    assert told(network.say("COMMAND_INT", **reposition, x=nowhere, y=nowhere)) == [
        (PAUSED, QGC, "DO_REPOSITION without a position")
    ]
    assert told(network.say("COMMAND_INT", **reposition, x=0, y=0)) == [
        (MODE, QGC, "DO_REPOSITION to a position")  # 0/0 is a place: a PX4 sets off for it
    ]


@pytest.mark.parametrize(
    ("main", "sub", "what", "how"),
    [
        (4, 3, PAUSED, "DO_SET_MODE AUTO.LOITER"),
        (4, 4, CONTINUED, "DO_SET_MODE AUTO.MISSION"),
        (6, 0, CONTINUED, "DO_SET_MODE OFFBOARD"),
        (4, 5, MODE, "DO_SET_MODE AUTO.RTL"),
        (3, 0, MODE, "DO_SET_MODE POSCTL"),
    ],
)
def test_a_px4s_modes_are_main_and_sub_mode(
    main: int, sub: int, what: StationAct, how: str
) -> None:
    network, custom_mode = Network("px4"), main << 16 | sub << 24
    set_mode = mavlink.MAV_CMD_DO_SET_MODE
    acts = network.command(set_mode, 1.0, float(main), float(sub))
    assert acts == [StationActed(what, QGC, how, custom_mode, set_mode)]
    network.now += 60.0
    acts = network.overhear(
        network.message("SET_MODE", target_system=1, base_mode=1, custom_mode=custom_mode)
    )
    assert acts == [StationActed(what, QGC, how.removeprefix("DO_"), custom_mode)]


def test_qgroundcontrols_standard_modes_are_those_of_the_px4() -> None:
    network = Network("px4")
    standard = mavlink.MAV_CMD_DO_SET_STANDARD_MODE
    mission = float(mavlink.MAV_STANDARD_MODE_MISSION)
    recovery = float(mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY)
    assert told(network.command(standard, mission)) == [
        (CONTINUED, QGC, "DO_SET_STANDARD_MODE AUTO.MISSION")
    ]
    assert network.command(standard, recovery) == [
        StationActed(MODE, QGC, "DO_SET_STANDARD_MODE AUTO.RTL", PX4_RTL, standard)
    ]


@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 3e38])
def test_nonsense_in_a_command_does_no_harm(value: float) -> None:
    for network in (Network(), Network("px4")):
        network.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, value)
        network.command(mavlink.MAV_CMD_DO_REPOSITION, *[value] * 7)
        network.command(mavlink.MAV_CMD_DO_SET_STANDARD_MODE, value)
        (act,) = network.command(mavlink.MAV_CMD_DO_SET_MODE, value, value, value)
        assert (act.act, act.mode, act.how) == (MODE, None, "DO_SET_MODE")


# --- who counts -------------------------------------------------------------------------


def test_the_autopilot_itself_and_we_are_no_stations(network: Network) -> None:
    # A PX4 sends COMMAND_LONG to component 0 on every link by itself.
    for nobody in ((1, 1), (1, 191)):
        assert network.say("MISSION_CLEAR_ALL", nobody) == []
        assert network.command(mavlink.MAV_CMD_NAV_LAND, station=nobody) == []
    assert network.overhear(network.autopilot("MISSION_CLEAR_ALL", **VEHICLE)) == []


@pytest.mark.parametrize("station", [(1, 190), (1, 195), (255, 190), (255, 191), (2, 1)])
def test_anybody_else_is_a_station_also_with_our_own_system_id(
    network: Network, station: tuple[int, int]
) -> None:
    (act,) = network.say("MISSION_CLEAR_ALL", station)
    assert act.station == station


@pytest.mark.parametrize("system", [0, 1])
@pytest.mark.parametrize("component", [0, 1])
def test_what_is_for_everybody_is_for_the_autopilot_too(
    network: Network, system: int, component: int
) -> None:
    target: dict[str, Any] = {"target_system": system, "target_component": component}
    assert len(network.command(mavlink.MAV_CMD_NAV_LAND, **target)) == 1


@pytest.mark.parametrize(("system", "component"), [(2, 1), (1, 100), (1, 154), (1, 191)])
def test_commands_to_others_are_nothing_to_us(
    network: Network, system: int, component: int
) -> None:
    target: dict[str, Any] = {"target_system": system, "target_component": component}
    assert network.command(mavlink.MAV_CMD_NAV_LAND, **target) == []
    assert network.say("MISSION_CLEAR_ALL", **target) == []


def test_stations_behind_the_vehicles_own_link_are_heard_as_well(network: Network) -> None:
    acts = network.answer(network.message("MISSION_CLEAR_ALL", **VEHICLE))
    assert told(acts) == [(CLEARED, QGC, "MISSION_CLEAR_ALL")]


def test_what_a_station_says_is_never_taken_for_the_vehicles_word(network: Network) -> None:
    before = network.vehicle.state
    as_autopilot = AutopilotMessages()
    network.overhear(as_autopilot.heartbeat(mode=RTL, armed=True), as_autopilot.position(5.0))
    assert network.vehicle.state is before


def test_before_the_vehicle_is_known_nothing_is_reported() -> None:
    vehicle = Vehicle()
    vehicle.start(0.0)
    vehicle.overhear(AutopilotMessages(*QGC)("MISSION_CLEAR_ALL", **VEHICLE), 0.0)
    assert vehicle.next_event() is None


# --- once each --------------------------------------------------------------------------


def test_repetitions_of_one_command_count_once(network: Network) -> None:
    pause = mavlink.MAV_CMD_DO_PAUSE_CONTINUE
    assert len(network.command(pause, 0.0)) == 1
    for confirmation in (1, 2, 3):
        network.now += 1.0
        assert network.command(pause, 0.0, confirmation=confirmation) == []
    network.now += REPEAT_S + 0.1
    assert len(network.command(pause, 0.0)) == 1


def test_what_comes_after_the_answer_is_another_wish(network: Network) -> None:
    """A station that clears, or pauses, two goals in a row means both."""
    pause = mavlink.MAV_CMD_DO_PAUSE_CONTINUE
    assert len(network.command(pause, 0.0)) == 1
    network.answer(network.autopilot.ack(mavlink.MAV_CMD_REQUEST_MESSAGE, 0))
    network.to_station("COMMAND_ACK", command=mavlink.MAV_CMD_REQUEST_MESSAGE)
    network.now += CROSSED_S + 0.1
    assert network.command(pause, 0.0) == [], "that was another command's answer"
    network.to_station("COMMAND_ACK", command=pause)
    network.now += CROSSED_S / 2.0
    assert network.command(pause, 0.0) == [], "it crossed the answer"
    network.now += CROSSED_S
    assert len(network.command(pause, 0.0)) == 1

    assert len(network.say("MISSION_CLEAR_ALL")) == 1
    network.now += 1.5
    assert network.say("MISSION_CLEAR_ALL") == []
    network.to_station("MISSION_ACK", type=0)
    network.now += CROSSED_S + 0.1
    assert len(network.say("MISSION_CLEAR_ALL")) == 1


def test_a_second_pause_after_resuming_counts(network: Network) -> None:
    pause = mavlink.MAV_CMD_DO_PAUSE_CONTINUE
    acts = [network.command(pause, float(value)) for value in (0, 1, 0, 1)]
    assert [act.act for (act,) in acts] == [PAUSED, CONTINUED, PAUSED, CONTINUED]


def test_a_packet_that_comes_twice_and_late_counts_once(network: Network) -> None:
    command = {**VEHICLE, "command": mavlink.MAV_CMD_DO_PAUSE_CONTINUE}
    pause = network.message("COMMAND_LONG", **command, param1=0.0)
    go_on = network.message("COMMAND_LONG", **command, param1=1.0)
    assert [act.act for act in network.overhear(pause, go_on, pause, go_on)] == [PAUSED, CONTINUED]


def test_two_stations_that_do_the_same_are_both_reported(network: Network) -> None:
    assert len(network.say("MISSION_CLEAR_ALL")) == 1
    (act,) = network.say("MISSION_CLEAR_ALL", (250, 190))
    assert act.station == (250, 190)


def test_a_crowd_of_stations_does_not_fill_the_memory(network: Network) -> None:
    for system in range(2, 250):
        network.say("MISSION_COUNT", (system, 190), count=3)
        network.say("MISSION_CLEAR_ALL", (system, 190))
    assert len(network.vehicle.stations.stations) == 32


def test_a_flood_of_jumps_is_cut_and_hides_no_pause(network: Network) -> None:
    told_s = []
    for number in range(2000):
        network.now += 0.002
        told_s += [network.now] * len(network.say("MISSION_SET_CURRENT", seq=number))
    assert len(told_s) == 20
    assert len(network.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0.0)) == 1
    assert len(network.say("MISSION_CLEAR_ALL")) == 1
    network.now += 20.0
    assert len(network.say("MISSION_SET_CURRENT", seq=1)) == 1


# --- another mission --------------------------------------------------------------------


@pytest.mark.parametrize("name", ["MISSION_REQUEST", "MISSION_REQUEST_INT"])
def test_another_mission_counts_when_the_vehicle_begins_to_take_it(
    network: Network, name: str
) -> None:
    assert network.say("MISSION_COUNT", count=5) == []
    assert told(network.to_station(name, seq=0)) == [(REPLACED, QGC, "MISSION_COUNT 5")]
    network.say("MISSION_COUNT", count=5)
    assert network.to_station(name, seq=0) == []
    assert network.to_station(name, seq=1) == []
    assert network.to_station("MISSION_ACK", type=0) == []


@pytest.mark.parametrize(
    ("autopilot", "count", "act"),
    [
        ("ardupilot", 0, CLEARED),
        ("ardupilot", 1, CLEARED),  # home alone, as MAVSDK clears it
        ("ardupilot", 2, REPLACED),
        ("px4", 0, CLEARED),
        ("px4", 1, REPLACED),
    ],
)
def test_an_empty_mission_clears_when_it_is_acknowledged(
    autopilot: str, count: int, act: StationAct
) -> None:
    network = Network(autopilot)
    assert network.say("MISSION_COUNT", count=count) == []
    acts = network.to_station("MISSION_ACK", type=0)
    assert told(acts) == [(act, QGC, f"MISSION_COUNT {count}")]


def test_a_rejected_mission_is_none(network: Network) -> None:
    network.say("MISSION_COUNT", count=5000)
    no_space = mavlink.MAV_MISSION_NO_SPACE
    assert network.to_station("MISSION_ACK", type=no_space) == []


def test_a_part_of_a_mission_is_another_mission(network: Network) -> None:
    network.say("MISSION_WRITE_PARTIAL_LIST", start_index=1, end_index=2)
    assert told(network.to_station("MISSION_REQUEST", seq=1)) == [
        (REPLACED, QGC, "MISSION_WRITE_PARTIAL_LIST")
    ]


def test_a_fence_upload_is_no_mission(network: Network) -> None:
    network.say("MISSION_COUNT", count=5, mission_type=1)
    assert network.to_station("MISSION_REQUEST_INT", seq=0, mission_type=1) == []
    network.say("MISSION_COUNT", count=5)
    assert network.to_station("MISSION_REQUEST_INT", seq=0, mission_type=1) == []


def test_an_upload_is_its_own_stations(network: Network) -> None:
    network.say("MISSION_COUNT", count=5)
    assert network.to_station("MISSION_REQUEST", (250, 190), seq=0) == []
    assert network.to_station("MISSION_REQUEST", (255, 191), seq=0) == []


def test_a_station_that_reads_the_mission_does_nothing(network: Network) -> None:
    assert network.say("MISSION_REQUEST_LIST") == []
    assert network.to_station("MISSION_COUNT", count=4) == []
    assert network.say("MISSION_REQUEST_INT", seq=0) == []
    assert network.say("MISSION_ACK", type=0) == []


@pytest.mark.parametrize(
    ("mission_type", "result", "again"),
    [
        (1, 0, True),
        (255, 0, True),
        (0, 0, False),
        (2, 0, False),
        (1, 1, False),
    ],
)
def test_a_fence_that_another_station_uploads_is_read_at_once(
    network: Network, mission_type: int, result: int, again: bool
) -> None:
    us = {"target_system": 1, "target_component": 191}
    network.vehicle.handle_timer(network.now)
    network.answer(network.autopilot("MISSION_COUNT", **us, count=0, mission_type=1))
    assert network.vehicle.stored_lists.fence == ()
    network.now += 1.0
    network.to_station("MISSION_ACK", type=result, mission_type=mission_type)
    network.vehicle.handle_timer(network.now)
    sent = network.vehicle.messages_to_send()
    lists = [m.mission_type for m in sent if m.get_type() == "MISSION_REQUEST_LIST"]
    assert (1 in lists) == again


# --- seen only in the vehicle's reports --------------------------------------------------


@pytest.mark.parametrize(
    ("total", "mission_id", "what", "how"),
    [
        (0xFFFF, 0, CLEARED, "removed"),
        (7, 9, REPLACED, "7 items instead of 3"),
        (3, 9, REPLACED, "replaced by another"),
    ],
)
def test_mission_current_reports_what_nobody_was_seen_to_do(
    total: int, mission_id: int, what: StationAct, how: str
) -> None:
    network = Network("px4")
    network.upload()
    assert network.answer(network.current(3, 8)) == []
    assert network.vehicle.stations.mission_change == ""
    (act,) = network.answer(network.current(total, mission_id))
    assert (act.act, act.station) == (what, None)
    assert act.how.startswith("MISSION_CURRENT shows")
    assert how in act.how
    assert network.vehicle.stations.mission_change == act.how
    assert network.answer(network.current(total, mission_id)) == []


def test_a_mission_replaced_before_it_was_reported_once_is_noticed() -> None:
    """A PX4 reports its mission once a second, and two stations may upload in that time."""
    network = Network("px4")
    network.upload()
    assert network.answer(network.current(5, 8)) == []
    network.now += 1.0
    assert network.answer(network.current(5, 8)) == []
    network.now += 1.0
    (act,) = network.answer(network.current(5, 8))
    assert (act.act, act.station) == (REPLACED, None)
    assert act.how == "MISSION_CURRENT shows 5 items instead of 3"


def test_an_ardupilots_words_tell_a_change_that_mission_current_does_not_show(
    network: Network,
) -> None:
    network.upload()
    network.answer(network.current(3))
    said = network.autopilot("STATUSTEXT", severity=2, text=b"Auto mission changed, restarted")
    (act,) = network.answer(said)
    assert (act.act, act.station) == (REPLACED, None)
    assert act.how == "the autopilot reports 'Auto mission changed, restarted'"


def test_what_was_sent_before_our_upload_was_over_proves_nothing() -> None:
    network = Network("px4")
    old = [network.current(3, 5), network.current(9, 4)]
    early = network.autopilot("STATUSTEXT", severity=2, text=b"Auto mission changed")
    network.answer(network.current(9, 4))
    network.upload()
    # Late and twice, before and after the first one that counts.
    assert network.answer(*old, early, *old) == []
    assert network.answer(network.current(3, 8), *old, network.current(3, 8)) == []
    assert network.vehicle.stations.mission_change == ""


def test_what_is_under_way_by_ourselves_is_no_change() -> None:
    network = Network("px4")
    network.upload()
    network.answer(network.current(3, 8))
    network.vehicle.missions.clear(network.now)
    assert network.answer(network.current(0xFFFF, 0)) == []
    assert network.answer(network.current(5, 3)) == []
    assert network.vehicle.stations.mission_change == ""


def test_without_a_mission_of_ours_there_is_nothing_to_change() -> None:
    network = Network("px4")
    for total in (3, 5, 0xFFFF):
        assert network.answer(network.current(total, total)) == []


def test_a_change_whose_author_was_seen_is_reported_once_and_with_the_author() -> None:
    network = Network("px4")
    network.upload()
    network.answer(network.current(3, 8))
    network.say("MISSION_COUNT", count=2)
    # The vehicle's request to the station was lost.
    assert told(network.answer(network.current(2, 9))) == [(REPLACED, QGC, "MISSION_COUNT 2")]
    assert network.to_station("MISSION_REQUEST_INT", seq=1) == []


def test_a_clearing_that_was_seen_is_not_reported_again_by_mission_current() -> None:
    network = Network("px4")
    network.upload()
    network.answer(network.current(3, 8))
    network.say("MISSION_CLEAR_ALL")
    network.now += 1.0
    assert network.answer(network.current(0xFFFF, 0)) == []
    assert network.vehicle.stations.mission_change != ""


def test_a_clearing_long_ago_explains_nothing() -> None:
    network = Network("px4")
    network.say("MISSION_CLEAR_ALL")
    network.upload()
    network.answer(network.current(3, 8))
    network.now += UPLOAD_S + 1.0
    (act,) = network.answer(network.current(0xFFFF, 0))
    assert act.station is None


def test_an_upload_that_the_vehicle_gave_up_explains_nothing_later() -> None:
    network = Network("px4")
    network.say("MISSION_COUNT", count=2)
    network.now += UPLOAD_S + 1.0
    assert network.to_station("MISSION_REQUEST_INT", seq=0) == []
    network.upload()
    network.answer(network.current(3, 8))
    (act,) = network.answer(network.current(2, 9))
    assert act.station is None


# --- a pause that nobody was seen to ask for ----------------------------------------------


def flying_its_mission(autopilot: str) -> Network:
    network = Network(autopilot)
    network.upload()
    px4 = network.px4
    kind = mavlink.MAV_AUTOPILOT_PX4 if px4 else mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    mode = PX4_MISSION if px4 else AUTO
    network.answer(network.autopilot.heartbeat(mode, autopilot=kind))
    assert network.vehicle.mode_name == ("AUTO.MISSION" if px4 else "AUTO")
    network.answer(network.current(3, 8 if px4 else 0))
    return network


def test_mission_current_reports_that_an_arducopter_was_paused_and_continues() -> None:
    network = flying_its_mission("ardupilot")
    (paused,) = network.answer(network.current(3, state=4))
    assert (paused.act, paused.station) == (PAUSED, None)
    assert network.answer(network.current(3, state=4)) == []
    (goes_on,) = network.answer(network.current(3, state=3))
    assert (goes_on.act, goes_on.station) == (CONTINUED, None)


def test_a_pause_whose_author_was_seen_is_not_reported_again() -> None:
    network = flying_its_mission("ardupilot")
    network.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0.0)
    assert network.answer(network.current(3, state=4)) == []


def test_the_state_of_a_px4s_mission_shows_no_pause() -> None:
    """It says so of a mission that was left, too (observed)."""
    network = flying_its_mission("px4")
    assert network.answer(network.current(3, 8, state=4)) == []
