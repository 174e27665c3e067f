from __future__ import annotations

import numpy as np
import pytest
import torch

from model.benchmarks.codec_browsing import measure_browsing
from model.errors import TrainingError
from model.latent.codes import TFCodec
from model.networks.codec import BrowserCodec
from model.samples.sampling import draw_opacity_tfs
from model.training.codec_training import UNIT_SCENE, CodecDesign, train_codec


@pytest.fixture(autouse=True)
def small_pool(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("model.training.codec_training.POOL", 500)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["plain", "contractive", "variational"])
def test_a_codec_learns(kind: str) -> None:
    tfs = draw_opacity_tfs(UNIT_SCENE, 9, 0, 300)
    errors = []
    design = CodecDesign(kind, latent_dim=4, width=0.1, batch_size=64)  # type: ignore[arg-type]
    for step, codec in train_codec(design, 120, reports=2):
        codec.eval()
        wrapped = TFCodec(codec)
        errors.append(np.square(wrapped.decode(wrapped.encode(tfs)) - tfs).mean())
        codec.train()
        assert step in (60, 120)
    assert errors[1] < errors[0] < np.square(tfs - 0.5).mean()


def test_a_run_is_repeatable() -> None:
    design = CodecDesign(latent_dim=2, width=0.1, batch_size=16)
    runs = [list(train_codec(design, 3, seed=5, reports=1))[-1][1] for _ in range(2)]
    for one, other in zip(*(codec.state_dict().values() for codec in runs), strict=True):
        assert torch.equal(one, other)


def test_unknown_kinds_are_refused() -> None:
    with pytest.raises(TrainingError, match="unknown"):
        CodecDesign("round")  # type: ignore[arg-type]
    with pytest.raises(TrainingError, match="at least 1"):
        CodecDesign(latent_dim=0)


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


def test_a_perfect_codec_measures_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    """TFs that are their own codes: nothing is lost, and lines of codes are lines of TFs."""
    for name, count in (("CHECKED", 300), ("KNOWN", 400), ("RANDOM", 200), ("PAIRS", 100)):
        monkeypatch.setattr(f"model.benchmarks.codec_browsing.{name}", count)

    class Identity(TFCodec):
        def __init__(self) -> None:
            pass

        def encode(self, opacities: np.ndarray) -> np.ndarray:
            return np.asarray(opacities, dtype=np.float32)

        decode = encode

    row = measure_browsing("identity", Identity(), 0)
    assert row.layer_rmse == {1: 0.0, 16: 0.0}
    assert row.faint_rmse == row.returned == 0.0
    assert row.detour >= 1.0
    assert row.latent_dim == 256
    assert row.neighbours > 0.5
