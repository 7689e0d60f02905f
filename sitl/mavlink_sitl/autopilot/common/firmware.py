"""A firmware as data: a table of its parts and rules, and the step that it makes.

`step` goes from a state and an observation to the next state and the texts that are due. It reads
no clock, changes nothing and knows no MAVLink. `commander` carries out what people command.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.safety.arming import Arming
from mavlink_sitl.autopilot.safety.failsafe import Failsafes
from mavlink_sitl.autopilot.safety.fence import Fence
from mavlink_sitl.autopilot.state.navigation import Navigator
from mavlink_sitl.exchange import Observation, Severity, StatusText

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.personality import ModeSpec
    from mavlink_sitl.autopilot.state.mode import Mode

LANDED_AFTER_S = 1.5
"""From touching down to 'landed': 1.5 to 1.7 s in the recordings"""
LOW_THRUST = 0.75
STILL_M_S = 0.3


class Landing(NamedTuple):
    """The state of a land detector.

    Attributes:
        landed: whether the firmware believes to stand on the ground.
        since_s: simulated time of the latest landing; 0 before.
        quiet_since_s: since when it looks like one, in the air; None when it does not.
    """

    landed: bool = True
    since_s: float = 0.0
    quiet_since_s: float | None = None

    def become(self, landed: bool, now_s: float) -> Landing:
        """Landed, or in the air, from now on if that is new."""
        return Landing(landed, now_s if landed and not self.landed else self.since_s)

    def after(self, quiet_s: float, now_s: float, quiet: bool) -> Landing:
        """In the air: landed once it has been quiet for this time."""
        if not quiet:
            return self if self.quiet_since_s is None else self._replace(quiet_since_s=None)
        if self.quiet_since_s is None:
            return self._replace(quiet_since_s=now_s)
        return self if now_s - self.quiet_since_s < quiet_s else self.become(True, now_s)


class Inputs(NamedTuple):
    """The inputs of a step.

    Attributes:
        observation: the latest.
        parameters: the vehicle's.
        armed: whether the motors are armed.
        at_rest: whether the mode is over (`Mode.at_rest`).
        position_lost: whether the estimator has lost the GPS for good.
        scaled: from seconds after power-up in the real firmware to simulated time.
        elevation_m: of the origin, AMSL.
    """

    observation: Observation
    parameters: Parameters
    armed: bool
    at_rest: bool
    position_lost: bool
    scaled: Callable[[float], float]
    elevation_m: float


def landed_by_thrust(landing: Landing, inputs: Inputs) -> Landing:
    """Landed while motors push little and nothing moves, for a while: copters."""
    observation = inputs.observation
    now_s = observation.time_s
    if not inputs.armed:
        return landing.become(True, now_s)
    if landing.landed:
        return landing.become(observation.touching_ground, now_s)
    quiet = (
        observation.thrust_over_hover < LOW_THRUST
        and abs(observation.motion.velocity_down_m_s) < STILL_M_S
    )
    return landing.after(LANDED_AFTER_S, now_s, quiet)


@dataclass(frozen=True)
class Firmware:
    """The parts of a firmware for one kind of vehicle; the rest of it is in `Personality`.

    Attributes:
        modes: by `ModeSpec.behaviour`.
        navigator: its origin, home and limits.
        arming: its checks, and who may arm.
        failsafes: what it does when something is wrong.
        fence: its fence.
        landing: the rule of its land detector.
        first_mode: after power-up, where no INITIAL_MODE says another.
        keeps_early_mode: a mode that was chosen while it started stays.
        reports_start: HEARTBEAT reports the end of starting at once.
    """

    modes: Mapping[str, Callable[[Any, ModeSpec], Mode]]
    navigator: Callable[..., Navigator] = Navigator
    arming: Callable[..., Arming] = Arming
    failsafes: Callable[..., Failsafes] = Failsafes
    fence: Callable[..., Fence] = Fence
    landing: Callable[[Landing, Inputs], Landing] = landed_by_thrust
    first_mode: int = 0
    keeps_early_mode: bool = False
    reports_start: bool = False


class State(NamedTuple):
    """The state that a firmware keeps from one step to the next.

    Attributes:
        impact_m_s: of the latest hard landing.
        started: whether it has finished starting (HEARTBEAT no longer says BOOT).
        lines: of its start that it has said.
        aiding_lost: it has said that the GPS is lost for good.
        landing: of its land detector.
    """

    impact_m_s: float
    started: bool = False
    lines: int = 0
    aiding_lost: bool = False
    landing: Landing = Landing()


def step(
    firmware: Firmware, personality: Personality, state: State, inputs: Inputs
) -> tuple[State, list[StatusText]]:
    """The next state, and the texts that a firmware says by itself.

    Of the real copter are those 15 s after its GPS went off, and when it was back.
    """
    now_s, impact_m_s = inputs.observation.time_s, inputs.observation.impact_m_s
    texts, boot, lines = [], personality.boot, state.lines
    while lines < len(boot) and now_s >= inputs.scaled(boot[lines].at_s):
        text = boot[lines].text.format(elevation=inputs.elevation_m)
        texts.append(StatusText(Severity.INFO, text))
        lines += 1
    if inputs.position_lost is not state.aiding_lost:
        words = "stopped aiding" if inputs.position_lost else "is using GPS"
        severity = Severity.WARNING if inputs.position_lost else Severity.INFO
        texts += [StatusText(severity, f"{name} {words}") for name in personality.estimators]
    if impact_m_s not in (0.0, state.impact_m_s) and personality.says_impacts:
        texts.append(StatusText(Severity.INFO, f"SIM Hit ground at {impact_m_s:.6f} m/s"))
    started = state.started or now_s >= inputs.scaled(personality.standby_s)
    landing = firmware.landing(state.landing, inputs)
    return State(impact_m_s, started, lines, inputs.position_lost, landing), texts
