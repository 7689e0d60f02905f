"""Report sections of ``navigation_server --check``, line by line. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from drone_navigation.check.examination import Checker, RequestedRate
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.io.links import parse_url
from mavlink_vehicle.profiles import Profile, VehicleKind
from mavlink_vehicle.profiles.flown_releases import FLOWN, flown_with
from mavlink_vehicle.state.health import battery_is_low
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.configuration.settings import TrafficConfig
from navigation_bridge.vehicle.link_health import LinkHealth
from navigation_core.safety.late_setpoints import LATE_S, TOO_LATE_S

# GPS_FIX_TYPE (common.xml), from 0.
_FIXES = ("none", "none", "2D", "3D", "DGPS", "RTK float", "RTK fixed", "static", "PPP")
FIX_3D = 3
_BATTERY_LOW = 0.3
NO_FIX = "Move the vehicle under open sky, and wait for a 3D fix."
_UNKNOWN = "not reported"
_MAVLINK_1 = (
    "No fence, rally points and signing, and no ODOMETRY. Set its port to MAVLink 2: "
    "SERIALn_PROTOCOL 2 (ArduPilot), MAV_PROTO_VER 2 (PX4)."
)
_TRAFFIC = "ADSB_VEHICLE"
# The files of bridge_config/ are named by firmware (MAV_AUTOPILOT) and kind.
_FIRMWARES = {
    "ardupilot": mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
    "px4": mavlink.MAV_AUTOPILOT_PX4,
}
# Only missions with heights above terrain look at it, and many vehicles have no terrain data.
_DISPENSABLE = frozenset({"TERRAIN_REPORT"})


@dataclass(frozen=True)
class Line:
    """One finding; `warning` says what deserves attention, and what to do."""

    name: str
    value: str
    warning: str | None = None


@dataclass(frozen=True)
class CheckSection:
    """Lines that belong together."""

    title: str
    lines: tuple[Line, ...]


def vehicle_section(checker: Checker, profile: Profile, set_up: str = "") -> CheckSection:
    """Identity and state of the vehicle."""
    vehicle = checker.vehicle
    state = vehicle.state
    failsafe = None if state.failsafe is None else state.failsafe.text
    goto = checker.config.bridge.goto
    unarmed = "no, but may take off once armed" if goto.may_leave_ground else "no"
    return CheckSection(
        "Vehicle",
        (
            _firmware(profile, state),
            Line("kind", profile.kind.value),
            *_other_set_up(profile, state.autopilot, set_up),
            Line("system id", f"{state.system_id}, component {state.component_id}"),
            Line(
                "protocol",
                "MAVLink 1" if state.speaks_mavlink_1 else "MAVLink 2",
                _MAVLINK_1 if state.speaks_mavlink_1 else None,
            ),
            Line("also heard", ", ".join(checker.heard_besides()) or "nobody"),
            Line("mode", vehicle.mode_name),
            Line("armed", "yes" if state.armed else "no"),
            Line("landed", state.landed_state.name.lower().replace("_", " ")),
            Line(
                "pre-arm checks",
                {True: "passed", False: "not passed", None: _UNKNOWN}[state.prearm_ok],
            ),
            Line("failsafe", failsafe or "none", failsafe and "It controls the vehicle now."),
            Line("goals may arm", "yes" if goto.may_arm else unarmed),
            _separation(checker.config.bridge.traffic),
            _traffic_receiver(checker, profile),
            *_landing_on_a_target(checker, profile),
        ),
    )


def _firmware(profile: Profile, state: VehicleState) -> Line:
    version = state.firmware_version
    text = f"{profile.name} {version or '(version unknown)'}"
    if version is None or state.autopilot not in FLOWN:
        return Line("firmware", text)
    known, sentence = flown_with(state.autopilot, version)
    return Line("firmware", text, None if known else f"{sentence}.")


def _other_set_up(profile: Profile, autopilot: int, set_up: str) -> tuple[Line, ...]:
    """Return a warning about a set-up of bridge_config/ that is for another vehicle, if it is."""
    name, _, kind = set_up.partition("_")
    if name not in _FIRMWARES or kind not in {each.value for each in VehicleKind}:
        return ()  # a file of one's own
    if (_FIRMWARES[name], kind) == (autopilot, profile.kind.value):
        return ()
    right = next((n for n, number in _FIRMWARES.items() if number == autopilot), name)
    warning = f"It is for another vehicle; take {right}_{profile.kind.value}.yaml."
    return (Line("configuration file", f"{set_up}.yaml", warning),)


def _separation(traffic: TrafficConfig) -> Line:
    if not traffic.on:
        return Line("separation", "disabled", "Vehicles can meet; set separation to enabled.")
    kept = traffic.separation
    text = f"{kept.horizontal_m:g} m horizontally, or {kept.vertical_m:g} m vertically"
    return Line("separation", text)


def _traffic_receiver(checker: Checker, profile: Profile) -> Line:
    """Whether aircraft that an ADS-B receiver hears are made known."""
    name, what = profile.traffic_receiver_parameter, "other aircraft"
    if not checker.config.bridge.traffic.on:
        return Line(what, "not asked for")
    if checker.has_received(_TRAFFIC):
        return Line(what, f"{_TRAFFIC} is received")
    refusal = checker.vehicle.rates.refusal(_TRAFFIC)
    value = None if name is None else checker.parameters.get(name)
    if value == 0.0:
        return Line(what, f"unknown to the vehicle: {name} is 0, it has no ADS-B receiver")
    if refusal is not None:
        warning = f"The vehicle rejects the request for {_TRAFFIC} ({refusal})."
        return Line(what, "not sent", warning)
    if name is not None and value is None:
        return Line(what, f"unknown to the vehicle: it does not report {name}")
    return Line(what, f"{_TRAFFIC} is asked for; none has been received yet")


def _landing_on_a_target(checker: Checker, profile: Profile) -> tuple[Line, ...]:
    """Return what a landing on a target lacks, for the kinds that have it; few need it."""
    rules = profile.landing_target
    if rules is None:
        return ()
    wanted = rules.to_set(checker.parameters)
    value = f"not yet: set {wanted}, and restart it" if wanted else f"possible, in {rules.mode}"
    return (Line("land on a target", value),)


def position_section(state: VehicleState) -> CheckSection:
    """Position and estimator."""
    gps, estimator, position = state.gps, state.estimator, state.global_position
    lines = []
    if gps is None:
        lines.append(Line("GPS", _UNKNOWN, "GPS_RAW_INT is not received."))
    else:
        fix = _FIXES[gps.fix_type] if gps.fix_type < len(_FIXES) else str(gps.fix_type)
        satellites = "" if gps.satellites is None else f", {gps.satellites} satellites"
        hdop = "" if gps.hdop is None else f", HDOP {gps.hdop:.1f}"
        warning = None if gps.fix_type >= FIX_3D else NO_FIX
        lines.append(Line("GPS", f"fix {fix}{satellites}{hdop}", warning))
    if estimator is None:
        lines.append(Line("estimator", _UNKNOWN, "Health unknown; its positions are used."))
    elif estimator.horizontal_position_ok:
        lines.append(Line("estimator", "position good"))
    else:
        lines.append(Line("estimator", "no position", "Wait; a position needs GPS."))
    if position is None:
        lines.append(Line("position", "none"))
    else:
        lines.append(
            Line(
                "position",
                f"{position.latitude_deg:.7f}, {position.longitude_deg:.7f}, "
                f"{position.altitude_amsl_m:.1f} m above sea level",
            )
        )
    home, origin = state.home, state.origin
    lines.append(
        Line("home", _UNKNOWN, "Heights refer to the origin until home is received.")
        if home is None
        else Line(
            "home",
            f"{home.latitude_deg:.7f}, {home.longitude_deg:.7f}, {home.altitude_amsl_m:.1f} m",
        )
    )
    lines.append(
        Line("origin", "not reported; derived from the positions")
        if origin is None
        else Line("origin", f"{origin.latitude_deg:.7f}, {origin.longitude_deg:.7f}")
    )
    return CheckSection("Position", tuple(lines))


def battery_section(state: VehicleState) -> CheckSection:
    """Batteries: of several each one, and the charge that counts."""
    battery = state.battery
    if battery is None:
        line = Line("battery", _UNKNOWN, "The battery check is inactive.")
        return CheckSection("Battery", (line,))
    remaining = battery.remaining
    low = battery_is_low(battery) or (remaining is not None and remaining < _BATTERY_LOW)
    several = state.batteries if len(state.batteries) > 1 else ()
    return CheckSection(
        "Battery",
        (
            Line("remaining", _percent(remaining), "Charge the battery." if low else None),
            Line("voltage", _number(battery.voltage_v, "V")),
            Line("current", _number(battery.current_a, "A")),
            *(
                Line(
                    f"battery {each.battery_id}",
                    f"{_percent(each.remaining)}, {_number(each.voltage_v, 'V')}",
                    "The autopilot reports it low." if battery_is_low(each) else None,
                )
                for each in several
            ),
        ),
    )


def _percent(share: float | None) -> str:
    return _UNKNOWN if share is None else f"{100.0 * share:.0f} %"


def _number(value: float | None, unit: str) -> str:
    return _UNKNOWN if value is None else f"{value:.1f} {unit}"


def failsafes_section(checker: Checker, profile: Profile) -> CheckSection:
    """Failsafe actions, by the vehicle's parameters."""
    values = checker.parameters
    lines = []
    unknown = []
    for setting in profile.failsafe_settings:
        name = next((name for name in setting.names if name in values), None)
        if name is None:
            if not setting.in_some_releases:
                unknown.append(" or ".join(setting.names))
            continue
        value = values[name]
        off = int(value) in setting.off and value == int(value)
        warning = "Off: the vehicle does not react." if off else None
        lines.append(Line(name, f"{setting.about}: {setting.describe(value)}", warning))
    if unknown:
        lines.append(Line(_UNKNOWN, ", ".join(unknown)))
    return CheckSection("Vehicle failsafes", tuple(lines))


