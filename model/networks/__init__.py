"""Networks: what they share, their sizes, cards and checkpoints; the paper's two in a package."""
