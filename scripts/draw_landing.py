"""Draw docs/landing.png: ``python scripts/draw_landing.py``, landings on a target as flown."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import matplotlib as mpl
from flight_pictures import COLOURS, save_picture

mpl.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from navigation_bridge.goals.requests import LandRequest  # noqa: E402
from tests.support.flights.landing_flight import LandingFlight  # noqa: E402

PICTURE = ROOT / "docs/landing.png"
_TARGET, _WIND_M_S, _SEARCH_M, _LIMIT_S = (2.0, 3.0, 0.0), 5.0, 8.0, 200.0
_COVERED_BELOW_M, _COVERED_S = 4.0, 3.0
_REQUEST = LandRequest("/target", target_required=True, retries=2, search_height_m=_SEARCH_M)
_STEP_S = 0.1


def main() -> None:
    """Fly with both firmwares, and draw what the simulation knows of it."""
    figure, (above, height) = pyplot.subplots(
        1, 2, figsize=(11.0, 4.5), width_ratios=(1.0, 1.5), layout="constrained"
    )
    above.plot(*_TARGET[:2], "k+", ms=14)
    for autopilot, colour in COLOURS.items():
        _draw(autopilot, colour, above, height)
    above.set(xlabel="east, m", ylabel="north, m", aspect="equal", title="From above")
    height.axhline(_SEARCH_M, color="0.7", ls="--")
    height.set(
        xlabel="time, s", ylabel="height, m", ylim=(0.0, None),
        title="Thick: the camera does not see the target; dashed: the search height",
    )  # fmt: skip
    height.legend()
    save_picture(figure, PICTURE)


def _draw(autopilot: str, colour: str, above: Axes, height: Axes) -> None:
    flight = LandingFlight(autopilot, _TARGET, wind_m_s=_WIND_M_S)
    goal_id, start_s = flight.start(_REQUEST), flight.now
    covered_s: float | None = None
    times_s, places, hidden_m = [], [], []
    while not flight.ends(goal_id) and flight.now < start_s + _LIMIT_S:
        east, north, up = flight.truth()[0]
        if covered_s is None and up < _COVERED_BELOW_M:
            covered_s = flight.now
        flight.is_covered = covered_s is not None and flight.now < covered_s + _COVERED_S
        flight.look()
        flight.run_for(_STEP_S)
        times_s.append(flight.now - start_s)
        places.append((east, north, up))
        hidden_m.append(up if flight.is_covered else math.nan)
    east_m, north_m, up_m = zip(*places, strict=True)
    above.plot(east_m, north_m, color=colour)
    label = f"{autopilot}: {100.0 * flight.off_m:.0f} cm off the target"
    height.plot(times_s, up_m, color=colour, label=label)
    height.plot(times_s, hidden_m, color=colour, lw=5, alpha=0.4)


if __name__ == "__main__":
    main()
