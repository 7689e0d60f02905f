"""Judgement of this computer by a flight in the simulator, for ``--check``. Pure."""

from __future__ import annotations

import enum
from collections.abc import Iterator
from dataclasses import dataclass

from drone_navigation.check.sections import CheckSection, Line
from flight_rehearsal.trial import Trial
from mavlink_vehicle.io.this_computer import Heat
from navigation_bridge.search_thread import LEAD_MAX_S
from navigation_core.safety.late_setpoints import LATE_S

__all__ = [
    "ROW_HEAD",
    "Computer",
    "Speed",
    "computer_section",
    "failed_section",
    "judge",
    "table_row",
]

TITLE = "This computer"

LATE_P99_PERIODS, LATE_WORST_PERIODS = 0.5, 1.0
"""The benchmarks hold the server to these: at 20 Hz 25 ms and 50 ms."""
TOO_LATE_P99_PERIODS = 1.0
"""Later than this the vehicle misses setpoints all the time."""
TOO_LATE_WORST_S = LATE_S
"""A goal slows the vehicle down from here on."""
PLAN_S = 0.5 * LEAD_MAX_S
PLAN_TOO_LONG_S = LEAD_MAX_S
"""A path begins where the vehicle is this time after the search has begun, and not later."""
MEMORY_BYTES, MEMORY_TOO_LITTLE_BYTES = 512_000_000, 256_000_000
"""Available. Server and console with ROS take some 250 MB; the first leaves as much again."""
CORES = 2
"""Searches and ROS need one beside that of the setpoints."""
BUSY_CORES = 0.5
"""Other programs that take more of the processors than this are named beside a bad result."""
HOT_MARGIN_C = 10.0
"""A computer this close to its limit after ten seconds reaches it in the sun."""

_MB = 1e6
_GB = 1e9


class Speed(enum.IntEnum):
    """Whether a computer is fast enough."""

    YES = 0
    MARGINAL = 1
    NO = 2

    @property
    def word(self) -> str:
        """The verdict for people."""
        return self.name.lower()


@dataclass(frozen=True)
class Computer:
    """This computer, with what a trial has measured on it.

    Attributes:
        model: name of the board or the processor; empty if it is unknown.
        architecture: such as "aarch64".
        python: version.
        cores: that this process may use.
        memory_bytes: in all; None if it is unknown.
        available_bytes: that programs can still get; None if it is unknown.
        heat: at the end of the trial.
        trial: the measurements.
    """

    model: str
    architecture: str
    python: str
    cores: int
    memory_bytes: int | None
    available_bytes: int | None
    heat: Heat
    trial: Trial


def judge(computer: Computer) -> tuple[Speed, tuple[str, ...]]:
    """Return whether a computer is fast enough, and each reason why not, for people."""
    found = sorted(_objections(computer), key=lambda each: -each[0])
    worst = max((speed for speed, _ in found), default=Speed.YES)
    reasons = [text for _, text in found]
    others = computer.trial.others_cores
    if reasons and others > BUSY_CORES:
        reasons.append(f"other programs took {_busy(others)} meanwhile: end them and try again")
    return worst, tuple(reasons)


def _objections(computer: Computer) -> Iterator[tuple[Speed, str]]:
    trial, heat = computer.trial, computer.heat
    period_ms = 1e3 / trial.setpoint_rate_hz
    yield from _above(
        "99 of 100 setpoints are within {:.0f} ms",
        trial.late_p99_ms,
        LATE_P99_PERIODS * period_ms,
        TOO_LATE_P99_PERIODS * period_ms,
    )
    yield from _above(
        "the worst setpoint is {:.0f} ms late",
        trial.late_worst_ms,
        LATE_WORST_PERIODS * period_ms,
        1e3 * TOO_LATE_WORST_S,
    )
    yield from _above(
        "the longest plan takes {:.0f} ms", trial.plan_worst_ms, 1e3 * PLAN_S, 1e3 * PLAN_TOO_LONG_S
    )
    if trial.simulator_late_s > LATE_S:
        yield Speed.NO, f"simulated time was {trial.simulator_late_s:.1f} s behind"
    if trial.ended:
        yield Speed.NO, f"the goal ended early with {trial.ended}"
    available_bytes = computer.available_bytes
    if available_bytes is not None and available_bytes < MEMORY_BYTES:
        speed = Speed.NO if available_bytes < MEMORY_TOO_LITTLE_BYTES else Speed.MARGINAL
        text = f"only {available_bytes / _MB:.0f} MB of memory are available"
        yield speed, f"{text} ({MEMORY_BYTES / _MB:.0f} MB are enough)"
    if computer.cores < CORES:
        yield Speed.MARGINAL, f"it has one core ({CORES} are enough)"
    if heat.throttles:
        yield Speed.MARGINAL, "the processor is slowed down for its temperature; cool it"
    elif _is_hot(heat):
        yield Speed.MARGINAL, f"it has {heat.hottest_c:.0f} °C already; cool it"


