"""Sensitivities in the window: over the images and over the opacity curve."""
