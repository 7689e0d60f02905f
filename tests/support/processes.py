"""Child processes of tests, with limits that a busy machine keeps."""

from __future__ import annotations

from drone_navigation import processes

_PATIENCE = 10.0
"""How much longer a machine with eight busy loops may take than an idle one"""
_LONGEST_S = 600.0
"""A test ends by its own timeout after 900 s"""
HANGS_AFTER_S = 300.0
"""Of a process that a test starts and that only computes. `make test-all` runs such tests at the
lowest priority: what takes 3 s of CPU took more than 55 s there."""
STARVED = ("The control loop is", "The server was suspended")
"""The server tells so that it did not get the processor"""


def patient_s(timeout_s: float) -> float:
    """Return how long to wait for what takes at most ``timeout_s`` on an idle machine."""
    return max(timeout_s, min(_PATIENCE * timeout_s, _LONGEST_S))


class Process(processes.Process):
    """A child process; what it is waited for is waited for longer."""

    def wait_for(self, fragment: str, timeout_s: float, *, after: int = 0) -> str:
        """Wait for a line that contains ``fragment``."""
        return super().wait_for(fragment, patient_s(timeout_s), after=after)

    def wait(self, timeout_s: float) -> int:
        """Wait for the end and return the exit code."""
        return super().wait(patient_s(timeout_s))
