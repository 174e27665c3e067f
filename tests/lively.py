import torch
from torch import nn

from model.networks.blocks import kaiming_init
from model.networks.paper import TwoStageGenerator
from model.networks.size import NetworkSize

SIZE = NetworkSize(0.125, 32, 64)


def lively_network():
    """A network whose images depend on its inputs; the paper's first weights are too small."""
    torch.manual_seed(0)
    network = TwoStageGenerator(SIZE)
    kaiming_init(network)
    for layer in network.modules():
        if isinstance(layer, nn.Conv2d):
            nn.init.kaiming_normal_(layer.weight)
    return network
