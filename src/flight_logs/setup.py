"""Installs `flight_logs` (ament_python)."""

from setuptools import find_packages, setup

PACKAGE = "flight_logs"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Recorded flights: telemetry logs read in bulk and exported, without ROS",
    license="Apache-2.0",
    maintainer="The maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed", "**/*.json", "**/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    python_requires=">=3.10",
    install_requires=["numpy", "pyarrow", "rich"],
    zip_safe=False,
    entry_points={"console_scripts": ["tlog_export = flight_logs.export_command:main"]},
)
