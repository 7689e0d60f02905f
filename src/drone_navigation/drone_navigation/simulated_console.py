"""``make console``: simulator, navigation server and console, until Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from types import FrameType

from drone_navigation.processes import (
    Process,
    ProcessError,
    free_domain,
    free_udp_port,
    ros_environment,
)

EXIT_FAILED = 1
_READY_TIMEOUT_S = 20.0
_END_TIMEOUT_S = 10.0
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
    environment = ros_environment(free_domain(os.getpid()))
    link = f"//127.0.0.1:{free_udp_port()}"
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            "navigation_server": [
                "drone_navigation.navigation_server", "--config", str(_SERVER),
                "--link", f"udpin:{link}", "--tlog", str(Path(folder, "flight.tlog")),
            ],
            # A vehicle whose server hangs flies on for one second instead of three.
            "mavlink_sitl": [
                "mavlink_sitl", "--link", f"udpout:{link}", "--world", str(_WORLD),
                "--param", "GUID_TIMEOUT=1",
            ],
        }  # fmt: skip
        processes: list[Process] = []
        try:
            for name, words in commands.items():
                processes.append(Process(name, ["python", "-m", *words], environment))
            processes[0].wait_for("Position valid", _READY_TIMEOUT_S)
            return _run_console(arguments, environment)
        except ProcessError as error:
            print(f"The console was not started: {error}", file=sys.stderr)
            return EXIT_FAILED
        except KeyboardInterrupt:
            return EXIT_FAILED
        finally:
            for process in reversed(processes):
                process.stop()


def _run_console(arguments: list[str], environment: dict[str, str]) -> int:
    # Its address goes directly to this terminal.
    console = subprocess.Popen(
        [sys.executable, "-m", "drone_navigation.navigation_console", *arguments], env=environment
    )
    try:
        return console.wait()
    except KeyboardInterrupt:
        console.send_signal(signal.SIGINT)
        return console.wait(_END_TIMEOUT_S)
    finally:
        if console.poll() is None:
            console.kill()
            console.wait()


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