def link_section(checker: Checker, health: LinkHealth) -> CheckSection:
    """Link quality."""
    warning = "The link loses too much." if health.loss_share > health.LOSS_WARNING else None
    values = health.values
    note = parse_url(checker.config.link_url).note
    return CheckSection(
        "Link",
        (
            Line("link", checker.config.link_url),
            *([] if note is None else [Line("where", note)]),
            Line("messages per second", values["messages per second"]),
            Line("lost", values["lost"], warning),
            Line("round trip", values["round trip"]),
            _data_age(checker),
            Line("bad checksums", values["bad checksums since start"]),
        ),
    )


def _data_age(checker: Checker) -> Line:
    name, age_s = "age of the data", checker.data_age_s
    if age_s is not None:
        late = f"A goal slows the vehicle down from {LATE_S:g} s on, and stops it from "
        late += f"{TOO_LATE_S:g} s on. Reduce the load on this machine, or check the link."
        return Line(name, f"{age_s:.2f} s at most", late if age_s >= LATE_S else None)
    if checker.vehicle.timesync.round_trip_s is None:
        value = "unknown: the vehicle does not answer TIMESYNC, so old data is not noticed"
    else:
        value = "unknown: no two quick answers to TIMESYNC with the vehicle's time yet"
    return Line(name, value)


def rates_section(checker: Checker, profile: Profile, now: float) -> CheckSection:
    """Message rates."""
    return CheckSection(
        "Message rates, of those requested",
        tuple(_rate_line(rate, profile) for rate in checker.rates(now)),
    )


def _rate_line(rate: RequestedRate, profile: Profile) -> Line:
    value = f"{rate.measured_hz:.1f} Hz of {rate.asked_hz:g} Hz"
    if rate.refusal is not None:
        warning = f"The vehicle rejects the request ({rate.refusal})."
        return Line(rate.name, value, None if rate.name in _DISPENSABLE else warning)
    if rate.pending:
        return Line(rate.name, f"{rate.pending} ({rate.asked_hz:g} Hz requested)")
    if rate.own_hz is not None and rate.own_hz < rate.asked_hz:
        value += f"; the firmware sends it at {rate.own_hz:g} Hz"
    if not rate.low:
        return Line(rate.name, value)
    warning = f"{rate.asked_hz:g} Hz requested; is the link too slow?"
    parameter = profile.messages.link_rate_parameter
    if parameter is not None:
        warning += (
            f" Compare {parameter}, the bytes per second of this port, with what its baud rate "
            "allows."
        )
    return Line(rate.name, value, warning)
