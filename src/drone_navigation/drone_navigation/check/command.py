"""Entry point of ``navigation_server --check``: open the link, check, print. No ROS graph."""

from __future__ import annotations

import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from rich.console import Console

from drone_navigation.check.examination import Checker
from drone_navigation.check.other_links import links_with_mavlink, serial_devices
from drone_navigation.check.report import Missing, Report, make_report
from drone_navigation.check.report_output import as_json, show
from drone_navigation.check.this_computer import ROW_HEAD, table_row
from drone_navigation.check.trial_flight import (
    TrialFailedError,
    Values,
    tried_section,
    try_computer,
)
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.links import LinkKind, LinkUrl, parse_url
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.fleet import FleetApplication, Member
from navigation_bridge.network import open_network

_POLL_S = 0.2

_LINK_ADVICE = {
    LinkKind.SERIAL: "Check the cable, the device name, the baud rate, and the permission to open "
    "it (often group dialout).",
    LinkKind.UDP_IN: "Check that the vehicle sends to this machine and port, and that no firewall "
    "blocks it.",
    LinkKind.UDP_OUT: "Check the address, and that the vehicle listens there.",
    LinkKind.TCP_OUT: "Check the address, and that the vehicle accepts TCP connections there.",
    LinkKind.TCP_IN: "Check that the vehicle connects to this machine and port.",
    LinkKind.TLOG: "Check that the recording contains a vehicle.",
}


def run_check(
    configs: Mapping[str, ServerConfig],
    limit_s: float,
    json_output: bool,
    set_up: str = "",
    tried: Sequence[Values] = (),
) -> int:
    """Check the vehicles and print the findings; return the worst exit code.

    Args:
        configs: the settings of each vehicle by its name; empty for one without a name.
        limit_s: longest time to look; vehicles that are ready are done with sooner.
        json_output: print the report as JSON (of several vehicles, an object with a report for
            each), and nothing else on standard output.
        set_up: name of the configuration file without its suffix, empty without one.
        tried: the parameters of each vehicle, to try this computer with them; empty: it is not
            tried. The exit code does not depend on it.

    Raises:
        LinkError: a link cannot be opened.
    """
    progress = Console(stderr=True)
    reports = look(configs, limit_s, progress, set_up)
    if all(report.is_silent for report in reports.values()):
        (config, *_) = configs.values()
        elsewhere = _elsewhere(parse_url(config.link_url))
        reports = {
            name: replace(report, missing=(*report.missing, *elsewhere))
            for name, report in reports.items()
        }
    if tried:
        # The links are closed by now: neither disturbs the other.
        section = tried_section(tried, partial(_say, progress))
        name, report = next(iter(reports.items()))
        reports[name] = replace(report, sections=(*report.sections, section))
    if json_output:
        print(as_json(reports))
    else:
        console = Console(file=sys.stdout)
        if len(configs) > 1:
            most = next(iter(configs.values())).vehicles_max
            _say(console, f"{len(configs)} vehicles of at most {most} (vehicles_max)")
        for name, report in reports.items():
            if name:
                _say(console, f"--- Vehicle {name}")
            show(report, console)
    return max(int(report.verdict) for report in reports.values())


def print_computer_row(tried: Sequence[Values]) -> int:
    """Try this computer and print its row for the table in docs/on_board.md; return 0 or 1.

    Args:
        tried: the parameters of each vehicle.
    """
    progress = Console(stderr=True)
    try:
        computer = try_computer(tried, partial(_say, progress))
    except TrialFailedError as error:
        _say(progress, f"This computer was not tried: {error}.")
        return 1
    _say(progress, ROW_HEAD)
    print(table_row(computer))
    return 0


def look(
    configs: Mapping[str, ServerConfig], limit_s: float, progress: Console, set_up: str = ""
) -> dict[str, Report]:
    """Open the links, check until everything is known or the timeout, and report.

    Args:
        configs: the settings of each vehicle by its name.
        limit_s: longest time to look.
        progress: where it says what it waits for.
        set_up: name of the configuration file without its suffix, empty without one.

    Raises:
        LinkError: a link cannot be opened, or the file of the signing key holds none.
    """
    clock = MonotonicClock()
    say = partial(_say, progress)
    (first, *_) = configs.values()
    # The recording is of flights: a check that began it again would lose one.
    network = open_network(replace(first, record_tlog=None), list(configs.values()), say)
    checkers = {
        name: Checker(config, partial(network.statistics_of, config.vehicle.target_system))
        for name, config in configs.items()
    }
    fleet = FleetApplication(
        [
            Member(name, configs[name].vehicle.target_system, checker)
            for name, checker in checkers.items()
        ],
        clock,
    )
    driver = network.drive(fleet, clock)
    fleet.attach(driver)
    driver.start()
    try:
        pause, said, end_s = threading.Event(), "", clock.now() + limit_s
        while clock.now() < end_s:
            waiting = driver.call(partial(_waiting_for, checkers, clock))
            if waiting is None:
                break
            if waiting != said:
                said = waiting
                say(f"{end_s - clock.now():4.0f} s left, waiting for {waiting}")
            pause.wait(_POLL_S)
        return {
            name: driver.call(
                partial(
                    make_report,
                    checker,
                    link_advice(parse_url(configs[name].link_url)),
                    clock.now(),
                    set_up,
                )
            )
            for name, checker in checkers.items()
        }
    finally:
        driver.stop()


def _elsewhere(url: LinkUrl) -> tuple[Missing, ...]:
    """Return where else a vehicle may be found, when nothing is heard on a link."""
    if url.kind is LinkKind.TLOG:
        return ()
    found = [
        Missing(f"MAVLink arrives on {link}.", f"Set link_url to {link}, or give --link {link}.")
        for link in links_with_mavlink(url)
    ]
    devices = serial_devices()
    if devices:
        device = devices[0].partition(" ")[0]
        advice = f"For a vehicle on one of them give --link serial://{device}:57600, or its baud."
        found.append(Missing(f"Serial devices: {', '.join(devices)}.", advice))
    elif url.kind is LinkKind.SERIAL:
        found.append(Missing("This machine has no serial device.", "Check cable and power."))
    return tuple(found)


def link_advice(url: LinkUrl) -> str:
    """Return the advice for a silent link."""
    if url.listens and not url.is_exposed:
        return f"{url.note} Check that the vehicle sends to this port."
    return _LINK_ADVICE[url.kind]


def _waiting_for(checkers: Mapping[str, Checker], clock: MonotonicClock) -> str | None:
    """Return the pending item of the first unfinished vehicle."""
    for name, checker in checkers.items():
        waiting = checker.waiting_for(clock.now())
        if waiting is not None:
            return f"{name}: {waiting}" if name else waiting
    return None


def _say(progress: Console, text: str) -> None:
    progress.print(text, highlight=False, markup=False, soft_wrap=True)
