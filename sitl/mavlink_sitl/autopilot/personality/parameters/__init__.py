"""The parameters of each personality: name, default value and type, in a file for each set.

The sets here are those that have an effect. The folder `whole` has everything that the real
firmware lists, as its own simulator dumped it (ArduPilot 4.7-dev with LOG_BACKEND_TYPE 0 and
BATT_CAPACITY 60000, PX4 v1.17).

The folder `versions` has what other releases have otherwise, one change a line:

- gone NAME
- new NAME DEFAULT [TYPE]; the same for another default or type
- acts NAME DEFAULT [TYPE]: the same for one that has an effect
- renamed NAME OTHER [FACTOR [OFFSET]]: the value under the recorded name is FACTOR times that under
  the other one, plus OFFSET

Types are those of MAV_PARAM_TYPE, REAL32 where none is given; `unlisted` is what the firmware
leaves out of its list. Defaults are the firmware's where it has one and the recordings do not say
otherwise.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

from mavlink_sitl.autopilot.parameters import Changes, ParameterSpec, ParameterType, Renamed


def table(name: str) -> tuple[ParameterSpec, ...]:
    """The parameters in `NAME.parm`."""
    return tuple(_spec(*row) for row in _rows(f"{name}.parm"))


@cache
def whole_list(name: str) -> tuple[ParameterSpec, ...]:
    """The parameters in `whole/NAME.parm`, read once."""
    return table(f"whole/{name}")


def exists(name: str) -> bool:
    """Whether there is a list of changes `versions/NAME.txt`."""
    return resources.files(__name__).joinpath(f"versions/{name}.txt").is_file()


@cache
def changes_in(name: str) -> Changes:
    """The changes in `versions/NAME.txt`, read once."""
    rows: dict[str, list[list[str]]] = {"gone": [], "new": [], "acts": [], "renamed": []}
    for kind, *row in _rows(f"versions/{name}.txt"):
        rows[kind].append(row)
    return Changes(
        gone=frozenset(name for (name,) in rows["gone"]),
        inert=tuple(_spec(*row) for row in rows["new"]),
        acting=tuple(_spec(*row) for row in rows["acts"]),
        renamed={old: Renamed(new, *map(float, numbers)) for old, new, *numbers in rows["renamed"]},
    )


def _rows(file: str) -> list[list[str]]:
    text = resources.files(__name__).joinpath(file).read_text("utf-8")
    return [line.split() for line in text.splitlines() if not line.startswith("#")]


def _spec(name: str, default: str, kind: str = "REAL32", listed: str = "") -> ParameterSpec:
    return ParameterSpec(name, float(default), ParameterType[kind], listed != "unlisted")
