"""The latent browser: a map of TFs, a grid of its cells, and pictures under the mouse."""
