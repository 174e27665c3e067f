"""The image panes, with mouse gestures and the light ball."""
