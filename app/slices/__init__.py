"""Three slices of the volume, with a cross-hair, next to the images."""
