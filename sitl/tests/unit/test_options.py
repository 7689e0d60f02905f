"""The command line: every invalid option gets one sentence and exit code 2."""

from __future__ import annotations

import pytest

from mavlink_sitl.command_line.options import make_parser, parse
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.links.addresses import AddressError, LinkAddress, parse_address
from mavlink_sitl.links.faults import LinkFaults


def test_defaults() -> None:
    options, config = parse([])
    assert options.link == [LinkAddress("udpout", "127.0.0.1", 14550)]
    assert (options.speedup, options.seed) == (1.0, 0)
    assert (config.vehicle, config.autopilot, config.system_id) == ("copter", "ardupilot", 1)
    assert config.ready_after_s == 2.0
    assert config.faults is None


def test_everything_at_once() -> None:
    line = (
        "--vehicle copter --autopilot ardupilot --link udpin://127.0.0.1:14560 "
        "--link tcpin:127.0.0.1:5760 --speedup 10 --seed 7 --home -35.1,-149.2,600,-10 "
        "--system-id 3 --ready-after 5 --tlog x.tlog --fault loss=0.2,delay=0.5,jitter=0.1 "
        "--battery cells=4,capacity=5000,resistance=0.02,remaining=0.5 --wind 5,270 "
        "--param rtl_alt=2000 --param FS_GCS_ENABLE=1 --quiet"
    )
    options, config = parse(line.split())
    assert [link.kind for link in options.link] == ["udpin", "tcpin"]
    assert config.home == GeoPoint(-35.1, -149.2, 600.0)
    assert config.heading_deg == -10.0
    assert config.faults == LinkFaults(loss=0.2, delay_s=0.5, jitter_s=0.1)
    assert (config.battery.cells, config.battery.capacity_mah) == (4, 5000.0)
    assert config.battery_remaining == 0.5
    assert config.parameters == {"RTL_ALT": 2000.0, "FS_GCS_ENABLE": 1.0}
    assert options.world.wind.velocity_ned_m_s == pytest.approx((0.0, 5.0, 0.0))


@pytest.mark.parametrize(
    ("line", "roles"),
    [
        ("", ("gcs", "onboard")),
        ("--link udpout://127.0.0.1:14545 --link tcpin::5760", ("onboard", "gcs")),
        ("--link gcs@udpout://127.0.0.1:14545 --link onboard@tcpin::5760", ("gcs", "onboard")),
    ],
)
def test_the_role_of_a_link_is_given_or_follows_from_its_port(
    line: str, roles: tuple[str, ...]
) -> None:
    _, config = parse(["--autopilot", "px4", *line.split()])
    assert config.links == roles


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "--vehicle submarine",
            "submarine with ardupilot is not supported; supported are: copter with ardupilot",
        ),
        ("--autopilot inav", "copter with inav is not supported"),
        ("--link nonsense", "'nonsense' is not a link: write KIND://HOST:PORT"),
        ("--link udpout://127.0.0.1:0", "no usable port"),
        ("--link boss@udpout://127.0.0.1:1", "'boss' is no role of a link; roles are gcs and onb"),
        ("--link serial:///dev/ttyACM0:57600", "is not a link"),
        ("--speedup 0", "the speedup must be a number from 0.01 to 1000, not '0'"),
        ("--speedup fast", "the speedup must be a number"),
        ("--speedup nan", "the speedup must be a number"),
        ("--seed x", "seed"),
        ("--home 1,2,3", "write LAT,LON,ALT_AMSL_M,HEADING_DEG as numbers, not '1,2,3'"),
        ("--home 91,2,3,4", "latitude of home must be -90 to 90"),
        ("--home nan,2,3,4", "write LAT,LON"),
        ("--system-id 256", "system id must be between 1 and 255, not 256"),
        ("--ready-after -1", "time until ready must be a number from 0 to 3600"),
        ("--fault loss=2", "loss must be between 0 and 1, not 2.0"),
        ("--fault rain=1", "'rain' is not one of loss, duplicate, delay, jitter, corrupt"),
        ("--fault loss", "loss needs a number, not ''"),
        ("--battery capacity=0", "capacity must be above 0 mAh"),
        ("--battery cells=0.5", "the battery must have a cell"),
        ("--battery remaining=7", "charge must be 0 to 1"),
        ("--battery cells=inf", "cells needs a number, not 'inf'"),
        ("--battery resistance=-1", "resistance must be 0 to 10 ohm"),
        ("--wind 5", "write SPEED_M_S,FROM_DEG as numbers, not '5'"),
        ("--param RTL_ALT", "write NAME=NUMBER, not 'RTL_ALT'"),
        ("--param NO_SUCH=1", "no parameter 'NO_SUCH' among 1345"),
        ("--param RTL_ALT=nan", "must be a finite number"),
        ("--no-such-option", "unrecognized arguments: --no-such-option"),
    ],
)
def test_a_wrong_line_gets_one_sentence(
    line: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ending:
        parse(line.split())
    assert ending.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("mavlink_sitl: ")
    assert said.err.count("\n") == 1
    assert words in said.err


def test_help_names_every_option() -> None:
    text = make_parser().format_help()
    for option in ("--link", "--speedup", "--home", "--fault", "--battery", "--param", "--tlog"):
        assert option in text
    assert "examples:" in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("udpout://127.0.0.1:14550", LinkAddress("udpout", "127.0.0.1", 14550)),
        ("udpout:127.0.0.1:14550", LinkAddress("udpout", "127.0.0.1", 14550)),
        ("udpin://0.0.0.0:14550", LinkAddress("udpin", "0.0.0.0", 14550)),
        ("udpin:0.0.0.0:14550", LinkAddress("udpin", "0.0.0.0", 14550)),
        ("udpin://:14550", LinkAddress("udpin", "127.0.0.1", 14550)),
        ("tcpin://127.0.0.1:0", LinkAddress("tcpin", "127.0.0.1", 0)),
        ("tcp:127.0.0.1:5760", LinkAddress("tcpout", "127.0.0.1", 5760)),
        ("udpout://[::1]:14550", LinkAddress("udpout", "::1", 14550)),
        ("udpout://ground.example:14550", LinkAddress("udpout", "ground.example", 14550)),
    ],
)
def test_addresses_in_both_ways_of_writing(text: str, expected: LinkAddress) -> None:
    assert parse_address(text) == expected
    assert parse_address(str(expected)) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "udpout",
        "udpout://127.0.0.1",
        "udpout://127.0.0.1:x",
        "udpout://127.0.0.1:70000",
        "udp://127.0.0.1:1",
        "udpout://a b:1:2",
    ],
)
def test_addresses_that_are_none(text: str) -> None:
    with pytest.raises(AddressError):
        parse_address(text)
