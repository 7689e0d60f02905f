"""Reports what other stations make the autopilot do, once each, with the sender.

A sender may be a ground station beside us, another computer on board, or another station behind
the same link: anybody but the autopilot itself and ourselves. `hear` takes what they send to the
autopilot, `answered` what it answers them, and `mission_changed` what MISSION_CURRENT shows while
nobody was seen.

- Commands to other systems, or to a camera or gimbal, are nothing to us. A PX4 itself sends
  COMMAND_LONG to component 0 on every link (observed: gimbal), as the autopilot.
- A command is repeated until it is acknowledged, and a packet may come twice: that is one act.
  A message after the answer is another act: a station that clears two goals in a row means both.
- Another mission counts when the autopilot begins to take it, not when it is offered: it may be
  rejected.

Pure and of bounded size; `now` is in seconds.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass, field

from mavlink_vehicle.codec import Message, mavlink, target
from mavlink_vehicle.events import StationAct, StationActed, VehicleEvent
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.mission.transfer import ACCEPTED
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.stations.station_acts import Act, act_of, is_mission_list

REPEAT_S = 5.0
"""The same again within this time of the last is a repetition, not a new wish."""
CROSSED_S = 0.5
"""The same after the answer: the last repetition may have crossed it on the way."""
UPLOAD_S = 10.0
"""An upload is over after this time of silence; an ArduPilot gives up after 8 s."""
_STATIONS_MAX = 32
_NOTES = frozenset({StationAct.CHANGED_MODE, StationAct.CHANGED_ITEM})
_NOTES_MAX, _NOTES_TIME_S = 20, 10.0
"""More of those that ask nothing of us are a flood, and not reported."""
_REMEMBERED = 8

_COUNT = mavlink.MAVLink_mission_count_message
_PARTIAL = mavlink.MAVLink_mission_write_partial_list_message
_SET_MODE = mavlink.MAVLink_set_mode_message
_MISSION_ACK = mavlink.MAVLink_mission_ack_message
_COMMAND_ACK = mavlink.MAVLink_command_ack_message
_BY_MISSION_ACK = -1
_FOR_MISSIONS = (
    _COUNT,
    _PARTIAL,
    mavlink.MAVLink_mission_clear_all_message,
    mavlink.MAVLink_mission_set_current_message,
)
HEARD = (
    *_FOR_MISSIONS,
    _SET_MODE,
    mavlink.MAVLink_command_long_message,
    mavlink.MAVLink_command_int_message,
)
"""The messages of a station that can matter."""
ANSWERS = (
    _COMMAND_ACK,
    _MISSION_ACK,
    mavlink.MAVLink_mission_request_message,
    mavlink.MAVLink_mission_request_int_message,
)
"""The answers of the autopilot to others that can matter."""

Station = tuple[int, int]


@dataclass
class _Upload:
    """A mission that a station has offered, and whether it was reported already."""

    how: str
    heard_s: float
    what: StationAct = StationAct.REPLACED_MISSION
    reported: bool = False


@dataclass
class _Past:
    """The recent acts of one station: act, sequence number and when it was last heard."""

    acts: deque[tuple[Act, int, float]] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))
    upload: _Upload | None = None
    cleared_s: float | None = None
    awaits: int | None = None
    """The answer that the last act waits for: the command of a COMMAND_ACK, or _BY_MISSION_ACK."""
    answered_s: float | None = None


class StationWatch:
    """Turns other stations' conversations with the autopilot into `StationActed`."""

    def __init__(self) -> None:
        """Begin without stations."""
        self._stations: OrderedDict[Station, _Past] = OrderedDict()
        self.events: deque[VehicleEvent] = deque()
        self._notes_s: deque[float] = deque(maxlen=_NOTES_MAX)

    @property
    def stations(self) -> tuple[Station, ...]:
        """Stations heard talking to the autopilot, the latest last; at most 32."""
        return tuple(self._stations)

    def hear(self, message: Message, address: Address, profile: Profile, now: float) -> None:
        """Process a message of anybody on the network; most are nothing to us."""
        header = message._header
        station = (header.srcSystem, header.srcComponent)
        if not isinstance(message, HEARD) or station in _not_stations(address):
            return
        if not _reaches_autopilot(message, address):
            return
        if isinstance(message, (_COUNT, _PARTIAL)):
            if is_mission_list(message.mission_type):
                self._offered(message, self._past(station), profile, now)
            return
        act = act_of(message, profile)
        if act is None or not self._is_new(act, message, self._past(station), now):
            return
        if act.what not in _NOTES or self._has_room(now):
            self._report(station, act)

    def answered(self, message: Message, address: Address, now: float) -> None:
        """Process what the autopilot answers a station, whoever that is."""
        if not isinstance(message, ANSWERS) or not address.answers(message):
            return
        station = (message.target_system, message.target_component)
        past = self._stations.get(station)
        if past is None:
            return
        if past.answered_s is None and past.awaits == _answer_to(message):
            past.answered_s = now
        if isinstance(message, _COMMAND_ACK) or past.upload is None:
            return
        if not is_mission_list(message.mission_type):
            return
        upload = past.upload
        if now - upload.heard_s > UPLOAD_S:
            return
        upload.heard_s = now
        if not isinstance(message, _MISSION_ACK) or message.type == ACCEPTED:
            self._taken(station, upload)

    def mission_changed(self, what: StationAct, how: str, now: float) -> None:
        """Record that the stored mission is another one; reported unless it already was."""
        for station, past in reversed(self._stations.items()):
            if past.upload is not None and now - past.upload.heard_s <= UPLOAD_S:
                self._taken(station, past.upload)
                return
            if past.cleared_s is not None and now - past.cleared_s <= UPLOAD_S:
                return
        self.events.append(StationActed(what, None, how))

    def pause_changed(self, what: StationAct, how: str, now: float) -> None:
        """Record that it was paused, or resumed; reported unless a station was seen to do it."""
        for past in self._stations.values():
            if any(act.what is what and now - at <= REPEAT_S for act, _, at in past.acts):
                return
        self.events.append(StationActed(what, None, how))

    def next_event(self) -> VehicleEvent | None:
        """Return and remove the next event."""
        return self.events.popleft() if self.events else None

    def _past(self, station: Station) -> _Past:
        past = self._stations.setdefault(station, _Past())
        self._stations.move_to_end(station)
        if len(self._stations) > _STATIONS_MAX:
            self._stations.popitem(last=False)
        return past

    def _offered(self, message: Message, past: _Past, profile: Profile, now: float) -> None:
        how, what = "MISSION_WRITE_PARTIAL_LIST", StationAct.REPLACED_MISSION
        if message.__class__ is _COUNT:
            how = f"MISSION_COUNT {message.count}"
            home = 0 if profile.missions is None else profile.missions.offset
            # MAVSDK clears an ArduPilot's mission in this way: nothing but home is left.
            if message.count <= home:
                what = StationAct.CLEARED_MISSION
        upload = past.upload
        if upload is not None and upload.how == how and now - upload.heard_s <= REPEAT_S:
            upload.heard_s = now
            return
        past.upload = _Upload(how, now, what)

    def _taken(self, station: Station, upload: _Upload) -> None:
        if not upload.reported:
            upload.reported = True
            self._report(station, Act(upload.what, upload.how))

    def _is_new(self, act: Act, message: Message, past: _Past, now: float) -> bool:
        sequence = message._header.seq
        over = past.answered_s is not None and now - past.answered_s > CROSSED_S
        if act.what is StationAct.CLEARED_MISSION:
            past.cleared_s = now
        for index, (earlier, number, heard_s) in enumerate(past.acts):
            is_last = index == len(past.acts) - 1 and not over
            if earlier == act and now - heard_s <= REPEAT_S and (is_last or number == sequence):
                if is_last:
                    past.acts[index] = (act, sequence, now)
                return False
        past.acts.append((act, sequence, now))
        past.awaits, past.answered_s = _answer_to(message), None
        return True

    def _has_room(self, now: float) -> bool:
        if len(self._notes_s) == _NOTES_MAX and now - self._notes_s[0] < _NOTES_TIME_S:
            return False
        self._notes_s.append(now)
        return True

    def _report(self, station: Station, act: Act) -> None:
        self.events.append(StationActed(act.what, station, act.how, act.mode, act.command))


def _answer_to(message: Message) -> int:
    """Return what a message and its answer have in common."""
    if message.__class__ is _SET_MODE:
        return int(mavlink.MAV_CMD_DO_SET_MODE)
    return int(getattr(message, "command", _BY_MISSION_ACK))


def _not_stations(address: Address) -> tuple[Station, Station]:
    return (
        (address.target_system, address.target_component),
        (address.source_system, address.source_component),
    )


def _reaches_autopilot(message: Message, address: Address) -> bool:
    system, component = target(message)  # SET_MODE names no component
    if system not in (0, address.target_system):
        return False
    if component in (0, address.target_component):
        return True
    # mavlink_mission.cpp takes these for itself, too; an ArduPilot takes what nobody else does.
    planner = component == mavlink.MAV_COMP_ID_MISSIONPLANNER
    return planner and isinstance(message, _FOR_MISSIONS)
