"""Draw docs/view_rviz.png and docs/view_foxglove.png: ``python scripts/draw_views.py``.

Neither program runs here. A recorded flight among obstacles is replayed, and Matplotlib draws what
the server publishes of it: each topic that bridge_config/views names, as its display would.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import matplotlib as mpl
import numpy as np
import yaml
from PIL import Image
from scipy.spatial.transform import Rotation

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from drone_navigation.bag.topics import BagPublisher  # noqa: E402
from drone_navigation.tlog2mcap import convert  # noqa: E402
from mavlink_sitl import load_world  # noqa: E402
from tests.support.flights.recorded_flight import Recorder  # noqa: E402
from tests.support.flights.simulated_flight import SimulatedFlight  # noqa: E402
from tests.support.logs.bags import ReadBag, read_bag  # noqa: E402

VIEWS = ROOT / "bridge_config/views"
_GOAL = (2.0, 28.0, 4.0)
# Share of the plan's time at which the pictures are taken.
_MOMENT = 0.55
_DARK, _LIGHT = "#20242a", "#d6dbe2"
_AROUND_M = 22.0

_STYLE: dict[Any, Any] = {
    **dict.fromkeys(("text.color", "axes.labelcolor", "xtick.color", "ytick.color"), _LIGHT),
    **dict.fromkeys(("axes.facecolor", "figure.facecolor"), _DARK),
    "axes.edgecolor": "#6b7480",
    "font.size": 8,
}
mpl.rcParams.update(_STYLE)


class Replay:
    """The topics of a replay, up to the moment of the picture."""

    def __init__(self, bag: ReadBag) -> None:
        """Choose a moment on the way."""
        self._bag = bag
        plans = [time for time, plan in self._messages("/navigation_server/plan") if plan.poses]
        poses = [time for time, _ in self._messages("/navigation_server/pose")]
        self.now_ns = int(plans[0] + _MOMENT * (poses[-1] - plans[0]))

    def _messages(self, topic: str) -> list[tuple[int, Any]]:
        return self._bag.topics[topic].messages

    def until(self, topic: str) -> list[Any]:
        """Return the messages until then."""
        return [message for time, message in self._messages(topic) if time <= self.now_ns]

    def frames(self, names: set[str]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return place and axes (as columns) in map of frames that hang on it one by one."""
        moving = {one.child_frame_id: one.transform for one in self.until("/tf")[-1].transforms}
        place, turn = np.zeros(3), np.eye(3)
        found = {"map": (place, turn)}
        for name in ("odom", "base_link"):
            moved, q = moving[name].translation, moving[name].rotation
            place = place + turn @ (moved.x, moved.y, moved.z)
            turn = turn @ Rotation.from_quat((q.x, q.y, q.z, q.w)).as_matrix()
            found[name] = (place, turn)
        return {name: frame for name, frame in found.items() if name in names}


def main() -> None:
    """Fly, replay, and draw both."""
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder, "flight.tlog"), Path(folder, "flight.mcap")
        world = load_world(ROOT / "bridge_config/worlds/demo.yaml")
        flight = SimulatedFlight(world=world)
        recorder = Recorder(flight, log)
        flight.ready()
        flight.run_to_end(flight.start(flight.request(*_GOAL, avoid=True)), 200.0)
        recorder.close()
        # The grid is published on demand, and a viewer demands it.
        with patch.object(BagPublisher, "get_subscription_count", return_value=1):
            convert(log, out)
        replay = Replay(read_bag(out))
    draw_rviz(replay)
    draw_foxglove(replay)


def draw_rviz(replay: Replay) -> None:
    """Draw the displays of the RViz configuration."""
    path = VIEWS / "mavbridge.rviz"
    view = yaml.safe_load(path.read_text("utf-8"))["Visualization Manager"]
    figure, axes = plt.subplots(figsize=(10, 6.2), subplot_kw={"projection": "3d"})
    for display in view["Displays"]:
        name = display["Class"].removeprefix("rviz_default_plugins/")
        if name == "TF":
            names = {name for name, shown in display["Frames"].items() if shown is not False}
            draw_frames(axes, replay.frames(names))
        elif name != "Grid":
            DRAWN[name](axes, replay.until(display["Topic"]["Value"]))
    finish(axes, replay)
    labels = "\n".join(f"☑ {display['Name']}" for display in view["Displays"])
    figure.text(0.02, 0.96, f"Displays\nFixed Frame: map\n{labels}", va="top", linespacing=1.7)
    save(figure, "view_rviz.png")


