"""The report of a recorded flight as values."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flight_logs.errors import LogError
from flight_reports.report_values import report_values

DATA = Path(__file__).resolve().parents[2] / "data"


def test_the_values_are_those_of_the_page() -> None:
    (flight,) = report_values(DATA / "copter_lowbatt.tlog")
    assert flight["vehicle"] == "ArduCopter, system 1"
    assert isinstance(flight["duration_s"], float)
    assert isinstance(flight["distance_m"], float)
    first, last = flight["battery_first_percent"], flight["battery_last_percent"]
    assert isinstance(first, float)
    assert isinstance(last, float)
    assert first > last, "its battery runs low"
    warnings = flight["warnings"]
    assert isinstance(warnings, list)
    assert any("attery" in each["text"] for each in warnings)
    assert flight["lacks"], "it is no recording of the server"
    json.dumps(flight)


def test_what_is_no_log_has_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="nothing"):
        report_values(tmp_path / "nothing.tlog")
