"""What is open and edited; knows no widget."""
