"""Build script of `drone_navigation` (ament_python)."""

from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = "drone_navigation"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="ROS 2 action server and client for navigation goals over MAVLink",
    license="Apache-2.0",
    maintainer="The maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", sorted(map(str, Path("launch").glob("*.py")))),
    ],
    python_requires=">=3.10",
    install_requires=[
        "numpy",
        "PyYAML",
        "rich",
        "mcap",
        "shtab",
    ],
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "navigation_server = drone_navigation.navigation_server:main",
            "navigation_client = drone_navigation.navigation_client:main",
            "navigation_report = flight_reports.navigation_report:main",
            "tlog2mcap = drone_navigation.tlog2mcap:main",
        ],
    },
)
