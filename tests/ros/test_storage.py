"""Fence, rally points and parameters by services, actions and the client's commands."""

from __future__ import annotations

import json
import math
import signal
from pathlib import Path
from typing import Any

import pytest
from rclpy.action import ActionClient

from custom_interfaces.action import ListVehicleParameters, LoadVehicleParameters
from custom_interfaces.msg import FenceArea, RallyPoint, VehicleParameter
from custom_interfaces.srv import (
    GetFence,
    GetVehicleParameter,
    SetFence,
    SetRallyPoints,
    SetVehicleParameter,
)
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_storage")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]
HOME_DEG = (-35.363261, 149.165230)
STEP_DEG = 0.002


def call(flight: Flight, kind: Any, service: str, /, **fields: Any) -> Any:
    client = flight._node.create_client(kind, f"{SERVER_NODE_NAME}/{service}")
    assert client.wait_for_service(timeout_sec=20.0)
    answer = client.call_async(kind.Request(**fields))
    flight.wait(answer.done, 60.0, f"an answer of {service}")
    flight._node.destroy_client(client)
    return answer.result()


def act(flight: Flight, kind: Any, name: str, **fields: Any) -> tuple[Any, list[Any]]:
    client = ActionClient(flight._node, kind, f"{SERVER_NODE_NAME}/{name}")
    assert client.wait_for_server(timeout_sec=20.0)
    told: list[Any] = []
    sent = client.send_goal_async(kind.Goal(**fields), lambda m: told.append(m.feedback))
    flight.wait(sent.done, 20.0, "acceptance")
    result = sent.result().get_result_async()
    flight.wait(result.done, 60.0, f"a result of {name}")
    client.destroy()
    return result.result().result, told


def run(flight: Flight, *arguments: str) -> tuple[int | None, str]:
    shown = Process("client", [*CLIENT, *arguments], flight.environment)
    return shown.wait(90.0), shown.text


def square(size: float = 1.0, inclusion: bool = True) -> FenceArea:
    area = FenceArea(shape=FenceArea.POLYGON, inclusion=inclusion)
    corners = [(-size, -size), (-size, size), (size, size), (size, -size)]
    area.latitudes = [HOME_DEG[0] + north * STEP_DEG for north, _ in corners]
    area.longitudes = [HOME_DEG[1] + east * STEP_DEG for _, east in corners]
    return area


def circle(radius_m: float) -> FenceArea:
    area = FenceArea(shape=FenceArea.CIRCLE, inclusion=False, radius=radius_m)
    area.latitudes, area.longitudes = [HOME_DEG[0] + STEP_DEG / 2], [HOME_DEG[1]]
    return area


def test_a_fence_is_stored_read_and_removed(flight: Flight) -> None:
    answer = call(flight, SetFence, "set_fence", areas=[square(), circle(12.5)])
    assert answer.success, answer.message
    assert "5 items" in answer.message
    assert "does not enforce it (FENCE_ENABLE 0" in answer.message
    read = call(flight, GetFence, "get_fence")
    assert read.success, read.message
    polygon, hole = read.areas
    assert list(polygon.latitudes) == pytest.approx(list(square().latitudes), abs=1e-7)
    assert list(polygon.longitudes) == pytest.approx(list(square().longitudes), abs=1e-7)
    assert (polygon.inclusion, polygon.stored, polygon.in_force) == (True, True, False)
    assert (hole.shape, hole.radius, hole.inclusion) == (FenceArea.CIRCLE, 12.5, False)
    answer = call(flight, SetFence, "set_fence")
    assert answer.success, answer.message
    assert call(flight, GetFence, "get_fence").areas == []


