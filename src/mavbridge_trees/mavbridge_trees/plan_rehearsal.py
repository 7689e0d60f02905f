"""A plan flown in the simulator before it is flown, in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from typing import Any

__all__ = ["PlanRehearsal"]

_COMMAND = (sys.executable, "-m", "flight_rehearsal")


class PlanRehearsal:
    """One run of `flight_rehearsal`; nobody waits for it."""

    def __init__(self, order: dict[str, object], until_s: float) -> None:
        """Begin.

        Args:
            order: what is known of the vehicle, and the steps.
            until_s: when it is given up, by the clock that `result` is asked with.

        Raises:
            OSError: the process cannot be started.
        """
        self._until_s = until_s
        # A file, as a pipe would fill up while nobody reads.
        self._output = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        self._process = subprocess.Popen(
            _COMMAND, stdin=subprocess.PIPE, stdout=self._output, text=True
        )
        if self._process.stdin is not None:
            self._process.stdin.write(json.dumps({**order, "number": 1}) + "\n")
            self._process.stdin.close()

    def result(self, now: float) -> dict[str, Any] | None:
        """Return a `flight_rehearsal.Rehearsal`, or its `error`; None while it continues."""
        if self._process.poll() is None and now < self._until_s:
            return None
        self._output.seek(0)
        lines = [json.loads(line) for line in self._output if line.endswith("\n")]
        self.close()
        for line in lines:
            if "rehearsal" in line:
                return dict(line["rehearsal"])
            if "error" in line:
                return {"error": line["error"]}
        return {"error": "It was given up." if now >= self._until_s else "It has failed."}

    def close(self) -> None:
        """End it."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        self._output.close()
