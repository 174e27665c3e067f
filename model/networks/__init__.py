"""Networks, their sizes, cards and checkpoints."""