def test_what_is_wrong_is_rejected_with_a_sentence_and_nothing_is_sent(flight: Flight) -> None:
    assert call(flight, SetFence, "set_fence", areas=[square()]).success
    bent = square()
    bent.latitudes = [bent.latitudes[i] for i in (0, 2, 1, 3)]
    bent.longitudes = [bent.longitudes[i] for i in (0, 2, 1, 3)]
    two = FenceArea(latitudes=[1.0, 2.0], longitudes=[1.0, 2.0])
    in_map = FenceArea(shape=FenceArea.CIRCLE, radius=3.0)
    far = square()
    far.latitudes = [91.0, *list(far.latitudes)[1:]]
    for area, sentence in (
        (bent, "Area 1: its edges from corner"),
        (two, "Area 1: a polygon has at least 3 corners, not 2."),
        (in_map, "Area 1: a circle has one centre, not 0."),
        (circle(-1.0), "Area 1: radius -1 m"),
        (circle(math.nan), "Area 1: radius nan m"),
        (far, "Area 1: point 1: latitude 91"),
        (FenceArea(latitudes=[1.0]), "Area 1: 1 latitudes and 0 longitudes."),
        (FenceArea(shape=9, latitudes=[1.0], longitudes=[1.0]), "Area 1: shape 9"),
    ):
        answer = call(flight, SetFence, "set_fence", areas=[area])
        assert not answer.success
        assert answer.message.startswith(sentence), answer.message
    point = RallyPoint(latitude=math.nan, longitude=1.0)
    answer = call(flight, SetRallyPoints, "set_rally_points", points=[point])
    assert (answer.success, answer.message[:14]) == (False, "Rally point 1:")
    for name, value in (("WPNAV_SPEED", math.nan), ("wrong name", 1.0), ("", 1.0)):
        answer = call(flight, SetVehicleParameter, "vehicle_parameters/set", name=name, value=value)
        assert not answer.success
        assert math.isnan(answer.new_value)
    empty, _ = act(flight, LoadVehicleParameters, "vehicle_parameters/load")
    assert (empty.success, empty.message) == (False, "The request names no parameter.")
    assert len(call(flight, GetFence, "get_fence").areas) == 1


def test_parameters_are_listed_with_progress_and_loaded(flight: Flight) -> None:
    listed, told = act(flight, ListVehicleParameters, "vehicle_parameters/list")
    assert listed.success, listed.message
    assert listed.system_id == 1
    values = {parameter.name: parameter.value for parameter in listed.parameters}
    assert len(values) == len(listed.parameters) > 40
    assert all(feedback.received <= feedback.total for feedback in told if feedback.total)
    wanted = [
        VehicleParameter(name="WPNAV_SPEED", value=values["WPNAV_SPEED"] + 10.0),
        VehicleParameter(name="FENCE_TYPE", value=1.5),
        VehicleParameter(name="NO_SUCH_ONE", value=1.0),
        VehicleParameter(name="FENCE_RADIUS", value=values["FENCE_RADIUS"]),
    ]
    loaded, _ = act(flight, LoadVehicleParameters, "vehicle_parameters/load", parameters=wanted)
    assert not loaded.success
    assert list(loaded.changed) == ["WPNAV_SPEED"]
    assert list(loaded.unknown) == ["NO_SUCH_ONE"]
    assert list(loaded.failed) == ["FENCE_TYPE"]
    assert list(loaded.unchanged) == ["FENCE_RADIUS"]
    assert "1.5 is not an integer" in loaded.reasons[0]
    request = {"name": "WPNAV_SPEED", "value": values["WPNAV_SPEED"]}
    answer = call(flight, SetVehicleParameter, "vehicle_parameters/set", **request)
    assert answer.success, answer.message
    assert answer.old_value == values["WPNAV_SPEED"] + 10.0
    assert answer.new_value == values["WPNAV_SPEED"]


