"""Runs ``navigation_server --check``: opens the link, looks, prints, ends. No ROS graph."""

from __future__ import annotations

import sys
import threading

from rich.console import Console

from drone_navigation.check import Checker
from drone_navigation.check_report import Report, make_report
from drone_navigation.check_view import as_json, show
from drone_navigation.configuration import ServerConfig
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links import LinkKind, open_link, parse_url
from mavlink_vehicle.io.signing_key import open_signing
from mavlink_vehicle.io.tlog import TlogWriter

_POLL_S = 0.2

_LINK_ADVICE = {
    LinkKind.SERIAL: "Check the cable, the device's name, the baud rate, and your right to open "
    "it (often the group dialout).",
    LinkKind.UDP_IN: "Check that the vehicle sends to this machine and port, and that no firewall "
    "is between.",
    LinkKind.UDP_OUT: "Check the address, and that the vehicle listens there.",
    LinkKind.TCP_OUT: "Check the address, and that the vehicle serves TCP there.",
    LinkKind.TCP_IN: "Check that the vehicle connects to this machine and port.",
    LinkKind.TLOG: "Check that the recording is one of a vehicle.",
}


def run_check(config: ServerConfig, limit_s: float, json_output: bool) -> int:
    """Look at the vehicle and print what was found; returns the exit code.

    Args:
        config: the server's settings.
        limit_s: longest time to look; a vehicle that is ready is done with sooner.
        json_output: print the report as JSON, and nothing else on standard output.

    Raises:
        LinkError: the link cannot be opened.
        OSError: the recording cannot be written.
    """
    progress = Console(stderr=True)
    report = look(config, limit_s, progress)
    if json_output:
        print(as_json(report))
    else:
        show(report, Console(file=sys.stdout))
    return int(report.verdict)


def look(config: ServerConfig, limit_s: float, progress: Console) -> Report:
    """Open the link, look until everything is known or the time is over, and report.

    Args:
        config: the server's settings.
        limit_s: longest time to look.
        progress: where it says what it waits for.

    Raises:
        LinkError: the link cannot be opened, or the file of the signing key holds none.
        OSError: the recording cannot be written.
    """
    clock = MonotonicClock()
    signing = open_signing(config.signing_key_file, lambda text: _say(progress, text))
    link = open_link(config.link_url, lambda text: _say(progress, text))
    recorder = None if config.record_tlog is None else TlogWriter(config.record_tlog)
    settings = config.vehicle
    codec = Codec(settings.source_system or 1, settings.source_component, signing)
    checker = Checker(config, codec.statistics)
    driver = Driver(checker, link, codec, clock, recorder)
    driver.start()
    try:
        pause, said, end_s = threading.Event(), "", clock.now() + limit_s
        while clock.now() < end_s:
            waiting = driver.call(lambda: checker.waiting_for(clock.now()))
            if waiting is None:
                break
            if waiting != said:
                said = waiting
                _say(progress, f"{end_s - clock.now():4.0f} s left, waiting for {waiting}")
            pause.wait(_POLL_S)
        advice = _LINK_ADVICE[parse_url(config.link_url).kind]
        return driver.call(lambda: make_report(checker, advice, clock.now()))
    finally:
        driver.stop()


def _say(progress: Console, text: str) -> None:
    progress.print(text, highlight=False, markup=False, soft_wrap=True)
