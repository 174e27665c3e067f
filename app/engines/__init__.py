"""What draws, in threads of its own; knows no widget."""
