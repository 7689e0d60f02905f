"""The simulated vehicle in the place of ArduPilot's SITL program.

It listens where that one does: MAVLink on TCP, and the pilot's sticks as 16 little-endian words
of PWM microseconds on UDP. SIM_SPEEDUP changes how fast it runs.
"""

from __future__ import annotations

import argparse
import signal
import socket
import struct
import sys
from dataclasses import replace
from pathlib import Path

from mavlink_sitl.autopilot.parameters import ParameterSpec
from mavlink_sitl.config import PERSONALITIES, VehicleConfig
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.links.addresses import LinkAddress
from mavlink_sitl.simulation import Simulation
from mavlink_sitl.vehicles.vehicle import SimulatedVehicle
from mavlink_sitl.wall_clock_link import Runner

_CHANNELS = struct.Struct("<16H")
_DEFAULT_SPEEDUP = 10.0
# MAVLink is on the serial ports 0, 1 and 2, at these distances from the first one's TCP port.
_SERIALS = (0, 2, 3)


class Sticks:
    """The RC channels that the test's pilot sends over UDP, read without waiting."""

    def __init__(self, port: int, vehicle: SimulatedVehicle) -> None:
        """Listen on a loopback port."""
        self._vehicle = vehicle
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.setblocking(False)

    def look(self) -> None:
        """Pass the newest positions of the sticks to the vehicle."""
        newest = None
        while True:
            try:
                newest = self._socket.recv(64)
            except BlockingIOError:
                break
        if newest is not None and len(newest) == _CHANNELS.size:
            self._vehicle.firmware.pilot.receive(_CHANNELS.unpack(newest))

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def read_parameters(files: list[Path]) -> dict[str, float]:
    """Return the settings of files of names and values; later ones win."""
    values: dict[str, float] = {}
    for file in files:
        for line in file.read_text(encoding="utf-8").splitlines():
            words = line.partition("#")[0].replace(",", " ").split()
            if len(words) == 2:
                values[words[0]] = float(words[1])
    return values


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicle", choices=("copter", "rover", "plane"), required=True)
    parser.add_argument("--home", required=True, help="LAT,LON,ALT_AMSL_M,HEADING_DEG")
    parser.add_argument("--port", type=int, default=5760, help="TCP port of MAVLink")
    parser.add_argument("--sticks-port", type=int, default=5501, help="UDP port of the sticks")
    parser.add_argument("--speedup", type=float, default=_DEFAULT_SPEEDUP)
    parser.add_argument("--defaults", type=Path, nargs="*", default=[], help="parameter files")
    parser.add_argument(
        "--hidden", type=Path, help="file with names of parameters that are known, but not listed"
    )
    return parser.parse_args()


class Program:
    """ArduPilot's program, which a reboot starts again where it began, with its parameters."""

    def __init__(self, options: argparse.Namespace) -> None:
        """Prepare; `run` runs it."""
        self._options = options
        self._runner: Runner | None = None
        self._stopped = False

    def stop(self) -> None:
        """End `run`."""
        self._stopped = True
        if self._runner is not None:
            self._runner.stop()

    def run(self) -> None:
        """Run until `stop`."""
        options = self._options
        if options.hidden is not None:
            hide(options.vehicle, options.hidden.read_text(encoding="utf-8").split())
        parameters = _known(options.vehicle, read_parameters(options.defaults))
        while not self._stopped:
            parameters = self._run_once(parameters)

    def _run_once(self, parameters: dict[str, float]) -> dict[str, float]:
        """Run until a reboot; return the parameters that are stored then."""
        options = self._options
        latitude, longitude, altitude, heading = (float(each) for each in options.home.split(","))
        config = VehicleConfig(
            options.vehicle,
            home=GeoPoint(latitude, longitude, altitude),
            heading_deg=heading,
            parameters=parameters,
            links=("gcs",) * len(_SERIALS),
        )
        simulation = Simulation([config])
        vehicle = simulation.vehicles[0]
        sticks = Sticks(options.sticks_port, vehicle)

        def look() -> None:
            sticks.look()
            if vehicle.firmware.boot_s > 0.0:
                runner.stop()

        links = [LinkAddress("tcpin", "127.0.0.1", options.port + each) for each in _SERIALS]
        self._runner = runner = Runner(simulation, links, options.speedup, look)
        print(f"Listening on {', '.join(map(str, links))}", flush=True)
        try:
            runner.run()
        finally:
            runner.close()
            sticks.close()
        return {name: vehicle.parameters[name] for name in vehicle.parameters.specs}


def main() -> int:
    """Run until SIGTERM."""
    program = Program(_options())
    # The suite's end closes the terminal of this program.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: program.stop())
    program.run()
    return 0


def hide(vehicle: str, names: list[str]) -> None:
    """Have the firmware know these parameters by name, and not list them.

    The real one knows all of a part that is switched off so. They have no effect here. Names
    that act in another vehicle type are that one's, and stay unknown.
    """
    kind = vehicle, "ardupilot"
    personality = PERSONALITIES[kind]
    known = set(personality.parameter_table.specs)
    for other in PERSONALITIES.values():
        known.update(other.parameter_table.acting)
    specs = (ParameterSpec(name, 0.0, listed=False) for name in names if name not in known)
    PERSONALITIES[kind] = replace(personality, parameters=(*personality.parameters, *specs))


def _known(vehicle: str, values: dict[str, float]) -> dict[str, float]:
    """Return the settings whose names the simulated firmware has."""
    names = Simulation([VehicleConfig(vehicle)]).vehicles[0].parameters
    return {name: value for name, value in values.items() if name in names}


if __name__ == "__main__":
    sys.exit(main())
