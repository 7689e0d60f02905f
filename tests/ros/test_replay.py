"""A recording in the place of a vehicle: subscribers see what they saw when it was flown."""

from __future__ import annotations

import math
import operator
import os
import struct
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path as PathMessage
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from custom_interfaces.action import Takeoff
from custom_interfaces.msg import GoalEvent, ReplayStatus, VehicleStatus
from custom_interfaces.srv import SeekReplay
from drone_navigation.processes import ros_environment
from drone_navigation.server.replay_node import recording_of
from mavlink_vehicle.codec import Codec, with_source
from mavlink_vehicle.io.tlog import TlogReader
from navigation_bridge.configuration.make_config import ConfigurationError, make_config
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.names import SERVER_NODE_NAME, TAKEOFF_ACTION_NAME
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import Flight, navigate_goal, new_domain

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_replay")]

# Deep enough to lose nothing of what comes as fast as possible.
DEEP_QOS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=20_000)
LATCHED_DEEP_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=20_000, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
TOPICS: dict[str, tuple[Any, QoSProfile]] = {
    "pose": (PoseStamped, DEEP_QOS),
    "vehicle_status": (VehicleStatus, DEEP_QOS),
    "goal_events": (GoalEvent, DEEP_QOS),
    "plan": (PathMessage, DEEP_QOS),
}


@dataclass
class Heard:
    """The messages that a subscriber heard of one vehicle, in order."""

    messages: dict[str, list[Any]] = field(default_factory=lambda: {name: [] for name in TOPICS})

    def subscribe(self, subscribe: Callable[..., Any], namespace: str = "") -> None:
        for name, (kind, qos) in TOPICS.items():
            subscribe(
                kind, f"{namespace}{SERVER_NODE_NAME}/{name}", self.messages[name].append, qos
            )

    def poses(self) -> list[tuple[float, ...]]:
        found = [message.pose for message in self.messages["pose"]]
        return [(*_xyz(p.position), p.orientation.z, p.orientation.w) for p in found]

    def statuses(self) -> list[tuple[Any, ...]]:
        """Return the vehicle's statuses, without those that are like the one before."""
        return _changes(
            (
                s.mode, s.armed, s.in_control, s.landed_state, s.position_valid, s.failsafe,
                s.connected, s.autopilot, s.last_status_text,
            )
            for s in self.messages["vehicle_status"]
        )  # fmt: skip

    def active_goals(self) -> list[str]:
        """Apart from the statuses: packets read at once are all recorded before what came of them.

        A goal that ends with the first of them, on a machine that hung, is recorded after the last.
        """
        return _changes(s.active_goal for s in self.messages["vehicle_status"])

    def events(self) -> list[tuple[str, ...]]:
        return [(e.goal_id, e.event, e.what, e.message) for e in self.messages["goal_events"]]

    def plans(self) -> list[list[tuple[float, ...]]]:
        return [[_xyz(p.pose.position) for p in m.poses] for m in self.messages["plan"]]


def _changes(told: Iterable[Any]) -> list[Any]:
    values = list(told)
    return [one for one, before in zip(values, [None, *values], strict=False) if one != before]


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec * 1e-9)


def _xyz(point: Any) -> tuple[float, ...]:
    return point.x, point.y, point.z


@dataclass(frozen=True)
class Flown:
    """A flight that was recorded, and what a subscriber heard while it was flown."""

    tlog: Path
    heard: Heard


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    folder = tmp_path_factory.mktemp("flown")
    flight, heard = Flight(folder), Heard()
    try:
        heard.subscribe(flight.subscribe)
        flight.spin_for(1.0)
        flight.send(navigate_goal(9e5, 0.0, 3.0))
        flight.wait_for_result(flight.send(navigate_goal(4.0, 2.0, 3.0)))
        flight.spin_for(0.5)
    finally:
        flight.close()
    (tlog,) = folder.glob("*.tlog")
    return Flown(tlog, heard)


