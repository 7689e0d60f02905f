"""Reader of tlogs for reports: senders, times and the records of a flight. No ROS."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flight_logs.autopilot.as_tlog import is_autopilot_log, write_as_tlog
from flight_logs.frames.records import HEADERS, Records
from flight_logs.tlog import Counts, Tlog, iterate_tlog
from flight_logs.vehicles import Source, vehicle_ranks
from flight_reports.contents.message_rates import MessageRate, count_messages
from mavlink_vehicle.codec import Message, mavlink, with_source
from navigation_bridge import notes

Floats: TypeAlias = NDArray[np.float64]
Progress: TypeAlias = Callable[[int, int], None]

POSITIONS = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED")
ESTIMATORS = ("EKF_STATUS_REPORT", "ESTIMATOR_STATUS")
REQUESTS = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "MISSION_COUNT", "MISSION_CLEAR_ALL")
"""Messages that command an autopilot, besides setpoints."""
SETPOINTS = ("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT")
# Of these, only those of the server's notes are of use.
_NOTED = ("NAMED_VALUE_FLOAT", "NAMED_VALUE_INT", "DEBUG_FLOAT_ARRAY")
_RETOLD = (
    *POSITIONS,
    *REQUESTS,
    *_NOTED,
    "HEARTBEAT",
    "STATUSTEXT",
    "SYSTEM_TIME",
    "SYS_STATUS",
    "BATTERY_STATUS",
    "CURRENT_MODE",
    "EXTENDED_SYS_STATE",
    "FENCE_STATUS",
    "AUTOPILOT_VERSION",
    "COMMAND_ACK",
    "MISSION_ACK",
    "MISSION_CURRENT",
    "MISSION_REQUEST",
    "MISSION_REQUEST_INT",
)
KEPT = frozenset(
    {*_RETOLD, *SETPOINTS, *ESTIMATORS, "GPS_GLOBAL_ORIGIN", "OBSTACLE_DISTANCE"},
)
_CLASSES: dict[str, type[Message]] = {cls.msgname: cls for cls in mavlink.mavlink_map.values()}
# A time that is this much later than two of the next few, or this far from what is usual in the
# log, is damaged.
_SPIKE_S = 60.0
_NEXT_FEW = 5
_FAR_S = 3 * 86400.0
_MAVLINK_SINCE_S = 1_230_768_000.0  # 2009
# Of positions, a few are enough to see a restart by the time since boot.
_RETOLD_PERIOD_S = 0.5


@dataclass(frozen=True)
class LogContents:
    """A log, with times in seconds since its first packet, which never go back.

    Attributes:
        path: the file.
        begun_unix_s: when the first packet was recorded.
        duration_s: to the last packet.
        packets: `time_s`, `system`, `component`, `sequence_number` of every packet, by time.
        rates: how often each message came, by sender and name, in the recorder's own time.
        records: of those of them that are in `KEPT`.
        counts: what was met, beside the messages.
        times_mended: packets whose time can't be; they have that of the packet before.
        is_autopilots: it is the autopilot's own log, retold as telemetry; there was no link.
        damage: what of an autopilot's own log is damaged, a phrase each.
        remarks: what an autopilot's own log lacks, a sentence each.
    """

    path: Path
    begun_unix_s: float
    duration_s: float
    packets: Records
    rates: dict[tuple[Source, str], MessageRate]
    records: dict[str, Records]
    counts: Counts
    times_mended: int
    is_autopilots: bool = False
    damage: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def has_date(self) -> bool:
        """Whether the recorder's clock was set: no log is older than MAVLink."""
        return self.begun_unix_s >= _MAVLINK_SINCE_S

    def sources(self) -> list[Source]:
        """Return all senders, in order."""
        return sorted({source for source, _ in self.rates})

    @property
    def names(self) -> frozenset[str]:
        """Names of all messages in the log."""
        return frozenset(name for _, name in self.rates)

    def of(self, name: str, source: Source) -> Records | None:
        """Return the records of a message from one sender, None if there are none."""
        records = self.records.get(name)
        if records is None:
            return None
        system, component = source
        chosen = records[(records["system"] == system) & (records["component"] == component)]
        return chosen if len(chosen) else None

    def vehicles(self) -> dict[Source, int]:
        """Return the vehicles with their ranks, the best known first.

        Without HEARTBEAT of a vehicle these are the senders of positions, with rank 0.
        """
        heartbeats = self.records.get("HEARTBEAT")
        found = {} if heartbeats is None else vehicle_ranks(heartbeats)
        if found:
            return found
        places = [records for name in POSITIONS if (records := self.records.get(name)) is not None]
        return {source: 0 for records in places for source in _first_of_each(records)}

    def messages(self) -> Iterator[tuple[float, Message]]:
        """Yield (time in s, message) of the messages that show events, by time.

        Messages are renumbered for each sender, as much is left out.
        """
        times, kinds = [], []
        fields: list[tuple[type[Message], Records]] = []
        for name in _RETOLD:
            if (records := self.records.get(name)) is not None:
                chosen = records[_retold(name, records)]
                times.append(chosen["time_s"])
                kinds.append(np.full(len(chosen), len(fields)))
                fields.append((_CLASSES[name], chosen[["system", "component", *_names(name)]]))
        if not times:
            return
        time_s, kind = np.concatenate(times), np.concatenate(kinds)
        ready = [
            zip(itertools.repeat(cls), chosen.tolist(), strict=False) for cls, chosen in fields
        ]
        sequence: dict[Source, int] = {}
        for index in np.argsort(time_s, kind="stable").tolist():
            cls, (system, component, *values) = next(ready[kind[index]])
            number = sequence[system, component] = (sequence.get((system, component), -1) + 1) % 256
            made = cls(*map(_plain, values))
            message = with_source(made, system, component, number)
            yield float(time_s[index]), message


