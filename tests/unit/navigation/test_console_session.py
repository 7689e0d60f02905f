"""Pages show values, and their messages act."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from drone_navigation.console import plans
from drone_navigation.console.lease import SILENCE_S
from drone_navigation.console.messages import (
    PageCommand,
    PageFollow,
    PageGoal,
    PagePhoto,
    PagePoint,
    PageWaypoint,
    PlanSurvey,
    Rehearse,
    RehearseTogether,
    Replay,
)
from drone_navigation.console.page_types import HomeValue
from drone_navigation.console.session import Page, Rules
from drone_navigation.console.shown_values import ShownValues
from tests.support.messages.random_console_messages import FLY, MOVING, broken

HOME = HomeValue(latitude=-35.3632621, longitude=149.1652374, altitude=584.0, at=[1.0, 2.0, 0.5])


class FakePilots:
    """Notes what would have moved a vehicle."""

    def __init__(self) -> None:
        self.moved: list[Any] = []
        self.stopped: list[str] = []

    def prepare(self, vehicle: str) -> None:
        """Nothing is to be found."""

    def hold(self, vehicle: str, answer: Any) -> None:
        self.stopped.append("hold")
        answer(True, "Holding.")

    def cancel(self, vehicle: str, answer: Any) -> None:
        self.stopped.append("cancel")

    def command(self, command: PageCommand, by: str, answer: Any) -> None:
        self.moved.append(command)

    def replay(self, replay: Replay, answer: Any) -> None:
        self.stopped.append(f"replay {replay.name} {replay.value:g}")

    def payload(self, asked: PagePhoto | PagePoint, answer: Any) -> None:
        self.moved.append(asked.kind)

    def survey(self, asked: PlanSurvey, tell: Any, answer: Any) -> None:
        tell({"type": "survey", "corners": asked.corners_enu_m})

    def rehearse(self, order: Rehearse, by: str, tell: Any) -> None:
        tell({"type": "rehearsal", "number": order.number})

    def rehearse_together(self, order: RehearseTogether, by: str, tell: Any) -> None:
        tell({"type": "together", "vehicles": [route.vehicle for route in order.routes]})

    def fly(self, order: PageGoal | PageFollow, by: str, answer: Any) -> None:
        self.moved.append(by)


class Console:
    """Rules with two pages and one vehicle."""

    def __init__(self) -> None:
        self.pilots = FakePilots()
        self.board = ShownValues()
        self.board.put("/", "alive", True)
        self.board.put("/", "status", {"autopilot": "ArduCopter"})
        self.board.put("/", "home", HOME)
        self.rules = Rules(self.pilots, self.board)
        self.told: dict[int, list[dict[str, Any]]] = {1: [], 2: []}
        self.pages = [Page(number, told.append, 0.0) for number, told in self.told.items()]

    def send(self, page: int, now: float = 0.0, **message: Any) -> dict[str, Any] | None:
        before = len(self.told[page])
        self.rules.take(self.pages[page - 1], json.dumps(message), now)
        told = self.told[page][before:]
        return told[0] if told else None


def test_only_the_page_with_control_moves_the_vehicle() -> None:
    console = Console()
    console.send(1, type="take", vehicle="/", over=False)
    for message in MOVING:
        told = console.send(2, **message)
        assert told is not None
        assert "does not have control" in told["text"]
    assert console.pilots.moved == []
    assert console.rules.rejected == {"control": len(MOVING)}
    for message in MOVING:
        console.send(1, **message)
    assert len(console.pilots.moved) == len(MOVING)


def test_hold_and_cancel_are_open_to_every_page_at_any_pace() -> None:
    console = Console()
    console.send(1, type="take", vehicle="/", over=False)
    for _ in range(200):
        console.send(2, type="alive")
    assert console.rules.rejected["rate"] > 0
    console.send(2, type="hold", vehicle="/")
    console.send(2, type="cancel", vehicle="/")
    assert console.pilots.stopped == ["hold", "cancel"]
    answer = {"type": "answer", "to": "hold", "vehicle": "/", "success": True, "text": "Holding."}
    assert console.told[2][-1] == answer


def test_control_is_taken_over_knowingly_and_lost_by_silence_and_by_leaving() -> None:
    console = Console()
    console.send(1, type="take", vehicle="/", over=False)
    told = console.send(2, type="take", vehicle="/", over=False)
    assert told is not None
    assert "Another page has control" in told["text"]
    console.send(2, type="take", vehicle="/", over=True)
    assert console.rules.leases.holder("/") == 2
    console.send(2, SILENCE_S + 1.0, **FLY)
    assert console.pilots.moved == []
    console.send(2, SILENCE_S + 1.0, type="take", vehicle="/", over=False)
    console.rules.close(console.pages[1], SILENCE_S + 1.1)
    assert console.rules.leases.holder("/") is None


def test_ten_thousand_broken_messages_move_nothing_even_with_control() -> None:
    console = Console()
    console.send(1, type="take", vehicle="/", over=False)
    for data in broken(17, 10_000):
        console.rules.take(console.pages[0], data, 1.0)
    assert console.rules.rejected == {"message": 10_000}
    assert console.pilots.moved == console.pilots.stopped == []
    # It is not answered as fast as it floods.
    assert len(console.told[1]) < 200


def test_a_vehicle_that_is_not_there_is_rejected() -> None:
    console = Console()
    console.send(1, type="hold", vehicle="/ghost")
    assert console.rules.rejected == {"vehicle": 1}
    assert console.pilots.stopped == []


def test_routes_of_several_vehicles_are_rehearsed_together_without_control() -> None:
    console = Console()
    console.board.put("/b", "alive", True)
    waypoints = [{"x": 1, "y": 2, "z": 3, "hold": 0}]
    route = {"vehicle": "/", "waypoints": waypoints, "speed": 0, "laps": 1, "avoid": False}
    route["radius"] = 0
    both = [route, {**route, "vehicle": "/b"}]
    told = console.send(2, type="rehearse_together", number=1, routes=both)
    assert told == {"type": "together", "vehicles": ["/", "/b"]}
    ghost = [route, {**route, "vehicle": "/ghost"}]
    for wrong in ([], [route] * 33, ghost, [{**route, "confirmed": "slide"}], [waypoints]):
        console.send(2, type="rehearse_together", number=1, routes=wrong)
    assert console.rules.rejected == {"message": 4, "vehicle": 1}
    assert console.pilots.moved == []


def test_every_page_may_compute_a_survey_and_nothing_moves() -> None:
    console = Console()
    corners = [{"x": 0, "y": 0}, {"x": 10, "y": 0}, {"x": 0, "y": 10}]
    asked: dict[str, Any] = {"type": "survey", "vehicle": "/", "height": 5}
    asked |= {"holes": [], "camera": None}
    asked |= {"spacing": 2, "speed": 0}
    told = console.send(2, **asked, corners=corners)
    assert told == {"type": "survey", "corners": ((0.0, 0.0), (10.0, 0.0), (0.0, 10.0))}
    for wrong in ({"corners": corners[:2]}, {"corners": corners * 200}, {"spacing": 0}, {}):
        console.send(2, **{**asked, **wrong})
    assert console.rules.rejected == {"message": 4}
    assert console.pilots.moved == []


def test_a_recording_is_played_without_control() -> None:
    console = Console()
    console.send(2, type="replay", vehicle="/", name="pause")
    console.send(2, type="replay", vehicle="/", name="speed", speed=5)
    console.send(2, type="replay", vehicle="/", name="speed", speed=0)
    console.send(2, type="replay", vehicle="/", name="stop")
    console.send(2, type="replay", vehicle="/", name="seek", position=12.5)
    for wrong in ({"position": -1}, {"position": 1e9}, {"position": "1"}, {}, {"speed": 1}):
        console.send(2, type="replay", vehicle="/", name="seek", **wrong)
    assert console.pilots.stopped == ["replay pause 0", "replay speed 5", "replay seek 12.5"]
    assert console.rules.rejected == {"message": 7}


# --- the board ------------------------------------------------------------------------------


def test_only_what_has_changed_is_sent() -> None:
    board = ShownValues()
    board.put("/a", "mode", "GUIDED")
    board.put("/b", "mode", "LAND")
    version, everything = board.since(0)
    assert everything == {"/a": {"mode": "GUIDED"}, "/b": {"mode": "LAND"}}
    board.put("/a", "mode", "GUIDED")
    assert board.since(version) == (version, {})
    board.put("/a", "armed", True)
    later, changes = board.since(version)
    assert changes == {"/a": {"armed": True}}
    assert board.since(later) == (later, {})


def test_a_trail_grows_with_the_distance_not_with_time() -> None:
    board = ShownValues()
    for step in range(1000):
        board.pass_through("/", [0.1 * (step // 100), 0.0, 5.0])
    assert len(board.trails()["/"]) == 2
    for step in range(10_000):
        board.pass_through("/", [float(step), 0.0, 5.0])
    assert len(board.trails()["/"]) == 600
    board.restart_trail("/")
    board.pass_through("/", [0.0, 0.0, 5.0])
    assert board.trails()["/"] == [[0.0, 0.0, 5.0]]


# --- plans ----------------------------------------------------------------------------------


@pytest.mark.parametrize("autopilot", ["ArduCopter", "PX4 multicopter"])
def test_a_saved_plan_is_read_as_the_same_waypoints(autopilot: str) -> None:
    waypoints = (PageWaypoint((11.0, 22.0, 5.5), 0.0), PageWaypoint((-100.0, 250.0, 20.0), 3.0))
    text = plans.make_plan(waypoints, autopilot, HOME)
    found, notes = plans.map_waypoints(text, autopilot, HOME)
    assert notes == ()
    for waypoint, back in zip(waypoints, found, strict=True):
        assert math.dist(waypoint.position_enu_m, (back["x"], back["y"], back["z"])) < 0.03
        assert back["hold"] == waypoint.hold_time_s
    items = json.loads(text)["mission"]["items"]
    assert items[0]["params"][6] == pytest.approx(5.0)  # above home, which is at 0.5 m in the map


def test_a_plan_is_rejected_with_a_reason() -> None:
    console = Console()
    for text, why in (("{}", "not a QGroundControl plan"), ("[", "not valid JSON")):
        told = console.send(1, type="read_plan", vehicle="/", text=text)
        assert told is not None
        assert why in told["text"]
    waypoints = [{"x": 1, "y": 2, "z": 3, "hold": 0}]
    saved = console.send(1, type="save_plan", vehicle="/", waypoints=waypoints)
    assert saved is not None
    read = console.send(1, type="read_plan", vehicle="/", text=saved["text"])
    assert read is not None
    assert read["waypoints"] == [{"x": 1.0, "y": 2.0, "z": 3.0, "hold": 0.0}]
    latitude_deg, longitude_deg, height_m = json.loads(saved["text"])["mission"]["items"][0][
        "params"
    ][4:]
    rows = (
        "QGC WPL 110\n0 0 3 16 0 0 0 0 47 8 300 1\n"
        f"1 0 3 16 0 0 0 0 {latitude_deg} {longitude_deg} {height_m} 1\n"
    )
    listed = console.send(1, type="read_plan", vehicle="/", text=rows)
    assert listed is not None
    assert listed["waypoints"] == read["waypoints"]
    ground = saved["text"].replace('"frame": 3', '"frame": 10')
    told = console.send(1, type="read_plan", vehicle="/", text=ground)
    assert told is not None
    assert "above terrain" in told["text"]
    console.board.put("/", "home", None)
    told = console.send(1, type="save_plan", vehicle="/", waypoints=waypoints)
    assert told is not None
    assert "home is not known" in told["text"]


def _stored_item(number: int, command: int, frame: int, *values: float | None) -> dict[str, Any]:
    return {"number": number, "command": command, "frame": frame, "values": list(values)}


@pytest.mark.parametrize(("autopilot", "first"), [("ArduCopter", 1), ("PX4 multicopter", 0)])
def test_the_mission_in_the_vehicle_becomes_a_route_or_a_file(autopilot: str, first: int) -> None:
    console = Console()
    console.board.put("/", "status", {"autopilot": autopilot})
    told = console.send(1, type="mission", vehicle="/", form="route")
    assert told is not None
    assert "not been read" in told["text"]
    place = (-35.3630621, 149.1654374)
    waypoints = [
        _stored_item(first, 16, 6, 2.0, 0.0, 0.0, None, *place, 12.0),
        _stored_item(first + 1, 16, 0, 0.0, 0.0, 0.0, 0.0, *place, 600.0),
    ]
    jump = _stored_item(first + 2, 177, 2, float(first), 1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    circle = {"inclusion": False, "stored": True, "radius": 8.0, "places": [list(place)]}
    square = {"inclusion": True, "stored": True, "radius": None, "places": [[1, 2], [3, 4], [5, 6]]}
    console.board.put("/", "fence", {"areas": [circle, square, {**circle, "stored": False}]})
    rally = _stored_item(0, 5100, 3, 0.0, 0.0, 0.0, 0.0, *place, 15.0)
    console.board.put("/", "rally_points", {"items": [rally]})
    console.board.put("/", "mission", {"current": 0, "items": []})
    told = console.send(1, type="mission", vehicle="/", form="file")
    assert told is not None
    assert "no mission" in told["text"]
    console.board.put("/", "mission", {"current": 0, "items": [*waypoints, jump]})
    told = console.send(1, type="mission", vehicle="/", form="file")
    assert told is not None
    plan = json.loads(told["text"])
    assert [item["doJumpId"] for item in plan["mission"]["items"]] == [1, 2, 3]
    assert plan["mission"]["items"][2]["params"][0] == 1
    assert [item["frame"] for item in plan["mission"]["items"]] == [3, 0, 2]
    assert plan["geoFence"]["circles"] == [
        {"inclusion": False, "version": 1, "circle": {"center": list(place), "radius": 8.0}}
    ]
    assert plan["geoFence"]["polygons"][0]["polygon"] == square["places"]
    assert plan["rallyPoints"]["points"] == [[*place, 15.0]]

    console.board.put("/", "mission", {"current": 0, "items": waypoints})
    told = console.send(1, type="mission", vehicle="/", form="route")
    assert told is not None
    assert [(point["z"], point["hold"]) for point in told["waypoints"]] == [
        (12.5, 2.0),
        (16.5, 0.0),
    ]
    assert console.pilots.moved == []


def test_each_vehicle_has_its_own_lists() -> None:
    console = Console()
    place = (-35.3630621, 149.1654374)
    for vehicle, height_m in (("/", 12.0), ("/other", 20.0)):
        item = _stored_item(1, 16, 3, 0.0, 0.0, 0.0, None, *place, height_m)
        lists = {
            "mission": {"items": [item]},
            "fence": {"areas": []},
            "rally_points": {"items": []},
        }
        status = {"status": {"autopilot": "ArduCopter"}, "home": HOME}
        for name, value in {**status, **lists}.items():
            console.board.put(vehicle, name, value)
    for vehicle, up_m in (("/", 12.5), ("/other", 20.5)):
        told = console.send(1, type="mission", vehicle=vehicle, form="route")
        assert told is not None
        assert told["waypoints"][0]["z"] == up_m


def test_every_page_may_rehearse_and_nothing_moves() -> None:
    console = Console()
    goal = {"x": 1.0, "y": 2.0, "z": 3.0, "hold": 0.0}
    order: dict[str, Any] = {
        "vehicle": "/",
        "waypoints": [goal],
        "speed": 0.0,
        "laps": 1,
        "avoid": False,
        "radius": 8.0,
    }
    told = console.send(2, type="rehearse", number=7, **order)
    assert told == {"type": "rehearsal", "number": 7}
    assert console.pilots.moved == []
    told = console.send(2, type="rehearse", number=-1, **order)
    assert told is not None
    assert "number" in told["text"]
