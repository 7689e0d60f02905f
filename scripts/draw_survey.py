"""Draw docs/survey.png: ``python scripts/draw_survey.py``, a survey around lakes as flown."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from flight_pictures import COLOURS, save_picture

mpl.use("Agg")
from matplotlib import pyplot
from matplotlib.patches import Polygon
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from mavlink_sitl import VehicleConfig  # noqa: E402
from navigation_bridge.goals.requests import WaypointsRequest  # noqa: E402
from navigation_bridge.goals.surveys import SurveyRequest, SurveyRoute, compute_survey  # noqa: E402
from tests.support.flights.simulated_flight import SimulatedFlight  # noqa: E402

PICTURE = ROOT / "docs/survey.png"
_BOUNDARY = ((10.0, 5.0), (110.0, 10.0), (120.0, 70.0), (60.0, 90.0), (5.0, 65.0))
_LAKES = (
    ((30.0, 25.0), (45.0, 22.0), (52.0, 34.0), (40.0, 44.0), (28.0, 38.0)),
    ((80.0, 45.0), (98.0, 50.0), (92.0, 62.0), (78.0, 60.0)),
)
_REQUEST = SurveyRequest(_BOUNDARY, _LAKES, height_m=20.0, spacing_m=8.0, entry=(0.0, 0.0))
_SPEED_M_S = 6.0


def main() -> None:
    """Plan, fly with both firmwares, and draw what the simulation knows of it."""
    route = compute_survey(_REQUEST)
    if not isinstance(route, SurveyRoute):
        raise SystemExit(route.message)
    figure, axes = pyplot.subplots(1, 2, figsize=(11.0, 4.6), layout="constrained", sharey=True)
    for axis, (autopilot, colour) in zip(axes, COLOURS.items(), strict=True):
        axis.add_patch(Polygon(_BOUNDARY, facecolor="0.93", edgecolor="0.5"))
        for lake in _LAKES:
            axis.add_patch(Polygon(lake, facecolor="lightskyblue", edgecolor="0.5"))
        track = _fly(autopilot, route)
        axis.plot(*track.T, color=colour, lw=1.2)
        axis.plot(*track[0], "k^", ms=7)
        axis.set(xlabel="east, m", aspect="equal", title=autopilot)
    axes[0].set(ylabel="north, m")
    save_picture(figure, PICTURE)


def _fly(autopilot: str, route: SurveyRoute) -> NDArray[np.float64]:
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0), battery_policy="ignore"
    ).ready()
    goal_id = flight.start(WaypointsRequest(route.waypoints, max_speed_m_s=_SPEED_M_S))
    track = []
    while not flight.ends(goal_id):
        flight.run_for(0.2)
        track.append(flight.truth()[0][:2])
    return np.array(track)


if __name__ == "__main__":
    main()
