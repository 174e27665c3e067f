"""Where in the transfer function an edit changes an image, and where in the image it shows."""
