"""The report's page breaks no rule of axe-core."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from flight_reports.navigation_report import main
from tests.interop.test_report import COPTER, ROVER, flown_by_the_server, in_a_browser
from tests.support.ros.accessibility import violations_at_all_widths
from tests.support.ros.browser import Browser

pytestmark = [pytest.mark.wide, in_a_browser]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    made = Browser(tmp_path_factory.mktemp("browser"))
    yield made
    made.close()


@pytest.mark.parametrize("kind", ["one", "compared"])
def test_a_report_breaks_no_rule(browser: Browser, tmp_path: Path, kind: str) -> None:
    page = tmp_path / "report.html"
    if kind == "one":
        arguments = [str(flown_by_the_server(tmp_path / "flight.tlog"))]
    else:
        arguments = ["--compare", str(COPTER), str(ROVER)]
    assert main([*arguments, "--out", str(page)]) == 0
    tab = browser.open(page.as_uri())
    tab.wait("document.documentElement.dataset.drawn > 0")
    tab.value("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    assert violations_at_all_widths(tab) == []
    tab.close()
