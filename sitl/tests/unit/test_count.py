"""Several vehicles from one command line."""

from __future__ import annotations

import pytest

from mavlink_sitl.command_line.options import parse
from mavlink_sitl.geodesy import ARDUPILOT
from sitl_support.programs import WAIT_S, client, running


def test_vehicles_stand_apart_with_ids_in_a_row() -> None:
    options, first = parse(["--count", "3", "--system-id", "7"])
    assert [config.system_id for config in options.vehicles] == [7, 8, 9]
    assert options.vehicles[0] == first
    offsets = [ARDUPILOT.to_local(first.home, config.home)[1] for config in options.vehicles]
    assert offsets == pytest.approx([0.0, 10.0, 20.0], abs=0.01)


@pytest.mark.parametrize("line", ["--count 0", "--count 2 --system-id 255", "--count x"])
def test_an_impossible_count_gets_one_sentence(
    line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ending:
        parse(line.split())
    assert ending.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "count" in said


def test_each_answers_for_itself_on_one_port() -> None:
    with running("--count", "3", "--link", "udpin://127.0.0.1:0") as program:
        for _ in range(2):
            program.line()
        with client(f"udpout:127.0.0.1:{program.port}") as ground:
            ground.mav.heartbeat_send(6, 8, 0, 0, 4)
            seen: set[int] = set()
            while seen != {1, 2, 3}:
                message = ground.recv_match(type="HEARTBEAT", blocking=True, timeout=WAIT_S)
                assert message is not None
                seen.add(message.get_srcSystem())
            ground.mav.command_long_send(2, 1, 31999, 0, 0, 0, 0, 0, 0, 0, 0)
            answer = ground.recv_match(type="COMMAND_ACK", blocking=True, timeout=WAIT_S)
            assert (answer.get_srcSystem(), answer.result) == (2, 3)
        program.end()
