"""The parameters of each personality: name, default value and type, in a file for each set.

The sets here are those that have an effect. The folder `whole` has everything that the real
firmware lists, as its own simulator dumped it (ArduPilot 4.7-dev with LOG_BACKEND_TYPE 0 and
BATT_CAPACITY 60000, PX4 v1.17).

Types are those of MAV_PARAM_TYPE, REAL32 where none is given; `unlisted` is what the firmware
leaves out of its list. Defaults are the firmware's where it has one and the recordings do not say
otherwise.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

from mavlink_sitl.autopilot.parameters import ParameterSpec, ParameterType


def table(name: str) -> tuple[ParameterSpec, ...]:
    """The parameters in `NAME.parm`."""
    text = resources.files(__name__).joinpath(f"{name}.parm").read_text("utf-8")
    rows = [line.split() for line in text.splitlines() if not line.startswith("#")]
    return tuple(_spec(*row) for row in rows)


@cache
def whole_list(name: str) -> tuple[ParameterSpec, ...]:
    """The parameters in `whole/NAME.parm`, read once."""
    return table(f"whole/{name}")


def _spec(name: str, default: str, kind: str = "REAL32", listed: str = "") -> ParameterSpec:
    return ParameterSpec(name, float(default), ParameterType[kind], listed != "unlisted")
