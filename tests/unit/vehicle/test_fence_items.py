"""The uploaded fence: read, reread, and never in conflict with another transfer."""

from __future__ import annotations

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.mission_items import MissionType
from mavlink_vehicle.protocols.mission.fence_items import FenceItems
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.protocols.operations.command import Address
from tests.support.messages.autopilot_messages import AutopilotMessages

ADDRESS = Address(1, 191, 1, 1)
FENCE = int(MissionType.FENCE)
say = AutopilotMessages()


class Reading:
    """A reader, what it has sent, and whether it may read."""

    def __init__(self) -> None:
        self.free = True
        self.reader = FenceItems(TransferTiming(0.5, 3), lambda: self.free)
        self.reader.start(0.0)
        self.reader.resume(ADDRESS, 0.0)
        self.reader.handle_timer(0.0)

    def sent(self) -> list[str]:
        messages = self.reader.messages_to_send()
        assert all(m.mission_type == FENCE for m in messages)
        return [message.get_type() for message in messages]

    def tell(self, name: str, now: float, **fields: object) -> None:
        target = {"target_system": 1, "target_component": 191}
        self.reader.receive(say(name, mission_type=FENCE, **target, **fields), now)

    def circle(self, now: float, radius_m: float = 50.0) -> None:
        self.tell("MISSION_ITEM_INT", now, seq=0, command=5003, param1=radius_m)

    def wait(self) -> float:
        deadline = self.reader.next_deadline()
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
    assert reading.reader.items is not None
    assert [item.command for item in reading.reader.items] == [5003]


def test_it_is_read_again_and_the_same_list_stays_the_same() -> None:
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.1, count=1)
    reading.circle(0.2)
    first = reading.reader.items
    now = reading.wait()
    reading.tell("MISSION_COUNT", now, count=1)
    reading.circle(now)
    assert reading.reader.items is first
    now = reading.wait()
    reading.tell("MISSION_COUNT", now, count=0)
    assert reading.reader.items == ()
    reading.reader.forget()
    assert reading.reader.items is None


def test_an_autopilot_without_such_a_list_has_no_fence_and_a_silent_one_is_not_known() -> None:
    reading = Reading()
    reading.tell("MISSION_ACK", 0.1, type=3)  # MAV_MISSION_UNSUPPORTED
    assert reading.reader.items == ()
    silent = Reading()
    for _ in range(4):
        silent.wait()
    assert silent.reader.items is None
    silent.sent()
    silent.wait()
    assert silent.sent() == ["MISSION_REQUEST_LIST"]


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
    assert reading.reader.items == ()


def test_a_fence_that_is_replaced_while_it_is_read_is_reread() -> None:
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.1, count=2)
    reading.circle(0.2)
    reading.sent()
    reading.reader.refresh(0.3)
    reading.reader.handle_timer(0.3)
    assert reading.sent() == ["MISSION_REQUEST_LIST"]
    reading.tell("MISSION_COUNT", 0.4, count=1)
    reading.circle(0.5, radius_m=20.0)
    assert reading.reader.items is not None
    assert [item.params[0] for item in reading.reader.items] == [20.0]


def test_another_stations_upload_does_not_make_the_fence_disappear() -> None:
    """An ArduPilot answers DENIED while it takes a fence from somebody."""
    reading = Reading()
    reading.tell("MISSION_COUNT", 0.1, count=1)
    reading.circle(0.2)
    before = reading.reader.items
    now = reading.wait()
    for _ in range(5):
        reading.tell("MISSION_ACK", now, type=mavlink.MAV_MISSION_DENIED)
        now = reading.wait()
    assert reading.reader.items is before
    assert before
    reading.sent()
    reading.tell("MISSION_COUNT", now, count=1)
    reading.circle(now, radius_m=20.0)
    assert reading.reader.items is not before
