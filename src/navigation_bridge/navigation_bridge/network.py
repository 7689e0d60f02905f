"""Setup of a server's links, signing and recording, also for ``--check``. No ROS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.clock import Clock
from mavlink_vehicle.io.driver import Application, Driver
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.io.links import Link, LinkUrl, Report, open_link, parse_url
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.io.signing_key import open_signing
from mavlink_vehicle.io.tlog import TlogWriter
from mavlink_vehicle.io.tlog_series import SeriesTlogWriter, TlogSeries
from mavlink_vehicle.io.tlog_thread import ThreadedTlogWriter
from navigation_bridge.configuration.make_config import ServerConfig

__all__ = ["Network", "open_network"]

_MB = 1_000_000


class Network:
    """The open links of a server, and its recording."""

    def __init__(
        self, router: Router, recorder: TlogWriter | None, links: Mapping[LinkUrl, Link]
    ) -> None:
        """Assemble the parts; use :func:`open_network`."""
        self._router = router
        self._links = links
        self.recorder = recorder

    def drive(self, application: Application, clock: Clock) -> Driver:
        """Return a driver that runs an application on the links, and closes them."""
        return Driver(application, self._router, clock)

    def is_open(self, url: str) -> bool:
        """Return whether a vehicle's link is open."""
        return self._links[parse_url(url)].is_open

    def statistics_of(self, system_id: int) -> LinkStatistics:
        """Return the link statistics of a system; of all vehicles for 0."""
        return self._router.statistics.of_system(system_id)

    def station_links(self) -> list[tuple[str, LinkStatistics]]:
        """Return URL and statistics of each ground station link."""
        return self._router.statistics.station_links()


def open_network(
    config: ServerConfig,
    vehicles: Sequence[ServerConfig],
    report: Report,
    warn: Report | None = None,
    resumed: bool = False,
) -> Network:
    """Open every link once.

    Args:
        config: settings of the server.
        vehicles: settings of its vehicles, which may share links.
        report: receives sentences for people, such as the address of each listening link.
        warn: receives warnings about links that are lost or cannot be opened yet; ``report`` if
            None.
        resumed: continue the recording of this run of the server instead of beginning it again.

    Raises:
        LinkError: a link cannot be opened, or the signing key file has no key.
        OSError: the recording cannot be written.
    """
    signing = open_signing(config.signing_key_file, report)
    urls = dict.fromkeys(parse_url(vehicle.link_url) for vehicle in vehicles)
    with ExitStack() as on_failure:

        def opened(url: str) -> Link:
            link = open_link(url, report, warn)
            on_failure.callback(link.close)
            return link

        links = {url: opened(str(url)) for url in urls}
        stations = [opened(url) for url in config.gcs_links]
        for link in (*links.values(), *stations):
            if link.note is not None:
                report(link.note)
        recorder = _recorder(config, report, resumed)
        on_failure.pop_all()
    source = (config.vehicle.source_system or 1, config.vehicle.source_component)
    router = Router(
        list(links.values()), lambda: Codec(*source, signing), stations, recorder, len(vehicles)
    )
    return Network(router, recorder, links)


def _recorder(config: ServerConfig, report: Report, resumed: bool) -> TlogWriter | None:
    """Return what records; None where nothing is recorded.

    Raises:
        LinkError: the file cannot be written.
    """
    path, file_mb = config.record_tlog, config.record_tlog_file_mb
    if path is None:
        return None
    if not file_mb:
        return ThreadedTlogWriter(path, resumed)
    series = TlogSeries(path, file_mb * _MB, config.record_tlog_files)
    recorder = SeriesTlogWriter(series, path)
    report(f"Recording to {recorder.path}")
    return recorder
