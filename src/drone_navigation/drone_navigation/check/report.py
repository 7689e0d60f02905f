"""Findings of ``navigation_server --check`` as sections of text lines. Pure."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from drone_navigation.check.examination import Checker
from drone_navigation.check.sections import (
    FIX_3D,
    NO_FIX,
    CheckSection,
    battery_section,
    failsafes_section,
    link_section,
    position_section,
    rates_section,
    vehicle_section,
)
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.vehicle.traits import traits_of
from navigation_core.outcomes import OutcomeCode


class CheckVerdict(enum.IntEnum):
    """Verdict of a check; the number is the exit code."""

    READY = 0
    NOT_READY = 1
    NO_VEHICLE = 2


@dataclass(frozen=True)
class Missing:
    """An unmet condition of a goal, with advice."""

    what: str
    advice: str


@dataclass(frozen=True)
class Report:
    """All of it.

    Attributes:
        verdict: whether goals would be accepted.
        sentence: the same in words.
        sections: what was found.
        missing: what a goal lacks.
        yours: what is left to the pilot.
        is_silent: whether nothing was received at all.
    """

    verdict: CheckVerdict
    sentence: str
    sections: tuple[CheckSection, ...] = ()
    missing: tuple[Missing, ...] = ()
    yours: tuple[str, ...] = ()
    is_silent: bool = False


def make_report(checker: Checker, link_advice: str, now: float, set_up: str = "") -> Report:
    """Summarise the current findings of a checker.

    Args:
        checker: what was looked at.
        link_advice: what to look for when nothing comes on such a link.
        now: time in seconds.
        set_up: name of the configuration file without its suffix, empty without one.
    """
    profile = checker.vehicle.profile
    if profile is None:
        heard = _heard_instead(checker)
        what = heard or Missing(f"nothing received on {checker.config.link_url}.", link_advice)
        sentence = f"No vehicle was found: {what.what}"
        return Report(CheckVerdict.NO_VEHICLE, sentence, (), (what,), is_silent=heard is None)
    health = checker.link(now)
    sections = (
        vehicle_section(checker, profile, set_up),
        position_section(checker.vehicle.state),
        battery_section(checker.vehicle.state),
        failsafes_section(checker, profile),
        link_section(checker, health),
        rates_section(checker, profile, now),
    )
    missing, yours = _missing(checker, now), _yours(checker, profile)
    if missing:
        sentence = "Not ready: a goal would be rejected or fail."
        return Report(CheckVerdict.NOT_READY, sentence, sections, missing, yours)
    sentence = "Ready for goals." if not yours else "Ready for goals after the manual steps."
    return Report(CheckVerdict.READY, sentence, sections, (), yours)


def _heard_instead(checker: Checker) -> Missing | None:
    """Return what came that is no vehicle, None if nothing came."""
    statistics, url = checker.statistics(), checker.config.link_url
    if checker.heard:
        systems = ", ".join(checker.heard_besides())
        wanted = checker.config.vehicle.target_system
        return Missing(
            f"HEARTBEAT comes from {systems} (system/component), none of them the expected "
            f"autopilot (target_system is {wanted}, component 1).",
            "Set target_system to the vehicle's system id, or to 0 for any.",
        )
    if statistics.frames:
        return Missing(
            f"{statistics.frames} MAVLink messages received on {url}, but no HEARTBEAT.",
            "Check that the autopilot sends HEARTBEAT on this port.",
        )
    if statistics.unsigned or statistics.badly_signed or statistics.replayed:
        return Missing(
            f"MAVLink messages received on {url}, none with our key ({statistics.unsigned} "
            f"unsigned, {statistics.badly_signed} of another key, {statistics.replayed} too old).",
            "Load the key of signing_key_file into the vehicle, and set the clock of this machine.",
        )
    if statistics.bytes_dropped or statistics.bad_crc:
        return Missing(
            f"Bytes received on {url}, but they are not MAVLink.",
            "Check the baud rate, and that the autopilot's port is set to MAVLink.",
        )
    return None


def _missing(checker: Checker, now: float) -> tuple[Missing, ...]:
    state = checker.vehicle.state
    found = []
    rejection = checker.trial(now)
    if rejection is not None:
        found.append(
            Missing(f"{rejection.code.value}: {rejection.message}", _advice(rejection.code, state))
        )
    if state.failsafe is not None:
        found.append(
            Missing(
                f"A failsafe is active: {state.failsafe.text}",
                "Let it end, or take over manually, then check again.",
            )
        )
    is_named = rejection is not None and rejection.code is OutcomeCode.UNHEALTHY
    if state.prearm_ok is False and not state.armed and not is_named:
        reasons = _prearm_reasons(state)
        found.append(
            Missing(
                f"Pre-arm checks fail: {reasons or 'reason not reported'}.",
                "Mend what the autopilot reports, then check again."
                if reasons
                else "A ground station shows the reasons; PX4 reports them to ground stations only "
                "(set heartbeat_type: gcs).",
            )
        )
    return tuple(found)


def _prearm_reasons(state: VehicleState) -> str:
    texts = (text.text for text in state.status_texts)
    reasons = [text.split(":", 1)[1].strip() for text in texts if text.startswith("PreArm:")]
    return "; ".join(dict.fromkeys(reasons))


def _advice(code: OutcomeCode, state: VehicleState) -> str:
    if code is OutcomeCode.NO_POSITION:
        if state.gps is not None and state.gps.fix_type < FIX_3D:
            return NO_FIX
        estimates = state.estimator is None or state.estimator.horizontal_position_ok
        if state.global_position is None and estimates:
            return "Check the rate of GLOBAL_POSITION_INT (below)."
        return "Wait for the estimator; it takes up to a minute after power-up."
    if code is OutcomeCode.NO_VEHICLE:
        return "Check the link: the vehicle was heard before and is silent now."
    if code is OutcomeCode.UNSUPPORTED_VEHICLE:
        return "docs/autopilots.md lists the supported vehicles."
    if code is OutcomeCode.UNHEALTHY:
        return "Fix what the vehicle's own checks report."
    if code is OutcomeCode.LOW_BATTERY:
        return "Charge the battery; battery_reserve and battery_endurance_s set the limits."
    return "Change the named parameter of this server or of the vehicle."


def _yours(checker: Checker, profile: Profile) -> tuple[str, ...]:
    state, goto, flies = checker.vehicle.state, checker.config.bridge.goto, traits_of(profile).flies
    word = "pilot" if goto.may_leave_ground else "never"
    takes_off = "" if goto.may_leave_ground or not flies else "take off to a safe height"
    if not state.armed and not goto.may_arm:
        what = " and ".join(filter(None, ("arm it", takes_off)))
        why = f"arming is '{word}', so goals to a disarmed vehicle are rejected"
    elif takes_off and state.landed_state is LandedState.ON_GROUND:
        what, why = takes_off, f"arming is '{word}', so goals on the ground are rejected"
    else:
        return ()
    return (f"{what[0].upper()}{what[1:]} manually: {why}.",)
