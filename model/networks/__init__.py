"""The four networks of the paper, sized by one width and the image sizes."""
