"""`python -m mavlink_sitl`: a simulated autopilot as a program."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from mavlink_sitl.command_line.options import parse
from mavlink_sitl.command_line.summary import Summary
from mavlink_sitl.simulation import Simulation
from mavlink_sitl.wall_clock_link import LinkError, Runner

_BOLD, _DIM, _RESET = "\033[1m", "\033[2m", "\033[0m"


class ConsoleReporter:
    """Prints what changes: armed, mode, landed."""

    def __init__(self, simulation: Simulation, quiet: bool) -> None:
        self._simulation = simulation
        self._quiet = quiet
        self._colour = sys.stdout.isatty()
        self._seen: list[dict[str, str]] = [{} for _ in simulation.vehicles]

    def line(self, text: str) -> None:
        """Print a line with the simulated time."""
        if self._quiet:
            return
        time_s = f"{self._simulation.time_s:8.2f} s"
        if self._colour:
            time_s, text = f"{_DIM}{time_s}{_RESET}", f"{_BOLD}{text}{_RESET}"
        try:
            print(f"{time_s}  {text}", flush=True)
        except BrokenPipeError:
            # Whoever read the lines has gone; the flight continues, and so does the exit code.
            self._quiet = True
            sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115 - until the end

    def warn(self, text: str) -> None:
        """Print what is probably not meant."""
        self.line(f"warning: {text}")

    def watch(self) -> None:
        """Print what is not as it was."""
        for vehicle, seen in zip(self._simulation.vehicles, self._seen, strict=True):
            firmware = vehicle.firmware
            now = {
                "armed": "armed" if firmware.armed else "disarmed",
                "mode": f"mode {firmware.mode.spec.name}",
                "landed": firmware.landed_state.name.lower().replace("_", " "),
                "ready": "ready" if firmware.estimator.position_ok else "no position",
            }
            for key, word in now.items():
                if seen.get(key, word) != word:
                    self.line(f"vehicle {vehicle.system_id}: {word}")
            seen.update(now)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program.

    Returns:
        The exit code: 0 when ended by a signal, 1 when the summary could not be written, 2 when
        it could not start.
    """
    options, _ = parse(sys.argv[1:] if arguments is None else arguments)
    with ExitStack() as stack:
        try:
            log = stack.enter_context(Path(options.tlog).open("wb")) if options.tlog else None
            simulation = Simulation(
                options.vehicles,
                options.seed,
                log,
                world=options.world,
                collisions=options.collisions,
            )
            reporter = ConsoleReporter(simulation, options.quiet)
            summary = Summary(simulation) if options.summary else None

            def watch() -> None:
                reporter.watch()
                if summary is not None:
                    summary.watch()

            runner = Runner(
                simulation, options.link, options.speedup, watch, reporter.warn, options.camera
            )
        except LinkError as error:
            print(f"mavlink_sitl: {error}", file=sys.stderr)
            return 2
        except OSError as error:
            folder = Path(options.tlog).parent
            why = (
                error.strerror
                if folder.is_dir()
                else f"the folder {folder} does not exist; create it"
            )
            print(f"mavlink_sitl: cannot write {options.tlog}: {why}", file=sys.stderr)
            return 2
        stack.callback(runner.close)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: runner.stop())
        links = ", ".join(endpoint.describe() for endpoint in runner.endpoints)
        for config in options.vehicles:
            name = config.personality().name
            release = f" ({config.firmware})" if config.firmware else ""
            reporter.line(f"vehicle {config.system_id}: {name}{release} on {links}")
        runner.run()
        reporter.line("ended")
        if summary is not None:
            try:
                summary.write(Path(options.summary))
            except OSError as error:
                print(
                    f"mavlink_sitl: cannot write {options.summary}: {error.strerror}",
                    file=sys.stderr,
                )
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
