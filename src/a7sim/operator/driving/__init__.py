"""Driving an instrument: the driver protocol, controls, pointing and the floating mark."""
