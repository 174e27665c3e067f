"""The scene: volume, view, transfer functions, and what an image of it depends on."""
