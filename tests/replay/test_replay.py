"""A recording is played by its own time, sends nothing, and gives the same each time."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.goals.goal import (
    GoalFeedback,
    GoalFinished,
    GoalHappened,
    LogLine,
    Output,
    PlanChanged,
)
from navigation_bridge.goals.requests import TakeoffRequest
from navigation_bridge.recording.noted_outputs import NotedOutputs
from navigation_bridge.recording.replay import Player, ReplayError, open_recording, play
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from tests.support.flights.made_flights import FOLDER, RECIPES, MadeFlight

pytestmark = pytest.mark.wide_but_first


def bridge() -> Bridge:
    config = make_config({})
    return Bridge(Vehicle(config.vehicle), config.bridge)


def replayed(path: Path) -> list[tuple[float, Output]]:
    """Return the outputs of a replay, with the time of each."""
    heard, told = bridge(), list[tuple[float, Output]]()
    noted = NotedOutputs(heard)
    for played in play(TlogReader(path), heard, Codec(1, 191)):
        if played.is_note and played.message is not None:
            told += [(played.now, output) for output in noted.take(played.message, played.now)]
        while (output := heard.next_output()) is not None:
            told.append((played.now, output))
    return told


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, MadeFlight]:
    """A flight and its recording."""
    path = tmp_path_factory.mktemp("flown") / "a.tlog"
    return path, RECIPES["px4_copter_goals"].fly(path)


@pytest.mark.parametrize("kind", [GoalHappened, GoalFinished, PlanChanged, GoalFeedback])
def test_what_was_put_out_in_flight_comes_out_of_the_recording(
    kind: type[Output], flown: tuple[Path, MadeFlight]
) -> None:
    path, flight = flown
    live = [output for _, output in flight.outputs if isinstance(output, kind)]
    again = [output for _, output in replayed(path) if isinstance(output, kind)]
    assert len(live) >= 3
    assert len(again) == len(live)
    for one, other in zip(live, again, strict=True):
        (words, numbers), (live_words, live_numbers) = told(other), told(one)
        assert words == live_words
        # As single floats, and with three decimals, in the notes.
        assert numbers == pytest.approx(live_numbers, rel=1e-5, abs=1e-3)


def told(output: object) -> tuple[object, list[float]]:
    """Return an output as a client sees it: words, and numbers."""
    if isinstance(output, GoalFinished):
        words = (output.goal_id, output.state, output.code, output.message)
        return (*words, output.waypoints_reached, output.waypoints_missed), [output.elapsed_s]
    if isinstance(output, PlanChanged):
        return None, list(itertools.chain(*output.path_enu_m))
    if isinstance(output, GoalFeedback):
        left = [output.distance_remaining_m, output.time_remaining_s]
        return (output.goal_id, output.status, output.route, output.replans), left
    return output, []


def test_log_lines_about_the_vehicle_come_out_as_they_did(
    flown: tuple[Path, MadeFlight],
) -> None:
    path, flight = flown
    about_goals = ("Goal ", "Vehicle mode")
    live = [o.text for _, o in flight.outputs if isinstance(o, LogLine)]
    again = [o.text for _, o in replayed(path) if isinstance(o, LogLine)]
    assert [text for text in again if not text.startswith(about_goals)] == [
        text for text in live if not text.startswith(about_goals)
    ]


@pytest.mark.parametrize("name", ["link_cut", "px4_reboot", "no_path"])
def test_a_recording_gives_the_same_each_time(name: str) -> None:
    path = FOLDER / f"{name}.tlog"
    first = [(time_s, repr(told(o))) for time_s, o in replayed(path) if is_kept(o)]
    again = [(time_s, repr(told(o))) for time_s, o in replayed(path) if is_kept(o)]
    assert first == again
    assert first


def is_kept(output: Output) -> bool:
    """Notes about modes hold messages, which have no equality."""
    return isinstance(output, (GoalHappened, GoalFinished, PlanChanged, GoalFeedback, LogLine))


def test_silence_is_lived_through_by_timers_each_at_its_own_time() -> None:
    path = FOLDER / "link_cut.tlog"
    lost = [t for t, o in replayed(path) if isinstance(o, LogLine) and "No HEARTBEAT" in o.text]
    frames = [(t, packet) for t, packet in TlogReader(path) if packet[6] == 1]  # the autopilot's
    silences = [
        (before - frames[0][0], after - frames[0][0])
        for (before, _), (after, _) in itertools.pairwise(frames)
        if after - before > 10.0
    ]
    assert len(silences) == len(lost) == 1
    assert silences[0][0] + 2.0 < lost[0] < silences[0][0] + 4.0 < silences[0][1]


def test_a_bridge_that_rejects_goals_and_begins_again_still_rejects_them() -> None:
    heard = bridge()
    heard.refuse(Rejection(OutcomeCode.NO_VEHICLE, "A recording can't be flown."))
    for _ in play(TlogReader(FOLDER / "link_gap.tlog"), heard, Codec(1, 191)):
        pass
    system_id = heard.vehicle.state.system_id
    heard.begin_again()
    assert (system_id, heard.vehicle.state.system_id) == (1, 0)
    rejection = heard.goals.check(TakeoffRequest(3.0), 100.0)
    assert rejection is not None
    assert rejection.message == "A recording can't be flown."


class Restless:
    """An application whose deadline has always passed: a defect."""

    def start(self, now: float) -> None:
        """Begin."""

    def receive(self, message: Message, now: float) -> None:
        """Hear nothing."""

    def overhear(self, message: Message, now: float) -> None:
        """Hear nothing."""

    def handle_timer(self, now: float) -> None:
        """Leave the deadline where it is."""

    def next_deadline(self) -> float | None:
        """Return a time that is over."""
        return 0.0

    def messages_to_send(self) -> list[Message]:
        """Say nothing."""
        return []


def run(player: Player) -> None:
    while not player.ended:
        player.step()


def test_timers_that_do_not_come_to_rest_end_the_replay() -> None:
    player = Player(TlogReader(FOLDER / "link_gap.tlog"), Restless(), Codec(1, 191))
    with pytest.raises(ReplayError, match="did not settle"):
        run(player)


def test_a_recording_of_nothing_is_said_to_be_one(tmp_path: Path) -> None:
    path = tmp_path / "empty.tlog"
    path.write_bytes(b"")
    with pytest.raises(LinkError, match="contains no MAVLink packet"):
        open_recording(str(path))
