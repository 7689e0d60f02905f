"""Installs `navigation_core` (ament_python)."""

from setuptools import find_packages, setup

PACKAGE = "navigation_core"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Trajectories, path planning and navigation tasks, without ROS or MAVLink",
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
    install_requires=["ruckig"],
    zip_safe=False,
)