def draw_foxglove(replay: Replay) -> None:
    """Draw the panels of the Foxglove layout."""
    layout = json.loads((VIEWS / "foxglove_layout.json").read_text("utf-8"))
    panels = layout["configById"]
    figure = plt.figure(figsize=(12, 7))
    for name, (left, bottom, width, height) in places(layout["layout"], (0.0, 0.0, 1.0, 1.0)):
        kind, panel = name.split("!")[0], panels[name]
        inner = (left + 0.05 * width, bottom + 0.2 * height, 0.88 * width, 0.66 * height)
        figure.text(left + 0.01, bottom + height - 0.03, kind, weight="bold")
        if kind == "3D":
            axes = figure.add_axes((left, bottom, width, height - 0.02), projection="3d")
            for topic in panel["topics"]:
                messages = replay.until(topic)
                DRAWN[type(messages[-1]).__name__](axes, messages)
            shown = {
                f.removeprefix("frame:") for f, v in panel["transforms"].items() if v["visible"]
            }
            draw_frames(axes, replay.frames(shown))
            finish(axes, replay)
        elif kind == "map":
            fixes = [(fix.longitude, fix.latitude) for fix in replay.until(panel["followTopic"])]
            axes = figure.add_axes(inner)
            axes.plot(*zip(*fixes, strict=True), ".", color="#5aaaff", markersize=3)
            axes.ticklabel_format(useOffset=False)
            axes.tick_params(axis="x", rotation=20)
            axes.margins(0.3)
        elif kind == "DiagnosticSummary":
            latest = replay.until(panel["topicToRender"])[-1]
            lines = [f"● {status.name}: {status.message}" for status in latest.status]
            figure.text(left + 0.01, bottom + height - 0.08, "\n".join(lines), va="top",
                        color="#50dc78", linespacing=1.9, fontsize=7)  # fmt: skip
        else:
            draw_series(figure.add_axes(inner), replay, panel["paths"], kind == "Plot")
    save(figure, "view_foxglove.png")


def places(layout: Any, box: tuple[float, ...]) -> list[tuple[str, tuple[float, ...]]]:
    """Return left, bottom, width and height of each panel of a layout."""
    if isinstance(layout, str):
        return [(layout, box)]
    left, bottom, width, height = box
    share = layout["splitPercentage"] / 100.0
    if layout["direction"] == "row":
        first = (left, bottom, share * width, height)
        second = (left + share * width, bottom, (1.0 - share) * width, height)
    else:
        first = (left, bottom + (1.0 - share) * height, width, share * height)
        second = (left, bottom, width, (1.0 - share) * height)
    return [*places(layout["first"], first), *places(layout["second"], second)]


def draw_series(axes: Any, replay: Replay, paths: list[dict[str, Any]], numbers: bool) -> None:
    """Draw fields over time: as lines, or as words where they change."""
    for row, path in enumerate(paths):
        topic, field = path["value"].split(".", 1)
        times, values = [], []
        for message in replay.until(topic):
            stamp, value = message.header.stamp, message
            for part in field.split("."):
                value = getattr(value, part)
            times.append(stamp.sec + stamp.nanosec * 1e-9 - replay.now_ns * 1e-9)
            values.append(value)
        if numbers:
            axes.plot(times, values, label=path["label"], linewidth=1.2)
            continue
        changes = [i for i in range(len(times)) if i == 0 or values[i] != values[i - 1]]
        ends = [*(times[i] for i in changes[1:]), 0.0]
        for i, (at, end) in enumerate(zip((times[i] for i in changes), ends, strict=True)):
            axes.barh(-row, end - at, left=at, color=plt.cm.tab10(i % 10), alpha=0.6)
            if end - at > 2.0:
                axes.text(at, -row, f" {values[changes[i]]}", va="center", clip_on=True)
    axes.set_xlim(-20.0, 0.0)
    if numbers:
        axes.legend(loc="upper left", facecolor=_DARK, edgecolor="#6b7480")
    else:
        axes.set_yticks([])