class Replay:
    """A server on a recording, and a subscriber."""

    def __init__(self, *arguments: str) -> None:
        environment = ros_environment(new_domain())
        self.server = Process(
            "navigation_server",
            ["python", "-m", "drone_navigation.navigation_server", *arguments],
            environment,
        )
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=int(environment["ROS_DOMAIN_ID"]))
        self.node = rclpy.create_node("test_client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def subscribe(self, kind: Any, topic: str, callback: Callable[[Any], None], qos: Any) -> None:
        self.node.create_subscription(kind, topic, callback, qos)

    def wait(self, condition: Callable[[], bool], timeout_s: float = 30.0) -> None:
        deadline = time.monotonic() + patient_s(timeout_s)
        while not condition():
            assert time.monotonic() < deadline, self.server.text[-3000:]
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.02)

    def call(self, name: str) -> str:
        """Call a service of the replay; returns its sentence."""
        client = self.node.create_client(Trigger, f"{SERVER_NODE_NAME}/{name}")
        assert client.wait_for_service(timeout_sec=10.0)
        future = client.call_async(Trigger.Request())
        self.wait(future.done)
        assert future.result().success or name in ("arm", "pause"), future.result().message
        return str(future.result().message)

    def seek(self, position_s: float) -> str:
        """Go to a position in the recording; returns the answer's sentence."""
        client = self.node.create_client(SeekReplay, f"{SERVER_NODE_NAME}/replay/seek")
        assert client.wait_for_service(timeout_sec=10.0)
        future = client.call_async(SeekReplay.Request(position=position_s))
        self.wait(future.done)
        return str(future.result().message)

    def close(self) -> None:
        self.node.destroy_node()
        self._executor.shutdown()
        rclpy.try_shutdown(context=self._context)
        self.server.stop()


@pytest.fixture(scope="module")
def replay(flown: Flown) -> Iterator[Replay]:
    replay = Replay("--link", f"tlog:{flown.tlog}", "--ros-args", "-p", "replay_speed:=0.0")
    yield replay
    replay.close()


def follows(
    whole: list[Any], part: list[Any], same: Callable[[Any, Any], bool] = operator.eq
) -> bool:
    """Whether a list is in another one in its order; what came at once live may be told apart."""
    rest = iter(whole)
    return all(any(same(one, other) for other in rest) for one in part)


