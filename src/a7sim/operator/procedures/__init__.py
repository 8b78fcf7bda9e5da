"""Procedures of orientation: interior, relative, absolute, perspective centres, bridging, grid test."""
