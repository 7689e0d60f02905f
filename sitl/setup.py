"""Installs the package for ROS (ament_python); pyproject.toml says what it is."""

from setuptools import setup

setup()
