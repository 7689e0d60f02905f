"""``make console``: simulator, navigation server and console, until Ctrl-C."""

from __future__ import annotations

import signal
import sys
import tempfile
from pathlib import Path
from types import FrameType

from drone_navigation.processes import ProcessError, run_in_terminal, simulated_vehicle

EXIT_FAILED = 1
_CONSOLE = "drone_navigation.navigation_console"
_SERVER = Path("bridge_config/simulated/ardupilot_copter.yaml")
_WORLD = Path("bridge_config/worlds/demo.yaml")


def main(args: list[str] | None = None) -> int:
    """Run all three; the arguments are the console's. Return its exit code."""
    arguments = sys.argv[1:] if args is None else args
    for path in (_SERVER, _WORLD):
        if not path.exists():
            print(f"{path} not found; start in the folder of the repository.", file=sys.stderr)
            return EXIT_FAILED
    signal.signal(signal.SIGINT, _interrupt)
    signal.signal(signal.SIGTERM, _interrupt)
    with tempfile.TemporaryDirectory() as folder:
        server = ["--config", str(_SERVER), "--tlog", str(Path(folder, "flight.tlog"))]
        # A vehicle whose server hangs flies on for one second instead of three.
        simulator = ["--world", str(_WORLD), "--param", "GUID_TIMEOUT=1"]
        try:
            with simulated_vehicle(server, simulator) as environment:
                return run_in_terminal([_CONSOLE, *arguments], environment, ends_itself=True)
        except ProcessError as error:
            print(f"The console was not started: {error}", file=sys.stderr)
            return EXIT_FAILED
        except KeyboardInterrupt:
            return EXIT_FAILED


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
