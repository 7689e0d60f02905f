"""Draw docs/gimbal.png: ``python scripts/draw_gimbal.py``, a gimbal and a camera in a flight."""

from __future__ import annotations

import math
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib as mpl
from flight_pictures import save_picture

mpl.use("Agg")
from geographic_msgs.msg import GeoPoseStamped
from geometry_msgs.msg import Point, PoseStamped
from matplotlib import pyplot
from matplotlib.axes import Axes
from rclpy.action import ActionClient

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from custom_interfaces.action import NavigateWaypoints, PointGimbal, Takeoff  # noqa: E402
from custom_interfaces.msg import GimbalState, ImageCaptured, Waypoint, WaypointAct  # noqa: E402
from drone_navigation.qos import STREAM_QOS  # noqa: E402
from mavlink_vehicle.positions.frames import LocalFrame, equidistant_at  # noqa: E402
from navigation_bridge.names import POINT_GIMBAL_ACTION_NAME, SERVER_NODE_NAME  # noqa: E402
from tests.support.ros.ros_flight import Flight, GoalRecord  # noqa: E402

PICTURE = ROOT / "docs/gimbal.png"
_HEIGHT_M, _SPEED_M_S, _EVERY_M = 10.0, 3.0, 6.0
_FIRST, _SECOND = (20.0, 14.0), (-10.0, 16.0)
_CORNERS = ((4.0, 0.0), (36.0, 0.0), (36.0, 28.0), (4.0, 28.0), (4.0, 6.0))
_DOWN_FROM, _PASSED_M = 3, 5.0
_DOWN_RAD = -0.5 * math.pi
_ANSWER_S, _SIGHT_S = 20.0, 0.8
_LEAST_DEG = (-180.0, -60.0)
_LOOKS = {"ahead": "0.5", "at A": "tab:blue", "down": "tab:green", "at B": "darkorange"}


@dataclass(frozen=True)
class _Moment:
    """Vehicle and gimbal at one time, as the client had heard; angles in rad, from east."""

    time_s: float
    place_m: tuple[float, float, float]
    look: str
    demanded_rad: tuple[float, float]
    reported_rad: tuple[float, float]


@dataclass
class _Heard:
    """The messages of the server's topics so far."""

    poses: list[PoseStamped] = field(default_factory=list)
    places: list[GeoPoseStamped] = field(default_factory=list)
    photos: list[ImageCaptured] = field(default_factory=list)
    gimbal: list[GimbalState] = field(default_factory=list)

    def photo_places_m(self) -> list[tuple[float, float]]:
        """Return where the photos were taken, east and north in metres."""
        position, here = self.places[-1].pose.position, self.poses[-1].pose.position
        place = (position.latitude, position.longitude, position.altitude)
        projection = equidistant_at(position.latitude)
        frame = LocalFrame.through(place, (here.y, here.x, -here.z), projection)
        return [frame.enu_m((p.latitude, p.longitude, p.altitude))[:2] for p in self.photos]

    def moment(self, time_s: float, look: str) -> _Moment:
        """Return what is the case now."""
        pose, gimbal = self.poses[-1].pose, self.gimbal[-1]
        x, y, z = pose.position.x, pose.position.y, pose.position.z
        nose_rad = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        if look in ("at A", "at B"):
            target = _FIRST if look == "at A" else _SECOND
            east, north = target[0] - x, target[1] - y
            demanded = (-math.atan2(z, math.hypot(east, north)), math.atan2(north, east))
        else:
            demanded = (0.0 if look == "ahead" else _DOWN_RAD, nose_rad)
        yaw_rad = gimbal.yaw if gimbal.yaw_locked else gimbal.yaw + nose_rad
        return _Moment(time_s, (x, y, z), look, demanded, (gimbal.pitch, yaw_rad))


def main() -> None:
    """Fly a route with acts, point the gimbal beside it, and draw what the topics bring."""
    own = ("--param", "CAM1_TYPE=1", "--param", "MNT1_TYPE=1")
    with tempfile.TemporaryDirectory() as folder:
        flight = Flight(Path(folder), simulator=own)
        try:
            moments, photos_m = _fly(flight)
        finally:
            flight.close()
    figure = pyplot.figure(figsize=(9.0, 8.0), layout="constrained")
    parts = figure.subplot_mosaic([["above", "above"], ["pitch", "yaw"]], height_ratios=(1.7, 1.0))
    _draw_above(parts["above"], moments, photos_m)
    _draw_angle(parts["pitch"], moments, 0, "pitch above the horizon, degrees")
    _draw_angle(parts["yaw"], moments, 1, "yaw from east, degrees")
    save_picture(figure, PICTURE)


def _fly(flight: Flight) -> tuple[list[_Moment], list[tuple[float, float]]]:
    heard = _Heard()
    for kind, topic, into in (
        (PoseStamped, "pose", heard.poses),
        (GeoPoseStamped, "geo_pose", heard.places),
        (ImageCaptured, "image_captured", heard.photos),
        (GimbalState, "gimbal_state", heard.gimbal),
    ):
        flight.subscribe(kind, f"{SERVER_NODE_NAME}/{topic}", into.append, STREAM_QOS)
    client = ActionClient(flight.node, PointGimbal, POINT_GIMBAL_ACTION_NAME)
    if not client.wait_for_server(timeout_sec=_ANSWER_S):
        sys.exit("The server has no action for a gimbal.")
    _point(flight, client, PointGimbal.Goal())
    flight.wait_for_result(flight.send(Takeoff.Goal(height=_HEIGHT_M)))
    flight.wait(lambda: bool(heard.gimbal and heard.places), _ANSWER_S, "a state of the gimbal")
    route = NavigateWaypoints.Goal(waypoints=_waypoints(), max_speed=_SPEED_M_S)
    record, begun_s = flight.send(route), time.monotonic()
    moments: list[_Moment] = []
    seen, is_asked = 0, False
    while record.result is None:
        flight.spin_for(0.05)
        look = "at B" if is_asked else _look(record)
        if not is_asked and _is_on_last_leg(record):
            is_asked = True
            second = PointGimbal.Goal(mode=PointGimbal.Goal.POINT)
            second.target.header.frame_id = "map"
            second.target.point = Point(x=_SECOND[0], y=_SECOND[1])
            _point(flight, client, second)
        if len(heard.gimbal) > seen:
            seen = len(heard.gimbal)
            moments.append(heard.moment(time.monotonic() - begun_s, look))
    client.destroy()
    return moments, heard.photo_places_m()


