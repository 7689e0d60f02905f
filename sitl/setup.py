"""Installs `mavlink_sitl` (ament_python)."""

from setuptools import find_packages, setup

PACKAGE = "mavlink_sitl"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Simulated MAVLink autopilots: seeded, deterministic, faster than real time",
    license="Apache-2.0",
    maintainer="The maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    py_modules=["pytest_mavlink_sitl"],
    entry_points={"pytest11": ["mavlink_sitl = pytest_mavlink_sitl"]},
    package_data={PACKAGE: ["py.typed", "**/*.json", "**/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    python_requires=">=3.10",
    install_requires=["pymavlink", "fastcrc", "numpy", "PyYAML", "jsonschema"],
    zip_safe=False,
)
