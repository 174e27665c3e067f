from torch import nn


class Told(nn.Module):
    """A codec that decodes a TF as what it was told to."""

    def __init__(self, decode):
        super().__init__()
        self.decode = decode

    def encode(self, opacity_tf):
        return opacity_tf
