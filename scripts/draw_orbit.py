"""Draw docs/orbit.png: ``python scripts/draw_orbit.py``, circles in wind as they were flown."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import matplotlib as mpl
from flight_pictures import COLOURS, save_picture

mpl.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.patches import Circle

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from mavlink_sitl import VehicleConfig, Wind, World  # noqa: E402
from navigation_bridge.goals.requests import OrbitRequest  # noqa: E402
from tests.support.flights.simulated_flight import SimulatedFlight  # noqa: E402

PICTURE = ROOT / "docs/orbit.png"
_CENTRE, _RADIUS_M, _LAPS, _WIND_M_S = (35.0, 20.0, 0.0), 20.0, 2.0, 8.0
_REQUEST = OrbitRequest("map", _CENTRE, _RADIUS_M, 10.0, _LAPS, 5.0)
_NOSE_S, _NOSE_M = 2.5, 3.0


def main() -> None:
    """Fly with both firmwares, and draw what the simulation knows of it."""
    figure, (above, error) = pyplot.subplots(
        1, 2, figsize=(11.0, 5.0), width_ratios=(1.0, 1.3), layout="constrained"
    )
    above.add_patch(Circle(_CENTRE[:2], _RADIUS_M, fill=False, color="0.7", lw=4))
    above.plot(*_CENTRE[:2], "k+", ms=12)
    for autopilot, colour in COLOURS.items():
        _draw(autopilot, colour, above, error)
    above.annotate(
        f"wind, {_WIND_M_S:g} m/s", (22.0, 45.0), (-1.0, 44.4), arrowprops={"arrowstyle": "->"}
    )
    above.set(
        xlabel="east, m",
        ylabel="north, m",
        aspect="equal",
        ylim=(-3.0, 48.0),
        title="From above, and the nose",
    )
    error.axhspan(-0.03 * _RADIUS_M, 0.03 * _RADIUS_M, color="0.92")
    error.set(
        xlabel="laps flown", ylabel="distance from the circle, m",
        title="Outside and inside of the circle; grey: 3 % of the radius",
    )  # fmt: skip
    error.legend()
    save_picture(figure, PICTURE)


def _draw(autopilot: str, colour: str, above: Axes, error: Axes) -> None:
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0),
        world=World(wind=Wind((0.0, _WIND_M_S, 0.0))),
    ).ready()
    goal_id = flight.start(_REQUEST)
    path, laps, errors_m, nose_s = [], [], [], 0.0
    while not flight.ends(goal_id):
        flight.run_for(0.1)
        (east, north, _), _ = flight.truth()
        path.append((east, north))
        feedback, pose = flight.feedback(goal_id), flight.bridge.pose
        orbit = feedback[-1].orbit if feedback else None
        if orbit is None or pose is None or math.isnan(orbit.radius_error_m):
            continue
        away_m = math.hypot(east - _CENTRE[0], north - _CENTRE[1])
        laps.append(orbit.laps_flown)
        errors_m.append(away_m - _RADIUS_M)
        if flight.now >= nose_s and orbit.laps_flown < 1.0:
            nose_s = flight.now + _NOSE_S
            yaw = pose.yaw_enu_rad
            ahead = (east + _NOSE_M * math.cos(yaw), north + _NOSE_M * math.sin(yaw))
            above.plot(*zip((east, north), ahead, strict=True), color=colour, lw=1)
    above.plot(*zip(*path, strict=True), color=colour, lw=1)
    error.plot(laps, errors_m, color=colour, label=autopilot)


if __name__ == "__main__":
    main()