def is_same_pose(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether two poses have one place, and nearly one heading.

    Live, a position and the attitude after it may be read at once, and are published together.
    """
    turned = max(abs(a - b) for a, b in zip(one[3:], other[3:], strict=True))
    return one[:3] == other[:3] and turned < 0.05


def play_again(replay: Replay, heard: Heard) -> None:
    """Play from the beginning to the end, with all subscriptions in place."""
    replay.server.wait_for("The recording has ended", 30.0)
    ends = replay.server.text.count("The recording has ended")
    replay.spin_for(1.5)
    for messages in heard.messages.values():
        messages.clear()
    replay.call("replay/start")
    replay.wait(lambda: replay.server.text.count("The recording has ended") > ends)
    replay.spin_for(1.0)


def test_subscribers_see_what_they_saw_when_it_was_flown(flown: Flown, replay: Replay) -> None:
    live, heard = flown.heard, Heard()
    heard.subscribe(replay.subscribe)
    play_again(replay, heard)
    assert heard.events() == live.events()
    assert [event for _, event, _, _ in live.events()][:2] == ["REJECTED", "ACCEPTED"]
    assert len(live.poses()) > 50
    assert follows(heard.poses(), live.poses(), is_same_pose)
    assert len(live.statuses()) > 3
    assert follows(heard.statuses(), live.statuses())
    assert follows(heard.active_goals(), live.active_goals())
    assert len(heard.plans()) == len(live.plans()) > 1
    for again, first in zip(heard.plans(), live.plans(), strict=True):
        assert again == [pytest.approx(point, abs=1e-5) for point in first]


def test_played_twice_it_is_the_same_and_its_stamps_are_of_then(
    flown: Flown, replay: Replay
) -> None:
    heard, clocks = Heard(), list[Clock]()
    heard.subscribe(replay.subscribe)
    replay.subscribe(Clock, "/clock", clocks.append, DEEP_QOS)
    play_again(replay, heard)
    first = [heard.poses(), heard.statuses(), heard.events(), heard.plans()]
    stamps = [_seconds(message.header.stamp) for message in heard.messages["pose"]]
    play_again(replay, heard)
    assert [heard.poses(), heard.statuses(), heard.events(), heard.plans()] == first
    assert [_seconds(message.header.stamp) for message in heard.messages["pose"]] == stamps
    recorded = [time_s for time_s, _ in TlogReader(flown.tlog)]
    assert stamps == sorted(stamps)
    assert recorded[0] <= stamps[0]
    assert stamps[-1] <= recorded[-1] + 1e-3
    assert recorded[0] - 1e-3 <= _seconds(clocks[-1].clock) <= recorded[-1] + 1e-3


def test_a_recording_cannot_be_flown_and_says_so(replay: Replay) -> None:
    client = ActionClient(replay.node, Takeoff, TAKEOFF_ACTION_NAME)
    assert client.wait_for_server(timeout_sec=10.0)
    future = client.send_goal_async(Takeoff.Goal(altitude=3.0))
    replay.wait(future.done)
    assert not future.result().accepted
    replay.server.wait_for("is a recording; goals need a vehicle", 5.0)
    assert "goals need a vehicle" in replay.call("arm")
    assert replay.call("pause") == "No goal is active."


def test_it_is_paused_and_continues_at_another_speed(flown: Flown) -> None:
    replay = Replay("--link", f"tlog:{flown.tlog}")
    try:
        clocks = list[Clock]()
        replay.subscribe(Clock, "/clock", clocks.append, DEEP_QOS)
        replay.wait(lambda: len(clocks) > 5)
        assert "is paused" in replay.call("replay/pause")
        replay.spin_for(0.5)
        stood = len(clocks)
        replay.spin_for(0.5)
        assert len(clocks) == stood
        parameters = AsyncParameterClient(replay.node, SERVER_NODE_NAME)
        parameters.wait_for_services(timeout_sec=10.0)
        future = parameters.set_parameters([Parameter("replay_speed", value=50.0)])
        replay.wait(future.done)
        assert all(result.successful for result in future.result().results)
        assert "is resumed" in replay.call("replay/resume")
        replay.wait(lambda: "The recording has ended" in replay.server.text)
        assert len(clocks) > stood
        assert "is stopped at its beginning" in replay.call("replay/stop")
    finally:
        replay.close()


def test_a_seek_publishes_nothing_on_the_way(flown: Flown) -> None:
    replay = Replay("--link", f"tlog:{flown.tlog}", "--ros-args", "-p", "replay_speed:=0.0")
    try:
        heard, told = Heard(), list[ReplayStatus]()
        heard.subscribe(replay.subscribe)
        replay.subscribe(ReplayStatus, f"{SERVER_NODE_NAME}/replay/status", told.append, DEEP_QOS)
        replay.wait(lambda: bool(told) and told[-1].ended and told[-1].duration > 0.0)
        end = told[-1]
        assert end.position == pytest.approx(end.duration)
        assert (end.paused, end.speed, end.jumps) == (False, 0.0, 0)
        replay.call("replay/pause")
        replay.spin_for(0.5)
        begin_s, _ = next(iter(TlogReader(flown.tlog)))
        for share in (0.5, 0.95, 0.3):
            for messages in heard.messages.values():
                messages.clear()
            jumps = int(told[-1].jumps)
            assert "goes to" in replay.seek(share * end.duration)

            def there(jumps: int = jumps) -> bool:
                return bool(told[-1].jumps > jumps and not told[-1].seeking)

            replay.wait(there)
            replay.spin_for(0.5)
            # Only the state there, and no event again.
            assert heard.events() == []
            assert len(heard.messages["vehicle_status"]) == 1
            assert len(heard.messages["pose"]) == 1
            stamp_s = _seconds(heard.messages["pose"][0].header.stamp)
            # The last pose before that place. A loaded machine records them further apart.
            assert -0.001 < share * end.duration - (stamp_s - begin_s) < 0.25
            status = heard.messages["vehicle_status"][0]
            before = [
                event
                for event in flown.heard.messages["goal_events"]
                if _seconds(event.header.stamp) < stamp_s
            ]
            active = before[-1].goal_id if before and before[-1].event != "ENDED" else ""
            assert status.active_goal == active
            (plan,) = heard.plans()
            planned = [
                message
                for message in flown.heard.messages["plan"]
                if _seconds(message.header.stamp) < stamp_s
            ]
            assert len(plan) == (len(planned[-1].poses) if planned else 0)
        for messages in heard.messages.values():
            messages.clear()
        replay.call("replay/resume")
        replay.wait(lambda: told[-1].ended)
        replay.spin_for(0.5)
        # From there it is played as ever.
        assert len(heard.poses()) > 10
        assert follows(flown.heard.events(), heard.events())
        assert len(heard.events()) > 0
        for bad in (-1.0, math.nan, math.inf):
            assert "not a number of seconds" in replay.seek(bad)
        replay.seek(1e6)
        replay.wait(lambda: told[-1].ended and not told[-1].seeking)
    finally:
        replay.close()


def test_vehicles_of_one_recording_each_hear_their_own(flown: Flown, tmp_path: Path) -> None:
    both = tmp_path / "both.tlog"
    both.write_bytes(with_a_second_vehicle(flown.tlog))
    config = tmp_path / "both.yaml"
    config.write_text(
        yaml.safe_dump(
            {
                "navigation_server": {
                    "ros__parameters": {
                        "vehicles": ["a", "b"],
                        "link_url": f"tlog:{both}",
                        "replay_speed": 0.0,
                    }
                },
                **{
                    f"/{name}/navigation_server": {"ros__parameters": {"target_system": number}}
                    for name, number in (("a", 1), ("b", 2))
                },
            }
        )
    )
    replay = Replay("--config", str(config))
    try:
        heard = {"a": Heard(), "b": Heard()}
        for name, one in heard.items():
            one.subscribe(replay.subscribe, f"/{name}/")
        play_again(replay, heard["a"])
        assert heard["a"].events() == flown.heard.events()
        assert follows(heard["a"].poses(), flown.heard.poses(), is_same_pose)
        assert heard["b"].poses()[-len(flown.heard.poses()) :] != []
        assert not heard["b"].events()
        assert {status[-2] for status in heard["b"].statuses()} >= {"ArduCopter"}
    finally:
        replay.close()


def with_a_second_vehicle(tlog: Path) -> bytes:
    """Return a recording with all that the autopilot says twice, as system 1 and as system 2."""
    codec, second = Codec(255, 190), Codec(2, 1)
    whole = b""
    for time_s, packet in TlogReader(tlog):
        stamp = struct.pack(">Q", round(time_s * 1e6))
        whole += stamp + packet
        for message in codec.decode(packet):
            if (message.get_srcSystem(), message.get_srcComponent()) == (1, 1):
                whole += stamp + second.encode(with_source(message, 2, 1))
    return whole


@pytest.mark.parametrize(
    ("links", "others", "sentence"),
    [
        (["tlog:a.tlog", "tlog:b.tlog"], {}, "the link of all vehicles or of none"),
        (["tlog:a.tlog", "udpin://127.0.0.1:14550"], {}, "the link of all vehicles or of none"),
        (["tlog:a.tlog"], {"gcs_links": ["udpin://127.0.0.1:14551"]}, "gcs_links must be empty"),
        (["tlog:a.tlog"], {"record_tlog": "a.tlog"}, "record_tlog must be empty"),
    ],
)
def test_what_has_no_use_with_a_recording_is_rejected(
    links: list[str], others: dict[str, ParameterValue], sentence: str
) -> None:
    vehicles = [make_config({"link_url": link, **others}) for link in links]
    with pytest.raises(ConfigurationError, match=sentence):
        recording_of(vehicles[0], vehicles)


def test_a_live_link_is_no_recording() -> None:
    config = make_config({"link_url": "udpin://127.0.0.1:14550"})
    assert recording_of(config, [config]) is None


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "No such file"),
        (b"", "contains no MAVLink packet"),
        (b"these are only some notes", "is not a tlog"),
        (bytes(5000), "is not a tlog"),
    ],
    ids=["missing", "empty", "text", "zeros"],
)
def test_a_server_on_no_recording_ends_with_one_sentence(
    content: bytes | None, sentence: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.tlog"
    if content is not None:
        path.write_bytes(content)
    server = Process(
        "navigation_server",
        ["python", "-m", "drone_navigation.navigation_server", "--link", f"tlog:{path}"],
        ros_environment(new_domain()),
    )
    try:
        server.wait_for(sentence, 30.0)
        assert server.wait(20.0) == 2
        assert "Traceback" not in server.text
        assert len(server.text.strip().splitlines()) == 1
    finally:
        server.stop()
