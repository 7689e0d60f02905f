"""Draw docs/follow.png: ``python scripts/draw_follow.py``, beside a target as it was flown."""

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

from navigation_bridge.goals.requests import FollowRequest, TargetSource  # noqa: E402
from navigation_core.geometry import Vector3  # noqa: E402
from tests.support.flights.follow_flight import FollowFlight  # noqa: E402

PICTURE = ROOT / "docs/follow.png"
_SPEED_M_S, _LEG_M, _RADIUS_M, _LEAST_M = 4.0, 40.0, 15.0, 4.0
_REQUEST = FollowRequest(
    TargetSource("/target"), (-8.0, 0.0, 5.0), least_distance_m=_LEAST_M, max_speed_m_s=6.0
)
_TURN_S = math.pi * _RADIUS_M / _SPEED_M_S
_BACK_S = 2.0 * _LEG_M / _SPEED_M_S + _TURN_S
_COMES_S, _LOST_S, _END_S = 8.0, 4.0, 12.0


def main() -> None:
    """Fly with both firmwares, and draw what the simulation knows of it."""
    figure, (above, gap) = pyplot.subplots(
        1, 2, figsize=(11.0, 4.5), width_ratios=(1.0, 1.3), layout="constrained"
    )
    for autopilot, colour in COLOURS.items():
        _draw(autopilot, colour, above, gap)
    above.set(xlabel="east, m", ylabel="north, m", aspect="equal", title="From above")
    gap.axhspan(0.0, _LEAST_M, color="0.92")
    gap.axvspan(_BACK_S, _BACK_S + _COMES_S, color="tab:green", alpha=0.1)
    gap.axvspan(_BACK_S + _COMES_S, _BACK_S + _COMES_S + _LOST_S, color="tab:red", alpha=0.1)
    gap.set(
        xlabel="time, s", ylabel="distance to the target, m", ylim=(0.0, None),
        title="Grey: the least distance; green: it comes; red: it is not measured",
    )  # fmt: skip
    gap.legend()
    above.legend()
    save_picture(figure, PICTURE)


def _target(passed_s: float) -> Vector3:
    """To the east, back by a half circle to the left, then straight at who is behind."""
    leg_s = _LEG_M / _SPEED_M_S
    passed_s = min(passed_s, _BACK_S + 0.75 * _COMES_S)
    if passed_s <= leg_s:
        return (10.0 + _SPEED_M_S * passed_s, 0.0, 0.0)
    angle_rad = (passed_s - leg_s) * _SPEED_M_S / _RADIUS_M
    if angle_rad <= math.pi:
        east, north = math.sin(angle_rad), 1.0 - math.cos(angle_rad)
        return (10.0 + _LEG_M + _RADIUS_M * east, _RADIUS_M * north, 0.0)
    along_m = _SPEED_M_S * (passed_s - leg_s - _TURN_S)
    ahead_m = min(along_m, _LEG_M)
    backwards_m = along_m - ahead_m
    return (10.0 + _LEG_M - ahead_m + 0.7 * backwards_m, 2.0 * _RADIUS_M, 0.0)


def _draw(autopilot: str, colour: str, above: Axes, gap: Axes) -> None:
    flight = FollowFlight(_target, autopilot=autopilot, speed_max_m_s=8.0)
    flight.follow(_REQUEST)
    flight.chase(_BACK_S + _COMES_S)
    flight.is_seen = False
    flight.chase(_LOST_S)
    flight.is_seen = True
    flight.chase(_END_S)
    flown, followed = zip(*flight.places, strict=True)
    if autopilot == "ardupilot":
        above.plot([at[0] for at in followed], [at[1] for at in followed], "k--", label="target")
    above.plot([at[0] for at in flown], [at[1] for at in flown], color=colour, label=autopilot)
    gaps_m = [math.dist(*pair) for pair in flight.places]
    gap.plot(flight.times_s, gaps_m, color=colour, label=autopilot)


if __name__ == "__main__":
    main()
