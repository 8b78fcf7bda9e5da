"""Widgets and screens of the console."""
