"""The report of a flight in a browser without a network, and the command that writes it."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from flight_reports.navigation_report import main
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from navigation_bridge import notes
from navigation_bridge.goals.goal import GoalFinished, GoalHappened
from navigation_bridge.goals.lifecycle import GoalState
from navigation_core.outcomes import OutcomeCode

pytestmark = pytest.mark.wide_but_first


DATA = Path(__file__).resolve().parents[1] / "data"
COPTER = DATA / "copter_lowbatt.tlog"
ROVER = DATA / "rover_guided.tlog"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=10000",
)  # fmt: skip
EVIL = '<img src=x onerror=alert(1)></script><script>document.title="broken"</script>'
LONG = (
    "No path to (20.0, 18.0, 4.0) m keeps 2.00 m clear of all 448 obstacles: the target is enclosed"
)
GOAL_ID = "d000e038" + 24 * "a"

in_a_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here (apt install chromium), so no page can be opened"
)


def flown_by_the_server(log: Path) -> Path:
    """Write a recording with a goal, and with words that would like to be HTML."""
    records = list(TlogReader(COPTER))
    codec = Codec(source_system=1, source_component=notes.COMPONENT_ID)
    begun_s = records[0][0]
    end = GoalFinished(GOAL_ID, GoalState.ABORTED, OutcomeCode.LOW_BATTERY, EVIL, None, 12.5, 3.25)
    noted = [
        *notes.long_text(notes.event(GoalHappened(GOAL_ID, "ACCEPTED", "", "fly"), "Navigate"), 1),
        notes.goal_accepted(GOAL_ID[:8], (10.0, 20.0, 15.0)),
        *notes.long_text(notes.event(GoalHappened(GOAL_ID, "STATUS", "BLOCKED", LONG), ""), 3),
        *notes.plan(((0.0, 0.0, 15.0), (10.0, 20.0, 15.0))),
        *notes.long_text(
            notes.event(GoalHappened(GOAL_ID, "ENDED", "LOW_BATTERY", EVIL), "", end), 2
        ),
    ]
    said = make("STATUSTEXT", severity=mavlink.MAV_SEVERITY_CRITICAL, text="<b onclick=x()>")
    told: list[Message] = [*noted, with_source(said, 1, 1)]
    extra = [(begun_s + 30.0 + 0.1 * i, codec.encode(message)) for i, message in enumerate(told)]
    writer = TlogWriter(log)
    for time_s, packet in sorted([*records, *extra], key=lambda record: record[0]):
        writer.write(packet, time_s)
    writer.close()
    return log


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    log = flown_by_the_server(folder / "flight <i>.tlog")
    assert main([str(log), "--out", str(folder / "report.html")]) == 0
    return folder / "report.html"


def opened(page: Path, folder: Path) -> str:
    """Return the document as it is after its scripts have run."""
    command = [str(CHROMIUM), *QUIET, f"--user-data-dir={folder}", "--dump-dom", page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=80, check=True).stdout


class Elements(HTMLParser):
    """Collects what a page would fetch or run, and the text of its tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.cells: list[str] = []
        self._in_cell = 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag == "td":
            self._in_cell = 1
            self.cells.append("")

    def handle_endtag(self, tag: str) -> None:
        if tag == "td":
            self._in_cell = 0

    def handle_data(self, data: str) -> None:
        if self._in_cell:
            self.cells[-1] += data


@in_a_browser
def test_the_page_draws_its_plots_without_a_network_and_without_an_error(
    page: Path, tmp_path: Path
) -> None:
    dom = opened(page, tmp_path)
    drawn = re.search(r'data-drawn="(\d+)"', dom)
    assert drawn is not None, dom[-2000:]
    assert int(drawn[1]) >= 2
    body = dom[: dom.index('id="plots"')]
    errors = re.search(r'<p id="errors"[^>]*>(.*?)</p>', body)
    assert errors is not None
    assert errors[1] == ""
    assert len(re.findall(r'class="js-line"', body)) >= 6
    assert "LOW_BATTERY" in body
    assert "<title>Flight in flight &lt;i&gt;.tlog</title>" in dom


PROBE = """<script>
addEventListener("load", () => setTimeout(() => {
  const wide = [...document.querySelectorAll(".scroll, .plot, main, html")]
    .filter((part) => part.scrollWidth > part.clientWidth + 1)
    .map((part) => `${part.tagName} ${part.textContent.slice(0, 30)}: ${part.scrollWidth}`);
  const cells = document.querySelectorAll("td").length;
  parent.postMessage({ width: innerWidth, wide, cells }, "*");
}, 2000));
</script></body>"""
FRAME = """<!doctype html><title>no answer</title><iframe src="%s" width="%d" height="900"></iframe>
<script>addEventListener("message", (event) => {
  const told = document.createElement("p");
  told.id = "told";
  told.textContent = JSON.stringify(event.data);
  document.body.append(told);
})</script>"""