def draw_path(axes: Any, messages: list[Any]) -> None:
    """Draw the last path."""
    points = [one.pose.position for one in messages[-1].poses]
    axes.plot([p.x for p in points], [p.y for p in points], [p.z for p in points],
              color="#50dc78", linewidth=2.0)  # fmt: skip


def draw_markers(axes: Any, messages: list[Any]) -> None:
    """Draw the cubes of the last markers as squares of their size and height."""
    for marker in messages[-1].markers:
        offset = marker.pose.position
        for point in marker.points:
            at, size = (point.x + offset.x, point.y + offset.y, point.z + offset.z), marker.scale
            low, high = max(at[2] - size.z / 2, 0.0), min(at[2] + size.z / 2, 8.0)
            corner = (at[0] - size.x / 2, at[1] - size.y / 2, low)
            colour = (marker.color.r, marker.color.g, marker.color.b)
            axes.bar3d(*corner, size.x, size.y, high - low, color=colour, alpha=0.5)


def draw_grid(axes: Any, messages: list[Any]) -> None:
    """Draw the occupied cells of the last grid on the ground."""
    grid = messages[-1]
    cells = np.array(grid.data).reshape(grid.info.height, grid.info.width)
    north, east = np.nonzero(cells == 100)
    origin, side_m = grid.info.origin.position, grid.info.resolution
    axes.scatter(origin.x + (east + 0.5) * side_m, origin.y + (north + 0.5) * side_m, 0.0,
                 marker="s", s=3, color="#c05ae0")  # fmt: skip


def draw_poses(axes: Any, messages: list[Any]) -> None:
    """Draw arrows where the vehicle has been."""
    for message in messages[::4]:
        pose = getattr(message.pose, "pose", message.pose)
        yaw = 2.0 * np.arctan2(pose.orientation.z, pose.orientation.w)
        axes.quiver(pose.position.x, pose.position.y, pose.position.z, np.cos(yaw), np.sin(yaw), 0,
                    color="#5aaaff", linewidth=0.8)  # fmt: skip


def draw_frames(axes: Any, frames: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """Draw the axes of frames."""
    for number, (name, (at, turn)) in enumerate(frames.items()):
        for direction, colour in zip(turn.T, "rgb", strict=True):
            axes.plot(*np.stack([at, at + 2.0 * direction]).T, color=colour)
        axes.text(at[0], at[1], at[2] - 0.8 * (number + 1), name)


DRAWN: dict[str, Callable[[Any, list[Any]], None]] = {
    "Map": draw_grid, "OccupancyGrid": draw_grid, "MarkerArray": draw_markers,
    "Path": draw_path, "Odometry": draw_poses, "PoseStamped": draw_poses,
}  # fmt: skip
"""By RViz display and by message type."""


def finish(axes: Any, replay: Replay) -> None:
    """Look at the vehicle, from a side and above."""
    (east, north, _), _ = replay.frames({"base_link"})["base_link"]
    axes.set(xlim=(east - _AROUND_M, east + _AROUND_M), ylim=(north - _AROUND_M, north + _AROUND_M),
             zlim=(0.0, 12.0), xlabel="east [m]", ylabel="north [m]")  # fmt: skip
    axes.set_box_aspect((2, 2, 0.55), zoom=1.3)
    axes.view_init(elev=42, azim=-120)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.14, 0.16, 0.19, 1.0))


def save(figure: Any, name: str) -> None:
    """Write a picture into docs."""
    with tempfile.TemporaryFile() as shot:
        figure.savefig(shot, dpi=100)
        with Image.open(shot) as image:
            image.convert("RGB").quantize(128).save(ROOT / "docs" / name, optimize=True)
    plt.close(figure)


if __name__ == "__main__":
    main()
