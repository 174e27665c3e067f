"""Figures as PNG files, for the command line and the window."""
