"""Fence, rally points and mission: read, reread, and never in conflict with another transfer."""

from __future__ import annotations

import math

from mavlink_vehicle.codec import Message, mavlink, with_source
from mavlink_vehicle.mission_items import MissionItem, MissionType
from mavlink_vehicle.protocols.mission.stored_lists import StoredLists, lists_taken
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.state.telemetry import MissionProgress
from tests.support.messages.autopilot_messages import AutopilotMessages

ADDRESS = Address(1, 191, 1, 1)
FENCE = int(MissionType.FENCE)
say = AutopilotMessages()


class Reading:
    """A reader, what it has sent, and whether it may read."""

    def __init__(self) -> None:
        self.free = True
        self.reader = StoredLists(TransferTiming(0.5, 3), lambda: self.free)
        self.reader.start(0.0)
        self.reader.resume(ADDRESS, 0.0)
        self.reader.handle_timer(0.0)

    @property
    def fence(self) -> tuple[MissionItem, ...] | None:
        return self.reader.of(MissionType.FENCE)

    def sent(self, kind: MissionType = MissionType.FENCE) -> list[str]:
        messages = self.reader.messages_to_send()
        assert all(m.mission_type == kind for m in messages)
        return [message.get_type() for message in messages]

    def tell(self, name: str, now: float, kind: int = FENCE, **fields: object) -> None:
        target = {"target_system": 1, "target_component": 191}
        self.reader.receive(say(name, mission_type=kind, **target, **fields), now)

    def empty(self, *kinds: MissionType) -> float:
        """Read lists that are empty; return the time."""
        now = 0.0
        for kind in kinds:
            now = self.wait()
            assert self.sent(kind)[-1] == "MISSION_REQUEST_LIST"
            self.tell("MISSION_COUNT", now, kind, count=0)
            self.sent(kind)
        return now

    def circle(self, now: float, radius_m: float = 50.0) -> None:
        self.tell("MISSION_ITEM_INT", now, seq=0, command=5003, param1=radius_m, param4=math.nan)

    def whole(self) -> tuple[tuple[MissionItem, ...] | None, float]:
        """Read a fence and two empty lists; return the fence, and when it is read again."""
        self.tell("MISSION_COUNT", 0.0, count=1)
        self.circle(0.0)
        self.sent()
        self.empty(MissionType.RALLY, MissionType.MISSION)
        return self.fence, self.wait()

    def wait(self) -> float:
        deadline = self.reader.deadline_s
        assert deadline is not None
        self.reader.handle_timer(deadline)
        return deadline


def test_the_list_is_read_and_acknowledged() -> None:
    reading = Reading()
    assert reading.sent() == ["MISSION_REQUEST_LIST"]
    reading.tell("MISSION_COUNT", 0.1, count=1)
    assert reading.sent() == ["MISSION_REQUEST_INT"]
    reading.circle(0.2)
    assert reading.sent() == ["MISSION_ACK"]
    assert reading.fence is not None
    assert [item.command for item in reading.fence] == [5003]


def test_it_is_read_again_and_the_same_list_stays_the_same() -> None:
    reading = Reading()
    first, now = reading.whole()
    reading.tell("MISSION_COUNT", now, count=1)
    reading.circle(now)
    assert reading.fence is first
    reading.sent()
    reading.empty(MissionType.RALLY, MissionType.MISSION)
    now = reading.wait()
    reading.tell("MISSION_COUNT", now, count=0)
    assert reading.fence == ()
    reading.reader.vehicle_gone("the autopilot restarted", now)
    assert reading.fence is None


def test_an_autopilot_without_such_a_list_has_no_fence_and_a_silent_one_is_not_known() -> None:
    reading = Reading()
    reading.tell("MISSION_ACK", 0.1, type=3)  # MAV_MISSION_UNSUPPORTED
    assert reading.fence == ()
    silent = Reading()
    for _ in range(4):
        silent.wait()
    assert silent.fence is None
    silent.sent()
    silent.wait()
    assert silent.sent(MissionType.RALLY) == ["MISSION_REQUEST_LIST"]


def test_a_mission_transfer_goes_first() -> None:
    reading = Reading()
    reading.sent()
    reading.free = False
    reading.wait()
    assert reading.sent() == ["MISSION_ACK"]  # cancelled
    reading.wait()
    assert reading.sent() == []
    reading.free = True
    reading.wait()
    assert reading.sent() == ["MISSION_REQUEST_LIST"]


def test_messages_of_other_lists_are_not_its_own() -> None:
    reading = Reading()
    other: Message = say("MISSION_COUNT", target_system=1, target_component=191, count=3)
    reading.reader.receive(other, 0.1)
    reading.sent()
    reading.tell("MISSION_COUNT", 0.2, count=0)
    assert reading.fence == ()


