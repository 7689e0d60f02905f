"""The flight that shows whether this computer is fast enough, in a process of its own.

That process has the simulator, which no node may import, and neither ROS nor the vehicle's link.
"""

from __future__ import annotations

import json
import os
import platform
import selectors
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drone_navigation.check.sections import CheckSection
from drone_navigation.check.this_computer import Computer, computer_section, failed_section
from flight_rehearsal.trial import Trial
from mavlink_vehicle.io.this_computer import read_heat, read_memory_bytes, read_model
from navigation_bridge.configuration.parameter_table import ParameterValue

__all__ = ["TRIAL_S", "TrialFailedError", "tried_section", "try_computer"]

TRIAL_S = 10.0
_LIMIT_S = 60.0
"""Beyond the flight: Python, SciPy and the simulator start within seconds."""
_COMMAND = (sys.executable, "-m", "flight_rehearsal.computer_trial")

Values = Mapping[str, ParameterValue]


class TrialFailedError(Exception):
    """There is no result; the text says why, for people."""


def tried_section(vehicles: Sequence[Values], say: Callable[[str], None]) -> CheckSection:
    """Return the section about this computer, after a trial."""
    try:
        return computer_section(try_computer(vehicles, say))
    except TrialFailedError as error:
        return failed_section(str(error))


def try_computer(
    vehicles: Sequence[Values],
    say: Callable[[str], None],
    seconds: float = TRIAL_S,
    command: Sequence[str] = _COMMAND,
    limit_s: float = _LIMIT_S,
) -> Computer:
    """Fly the trial, and return what it shows of this computer.

    Args:
        vehicles: the parameters of each vehicle's server.
        say: takes the progress, for people.
        seconds: how long to fly.
        command: that of the process.
        limit_s: longest time to wait beyond that.

    Raises:
        TrialFailedError: there is no result.
    """
    say(f"{seconds:4.0f} s and the start of the simulator, trying this computer")
    order = {"vehicles": [_plain(values) for values in vehicles], "seconds": seconds}
    result = _run(command, json.dumps(order), say, seconds + limit_s)
    memory_bytes, available_bytes = read_memory_bytes()
    return Computer(
        model=read_model() or platform.processor(),
        architecture=platform.machine(),
        python=platform.python_version(),
        cores=len(os.sched_getaffinity(0)),
        memory_bytes=memory_bytes,
        available_bytes=available_bytes,
        heat=read_heat(),
        trial=result,
    )


def _plain(values: Values) -> dict[str, object]:
    return {
        name: list(value) if isinstance(value, list | tuple) else value
        for name, value in values.items()
    }


def _run(command: Sequence[str], order: str, say: Callable[[str], None], limit_s: float) -> Trial:
    end_s = time.monotonic() + limit_s
    with tempfile.TemporaryFile() as errors:
        try:
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors
            )
        except OSError as error:
            raise TrialFailedError(f"it cannot be started: {error.strerror}") from error
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            # Its end also ends the process.
            with process.stdin, process.stdout:
                process.stdin.write(order.encode() + b"\n")
                process.stdin.flush()
                for line in _lines(process.stdout.fileno(), end_s):
                    answer: dict[str, Any] = json.loads(line)
                    if "trial" in answer:
                        return Trial(**answer["trial"])
                    if "error" in answer:
                        raise TrialFailedError(answer["error"])
                    say(f"{answer['left_s']:4.0f} s left, trying this computer")
        except BrokenPipeError:
            pass  # it says why below
        finally:
            process.kill()
            process.wait()
        errors.seek(0)
        last = errors.read().decode(errors="replace").strip().rpartition("\n")[2]
        raise TrialFailedError(last.rstrip(".") or "the simulator has ended unexpectedly")


def _lines(number: int, end_s: float) -> Any:
    """Yield the lines of a pipe until its end.

    Raises:
        TrialFailedError: it takes too long.
    """
    waiting = b""
    with selectors.DefaultSelector() as selector:
        selector.register(number, selectors.EVENT_READ)
        while selector.select(max(end_s - time.monotonic(), 0.0)):
            data = os.read(number, 1 << 16)
            if not data:
                return
            waiting += data
            *lines, waiting = waiting.split(b"\n")
            yield from lines
    raise TrialFailedError("the simulator does not answer")