@pytest.mark.wide
@in_a_browser
@pytest.mark.parametrize("width", [1280, 768, 420])
def test_nothing_is_cut_off_at_any_width(page: Path, tmp_path: Path, width: int) -> None:
    # A window of Chromium is never narrower than 500 pixels, a frame in it is.
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text("utf-8"))
    probed, frame = tmp_path / "probed.html", tmp_path / "frame.html"
    probed.write_text(text.replace("</body>", PROBE), "utf-8")
    frame.write_text(FRAME % (probed.as_uri(), width), "utf-8")
    told = re.search(r'<p id="told">(.*?)</p>', opened(frame, tmp_path / "browser"))
    assert told is not None
    found = json.loads(html.unescape(told[1]))
    assert found["width"] == width
    assert found["cells"] > 20
    assert found["wide"] == []


def test_a_page_is_smaller_than_two_megabytes(page: Path) -> None:
    assert page.stat().st_size < 2_000_000


@pytest.mark.wide
@in_a_browser
def test_two_flights_are_laid_over_each_other(tmp_path: Path) -> None:
    out = tmp_path / "both.html"
    assert main(["--compare", str(COPTER), str(ROVER), "--out", str(out)]) == 0
    dom = opened(out, tmp_path / "browser")
    assert 'data-drawn="' in dom
    body = dom[: dom.index('id="plots"')]
    assert re.search(r'<p id="errors"[^>]*></p>', body)
    assert "Time zero is first movement" in body


def test_a_page_fetches_nothing_and_runs_only_its_own_scripts(page: Path) -> None:
    found = Elements(page.read_text("utf-8")).found
    for tag, attributes in found:
        assert not {"src", "srcset", "data", "action", "background"} & attributes.keys(), tag
        assert not any(name.startswith("on") for name in attributes), (tag, attributes)
        assert (attributes.get("href") or "#").startswith("#")
        assert tag not in ("link", "iframe", "object", "embed", "img", "base", "form")
    (policy,) = [a["content"] or "" for _, a in found if a.get("http-equiv")]
    assert "default-src 'none'" in policy
    assert "unsafe-inline" not in re.findall(r"script-src[^;]*", policy)[0]
    assert sum(tag == "script" for tag, _ in found) == 4


def test_goals_are_in_the_table_with_end_error_and_reason(page: Path) -> None:
    cells = Elements(page.read_text("utf-8")).cells
    place = next(i for i, cell in enumerate(cells) if cell.startswith("Navigate"))
    goal = cells[place : place + 9]
    assert goal[2] == "(10.0, 20.0, 15.0)"
    assert goal[4].startswith("LOW_BATTERY")
    assert goal[5:7] == ["12.5 s", "3.25 m"]
    assert EVIL in goal[8]
    assert not goal[8].startswith("LOW_BATTERY")


def test_what_a_log_says_stays_text(page: Path) -> None:
    text = page.read_text("utf-8")
    assert "onerror=alert(1)>" not in text.replace("\\u003e", ">").split('id="plots"')[0]
    assert EVIL not in text
    assert "<b onclick" not in text
    assert any("<b onclick=x()>" in cell for cell in Elements(text).cells)


def test_a_recording_of_another_program_says_what_it_lacks(tmp_path: Path) -> None:
    out = tmp_path / "report.html"
    assert main([str(ROVER), "--out", str(out)]) == 0
    text = out.read_text("utf-8")
    assert "Not in this log" in text
    assert "no goals, plans or replans" in text
    # The failsafe of the other one is worth a look.
    assert main([str(COPTER), "--out", str(out)]) == 0
    assert "Failsafe (battery)" in out.read_text("utf-8")


def packed(*messages: Message) -> bytes:
    codec = Codec(source_system=1, source_component=1)
    stamp = (1_700_000_000_000_000).to_bytes(8, "big")
    return b"".join(stamp + codec.encode(message) for message in messages)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "No such file"),
        (b"", "is empty"),
        (bytes(100_000), "not a tlog"),
        (b"a diary, not a log\n" * 500, "not a tlog"),
        (packed(make("ATTITUDE", yaw=1.0)), "contains no vehicle"),
        (COPTER.read_bytes()[:30], "no"),
    ],
    ids=["missing", "empty", "zeros", "text", "one message", "cut"],
)
def test_bad_logs_give_one_sentence_and_no_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes | None, told: str
) -> None:
    log = tmp_path / "bad.tlog"
    if content is not None:
        log.write_bytes(content)
    assert main([str(log)]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert "bad.tlog" in error
    assert len(error.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir() if path != log] == []


def test_one_heartbeat_is_a_flight_of_nothing(tmp_path: Path) -> None:
    log = tmp_path / "one.tlog"
    log.write_bytes(packed(make("HEARTBEAT", type=2, autopilot=3, mavlink_version=3)))
    assert main([str(log)]) == 0
    assert "no position of this vehicle" in (tmp_path / "one.html").read_text("utf-8")


def test_what_cant_be_done_is_a_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(ROVER), "--system", "9"]) == 2
    assert "no system 9; it contains 1" in capsys.readouterr().err
    (tmp_path / "file").write_text("in the way")
    assert main([str(ROVER), "--out", str(tmp_path / "file/report.html")]) == 1
    assert "cannot write" in capsys.readouterr().err
    log = tmp_path / "log.tlog"
    log.write_bytes(ROVER.read_bytes())
    assert main([str(log), "--out", str(log)]) == 2
    assert log.read_bytes() == ROVER.read_bytes()
    for arguments in ([], [str(ROVER), "--compare", str(ROVER), str(COPTER)]):
        with pytest.raises(SystemExit, match="2"):
            main(arguments)
