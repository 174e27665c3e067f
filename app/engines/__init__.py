"""Engines, which draw images in their own threads; independent of widgets."""
