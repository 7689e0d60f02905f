"""Build script of `flight_reports` (ament_python)."""

from setuptools import find_packages, setup

PACKAGE = "flight_reports"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Reports, plots and videos of recorded flights, without ROS",
    license="Apache-2.0",
    maintainer="The maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed", "**/*.css", "**/*.js", "**/*.LICENSE.txt"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    python_requires=">=3.10",
    install_requires=["numpy", "matplotlib", "pillow", "rich"],
    zip_safe=False,
)
