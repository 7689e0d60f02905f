"""Time limits of the benchmarks. They catch what hangs, and must not depend on the machine's load.

A wait for another process in real time has ten times what an idle machine needs. Work has a limit
of processor time.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
READY_S = 100.0
"""For a server to start and hear its vehicle, and for a vehicle to take off: seconds where idle"""
LATE_S = 60.0
"""For what is to happen at once"""
_LOAD = 10.0


def run_module(module: str, arguments: list[str], cpu_s: float) -> dict[str, Any]:
    """Run a module in a process of its own, and return what it prints as JSON.

    Args:
        module: its name, as for ``python -m``.
        arguments: its arguments.
        cpu_s: after so much processor time it is ended, and after ten times as long at the latest.

    Raises:
        RuntimeError: it failed, or was ended.
    """
    command = [sys.executable, "-m", module, *arguments]
    done = subprocess.run(
        command,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        check=False,
        timeout=_LOAD * cpu_s,
        preexec_fn=partial(_limit, int(cpu_s)),
    )
    if done.returncode:
        called = " ".join([module, *arguments])
        raise RuntimeError(f"{called} ended with {done.returncode}; its limit is {cpu_s:g} s")
    return dict(json.loads(done.stdout))


def _limit(cpu_s: int) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
