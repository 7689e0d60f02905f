"""Build script of `navigation_bridge` (ament_python)."""

from setuptools import find_packages, setup

PACKAGE = "navigation_bridge"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="ROS-free bridge between navigation goals and a MAVLink vehicle",
    license="Apache-2.0",
    maintainer="The maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed", "**/*.json"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    python_requires=">=3.10",
    install_requires=["numpy", "PyYAML", "jsonschema"],
    zip_safe=False,
)
