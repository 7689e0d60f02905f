"""pymavlink's own MAVFTP client, unmodified, with both simulated firmwares."""

from __future__ import annotations

from pathlib import Path

import pytest
from pymavlink.mavftp import MAVFTP, MAVFTPReturn

from sitl_support.ftp_client import CARDS, Master, card, connected


def done(result: MAVFTPReturn) -> MAVFTPReturn:
    assert result.error_code == 0, result.operation_name
    return result


@pytest.mark.parametrize("autopilot", sorted(CARDS))
def test_files_are_put_listed_got_and_removed(autopilot: str, tmp_path: Path) -> None:
    client = connected(autopilot)
    ftp = MAVFTP(Master(client.station), 1, 1)
    sent, received = tmp_path / "sent", tmp_path / "received"
    sent.write_bytes(bytes(range(256)) * 20)
    name = card(client, "new.bin").decode("ascii")
    done(ftp.cmd_put([str(sent), name]))
    done(ftp.process_ftp_reply("Put", timeout=20))
    listing = done(ftp.cmd_list([card(client).decode("ascii")]))
    entries = {entry.name: entry.size_b for entry in listing.directory_listing or []}
    assert entries["new.bin"] == 5120
    done(ftp.cmd_get([name, str(received)]))
    done(ftp.process_ftp_reply("Get", timeout=20))
    assert received.read_bytes() == sent.read_bytes()
    done(ftp.cmd_rm([name]))
    assert not client.station.vehicle.logbook.storage.files


def test_an_ardupilots_parameters_come_with_their_defaults(tmp_path: Path) -> None:
    client = connected("ardupilot")
    client.station.vehicle.parameters.set("WPNAV_SPEED", 700.0)
    ftp = MAVFTP(Master(client.station), 1, 1)
    values, defaults = tmp_path / "values.parm", tmp_path / "defaults.parm"
    ftp.cmd_getparams([str(values), str(defaults)])
    done(ftp.process_ftp_reply("GetParams", timeout=20))
    assert "WPNAV_SPEED,700\n" in values.read_text()
    assert "WPNAV_SPEED,1000\n" in defaults.read_text()
    assert len(values.read_text().splitlines()) == len(client.station.vehicle.parameters)
