"""The report of ``navigation_server --check`` is shown."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from drone_navigation.check.command import run_check
from drone_navigation.check.report import CheckVerdict, Report
from drone_navigation.check.report_output import plain_lines, show
from drone_navigation.check.sections import CheckSection, Line
from drone_navigation.processes import free_udp_port
from navigation_bridge.configuration.fleet_config import make_vehicle_configs


def test_a_shared_warning_is_shown_once() -> None:
    lines = tuple(Line(name, "0 (nothing)", "Off.") for name in ("A", "B"))
    alone = Line("C", "1", "Look here.")
    report = Report(CheckVerdict.READY, "Ready.", (CheckSection("Itself", (*lines, alone)),))
    assert plain_lines(report).count("    ! Off.") == 0
    assert "  ! A, B: Off." in plain_lines(report)
    assert "    ! Look here." in plain_lines(report)
    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    show(report, console)
    told = console.file.getvalue()
    assert told.count("Off.") == 1


def test_of_several_vehicles_it_says_how_many_a_server_flies(
    capsys: pytest.CaptureFixture[str],
) -> None:
    link_url = f"udpin://127.0.0.1:{free_udp_port()}"
    configs = make_vehicle_configs(
        {
            name: {"link_url": link_url, "vehicles_max": 7, "target_system": number}
            for number, name in enumerate("ab", 1)
        }
    )
    assert run_check(configs, 0.1, json_output=False) != 0, "nobody is there"
    assert capsys.readouterr().out.startswith("2 vehicles of at most 7 (vehicles_max)\n")
