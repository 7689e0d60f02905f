"""``make demo-fleet``: eight copters cross through one point; a ground station pauses one of them.

Bridges fly simulated vehicles, which can hit each other, over MAVLink in simulated time. The
flights are checked and drawn: a film from above, and from the side.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mavlink_vehicle.codec import Codec, make, mavlink
from tests.fleets.flown import Craft, FlownFleet
from tests.fleets.test_crossing import copters, cross, on_a_circle

mpl.use("Agg")
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle

try:
    import imageio_ffmpeg
except ImportError:
    imageio_ffmpeg = None

COUNT, RADIUS_M, HEIGHT_M = 8, 25.0, 6.0
PAUSED, PAUSE_S, RESUME_S = 2, 21.0, 33.0
BRAKE, GUIDED = 17, 4
FRAME_S, FRAMES_HZ = 0.4, 10
SIZE = (960, 544)
_TRAIL = 40


@dataclass
class Scene:
    """One picture of the film: time, places (N, 3: east, north, up), and what each is doing."""

    time_s: float
    places: NDArray[np.float64]
    states: list[str]


@dataclass
class Film:
    """Collects what happens, and draws it."""

    fleet: FlownFleet
    scenes: list[Scene] = field(default_factory=list)
    next_s: float = 0.0

    def watch(self, now: float) -> None:
        """Take a picture if it is time."""
        if now < self.next_s:
            return
        self.next_s = now + FRAME_S
        ned = self.fleet.simulation.positions_ned_m
        places = np.column_stack([ned[:, 1] + RADIUS_M, ned[:, 0], -ned[:, 2]])
        states = [
            ""
            if craft.bridge.goals.active is None or not craft.statuses()
            else craft.statuses()[-1]
            for craft in self.fleet.crafts
        ]
        self.scenes.append(Scene(now, places, states))

    def draw(self, folder: Path) -> list[Path]:
        """Write the film; return its files."""
        pictures = [self._picture(index) for index in range(len(self.scenes))]
        gif = folder / "fleet.gif"
        small = [Image.fromarray(picture).resize((640, 360)) for picture in pictures[::2]]
        frames = [image.quantize(48) for image in small]
        frames[0].save(
            gif, save_all=True, append_images=frames[1:], duration=200, loop=0, optimize=True
        )
        files = [gif]
        if imageio_ffmpeg is not None:
            mp4 = folder / "fleet.mp4"
            writer = imageio_ffmpeg.write_frames(str(mp4), SIZE, fps=FRAMES_HZ, codec="libx264")
            writer.send(None)
            for picture in pictures:
                writer.send(np.ascontiguousarray(picture))
            writer.close()
            files.append(mp4)
        return files

    def _picture(self, index: int) -> NDArray[np.uint8]:
        figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100)
        canvas: Any = FigureCanvasAgg(figure)
        above, beside = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
        scene = self.scenes[index]
        trail = np.array([one.places for one in self.scenes[max(index - _TRAIL, 0) : index + 1]])
        reach = RADIUS_M + 8.0
        for row, state in enumerate(scene.states):
            east, north, up = scene.places[row]
            colour = _colour(state)
            above.plot(trail[:, row, 0], trail[:, row, 1], color=colour, linewidth=1.0, alpha=0.5)
            half_m = 0.5 * self.fleet.separation.horizontal_m
            above.add_patch(Circle((east, north), half_m, color=colour, alpha=0.25))
            above.plot(east, north, "o", color=colour, markersize=4)
            above.annotate(f"{row + 1}", (east, north), fontsize=8, xytext=(4, 4),
                           textcoords="offset points")  # fmt: skip
            beside.plot(east, up, "o", color=colour, markersize=5)
        above.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="east, m",
                  ylabel="north, m", title=f"{scene.time_s:.0f} s")  # fmt: skip
        beside.set(xlim=(-reach, reach), ylim=(0.0, 25.0), xlabel="east, m", ylabel="height, m",
                   title="blue: flies; orange: waits; red: paused")  # fmt: skip
        figure.tight_layout()
        canvas.draw()
        return np.array(canvas.buffer_rgba(), dtype=np.uint8)[..., :3].copy()


def _colour(state: str) -> str:
    waits, paused = state == "WAITING_FOR_TRAFFIC", state in ("PAUSED", "HOLDING")
    return "tab:orange" if waits else "tab:red" if paused else "tab:blue" if state else "tab:gray"


def set_mode_by_station(fleet: FlownFleet, craft: Craft, mode: int) -> None:
    """A ground station changes the mode, through the server."""
    station = Codec(255, 190)
    command = make(
        "COMMAND_LONG", target_system=craft.row + 1, target_component=1,
        command=mavlink.MAV_CMD_DO_SET_MODE, confirmation=0, param1=1.0, param2=float(mode),
        param3=0.0, param4=0.0, param5=0.0, param6=0.0, param7=0.0,
    )  # fmt: skip
    data = station.encode(command)
    (parsed,) = Codec(1, 1).decode(data)
    craft.bridge.overhear(parsed, fleet.now)
    fleet.simulation.vehicles[craft.row].link.write(data)


def main() -> int:
    """Fly and draw; 0 if nobody came too near to anybody and all arrived."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/demo-fleet"), metavar="DIR")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    places = on_a_circle(COUNT, RADIUS_M)
    fleet = FlownFleet(copters(places), on_station_pause="pause").ready()
    film = Film(fleet)
    fleet.on_tick = film.watch
    cross(fleet, places, HEIGHT_M)
    begun_s, paused = fleet.now, fleet.crafts[PAUSED]
    fleet.run_for(PAUSE_S - begun_s)
    set_mode_by_station(fleet, paused, BRAKE)
    print(f"{fleet.now:.0f} s: a ground station pauses vehicle {PAUSED + 1}", flush=True)
    fleet.run_for(RESUME_S - PAUSE_S)
    set_mode_by_station(fleet, paused, GUIDED)
    print(f"{fleet.now:.0f} s: it resumes it", flush=True)
    try:
        fleet.run_to_end(300.0)
    except AssertionError as error:
        print(f"The demo failed: {error}", file=sys.stderr)
        return 1
    for craft in fleet.crafts:
        ((end_s, end),) = craft.ends()
        waited = craft.statuses().count("WAITING_FOR_TRAFFIC")
        print(f"{craft.name}: {end.message} After {end_s - begun_s:.0f} s, waited {waited} times")
    print(f"Least separation: {fleet.least_share:.2f} of the demanded one ({fleet.worst})")
    for path in film.draw(options.out):
        print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")
    crashed = fleet.simulation.truth.collided.any()
    arrived = all(craft.ends()[0][1].code.value == "SUCCESS" for craft in fleet.crafts)
    return 0 if arrived and fleet.least_share >= 1.0 and not crashed else 1


if __name__ == "__main__":
    sys.exit(main())
