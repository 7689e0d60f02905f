"""Installs the package (ament_python); setup.cfg says what it is."""

from setuptools import setup

setup()
