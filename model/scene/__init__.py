"""The scene: volume, view, transfer functions and light."""
