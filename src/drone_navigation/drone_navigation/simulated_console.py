"""``make console``: simulator, navigation server, a camera's target and console, until Ctrl-C."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from drone_navigation.processes import ProcessError, ProcessGroup, free_udp_port

EXIT_OK = 0
EXIT_FAILED = 1
_CONSOLE = "drone_navigation.navigation_console"
_TARGET = ["python", "-m", "drone_navigation.navigation_target"]
# It lands on targets, and has a camera, a gimbal and a gripper: the page has buttons for all.
_HAS = ("PLND_ENABLED=1", "PLND_TYPE=1", "CAM1_TYPE=1", "MNT1_TYPE=1", "GRIP_ENABLE=1")
# A vehicle whose server hangs flies on for one second instead of three.
_PARAMETERS = ("GUID_TIMEOUT=1", *_HAS)
_SERVER = Path("bridge_config/simulated/ardupilot_copter.yaml")
_WORLD = Path("bridge_config/worlds/demo.yaml")


def main(args: list[str] | None = None) -> int:
    """Run all of them; the arguments are the console's. Return its exit code."""
    arguments = sys.argv[1:] if args is None else args
    for path in (_SERVER, _WORLD):
        if not path.exists():
            print(f"{path} not found; start in the folder of the repository.", file=sys.stderr)
            return EXIT_FAILED
    with tempfile.TemporaryDirectory() as folder:
        server = ["--config", str(_SERVER), "--tlog", str(Path(folder, "flight.tlog"))]
        simulator = ["--world", str(_WORLD)]
        simulator += [word for each in _PARAMETERS for word in ("--param", each)]
        camera = f"//127.0.0.1:{free_udp_port()}"
        simulator += ["--camera", f"udpout:{camera}"]
        try:
            with ProcessGroup() as group:
                environment = group.start_vehicle(server, simulator)
                target = [*_TARGET, "--link", f"udpin:{camera}"]
                group.start("navigation_target", target, environment)
                return group.run_in_terminal([_CONSOLE, *arguments], environment, ends_itself=True)
        except ProcessError as error:
            print(f"The console was not started: {error}", file=sys.stderr)
            return EXIT_FAILED
        except KeyboardInterrupt:
            print("Ended; the simulated vehicle is gone, too.", flush=True)
            return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
