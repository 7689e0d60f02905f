"""`.plan` files of QGroundControl as items. No ROS.

Format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html. Versions 3.0
and 3.1 wrote four `params` and a `coordinate`, later ones seven `params` (MissionItem.cc).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping

from mavlink_vehicle.codec import mavlink
from navigation_bridge.plan_files.items import PlanError, PlanItem

_PX4 = mavlink.MAV_AUTOPILOT_PX4


def is_json(text: str) -> bool:
    """Return whether a text begins like JSON, as a plan does."""
    return text.lstrip().startswith(("{", "["))


def members_of(value: object) -> Mapping[str, object]:
    """Return the members of a JSON object; anything else has none."""
    return value if isinstance(value, dict) else {}


def plan_document(text: str) -> Mapping[str, object]:
    """Return the JSON object of a `.plan` file's text.

    Raises:
        PlanError: it is not one.
    """
    try:
        document = members_of(json.loads(text))
    except (ValueError, RecursionError) as error:  # also a number with thousands of digits
        line = f"line {error.lineno}: " if isinstance(error, json.JSONDecodeError) else ""
        raise PlanError(f"{line}not valid JSON.") from None
    if "MAV_AUTOPILOT" in document:
        raise PlanError(
            "a mission file of QGroundControl 3.0 or older; open it in QGroundControl and save it "
            "as a plan."
        )
    if not isinstance(document.get("mission"), dict) or document.get("fileType") != "Plan":
        raise PlanError("not a QGroundControl plan (fileType 'Plan' with a mission).")
    return document


def plan_items(document: Mapping[str, object]) -> tuple[list[PlanItem], list[str], bool]:
    """Return the items of a plan, notes, and whether a heading of 0 is meant as such.

    Raises:
        PlanError: an item is none, or lacks its waypoints.
    """
    mission = members_of(document["mission"])
    entries = mission.get("items")
    if not isinstance(entries, list):
        raise PlanError("the mission has no item list.")
    notes = []
    for key, what, command in (
        ("geoFence", ("polygons", "circles", "polygon"), "fence"),
        ("rallyPoints", ("points",), "rally"),
    ):
        if any(members_of(document.get(key)).get(name) for name in what):
            text = f"The plan's {key} is not sent to the vehicle; the command {command} does that."
            notes.append(text)
    items: list[PlanItem] = []
    for number, entry in enumerate(entries, start=1):
        items += _entry(entry, f"item {number}")
    return items, notes, mission.get("firmwareType") == _PX4


def _entry(entry: object, where: str) -> Iterator[PlanItem]:
    if not isinstance(entry, dict):
        raise PlanError(f"{where} is not an object.")
    if entry.get("type") == "SimpleItem":
        yield _simple(entry, where)
        return
    if entry.get("type") != "ComplexItem":
        raise PlanError(f"{where} is a {entry.get('type')!r}; only SimpleItem is supported.")
    name = entry.get("complexItemType")
    inner = members_of(entry.get("TransectStyleComplexItem")).get("Items")
    if not isinstance(inner, list) or not inner:
        raise PlanError(
            f"{where} is a complex item ({name}) without its waypoints; open the plan in "
            "QGroundControl and save it again, or convert it to simple items."
        )
    for place, item in enumerate(inner, start=1):
        inside = f"{where} ({name}), its item {place}"
        if not isinstance(item, dict) or item.get("type") != "SimpleItem":
            raise PlanError(f"{inside} is not a SimpleItem.")
        yield _simple(item, inside)


def _simple(entry: Mapping[str, object], where: str) -> PlanItem:
    command, frame, params = entry.get("command"), entry.get("frame"), entry.get("params")
    if type(command) is not int or type(frame) is not int:
        raise PlanError(f"{where}: command and frame must be integers.")
    place = entry.get("coordinate")
    if isinstance(params, list) and isinstance(place, list) and len(params) == 4:
        params = [*params, *place]
    if not isinstance(params, list) or len(params) != 7:
        raise PlanError(f"{where} does not have seven params, or four and a coordinate.")
    continues = entry.get("autoContinue", True)
    if not isinstance(continues, bool):
        raise PlanError(f"{where}: autoContinue is neither true nor false.")
    values = []
    for number, value in enumerate(params, start=1):
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
            raise PlanError(f"{where}: param {number} is {value!r}, not a number.")
        try:
            values.append(math.nan if value is None else float(value))
        except OverflowError:
            raise PlanError(f"{where}: param {number} is too large.") from None
    return PlanItem(where, command, frame, tuple(values), continues)
