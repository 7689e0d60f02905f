"""Surveys that pages ask the servers for."""
