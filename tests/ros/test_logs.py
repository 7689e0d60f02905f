"""The autopilot's own logs over ROS: listed, downloaded, resumed, cancelled, rejected."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.DFReader import DFReader_binary
from rclpy.action import ActionClient

from custom_interfaces.action import DownloadLog
from custom_interfaces.msg import GoalCode
from custom_interfaces.srv import ListLogs
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_logs")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]
ANSWER_S = 30.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="module")
def flight(folder: Path) -> Iterator[Flight]:
    """A vehicle that was armed for a while."""
    flight = Flight(folder)
    try:
        assert flight.call("arm").success
        flight.spin_for(4.0)
        assert flight.call("disarm").success
        yield flight
    finally:
        flight.close()


@pytest.fixture(autouse=True)
def lossy(flight: Flight) -> None:
    """A fifth of all datagrams is lost."""
    flight.relay.loss = 0.2


def begun(flight: Flight, log_id: int = DownloadLog.Goal.LATEST) -> tuple[Any, list[Any]]:
    """Send a goal; return its handle, and the list its feedback goes to."""
    client = ActionClient(flight._node, DownloadLog, "download_log")
    assert client.wait_for_server(timeout_sec=ANSWER_S)
    feedback: list[Any] = []
    sent = client.send_goal_async(
        DownloadLog.Goal(log_id=log_id), lambda message: feedback.append(message.feedback)
    )
    flight.wait(sent.done, ANSWER_S, "an answer to the goal")
    return sent.result(), feedback


def ended(flight: Flight, handle: Any) -> Any:
    answer = handle.get_result_async()
    flight.wait(answer.done, 60.0, "the end of the download")
    return answer.result().result


def downloaded(flight: Flight, log_id: int = DownloadLog.Goal.LATEST) -> Any:
    return ended(flight, begun(flight, log_id)[0])


def listed(flight: Flight) -> list[Any]:
    service = flight.node.create_client(ListLogs, "navigation_server/list_logs")
    assert service.wait_for_service(timeout_sec=ANSWER_S)
    answer = service.call_async(ListLogs.Request())
    flight.wait(answer.done, ANSWER_S, "the list")
    flight.node.destroy_client(service)
    assert answer.result().success, answer.result().message
    return list(answer.result().logs)


def asked_offsets(flight: Flight) -> list[int]:
    return [message.ofs for message in flight.relay.from_server("LOG_REQUEST_DATA")]


def test_a_log_is_listed_downloaded_and_readable(flight: Flight, folder: Path) -> None:
    for stored in (folder / "stored").glob("*"):
        stored.unlink()
    log = listed(flight)[0]
    assert log.log_id == 1
    assert log.size > 5000
    assert log.stamp.sec > 1_000_000_000

    handle, feedback = begun(flight, log.log_id)
    result = ended(flight, handle)
    assert result.success, result.message
    assert result.error_code == GoalCode.SUCCESS
    assert result.bytes_stored == result.size == log.size
    path = Path(result.path)
    assert path.parent == folder / "stored"
    assert path.stat().st_size == log.size
    assert not list(path.parent.glob("*.part"))
    assert feedback
    assert feedback[-1].log_id == 1
    reader = DFReader_binary(str(path))
    types = set()
    while (message := reader.recv_msg()) is not None:
        types.add(message.get_type())
    reader.close()
    assert {"PARM", "POS", "ATT", "MODE", "MSG"} <= types


def test_a_download_is_resumed_and_another_log_of_that_name_is_not(flight: Flight) -> None:
    path = Path(downloaded(flight, 1).path)
    whole = path.read_bytes()
    asked = len(asked_offsets(flight))
    assert downloaded(flight, 1).success  # it is there already
    assert len(asked_offsets(flight)) == asked

    part = path.with_name(path.name + ".part")
    path.rename(part)
    part.write_bytes(whole[:7000])
    result = downloaded(flight, 1)
    assert result.success, result.message
    assert path.read_bytes() == whole
    assert min(asked_offsets(flight)[asked:]) == 7000 - 4096

    asked = len(asked_offsets(flight))
    path.unlink()
    part.write_bytes(bytes(7000))
    result = downloaded(flight, 1)
    assert result.success, result.message
    assert path.read_bytes() == whole
    assert min(asked_offsets(flight)[asked:]) == 0
    assert not part.exists()


def test_what_cannot_be_downloaded_is_rejected_with_a_sentence(flight: Flight) -> None:
    ids = ", ".join(str(log.log_id) for log in listed(flight))
    result = downloaded(flight, 9)
    assert result.error_code == GoalCode.INVALID_NUMBER
    assert result.message == f"INVALID_NUMBER: The autopilot has no log 9; it has {ids}."
    assert result.path == ""

    flight.relay.loss = 0.0
    assert flight.call("arm").success
    result = downloaded(flight)
    assert flight.call("disarm").success
    assert result.error_code == GoalCode.BUSY
    assert result.message.startswith("BUSY: The vehicle is armed;")


def test_one_download_at_a_time_and_a_cancel_ends_it(flight: Flight, folder: Path) -> None:
    assert listed(flight)
    for stored in (folder / "stored").glob("*"):
        stored.unlink()
    flight.relay.withheld = frozenset({"LOG_DATA", "FILE_TRANSFER_PROTOCOL"})
    try:
        first, _ = begun(flight)
        second = downloaded(flight)
        cancel = first.cancel_goal_async()
        flight.wait(cancel.done, ANSWER_S, "an answer to the cancel")
        result = ended(flight, first)
    finally:
        flight.relay.withheld = frozenset()
    assert second.error_code == GoalCode.BUSY
    assert result.error_code == GoalCode.CANCELED, result.message


def test_the_client_lists_and_downloads(flight: Flight) -> None:
    def run(*arguments: str) -> tuple[int | None, list[dict[str, Any]]]:
        shown = Process("client", [*CLIENT, *arguments, "--json"], flight.environment)
        code = shown.wait(90.0)
        return code, [json.loads(line) for line in shown.text.splitlines()]

    flight.relay.loss = 0.0
    flight.spin_for(2.0)
    code, lines = run("logs")
    assert code == 0, lines
    last = lines[-1]["logs"][-1]["log_id"]
    code, lines = run("download")
    assert code == 0, lines
    assert lines[-1]["event"] == "download"
    assert Path(lines[-1]["path"]).stat().st_size == lines[-1]["size"]
    assert {line["log_id"] for line in lines if line["event"] == "progress"} == {last}
    code, lines = run("download", "77")
    assert code == 3, lines


def test_a_server_that_is_stopped_ends_a_download(flight: Flight, folder: Path) -> None:
    for stored in (folder / "stored").glob("*"):
        stored.unlink()
    flight.relay.loss, flight.relay.withheld = 0.0, frozenset({"LOG_DATA"})
    handle, _ = begun(flight, 1)
    flight.wait(lambda: bool(list((folder / "stored").glob("*.part"))), ANSWER_S, "its file")
    answer = handle.get_result_async()
    assert flight.server is not None
    flight.server.signal(signal.SIGTERM)
    flight.wait(answer.done, ANSWER_S, "the end of the download")
    assert answer.result().result.error_code == GoalCode.SHUTTING_DOWN
    assert flight.server.wait(5.0) == 0