def _waypoints() -> list[Waypoint]:
    photo = WaypointAct(kind=WaypointAct.PHOTO)
    at_first = WaypointAct(kind=WaypointAct.POINT, point=WaypointAct.POINT_POSITION)
    at_first.target = Point(x=_FIRST[0], y=_FIRST[1])
    down = WaypointAct(kind=WaypointAct.POINT, point=WaypointAct.POINT_ANGLE, pitch=_DOWN_RAD)
    every = WaypointAct(kind=WaypointAct.TRIGGER_DISTANCE, distance=_EVERY_M)
    end = WaypointAct(kind=WaypointAct.TRIGGER_DISTANCE)
    acts = ([at_first, photo], [photo], [down, photo, every], [end, photo], [photo])
    return [
        Waypoint(position=Point(x=x, y=y, z=_HEIGHT_M), acts=some)
        for (x, y), some in zip(_CORNERS, acts, strict=True)
    ]


def _point(flight: Flight, client: ActionClient, goal: PointGimbal.Goal) -> None:
    sent = client.send_goal_async(goal)
    flight.wait(sent.done, _ANSWER_S, "an answer to the goal for the gimbal")
    ended = sent.result().get_result_async()
    flight.wait(ended.done, _ANSWER_S, "the end of the goal for the gimbal")
    if not ended.result().result.success:
        sys.exit(ended.result().result.message)


def _look(record: GoalRecord) -> str:
    """Return what the gimbal was pointed at last by the route: its waypoint that comes next."""
    following = record.feedback[-1].current_waypoint if record.feedback else 0
    if following >= _DOWN_FROM:
        return "down"
    return "ahead" if following == 0 else "at A"


def _is_on_last_leg(record: GoalRecord) -> bool:
    """Return whether the acts of the last but one waypoint are done: they go before a request."""
    if not record.feedback or record.feedback[-1].current_waypoint < len(_CORNERS) - 1:
        return False
    position = record.feedback[-1].current_pose.pose.position
    return math.dist((position.x, position.y), _CORNERS[-2]) > _PASSED_M


def _draw_above(above: Axes, moments: list[_Moment], photos_m: list[tuple[float, float]]) -> None:
    drawn_s = -math.inf
    for now in moments:
        pitch_rad, yaw_rad = now.reported_rad
        if now.time_s < drawn_s + _SIGHT_S or pitch_rad > -0.1:
            continue
        drawn_s = now.time_s
        x, y, z = now.place_m
        away_m = z / math.tan(-pitch_rad)
        seen_m = (x + away_m * math.cos(yaw_rad), y + away_m * math.sin(yaw_rad))
        above.plot((x, seen_m[0]), (y, seen_m[1]), color=_LOOKS[now.look], lw=0.8)
    above.plot(*zip(*(now.place_m[:2] for now in moments), strict=True), "k-", lw=1.6)
    above.plot(*zip(*photos_m, strict=True), "o", color="tab:red", ms=6, label="photo")
    for name, (east, north) in (("A", _FIRST), ("B", _SECOND)):
        above.plot(east, north, "k*", ms=12)
        above.annotate(name, (east, north), (-16, 6), textcoords="offset points", weight="bold")
    for name, colour in _LOOKS.items():
        if name.startswith("at"):
            above.plot([], [], color=colour, lw=1.5, label=f"line of sight {name}")
    above.set(
        xlabel="east, m", ylabel="north, m", aspect="equal",
        title=f"From above, {_HEIGHT_M:g} m high",
    )  # fmt: skip
    above.legend(loc="upper left", bbox_to_anchor=(0.36, 0.93))


def _draw_angle(axes: Axes, moments: list[_Moment], which: int, title: str) -> None:
    times_s = [now.time_s for now in moments]
    demanded_deg = [_degrees(now.demanded_rad[which], which) for now in moments]
    reported_deg = [_degrees(now.reported_rad[which], which) for now in moments]
    axes.plot(times_s, demanded_deg, color="0.75", lw=5, label="demanded")
    axes.plot(times_s, reported_deg, "k.", ms=2.5, label="reported")
    for name, colour in _LOOKS.items():
        spent_s = [now.time_s for now in moments if now.look == name]
        axes.axvspan(spent_s[0], spent_s[-1], color=colour, alpha=0.12, lw=0)
        middle_s = 0.5 * (spent_s[0] + spent_s[-1])
        axes.text(
            middle_s, 1.01, name, transform=axes.get_xaxis_transform(), ha="center", color=colour
        )
    axes.set(xlabel="time, s", ylabel=title)
    axes.legend()


def _degrees(angle_rad: float, which: int) -> float:
    """Return an angle in degrees, within a turn in which none of the flight jumps."""
    least_deg = _LEAST_DEG[which]
    return (math.degrees(angle_rad) - least_deg) % 360.0 + least_deg


if __name__ == "__main__":
    main()
