"""Small recordings of flights in the simulator: every kind of vehicle, and what can go wrong.

    python -m tests.support.flights.made_flights [NAME ...]

writes them to `tests/replay/data/made`, the same each time. They are read as they are; make them
again only when what is recorded has changed, and look at what `--update-golden` then changes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from mavlink_sitl import RangeSensor, SimulatedVehicle, VehicleConfig, World
from mavlink_vehicle.codec import Codec, Message, make, mavlink
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.requests import LandRequest, WaypointRequest, WaypointsRequest
from tests.support.flights.recorded_flight import Recorder
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.worlds.enclosures import PEN

FOLDER = Path(__file__).resolve().parents[2] / "replay/data/made"
_BULK_HZ = 2.0
_LOW_BATTERY = {"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0}
_FENCE = {"FENCE_TYPE": 3.0, "FENCE_RADIUS": 200.0, "AVOID_ENABLE": 0.0}
_GCS_LOSS = {"FS_GCS_ENABLE": 1.0, "FS_GCS_TIMEOUT": 3.0}

Course = Callable[["MadeFlight"], None]


class MadeFlight(SimulatedFlight):
    """A flight that is recorded from the vehicle's power-up."""

    def __init__(
        self,
        path: Path,
        autopilot: str,
        vehicle: str,
        values: dict[str, float],
        world: World | None,
        **parameters: ParameterValue,
    ) -> None:
        super().__init__(
            simulated=VehicleConfig(
                autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0, parameters=values
            ),
            world=world,
            battery_policy="ignore",
            feedback_rate_hz=1.0,
            volume_radius_m=3000.0,
            **parameters,  # type: ignore[arg-type]
        )
        self.recorder = Recorder(self, path, _BULK_HZ)
        self._station = Codec(255, 190)

    def under_way(self) -> str:
        """Start a goal far off; it is on its way there when this returns."""
        self.ready()
        far = (0.0, 900.0, 70.0) if self.kind == "plane" else (40.0, 0.0, self.height_m)
        goal_id = self.send(*far, speed=0.0 if self.kind == "plane" else 5.0)
        self.run_until(lambda: self.status(goal_id) == "NAVIGATING", 120.0)
        self.run_for(3.0)
        return goal_id

    @property
    def height_m(self) -> float:
        return 4.0 if self.kind == "copter" else 0.0

    def station_says(self, message: Message) -> None:
        """A ground station beside the server speaks to the vehicle."""
        data = self._station.encode(message)
        (parsed,) = Codec(1, 1).decode(data)
        self.bridge.overhear(parsed, self.now)
        self.recorder.write(data)
        self.simulation.link.write(data)


def _goals(flight: MadeFlight) -> None:
    flight.ready()
    if flight.kind == "plane":
        goal_id = flight.under_way()
        flight.run_for(8.0)
        flight.bridge.goals.cancel(goal_id, flight.now)
        flight.run_to_end(goal_id)
        return
    flight.check(flight.request(9e5, 0.0, 3.0))
    flight.run_to_end(flight.send(6.0, 3.0, flight.height_m))
    if flight.kind == "boat":
        return
    route = WaypointsRequest(
        (
            WaypointRequest((6.0, 6.0, flight.height_m)),
            WaypointRequest((3.0, 6.0, flight.height_m)),
        )
    )
    flight.run_to_end(flight.start(route))
    if flight.kind == "copter":
        flight.run_to_end(flight.start(LandRequest()))


def _ends(trouble: Course, flight: MadeFlight) -> None:
    goal_id = flight.under_way()
    trouble(flight)
    flight.run_to_end(goal_id, 60.0)


def _cut(flight: MadeFlight) -> None:
    flight.link_up = False
    flight.run_for(20.0)
    flight.link_up = True
    flight.run_for(2.0)


def _gap(flight: MadeFlight) -> None:
    flight.link_up = False
    flight.run_for(3.5)
    flight.link_up = True


def _pull_fence_in(flight: MadeFlight) -> None:
    parameters = flight.simulation.vehicles[0].parameters
    parameters.set("FENCE_RADIUS", 5.0)
    parameters.set("FENCE_ENABLE", 1.0)