def _above(text: str, value: float, enough: float, too_much: float) -> Iterator[tuple[Speed, str]]:
    if value > enough:
        limits = f"up to {enough:.0f} ms is enough, more than {too_much:.0f} ms too much"
        yield (
            Speed.NO if value > too_much else Speed.MARGINAL,
            f"{text.format(value)} ({limits})",
        )


def _busy(cores: float) -> str:
    return f"{100.0 * cores:.0f} % of a core"


def _is_hot(heat: Heat) -> bool:
    if heat.hottest_c is None or heat.limit_c is None:
        return False
    return heat.hottest_c > heat.limit_c - HOT_MARGIN_C


def computer_section(computer: Computer) -> CheckSection:
    """Return what a trial has found."""
    trial, (speed, reasons) = computer.trial, judge(computer)
    flown = "one vehicle" if trial.vehicles == 1 else f"{trial.vehicles} vehicles"
    period_ms = 1e3 / trial.setpoint_rate_hz
    return CheckSection(
        TITLE,
        (
            Line("fast enough", speed.word, _sentence(reasons)),
            Line("computer", _described(computer)),
            Line("memory", _memory(computer)),
            Line(
                "trial",
                f"{flown} round obstacles in the simulator for {trial.seconds:.0f} s, without ROS",
            ),
            Line(
                "setpoints late",
                f"{trial.late_p50_ms:.1f} ms (p50), {trial.late_p99_ms:.1f} ms (p99), "
                f"{trial.late_worst_ms:.1f} ms (worst), at {trial.setpoint_rate_hz:g} Hz",
            ),
            Line(
                "time of a plan",
                f"{trial.plan_p50_ms:.0f} ms (p50), {trial.plan_worst_ms:.0f} ms (worst), "
                f"{trial.plans} in all",
            ),
            Line(
                "processor",
                f"{100.0 * trial.processor_share:.0f} % of a core; other programs "
                f"{_busy(trial.others_cores)}",
            ),
            Line("temperature", _temperature(computer.heat)),
            Line(
                "limits",
                f"late {LATE_P99_PERIODS * period_ms:.0f} ms (p99), "
                f"{LATE_WORST_PERIODS * period_ms:.0f} ms (worst); plan {1e3 * PLAN_S:.0f} ms; "
                f"{MEMORY_BYTES / _MB:.0f} MB available; {CORES} cores; not slowed down",
            ),
        ),
    )


def failed_section(reason: str) -> CheckSection:
    """Return that no trial was flown, and why."""
    text = f"Not tried: {reason}. --no-computer leaves it out."
    return CheckSection(TITLE, (Line("fast enough", "unknown", text),))


def _sentence(reasons: tuple[str, ...]) -> str | None:
    text = "; ".join(reasons)
    return f"{text[0].upper()}{text[1:]}." if text else None


def _described(computer: Computer) -> str:
    cores = "1 core" if computer.cores == 1 else f"{computer.cores} cores"
    model = computer.model or "unknown model"
    return f"{model}, {computer.architecture}, {cores}, Python {computer.python}"


def _memory(computer: Computer) -> str:
    if computer.memory_bytes is None or computer.available_bytes is None:
        return "not reported"
    used = f"{computer.trial.memory_bytes / _MB:.0f} MB in use by the trial"
    available, total = computer.available_bytes / _GB, computer.memory_bytes / _GB
    return f"{available:.1f} GB of {total:.1f} GB available, {used}"


def _temperature(heat: Heat) -> str:
    slowed = {True: "slowed down", False: "not slowed down", None: "slowing down not reported"}
    if heat.hottest_c is None:
        return f"not reported, {slowed[heat.throttles]}"
    limit = "" if heat.limit_c is None else f" of {heat.limit_c:.0f} °C"
    return f"{heat.hottest_c:.0f} °C{limit} ({heat.zone}), {slowed[heat.throttles]}"


ROW_HEAD = (
    "| Computer | Cores | Memory | Setpoints late, p50 / p99 / worst | Plan, p50 / worst "
    "| At the end | Others | Fast enough |"
)
"""Head of the table in docs/on_board.md"""


def table_row(computer: Computer) -> str:
    """Return the row of a computer for the table in docs/on_board.md."""
    trial = computer.trial
    memory = computer.memory_bytes
    late = f"{trial.late_p50_ms:.1f} / {trial.late_p99_ms:.1f} / {trial.late_worst_ms:.1f} ms"
    several = "" if trial.vehicles == 1 else f", {trial.vehicles} vehicles"
    heat = computer.heat
    end = "unknown" if heat.hottest_c is None else f"{heat.hottest_c:.0f} °C"
    if heat.throttles:
        end += ", slowed down"
    cells = (
        f"{computer.model or 'unknown'} ({computer.architecture}), Python {computer.python}",
        f"{computer.cores}",
        "unknown" if memory is None else f"{memory / _GB:.1f} GB",
        f"{late} at {trial.setpoint_rate_hz:g} Hz{several}",
        f"{trial.plan_p50_ms:.0f} / {trial.plan_worst_ms:.0f} ms",
        end,
        _busy(trial.others_cores),
        judge(computer)[0].word,
    )
    # A name with a bar would make more columns.
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
