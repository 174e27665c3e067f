"""The norm of a region's change by all edits."""

import numpy as np
import pytest
from ramp import make_tf, make_volume
from test_exact import VIEW, random_opacity, small_volume, tf_of

from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Outline, Region, windows_of
from model.scene.tf_perturbation import edit_around
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.exact import block_fields, change_norms

SIZE = 16
REGION = Region(4, 3, 13, 12)


def test_the_parts_of_a_region_add_up():
    renderer = RaycastRenderer(small_volume())
    inputs = SceneInputs.of(VIEW, tf_of(random_opacity(0.5)))
    whole = change_norms(renderer, inputs, SIZE, Outline(), 0.0)
    lasso = Outline(((0.1, 0.1), (0.9, 0.3), (0.5, 0.95)))
    pixel = Region(7, 8, 8, 9)
    for part in (lasso, pixel):
        mask = part.mask(SIZE)
        inside = change_norms(renderer, inputs, SIZE, part, 0.0)
        outside, _ = (
            renderer.squared_changes(inputs, SIZE, windows_of(m), np.eye(256))
            for m in (~mask, mask)
        )
        np.testing.assert_allclose(
            np.sqrt(inside.astype(float) ** 2 + outside), whole, rtol=1e-4, atol=1e-7
        )
    renderer.close()


def test_small_images_take_a_coarser_grid_for_many_edits():
    """On volumes that have more voxels than that grid has nodes."""
    places = np.stack(np.meshgrid(*[np.linspace(-1, 1, 72)] * 3, indexing="ij"))
    field = 255 * np.exp(-3 * (places**2).sum(axis=0)) * (1 + 0.2 * np.sin(9 * places[0]))
    volume = Volume(np.clip(np.rint(field), 0, 255).astype(np.uint8))
    renderer = RaycastRenderer(volume, "soft", threads=2)
    inputs = SceneInputs.of(VIEW, tf_of(np.linspace(0.01, 0.08, 256)))
    small, large = (
        change_norms(renderer, inputs, size, Region.whole(size), 6.0) for size in (64, 128)
    )
    # Four times as many pixels have twice the norm.
    small, large = 2 * small.astype(float), large.astype(float)
    assert np.linalg.norm(small - large) < 0.1 * np.linalg.norm(large)
    assert small @ large > (1 - 2e-3) * np.linalg.norm(small) * np.linalg.norm(large)
    renderer.close()


def block_norms(image, blocks):
    """Norm of the colours of each block."""
    side = len(image) // blocks
    parts = image.astype(np.float64).reshape(blocks, side, blocks, side, 3)
    return np.sqrt((parts**2).sum(axis=(1, 3, 4)))


@pytest.mark.parametrize("lighting", ["none", "soft"])
def test_fields_hold_how_the_norm_of_each_block_changes(lighting):
    inputs, width = SceneInputs.of(View(40, 20, 3, 1.0), make_tf()), 6.0
    renderer = RaycastRenderer(make_volume(), lighting, threads=1, sample_distance=1.0)
    fields = block_fields(renderer, inputs, 16, 4, width)
    edit = edit_around(150.0, (100.0, 200.0), width).astype(np.float64)
    change = renderer.change(inputs, 16, edit.astype(np.float32))
    image = renderer.render(inputs, 16)[..., :3].astype(np.float64)
    # The norm's derivative is the change along the image.
    h = 1e-4
    expected = (block_norms(image + h * change, 4) - block_norms(image - h * change, 4)) / (2 * h)
    ours = fields[..., round(255 * 0.5)]
    np.testing.assert_allclose(ours, expected, atol=2e-2 * np.abs(expected).max())
    renderer.close()
