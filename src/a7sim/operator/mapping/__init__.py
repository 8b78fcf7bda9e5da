"""Compiling a map: settings of the plotter, stereo view, contours, lines and spot heights."""
