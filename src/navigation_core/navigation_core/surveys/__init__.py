"""Surveys: areas that are covered by parallel lines."""