def _station_goes(flight: MadeFlight) -> None:
    for _ in range(4):
        flight.station_says(make("HEARTBEAT", type=mavlink.MAV_TYPE_GCS, autopilot=8))
        flight.run_for(1.0)


def _station_pauses(flight: MadeFlight) -> None:
    command = mavlink.MAV_CMD_DO_PAUSE_CONTINUE
    flight.station_says(
        make("COMMAND_LONG", target_system=1, target_component=1, command=command, param1=0.0)
    )


def _pilot(mode: str) -> Course:
    return lambda flight: flight.set_mode_as_pilot(mode)


def _walled_in(flight: MadeFlight) -> None:
    flight.ready()
    flight.run_for(1.0)
    goal_id = flight.start(flight.request(0.0, 12.0, 3.0, avoid=True))
    flight.run_to_end(goal_id, 60.0)


def _vehicle(act: Callable[[SimulatedVehicle], object]) -> Course:
    def course(flight: MadeFlight) -> None:
        act(flight.simulation.vehicles[0])

    return course


class Recipe:
    """How a recording is made."""

    def __init__(
        self,
        course: Course,
        autopilot: str = "ardupilot",
        vehicle: str = "copter",
        values: dict[str, float] | None = None,
        world: World | None = None,
        **parameters: ParameterValue,
    ) -> None:
        self._course = course

        def make_flight(path: Path) -> MadeFlight:
            return MadeFlight(path, autopilot, vehicle, values or {}, world, **parameters)

        self._make = make_flight

    def fly(self, path: Path) -> MadeFlight:
        """Fly and record."""
        flight = self._make(path)
        self._course(flight)
        flight.recorder.close()
        return flight


RECIPES: dict[str, Recipe] = {
    **{
        f"{autopilot}_{vehicle}_goals": Recipe(_goals, autopilot, vehicle)
        for autopilot in ("ardupilot", "px4")
        for vehicle in ("copter", "rover", "plane", "boat")
    },
    "link_cut": Recipe(partial(_ends, _cut)),
    "link_gap": Recipe(partial(_ends, _gap)),
    "px4_link_cut": Recipe(partial(_ends, _cut), "px4"),
    "battery_failsafe": Recipe(
        partial(_ends, _vehicle(lambda v: v.set_battery_voltage(10.0))), values=_LOW_BATTERY
    ),
    "fence": Recipe(partial(_ends, _pull_fence_in), values=_FENCE),
    "radio_loss": Recipe(
        partial(_ends, _vehicle(lambda v: v.lose_radio(True))), values={"FS_THR_ENABLE": 1.0}
    ),
    "gcs_loss": Recipe(partial(_ends, _station_goes), values=_GCS_LOSS),
    "gps_loss": Recipe(partial(_ends, _vehicle(lambda v: v.lose_gps()))),
    "pilot_override": Recipe(partial(_ends, _pilot("LOITER"))),
    "px4_pilot_override": Recipe(partial(_ends, _pilot("AUTO.LOITER")), "px4"),
    "reboot": Recipe(partial(_ends, _vehicle(lambda v: v.power_cycle()))),
    "px4_reboot": Recipe(partial(_ends, _vehicle(lambda v: v.power_cycle())), "px4"),
    "station_cancel": Recipe(partial(_ends, _station_pauses)),
    "no_path": Recipe(
        _walled_in,
        world=World(obstacles=PEN, range_sensor=RangeSensor(reach_m=8.0, noise_m=0.03)),
        blocked_timeout_s=2.0,
        volume_altitude_max_m=6.0,
    ),
}


def main(names: list[str]) -> int:
    """Make the recordings of these names, or all."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in names or RECIPES:
        path = FOLDER / f"{name}.tlog"
        flight = RECIPES[name].fly(path)
        ends = [finished.code.value for finished in flight.all(GoalFinished)]
        print(f"{name}: {flight.now:.0f} s, {path.stat().st_size // 1000} kB, {', '.join(ends)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
