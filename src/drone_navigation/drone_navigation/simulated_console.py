"""``make console``: simulator, navigation server and console, until Ctrl-C."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from drone_navigation.processes import ProcessError, ProcessGroup

EXIT_OK = 0
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
    with tempfile.TemporaryDirectory() as folder:
        server = ["--config", str(_SERVER), "--tlog", str(Path(folder, "flight.tlog"))]
        # A vehicle whose server hangs flies on for one second instead of three.
        simulator = ["--world", str(_WORLD), "--param", "GUID_TIMEOUT=1"]
        try:
            with ProcessGroup() as group:
                environment = group.start_vehicle(server, simulator)
                return group.run_in_terminal([_CONSOLE, *arguments], environment, ends_itself=True)
        except ProcessError as error:
            print(f"The console was not started: {error}", file=sys.stderr)
            return EXIT_FAILED
        except KeyboardInterrupt:
            print("Ended; the simulated vehicle is gone, too.", flush=True)
            return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
