"""Another position of a recording: the state there is that of playing up to it."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.recording.replay import Player, open_recording
from navigation_bridge.recording.replay_driver import ReplayDriver, ReplayPosition
from tests.support.processes import patient_s

DATA = Path(__file__).resolve().parents[1] / "data"
RECORDING = str(DATA / "copter_lowbatt.tlog")
_TIMEOUT_S = patient_s(30.0)


def make_bridge() -> Bridge:
    config = make_config({"link_url": f"tlog:{RECORDING}"})
    return Bridge(Vehicle(config.vehicle), config.bridge)


def state_of(bridge: Bridge) -> tuple[Any, ...]:
    """Return what a subscriber could see, without times."""
    state, pose = bridge.vehicle.state, bridge.pose
    return (
        state.custom_mode, state.armed, state.landed_state,
        state.failsafe and state.failsafe.text, bridge.map_frame.home_enu_m(bridge.vehicle.state),
        None if pose is None else pose.position_enu_m,
        None if pose is None else pose.yaw_enu_rad,
        None if state.battery is None else state.battery.remaining,
        tuple(text.text for text in state.texts.texts), bridge.vehicle.heartbeats.alive,
    )  # fmt: skip


def played_to(position_s: float) -> tuple[Any, ...]:
    """Return the state when it is played from the start."""
    bridge = make_bridge()
    player = Player(open_recording(RECORDING)[0], bridge, Codec(1, 191))
    while (due_s := player.due_s()) is not None and due_s <= position_s:
        player.step()
    return state_of(bridge)


@dataclass
class Heard:
    """A bridge that is played to, and whether it was heard meanwhile."""

    bridge: Bridge = field(default_factory=make_bridge)
    muted: bool = False
    heard: int = 0
    unheard: int = 0
    told: list[tuple[bool, tuple[Any, ...]]] = field(default_factory=list)

    def start(self, now: float) -> None:
        self.bridge.start(now)

    def receive(self, message: Message, now: float) -> None:
        self.heard += not self.muted
        self.unheard += self.muted
        self.bridge.receive(message, now)

    def overhear(self, message: Message, now: float) -> None:
        """No ground station is in a recording."""

    def handle_timer(self, now: float) -> None:
        self.bridge.handle_timer(now)

    def next_deadline(self) -> float | None:
        return self.bridge.next_deadline()

    def messages_to_send(self) -> list[Message]:
        while self.bridge.next_output() is not None:
            pass
        return self.bridge.messages_to_send()

    def take_note(self, message: Message, now: float) -> None:
        """It has none."""

    def begin_again(self) -> None:
        self.bridge.begin_again()

    def mute(self, muted: bool, now: float) -> None:
        self.muted = muted
        self.told.append((muted, state_of(self.bridge)))


class Playing:
    """A driver that plays the recording, paused by default."""

    def __init__(self, speed: float = 1.0) -> None:
        self.heard = Heard()
        self.driver = ReplayDriver(RECORDING, speed)
        self.driver.play_to(self.heard)
        self.times: list[float] = []
        self.driver.on_time = self.times.append
        self._looked = threading.Condition()
        self.driver.on_look = self._look
        self.driver.start()

    def _look(self) -> None:
        with self._looked:
            self._looked.notify_all()

    def wait(self, **wanted: Any) -> ReplayPosition:
        """Wait until the position is like this; returns it."""
        position = self.driver.call(self.driver.position, _TIMEOUT_S)

        def reached() -> bool:
            nonlocal position
            position = self.driver.position()
            return all(getattr(position, name) == value for name, value in wanted.items())

        with self._looked:
            assert self._looked.wait_for(reached, _TIMEOUT_S), position
        return position

    def seek(self, position_s: float) -> ReplayPosition:
        self.driver.seek(position_s)
        return self.wait(seeking=False)

    def state(self) -> tuple[Any, ...]:
        return self.driver.call(lambda: state_of(self.heard.bridge), _TIMEOUT_S)


@pytest.fixture
def playing() -> Any:
    playing = Playing()
    playing.driver.pause(True)
    yield playing
    playing.driver.stop()


@pytest.fixture(scope="module")
def duration_s() -> float:
    bridge = make_bridge()
    player = Player(open_recording(RECORDING)[0], bridge, Codec(1, 191))
    while not player.ended:
        player.step()
    return player.now


def test_forth_and_back_the_state_is_that_of_playing_up_to_there(
    playing: Playing, duration_s: float
) -> None:
    playing.wait(paused=True)
    places = [share * duration_s for share in (0.5, 0.9, 0.2, 0.95, 0.05, 0.5)]
    states = {place: played_to(place) for place in places}
    assert len(set(map(repr, states.values()))) == len(states)
    for number, place in enumerate(places, start=1):
        position = playing.seek(place)
        assert (position.paused, position.jumps) == (True, number)
        assert place - 1.5 < position.recording_s <= place
        assert playing.state() == states[place]
    assert playing.heard.heard < 5
    assert [muted for muted, _ in playing.heard.told] == [True, False] * len(places)
    # The clock of the recording is that of the position, and the application's never goes back.
    assert playing.times[-1] - playing.driver.begin_unix_s == pytest.approx(places[-1])


def test_it_plays_on_from_there_unless_it_is_paused(playing: Playing, duration_s: float) -> None:
    playing.seek(0.5 * duration_s)
    playing.driver.set_speed(0.0)
    playing.driver.pause(False)
    assert playing.wait(ended=True).recording_s == pytest.approx(duration_s)
    assert playing.heard.heard > 100
    ended = playing.state()
    playing.heard.heard = 0
    playing.seek(0.9 * duration_s)
    playing.wait(ended=True)
    assert playing.state() == ended
    assert 0 < playing.heard.heard < 0.3 * playing.heard.unheard


def test_beyond_the_end_is_the_end(playing: Playing, duration_s: float) -> None:
    ends = 0

    def count() -> None:
        nonlocal ends
        ends += 1

    playing.driver.on_end = count
    assert playing.seek(1e7).ended
    assert playing.wait(ended=True).recording_s == pytest.approx(duration_s)
    assert playing.state() == played_to(math.inf)
    assert ends == 1
    assert not playing.seek(1.0).ended


def test_a_newer_position_replaces_one_that_is_on_its_way(
    playing: Playing, duration_s: float
) -> None:
    for share in (0.9, 0.3, 0.99, 0.1, 0.6):
        playing.driver.seek(share * duration_s)
    assert playing.seek(0.7 * duration_s).jumps == 6
    assert playing.state() == played_to(0.7 * duration_s)
    playing.driver.seek(0.9 * duration_s)
    playing.driver.rewind(play=False)
    position = playing.wait(seeking=False)
    assert (position.recording_s, position.paused) == (0.0, True)
    assert not playing.heard.muted


def test_the_length_is_found_beside_the_playing(playing: Playing, duration_s: float) -> None:
    with playing._looked:
        assert playing._looked.wait_for(lambda: playing.driver.duration_s > 0.0, _TIMEOUT_S)
    assert playing.driver.duration_s == pytest.approx(duration_s)
