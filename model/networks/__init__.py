"""Networks: what they share, their sizes, cards and checkpoints; one package per architecture."""