@pytest.mark.night
def test_the_commands_of_the_client(flight: Flight, tmp_path: Path) -> None:
    plan = tmp_path / "area.plan"
    area = square()
    corners = [[a, b] for a, b in zip(area.latitudes, area.longitudes, strict=True)]
    document = {
        "fileType": "Plan",
        "version": 1,
        "mission": {"items": []},
        "geoFence": {
            "version": 2,
            "polygons": [{"inclusion": True, "polygon": corners, "version": 1}],
            "circles": [],
        },
        "rallyPoints": {"version": 2, "points": [[*corners[0], 30.0]]},
    }
    plan.write_text(json.dumps(document))
    for command in ("fence", "rally"):
        code, text = run(flight, command, "--plan", str(plan))
        assert code == 0, text
    code, text = run(flight, "fence", "--json")
    shown = json.loads(text)
    assert (code, shown["event"], len(shown["areas"][0]["points_deg"])) == (0, "fence", 4)
    code, text = run(flight, "rally")
    assert code == 0
    assert "30 m above home" in text
    assert run(flight, "rally", "--clear")[0] == 0
    assert run(flight, "fence", "--clear")[0] == 0
    document["geoFence"] = {"version": 2, "polygons": [], "circles": []}
    plan.write_text(json.dumps(document))
    code, text = run(flight, "fence", "--plan", str(plan))
    assert code == 2
    assert "The plan has no fence." in text

    for suffix in (".params", ".parm"):
        saved = tmp_path / f"all{suffix}"
        code, text = run(flight, "parameters", "save", str(saved))
        assert code == 0, text
        assert run(flight, "parameters", "save", str(saved))[0] == 2, "it exists"
        code, text = run(flight, "parameters", "load", str(saved))
        assert code == 0, text
        assert ": 0 changed, " in text
    (tmp_path / "some.parm").write_text("WPNAV_SPEED 420\nNO_SUCH_ONE 1 # ours\n")
    code, text = run(flight, "parameters", "load", str(tmp_path / "some.parm"))
    assert code == 1, text
    assert "changed  WPNAV_SPEED" in text
    assert "unknown  NO_SUCH_ONE" in text
    code, text = run(flight, "parameters", "get", "WPNAV_SPEED", "--json")
    assert (code, json.loads(text)["value"]) == (0, 420.0)
    code, text = run(flight, "parameters", "get", "NO_SUCH_ONE")
    assert code == 3
    assert "NO_SUCH_ONE" in text


def test_a_client_that_is_killed_ends_its_loading(flight: Flight, tmp_path: Path) -> None:
    """Each value that cannot be read back takes 7 s, and others are rejected meanwhile."""
    listed, _ = act(flight, ListVehicleParameters, "vehicle_parameters/list")
    outputs = [p for p in listed.parameters if p.name.startswith("SERVO1")]
    assert len(outputs) > 30
    path = tmp_path / "many.parm"
    path.write_text("".join(f"{p.name} {p.value + 1.0}\n" for p in outputs))

    def is_busy() -> bool:
        request = {"name": "WPNAV_SPEED"}
        answer = call(flight, GetVehicleParameter, "vehicle_parameters/get", **request)
        return "Parameters are being read or changed" in answer.message

    # From the first change on: with answers, all would be changed before anyone looks.
    flight.relay.withheld_after = "PARAM_SET"
    flight.relay.withheld = frozenset({"PARAM_VALUE"})
    client = Process("client", [*CLIENT, "parameters", "load", str(path)], flight.environment)
    flight.wait(lambda: not flight.relay.withheld_after, 60.0, "the first change")
    client.signal(signal.SIGKILL)
    client.wait(10.0)
    assert is_busy()
    flight.wait(lambda: not is_busy(), 60.0, "the end of the loading")
    flight.relay.withheld = frozenset()


def test_nothing_is_written_while_a_goal_is_active_or_the_vehicle_armed(flight: Flight) -> None:
    record = flight.send(navigate_goal(20.0, 0.0, 3.0, speed=0.5))
    flight.wait_for_status(record, "NAVIGATING")
    answer = call(flight, SetFence, "set_fence", areas=[square()])
    assert not answer.success
    assert "is active; cancel it first." in answer.message
    request = {"name": "WPNAV_SPEED", "value": 333.0}
    answer = call(flight, SetVehicleParameter, "vehicle_parameters/set", **request)
    assert not answer.success
    assert "the vehicle is armed" in answer.message
    assert flight.call("hold").success
    elsewhere = square()
    elsewhere.latitudes = [latitude + 1.0 for latitude in elsewhere.latitudes]
    answer = call(flight, SetFence, "set_fence", areas=[elsewhere])
    assert not answer.success
    assert "would be outside" in answer.message
    answer = call(flight, SetFence, "set_fence", areas=[square()])
    assert answer.success, answer.message
    request["while_armed"] = True
    answer = call(flight, SetVehicleParameter, "vehicle_parameters/set", **request)
    assert answer.success, answer.message