def read_log(path: Path, progress: Progress | None = None) -> LogContents:
    """Read a tlog, or an autopilot's own log.

    Raises:
        LogError: it can't be read, or is neither.
    """
    if not is_autopilot_log(path):
        return read_contents(path, progress)
    with tempfile.TemporaryDirectory() as folder:
        retold = Path(folder) / f"{path.name}.tlog"
        log = write_as_tlog(path, retold, progress)
        return replace(
            read_contents(retold),
            path=path,
            is_autopilots=True,
            damage=log.damage,
            remarks=log.remarks,
        )


def read_contents(path: Path, progress: Progress | None = None) -> LogContents:
    """Read a log.

    Raises:
        LogError: it can't be read, or is no tlog.
    """
    headers: list[Records] = []
    collected: dict[str, list[Records]] = {}
    rates: dict[tuple[Source, str], MessageRate] = {}
    counts, mended, usual_s = Counts(), 0, None
    for part in iterate_tlog(path, progress=progress):
        counts += part.counts
        for records in [*part.values(), part.unknown]:
            if len(records):
                usual_s = float(np.median(_all_times(part))) if usual_s is None else usual_s
                mended += _mend(records, usual_s)
        headers.append(_headers(part))
        for name, records in part.items():
            count_messages(rates, name, records)
        for name in KEPT & part.keys():
            collected.setdefault(name, []).append(part[name])
    packets = np.concatenate(headers) if headers else np.zeros(0, dtype=HEADERS)
    begun_s = float(packets["time_s"][0]) if len(packets) else 0.0
    kept = {}
    for name in list(collected):
        joined = np.concatenate(collected.pop(name))
        _since(joined, begun_s)
        kept[name] = joined
    _since(packets, begun_s)
    duration_s = float(packets["time_s"][-1]) if len(packets) else 0.0
    return LogContents(path, begun_s, duration_s, packets, rates, kept, counts, mended)


def _headers(part: Tlog) -> Records:
    """Return who sent each packet of a piece, of unknown messages, too, in the order of time."""
    parts = [*part.values(), part.unknown]
    headers: Records = np.zeros(sum(map(len, parts)), dtype=HEADERS)
    for name in HEADERS.names or ():
        headers[name] = np.concatenate([records[name] for records in parts])
    ordered: Records = headers[np.argsort(headers["time_s"], kind="stable")]
    return ordered


def _all_times(part: Tlog) -> Floats:
    return np.concatenate([records["time_s"] for records in [*part.values(), part.unknown]])


def _mend(records: Records, usual_s: float) -> int:
    """Give packets whose time can't be that of the packet before; return how many."""
    time_s: Floats = records["time_s"].copy()
    near = np.abs(time_s - usual_s) <= _FAR_S
    ahead = np.append(np.where(near, time_s, np.inf), np.full(_NEXT_FEW, np.inf))
    few = np.array([ahead[k : k + len(time_s)] for k in range(1, _NEXT_FEW + 1)])
    # Two of them, so that one that is too early damages none before it.
    good = near & (time_s <= np.sort(few, axis=0)[1] + _SPIKE_S)
    latest = np.maximum.accumulate(np.where(good, np.arange(len(time_s)), -1))
    first_s = float(time_s[np.argmax(good)]) if good.any() else usual_s
    records["time_s"] = np.where(latest >= 0, time_s[latest], first_s)
    return int((~good).sum())


def _since(records: Records, begun_s: float) -> None:
    """Count time from the start; a clock set back does not reverse the order."""
    records["time_s"] = np.maximum.accumulate(np.maximum(records["time_s"] - begun_s, 0.0))


def _first_of_each(records: Records) -> list[Source]:
    sources = list(zip(records["system"].tolist(), records["component"].tolist(), strict=True))
    return list(dict.fromkeys(sources))


def _retold(name: str, records: Records) -> NDArray[np.int64]:
    """Return the places of the records of a message that show events."""
    if name in _NOTED:
        return np.flatnonzero(records["component"] == notes.COMPONENT_ID)
    if name not in POSITIONS:
        return np.arange(len(records))
    # The first of each sender in each period.
    period = (records["time_s"] / _RETOLD_PERIOD_S).astype(np.int64)
    key = (period << 16) + (records["system"].astype(np.int64) << 8) + records["component"]
    places: NDArray[np.int64] = np.sort(np.unique(key, return_index=True)[1])
    return places


def _names(name: str) -> list[str]:
    """Return a message's fields in the order in which its class takes them."""
    return list(_CLASSES[name].fieldnames)


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value
