"""Check of a vehicle and its link for ``--check``, without moving anything. No ROS.

A :class:`Checker` runs in place of the server's application. It listens, asks for telemetry,
versions and parameters, and judges with the server's own bridge whether a goal would be
accepted now. It never starts one, so that nothing is sent that changes the vehicle.
"""

from __future__ import annotations

import logging
import math
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from mavlink_vehicle.codec import Message, mavlink, with_source
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.protocols.operations.command import CommandRequest
from mavlink_vehicle.protocols.parameters import ParameterReader
from mavlink_vehicle.state.identity import sender_name
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.goals.requests import NavigateRequest, Request, TakeoffRequest
from navigation_bridge.names import FRAME_BASE_LINK
from navigation_bridge.vehicle.link_health import LinkHealth
from navigation_bridge.vehicle.traits import traits_of
from navigation_core.safety.target_checks import Rejection

LOOK_S = 6.0
"""From the first HEARTBEAT: the telemetry is asked for, and its rates have settled."""

_WINDOW_S = 4.0
_PARAMETERS_S = 4.0
"""A parameter without an answer by then (a firmware gives none for one that it lacks)."""

_REASONS_AGAIN_S = 5.0


# Not sent by every firmware before its estimator has a position.
_NEED_POSITION = frozenset({"GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"})
_HEARD_MAX = 32
# Minimum observation to measure a message rate.
_RATE_S = 1.0


@dataclass(frozen=True)
class RequestedRate:
    """Rate of a message.

    Attributes:
        name: of the message.
        asked_hz: how often it was asked for.
        measured_hz: how often it came in the last seconds, since the first of them.
        refusal: why the vehicle does not send it, or None.
        own_hz: how often the firmware sends it at most, whatever is asked for; None: as asked.
        pending: why its rate cannot be judged yet, for people; empty when it can.
    """

    name: str
    asked_hz: float
    measured_hz: float
    refusal: str | None = None
    own_hz: float | None = None
    pending: str = ""

    @property
    def low(self) -> bool:
        """True if the rate is far too low; the slowest cannot be measured in this time."""
        expected_hz = min(self.asked_hz, self.own_hz or self.asked_hz)
        return not self.pending and expected_hz >= 1.0 and self.measured_hz < 0.4 * expected_hz


