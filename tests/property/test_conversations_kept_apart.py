"""The autopilot's messages to other stations never affect our conversations.

The same story is told twice to two vehicles of ours: once with everything, once with a message
of no meaning in the place of each that is for somebody else. Both must send the same, at the
same times, and come to the same ends. Only of another fence both are told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import OperationFinished, OperationResult, VehicleEvent
from mavlink_vehicle.mission_items import RELATIVE_ALT, MissionItem
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages

pytestmark = pytest.mark.wide


OURS = (1, 191)
OTHERS = [(255, 190), (255, 191), (1, 190), (1, 192), (2, 191)]
"""Ground stations, and computers on board with our system id or our component id."""
ITEMS = [
    MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, RELATIVE_ALT, x=5, y=number, z=9.0)
    for number in range(3)
]
COMMANDS = [
    mavlink.MAV_CMD_DO_SET_MODE,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
    mavlink.MAV_CMD_NAV_TAKEOFF,
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT,
]
FIRST_MODE = "ACRO"
START: dict[str, Callable[[Vehicle, float], int]] = {
    "mode": lambda vehicle, now: vehicle.change_mode(FIRST_MODE, now),
    "arm": lambda vehicle, now: vehicle.arm(now),
    "take off": lambda vehicle, now: vehicle.take_off(5.0, now),
    "upload": lambda vehicle, now: vehicle.missions.upload(ITEMS, now),
    "download": lambda vehicle, now: vehicle.missions.download(now),
    "clear": lambda vehicle, now: vehicle.missions.clear(now),
}


@dataclass(frozen=True)
class Said:
    """One message of the autopilot, to whom (None: to all), after so long."""

    name: str
    fields: tuple[tuple[str, object], ...]
    to: tuple[int, int] | None
    pause_s: float

    @property
    def is_fence_taken(self) -> bool:
        """The one answer to others that matters: there is another fence, which we read then."""
        return self.name == "MISSION_ACK" and dict(self.fields) == {"type": 0, "mission_type": 1}


def said(name: str, **fields: st.SearchStrategy[int]) -> st.SearchStrategy[Said]:
    return st.builds(
        Said,
        st.just(name),
        st.fixed_dictionaries(fields).map(lambda chosen: tuple(chosen.items())),
        st.sampled_from([OURS, OURS, *OTHERS]),
        PAUSES,
    )


PAUSES = st.sampled_from([0.0, 0.01, 0.3, 1.0])
SEQ, COUNT = st.integers(0, 3), st.integers(0, 4)
LIST = st.sampled_from([0, 0, 1])
ANSWERS = st.one_of(
    said("COMMAND_ACK", command=st.sampled_from(COMMANDS), result=st.integers(0, 6)),
    said("MISSION_REQUEST", seq=SEQ, mission_type=LIST),
    said("MISSION_REQUEST_INT", seq=SEQ, mission_type=LIST),
    said("MISSION_COUNT", count=COUNT, mission_type=LIST),
    said(
        "MISSION_ITEM_INT", seq=SEQ, mission_type=LIST, command=st.just(16), frame=st.just(6),
        x=st.just(5), y=SEQ, z=st.just(9), current=st.just(0), autocontinue=st.just(1),
    ),
    said("MISSION_ACK", type=st.sampled_from([0, 1, 3, 13, 14, 15]), mission_type=LIST),
)  # fmt: skip
TIMESYNCS = st.builds(
    lambda ts1, pause_s: Said("TIMESYNC", (("tc1", 7), ("ts1", ts1)), OTHERS[0], pause_s),
    st.integers(1, 2**62),
    PAUSES,
)
BEATS = st.builds(lambda pause_s: Said("HEARTBEAT", (), None, pause_s), PAUSES)
REPETITIONS = st.integers(1, 12)
"""A packet comes again, late: the one that many before."""
STEPS = st.lists(
    st.one_of(ANSWERS, ANSWERS, TIMESYNCS, BEATS, REPETITIONS, st.sampled_from(sorted(START)))
)


@dataclass
class Story:
    """A vehicle of ours that hears an autopilot, and what it makes of that."""

    autopilot: int
    now: float = 100.0
    sent: list[tuple[float, bytes]] = field(default_factory=list)
    events: list[VehicleEvent] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.vehicle = Vehicle(VehicleConfig(message_rates_hz={"GLOBAL_POSITION_INT": 4.0}))
        self.say = AutopilotMessages()
        self.heard: list[Message] = []
        self.vehicle.start(self.now)
        self.hear(self.beat())
        # It fills in whom it answers, which both know from the beginning.
        self.hear(self.say.ack(mavlink.MAV_CMD_REQUEST_MESSAGE, 0, OURS))

    def beat(self) -> Message:
        return self.say.heartbeat(autopilot=self.autopilot, armed=True, status=4)

    def hear(self, message: Message) -> None:
        self.heard.append(message)
        self.vehicle.receive(message, self.now)
        self.collect()

    def collect(self) -> None:
        for message in self.vehicle.messages_to_send():
            self.sent.append((self.now, bytes(message.pack(mavlink.MAVLink(None)))))
        while (event := self.vehicle.next_event()) is not None:
            self.events.append(event)

    def wait(self, seconds: float) -> None:
        end_s = self.now + seconds
        while (deadline := self.vehicle.next_deadline()) is not None and deadline <= end_s:
            self.now = max(deadline, self.now)
            self.vehicle.handle_timer(self.now)
            self.collect()
        self.now = end_s

    def start(self, what: str) -> None:
        START[what](self.vehicle, self.now)
        self.collect()

    def step(self, step: Said | str | int, alone: bool) -> None:
        """Continue; `alone`: what is for others is not heard."""
        if isinstance(step, str):
            self.start(step)
            return
        if isinstance(step, int):
            self.hear(self.heard[-step] if step <= len(self.heard) else self.heard[0])
            return
        self.wait(step.pause_s)
        fields = dict(step.fields)
        if step.name == "HEARTBEAT":
            self.hear(self.beat())
        elif alone and step.to in OTHERS and not step.is_fence_taken:
            self.hear(self.say("VIBRATION"))
        elif step.name == "TIMESYNC" or step.to is None:
            self.hear(self.say(step.name, **fields))
        else:
            target = {"target_system": step.to[0], "target_component": step.to[1]}
            self.hear(self.say(step.name, **target, **fields))


@pytest.mark.night
@given(STEPS, st.sampled_from([mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4]))
@settings(max_examples=400)
def test_answers_to_others_change_nothing(steps: list[Said | str | int], autopilot: int) -> None:
    among_others, alone = Story(autopilot), Story(autopilot)
    for step in steps:
        among_others.step(step, alone=False)
        alone.step(step, alone=True)
    for story in (among_others, alone):
        story.wait(30.0)
    assert among_others.events == alone.events
    assert among_others.sent == alone.sent
    assert among_others.vehicle.missions.stored == alone.vehicle.missions.stored
    assert among_others.vehicle.stored_lists.fence == alone.vehicle.stored_lists.fence
    assert among_others.vehicle.timesync.round_trip_s == alone.vehicle.timesync.round_trip_s
    assert among_others.vehicle.state == alone.vehicle.state


@given(st.lists(st.sampled_from([1, 2, 3, 4]), min_size=1, max_size=5))
def test_an_acknowledgement_without_a_name_is_not_ours_where_ours_have_names(
    results: list[int],
) -> None:
    """A PX4 acknowledges some of what was commanded on another link with targets 0/0."""
    story = Story(mavlink.MAV_AUTOPILOT_PX4)
    story.start("arm")
    story.start("upload")
    story.start("mode")
    before = list(story.events)
    for result in results:
        story.hear(story.say.ack(mavlink.MAV_CMD_DO_SET_MODE, result, (0, 0)))
    for _ in range(4):  # a refusal has ended it by then
        story.wait(1.0)
        story.hear(story.beat())
    assert story.events == before
    assert story.vehicle.profile is not None
    mode = story.vehicle.profile.modes[FIRST_MODE]
    story.hear(story.say.heartbeat(mode, autopilot=story.autopilot, armed=True, status=4))
    (end,) = [
        event for event in story.events[len(before) :] if isinstance(event, OperationFinished)
    ]
    assert end.result is OperationResult.ACHIEVED
