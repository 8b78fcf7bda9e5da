"""Tests of a7sim."""
