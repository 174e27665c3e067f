"""The image panes, with mouse gestures, keys, the orientation cube and the light ball."""
