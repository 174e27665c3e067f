"""Three slices of the volume, with a cross-hair, beside the images."""
