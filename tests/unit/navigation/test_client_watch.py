"""navigation_client waits for a silent server, with a limit."""

from __future__ import annotations

from drone_navigation.client.watch import ServerWatch


def test_a_responding_server_is_left_alone() -> None:
    watch = ServerWatch(30.0)
    for tenth in range(1, 1000):
        now_s = 0.1 * tenth
        assert watch.hear(now_s) == ""
        assert watch.look(now_s, ready=True) == ""
        assert not watch.asks_again(now_s)
        assert watch.verdict(now_s) == ""


def test_silence_is_reported_once_and_queried_repeatedly() -> None:
    watch = ServerWatch(30.0)
    watch.hear(0.0)
    assert watch.look(4.9, ready=True) == ""
    assert not watch.asks_again(4.9)
    assert watch.look(5.0, ready=True).startswith("Server silent for 5 s: ")
    assert watch.look(5.1, ready=True) == ""
    assert [second for second in range(5, 30) if watch.asks_again(second)] == [5, 10, 15, 20, 25]
    assert watch.verdict(30.0) == ""
    assert watch.verdict(30.1).startswith("Server lost: silent for 30 s.")


def test_a_server_that_said_goodbye_is_not_waited_for() -> None:
    watch = ServerWatch(30.0)
    watch.hear(0.0)
    watch.look(1.0, ready=False)
    assert watch.verdict(4.9) == ""
    assert watch.verdict(5.0).startswith("The server has ended;")


def test_a_server_that_restarts_and_is_known_in_part_for_a_moment_has_not_ended() -> None:
    watch = ServerWatch(90.0)
    watch.hear(0.0)
    watch.look(5.0, ready=True)
    watch.look(8.0, ready=False)
    assert watch.verdict(10.9) == ""
    watch.look(10.9, ready=True)
    watch.look(11.0, ready=False)
    assert watch.verdict(13.9) == ""
    watch.look(13.9, ready=True)
    assert watch.verdict(30.0) == ""


def test_a_server_that_ros_forgets_after_its_lease_may_be_cut_off_and_is_waited_for() -> None:
    watch = ServerWatch(60.0)
    watch.hear(0.0)
    watch.look(6.0, ready=True)
    watch.look(20.0, ready=False)
    assert watch.verdict(59.0) == ""


def test_a_server_that_ros_finds_again_is_asked_at_once() -> None:
    watch = ServerWatch(60.0)
    watch.hear(0.0)
    watch.look(5.0, ready=True)
    assert watch.asks_again(5.0)
    watch.look(6.0, ready=False)
    watch.look(7.0, ready=True)
    assert watch.asks_again(7.0)
    assert watch.verdict(7.0) == ""
    assert watch.hear(7.1) == "The server responds again after 7 s."


def test_the_timeout_is_never_shorter_than_a_reported_silence() -> None:
    watch = ServerWatch(0.0)
    watch.hear(0.0)
    assert watch.verdict(4.9) == ""
    assert watch.verdict(5.1) != ""