class Checker:
    """Listens to one vehicle and requests what a goal depends on."""

    def __init__(self, config: ServerConfig, statistics: Callable[[], LinkStatistics]) -> None:
        """Prepare for the vehicle of a configuration.

        Args:
            config: the server's settings.
            statistics: returns what the link has counted.
        """
        settings = config.vehicle
        if settings.heartbeat_type is None:
            # A PX4 that has heard a ground station takes the end of this check as its loss.
            settings = replace(settings, heartbeat_type=mavlink.MAV_TYPE_ONBOARD_CONTROLLER)
        # Whether the vehicle may be armed is said apart, so that it hides no other reason.
        goto = replace(config.bridge.goto, may_arm=True, may_take_off=True)
        self.config = config
        self.statistics = statistics
        self.vehicle = Vehicle(settings)
        self.heard: dict[tuple[int, int], str] = {}
        self._bridge = Bridge(self.vehicle, replace(config.bridge, goto=goto))
        self._reader = ParameterReader()
        self._health = LinkHealth()
        self._arrivals: dict[str, deque[float]] = defaultdict(deque)
        self._first_s: dict[str, float] = {}
        self._boot_time_ms: int | None = None
        self.data_age_s: float | None = None
        """Greatest age at which the vehicle's data was read; None while unknown."""
        self._found_s: float | None = None
        self._reasons_asked_s = -math.inf
        self._outbox: list[Message] = []

    # Called by the driver

    def start(self, now: float) -> None:
        """Start to listen."""
        self._health.update(self.vehicle, self.statistics(), now)
        self._bridge.start(now)

    def receive(self, message: Message, now: float) -> None:
        """Process one message."""
        header = message._header
        if isinstance(message, mavlink.MAVLink_heartbeat_message):
            source = header.srcSystem, header.srcComponent
            if len(self.heard) < _HEARD_MAX or source in self.heard:
                self.heard[source] = sender_name(message.autopilot, message.type)
        self._bridge.receive(message, now)
        self._drain()
        self._measure_age(now)
        profile = self.vehicle.profile
        if profile is None:
            return
        if self._found_s is None:
            self._found_s = now
            names = [name for setting in profile.failsafe_settings for name in setting.names]
            if profile.traffic_receiver_parameter is not None:
                names.append(profile.traffic_receiver_parameter)
            if profile.landing_target is not None:
                names.extend(profile.landing_target.needed)
            self._reader.resume(self.vehicle.address, names, profile.parameters_bytewise, now)
        if header.srcSystem == self.vehicle.state.system_id:
            self._reader.receive(message, now)
            self._count(message.get_type(), now)
        self._ask_for_reasons(now)

    def overhear(self, message: Message, now: float) -> None:
        """There are no ground stations."""

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        self._bridge.handle_timer(now)
        self._reader.handle_timer(now)
        self._drain()

    def next_deadline(self) -> float | None:
        """Return the time of the next call of :meth:`handle_timer`."""
        deadlines = (self._bridge.next_deadline(), self._reader.deadline_s)
        return min((time for time in deadlines if time is not None), default=None)

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent: HEARTBEAT and questions."""
        questions = [*self._reader.messages_to_send(), *self._outbox]
        self._outbox.clear()
        address = self.vehicle.address
        for message in questions:
            with_source(message, address.source_system, address.source_component)
        return [*self._bridge.messages_to_send(), *questions]

    def fail(self, error: Exception, _now: float = 0.0) -> None:
        """Report an internal error."""
        logging.getLogger(__name__).error("The check failed.", exc_info=error)

    def give_up(self, error: Exception) -> None:
        """Report the end of the check."""
        self.fail(error)

    # Findings

    def heard_besides(self) -> list[str]:
        """Return who else sent HEARTBEAT: "255/190 (GCS)"."""
        state = self.vehicle.state
        vehicle = (state.system_id, state.component_id) if self.vehicle.profile else None
        return [
            f"{system}/{component} ({name})"
            for (system, component), name in sorted(self.heard.items())
            if (system, component) != vehicle
        ]

    @property
    def parameters(self) -> dict[str, float]:
        """Settings that the report names, reported by the vehicle, by name."""
        return dict(self._reader.values)

    def waiting_for(self, now: float) -> str | None:
        """Return the pending item as text; None when the check is complete."""
        if self._found_s is None:
            return "a HEARTBEAT"
        if not self.vehicle.heartbeats.alive:
            return "the vehicle to respond again"
        elapsed_s = now - self._found_s
        if self._reader.reading and elapsed_s < _PARAMETERS_S:
            return "parameters"
        if elapsed_s < LOOK_S:
            return "telemetry at the requested rates"
        rejection = self.trial(now)
        if rejection is not None:
            return f"the conditions for a goal: {rejection.message}"
        if self.vehicle.state.prearm_ok is False and not self.vehicle.state.armed:
            return "the vehicle's pre-arm checks"
        return None

    def trial(self, now: float) -> Rejection | None:
        """Return why a minimal goal would be rejected now, apart from arming, or None."""
        rejection = self._bridge.goals.check(self._small_goal(), now)
        self._drain()
        return rejection

    def rates(self, now: float) -> list[RequestedRate]:
        """Return the measured rates of the last seconds and the requested ones."""
        profile = self.vehicle.profile
        if profile is None:
            return []
        refused = self.vehicle.rates.refusals
        return [
            self._rate(
                name, asked_hz, refused.get(name), profile.messages.own_rates_hz.get(name), now
            )
            for name, asked_hz in self.vehicle.config.message_rates_hz.items()
            if name not in profile.messages.unsupported and asked_hz > 0.0
        ]

    def _rate(
        self, name: str, asked_hz: float, refusal: str | None, own_hz: float | None, now: float
    ) -> RequestedRate:
        """Measure one rate; a message that begins to come meanwhile counts from its first."""
        first_s = self._first_s.get(name, math.inf)
        seen_s = min(now - first_s, _WINDOW_S)
        pending, measured_hz = "", 0.0
        if seen_s >= _RATE_S:
            count = sum(1 for time in self._arrivals[name] if time > now - seen_s)
            measured_hz = count / seen_s
        elif math.isfinite(first_s):
            pending = "just started"
        elif name in _NEED_POSITION and not self.vehicle.state.position_valid:
            pending = "sent once there is a position"
        return RequestedRate(name, asked_hz, measured_hz, refusal, own_hz, pending)

    def has_received(self, name: str) -> bool:
        """Whether a message of the vehicle's has been received."""
        return name in self._first_s

    def link(self, now: float) -> LinkHealth:
        """Return the link health since the last call."""
        self._health.update(self.vehicle, self.statistics(), now)
        return self._health

    def _small_goal(self) -> Request:
        """A goal with minimal motion: climb in place, or stay."""
        profile, state = self.vehicle.profile, self.vehicle.state
        grounded = not state.armed or state.landed_state is LandedState.ON_GROUND
        if profile is not None and traits_of(profile).flies and grounded:
            return TakeoffRequest(0.0)
        return NavigateRequest(FRAME_BASE_LINK, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), False, 0.0)

    def _ask_for_reasons(self, now: float) -> None:
        """Request the pre-arm reasons; unasked, a vehicle reports them every 30 s."""
        state = self.vehicle.state
        late = now >= self._reasons_asked_s + _REASONS_AGAIN_S
        if state.prearm_ok is False and not state.armed and late:
            self._reasons_asked_s = now
            request = CommandRequest(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
            self._outbox.append(request.message(self.vehicle.address, 0))

    def _measure_age(self, now: float) -> None:
        time_ms = self.vehicle.live.boot_time_ms
        if time_ms == self._boot_time_ms:
            return
        self._boot_time_ms = time_ms
        age_s = self.vehicle.data_age.age_s(time_ms, self.vehicle.state.clock_count, now)
        if age_s is not None:
            self.data_age_s = max(age_s, self.data_age_s or 0.0)

    def _count(self, name: str, now: float) -> None:
        self._first_s.setdefault(name, now)
        times = self._arrivals[name]
        times.append(now)
        while times[0] < now - _WINDOW_S:
            times.popleft()

    def _drain(self) -> None:
        while self._bridge.next_output() is not None:
            pass