def test_a_fence_that_is_replaced_while_it_is_read_is_reread() -> None:
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.1, count=2)
    reading.circle(0.2)
    reading.sent()
    reading.reader.refresh(MissionType.FENCE, 0.3)
    reading.reader.handle_timer(0.3)
    assert reading.sent() == ["MISSION_REQUEST_LIST"]
    reading.tell("MISSION_COUNT", 0.4, count=1)
    reading.circle(0.5, radius_m=20.0)
    assert reading.fence is not None
    assert [item.params[0] for item in reading.fence] == [20.0]


def test_another_stations_upload_does_not_make_the_fence_disappear() -> None:
    """An ArduPilot answers DENIED while it takes a fence from somebody."""
    reading = Reading()
    before, now = reading.whole()
    for _ in range(3):
        reading.tell("MISSION_ACK", now, type=mavlink.MAV_MISSION_DENIED)
        now = reading.wait()
    assert reading.fence is before
    assert before
    reading.sent()
    reading.tell("MISSION_COUNT", now, count=1)
    reading.circle(now, radius_m=20.0)
    assert reading.fence is not before


def test_rally_points_and_mission_follow_and_a_slow_list_is_read_less_often() -> None:
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.0, count=0)
    reading.sent()
    reading.empty(MissionType.RALLY)
    reading.wait()
    reading.sent(MissionType.MISSION)
    mission = int(MissionType.MISSION)
    reading.tell("MISSION_COUNT", 5.0, mission, count=1)
    reading.tell("MISSION_ITEM_INT", 10.0, mission, seq=0, command=16)
    assert len(reading.reader.of(MissionType.MISSION) or ()) == 1
    assert reading.sent(MissionType.MISSION)[-1] == "MISSION_ACK"
    assert reading.empty(MissionType.FENCE, MissionType.RALLY) == 60.0
    assert reading.wait() == 120.0
    reading.sent()
    reading.tell("MISSION_COUNT", 120.0, count=0)
    reading.sent()
    reading.empty(MissionType.RALLY)
    assert reading.wait() == 180.0
    reading.sent()
    reading.tell("MISSION_COUNT", 180.0, count=0)
    reading.sent()
    reading.empty(MissionType.RALLY)
    assert reading.wait() == 210.0  # 10 s of reading: not before 200 s have passed
    assert reading.sent(MissionType.MISSION) == ["MISSION_REQUEST_LIST"]


def test_reading_makes_way_for_a_station_and_continues_after_it() -> None:
    reading = Reading()
    reading.sent()
    upload = say("MISSION_COUNT", target_system=1, target_component=1, count=3)
    with_source(upload, 255, 190)
    reading.reader.overhear(upload, 0.1)
    assert reading.sent() == ["MISSION_ACK"]  # cancelled
    assert reading.wait() == 2.1
    assert reading.sent() == ["MISSION_REQUEST_LIST"]
    other_vehicle = say("MISSION_COUNT", target_system=2, target_component=1, count=3)
    reading.reader.overhear(other_vehicle, 2.2)
    assert reading.sent() == []


def test_what_mission_current_shows_is_read_again_but_not_what_was_just_stored() -> None:
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.0, count=0)
    reading.sent()
    reading.empty(MissionType.RALLY, MissionType.MISSION)
    told = MissionProgress(1.0, 0, 2, 3, 7, (), 8, 9)
    reading.reader.put(MissionType.MISSION, (), 10.0)
    reading.reader.compare(told, told._replace(total=3, mission_id=70), 11.0)
    assert reading.reader.deadline_s == 60.0
    for changed, kind in (
        (told._replace(mission_id=70), MissionType.MISSION),
        (told._replace(total=3), MissionType.MISSION),
        (told._replace(fence_id=80), MissionType.FENCE),
        (told._replace(rally_id=90), MissionType.RALLY),
    ):
        reading.reader.compare(told, changed, 20.0)
        assert reading.reader.deadline_s == 20.0
        reading.empty(kind)


def test_the_fence_goes_before_what_is_being_read() -> None:
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.0, count=0)
    reading.sent()
    reading.wait()
    assert reading.sent(MissionType.RALLY) == ["MISSION_REQUEST_LIST"]
    reading.reader.refresh(MissionType.FENCE, 0.1)
    assert reading.sent(MissionType.RALLY) == ["MISSION_ACK"]
    reading.reader.handle_timer(0.1)
    assert reading.sent() == ["MISSION_REQUEST_LIST"]


def test_an_acknowledgement_of_all_lists_counts_for_each() -> None:
    accepted = say("MISSION_ACK", type=0, mission_type=255)
    assert set(lists_taken(accepted)) == set(MissionType)
    assert lists_taken(say("MISSION_ACK", type=0, mission_type=2)) == (MissionType.RALLY,)
    assert lists_taken(say("MISSION_ACK", type=1, mission_type=2)) == ()
