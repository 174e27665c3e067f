from __future__ import annotations

import torch

from model.networks.codec import BrowserCodec


def test_codes_are_the_distribution_function_of_their_means() -> None:
    torch.manual_seed(0)
    codec = BrowserCodec(3, 0.1).eval()
    tfs = torch.rand(5, 256) * 2 - 1
    means, _ = codec.distribution(((tfs + 1) / 2).sqrt())
    expected = 2 * torch.distributions.Normal(0.0, 1.0).cdf(means) - 1
    assert torch.allclose(codec.encode(tfs), expected, atol=1e-6)
    # Decoding undoes it.
    assert torch.allclose(
        codec.decode(expected), 2 * codec.decode_roots(means).square() - 1, atol=1e-4
    )


def test_decoded_tfs_do_not_waver() -> None:
    """Even an untrained decoder's neighbouring bins differ less than its rough numbers."""
    torch.manual_seed(0)
    codec = BrowserCodec(3, 0.1)
    code = torch.randn(4, 3)
    rough = torch.sigmoid(codec.tf_decoder(code))
    smooth = codec.decode_roots(code)
    assert smooth.diff(dim=1).square().mean() < 0.1 * rough.diff(dim=1).square().mean()
