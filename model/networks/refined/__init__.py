"""The generator that refines images of a coarse volume, drawn under the true transfer functions."""
