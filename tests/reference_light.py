"""The light of the second ray caster, in 64-bit arithmetic: gradient shading and soft light.

Plain NumPy on whole arrays of samples, from what :mod:`model.rendering.raycast` says of each light;
none of its code, and none of what makes it fast: every sample is shaded itself, and every ray goes
to its end.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline
from scipy.ndimage import convolve1d

from model.rendering.raster import Raster
from model.rendering.scalars import noise_of
from model.scene.crop import CropBox
from model.scene.filling import fill
from model.scene.scene import LightDirection
from tests.reference_raycaster import (
    LARGEST_OPACITY,
    alphas_of,
    at_bins,
    cast,
    correct,
    interpolated,
    kept_of,
    nearest,
    unit_field,
    weights_of,
)

DIFFUSE, SPECULAR, HALF_POWER = 0.9, 0.2, 10
AMBIENT, DISTANT, SHADOW = 0.4, 0.65, 0.35
NOISE = 3.0
NODES, AROUND_NODE = 64, 4
RAYS_AT_ONCE = 2048
BLUR = NODE_BLUR = 0.0  # share of each of two neighbours in normals, and in soft light's nodes


def picture(
    volume, inputs, size, sample_distance, lighting="none", per_sample=None, opacity=None, least=0.0
):
    """Return a picture (rows, columns, 4): RGBA, premultiplied, clipped to 0 to 1.

    `per_sample` and `opacity` are opacities of a whole step and of a voxel's length, in place of
    the TF's; complex ones, and `least`, as in :mod:`tests.reference_raycaster`.
    """
    raster = Raster.of(size)
    scalar_range = volume.scalar_range
    if opacity is None:
        opacity = inputs.opacity_tf.sample(scalar_range).astype(np.float64)
    if per_sample is None:
        per_sample = correct(opacity, sample_distance)
    color = inputs.color_tf.sample(scalar_range).astype(np.float64)
    light = inputs.light or LightDirection()
    travel = -np.array(light.towards()) @ inputs.view.basis()
    mask = None if inputs.mask is None else inputs.mask.shown
    noise = 0.06 if inputs.is_nearest(volume) else NOISE * noise_of(unit_field(volume))
    if mask is not None:
        filled = np.minimum(volume.voxels, fill(volume.voxels.copy(), ~mask))
        volume = replace(volume, voxels=filled).over(scalar_range)
    field = unit_field(volume)
    glow = None
    if lighting == "soft":
        glow = _soft_grid(volume, field, opacity, travel, inputs, mask)
        glow = _blurred(glow, NODE_BLUR, (0, 1, 2))
    whole = np.zeros((*raster.shape, 4), dtype=per_sample.dtype)
    wide = min(raster.columns, RAYS_AT_ONCE)
    for tile in raster.tiles(wide, max(RAYS_AT_ONCE // wide, 1)):
        is_nearest = inputs.is_nearest(volume)
        shown = inputs.crop, is_nearest, mask, inputs.clip
        rays = cast(volume, inputs.view, tile, sample_distance, *shown)
        whole_steps = per_sample if mask is None else kept_of(rays, opacity, sample_distance)
        alpha = alphas_of(rays.bins, rays.shares, whole_steps, least)
        weight = weights_of(alpha)
        rgb = np.stack([at_bins(rays.bins, c) for c in color.T], axis=-1).astype(per_sample.dtype)
        if glow is not None:
            rgb = rgb * _at_nodes(glow, rays.places, volume.dimensions)[..., None]
        elif lighting == "direct":
            steps = (_label_steps if is_nearest else _steps)(field, rays.places)
            diffuse, gloss = _reflected(volume, steps, noise, rays, travel, inputs)
            rgb = rgb * diffuse[..., None] + gloss[..., None]
        rows = slice(tile.top - raster.top, tile.bottom - raster.top)
        columns = slice(tile.left - raster.left, tile.right - raster.left)
        whole[rows, columns, :3] = (weight[..., None] * rgb).sum(axis=-2)
        whole[rows, columns, 3] = weight.sum(axis=-1)
    return whole if np.iscomplexobj(whole) else np.clip(whole, 0, 1)


def _blurred(grid, share, axes):
    """Give each of a node's two neighbours a share, along some axes."""
    for axis in axes:
        grid = convolve1d(grid, (share, 1 - 2 * share, share), axis, mode="nearest")
    return grid


def _steps(field, places):
    """Differences of the field, blurred across, a voxel further and back along each axis."""
    across = [_blurred(field, BLUR, axes) for axes in ((0, 1), (0, 2), (1, 2))]
    ways = zip(across, np.eye(3), strict=True)
    steps = [interpolated(f, places + e) - interpolated(f, places - e) for f, e in ways]
    return np.stack(steps, -1)


def _label_steps(field, places):
    """Gradient of the share of the nearest voxel's label, by a cubic B-spline."""
    spline = BSpline.basis_element([-2, -1, 0, 1, 2], extrapolate=False)
    slope = spline.derivative()
    own, total = nearest(field, places), np.zeros_like(places)
    for offset in itertools.product((-1, 0, 1, 2), repeat=3):
        voxel = np.floor(places) + np.array(offset)
        weights = np.nan_to_num([spline(places - voxel), slope(places - voxel)])
        for axis in range(3):
            each = [weights[int(k == axis), ..., k] for k in range(3)]
            total[..., axis] += (nearest(field, voxel) == own) * each[0] * each[1] * each[2]
    return total


def _reflected(volume, steps, noise, rays, travel, inputs):
    """Factor of the colour, and white gloss of each sample, by gradient shading."""
    places, spacing = rays.places, np.array(volume.spacing)
    seen = rays.towards[..., None, :]
    change = np.linalg.norm(steps, axis=-1)
    normal = steps / spacing
    slope = np.linalg.norm(normal, axis=-1)
    known = change > 0
    unit = np.divide(normal, slope[..., None], out=np.zeros_like(normal), where=known[..., None])
    across = np.abs(unit @ travel)
    mirrored = 2 * across[..., None] * unit - travel
    along = (mirrored * seen).sum(axis=-1) / np.linalg.norm(mirrored, axis=-1)
    shine = np.where(along > 0, np.abs(along) ** (2 * HALF_POWER), 0)
    # A ratio first: fourth powers of small numbers would be 0.
    ratio = np.divide(noise, change, out=np.full_like(change, np.inf), where=known)
    share = np.where(known, 1 / (1 + ratio**4), 0)
    diffuse = DIFFUSE * (0.5 + share * (across - 0.5))
    gloss = SPECULAR * share * shine
    box = inputs.crop or CropBox()
    last = np.array(volume.dimensions) - 1
    faces = np.eye(3)
    deep = np.minimum(places - np.array(box.low) * last, np.array(box.high) * last - places)
    if inputs.clip is not None:
        # Its depth in voxels is along the direction that is its normal in voxels.
        normal = np.array(inputs.clip.normal)
        faces, of_voxels = np.vstack([faces, normal]), normal * spacing
        from_centre = (places - last / 2) @ of_voxels - inputs.clip.offset * volume.radius
        depth = -from_centre[..., None] / np.linalg.norm(of_voxels)
        deep = np.concatenate([deep, depth], axis=-1)
    near = np.clip(2 - 2 * deep, 0, 1)
    total, most = near.sum(axis=-1), near.max(axis=-1)
    passing = (travel * seen).sum(axis=-1)[..., None]
    along_faces = 2 * (faces @ travel) * (seen @ faces.T) - passing
    shines = np.where(along_faces > 0, np.abs(along_faces) ** (2 * HALF_POWER), 0)
    some = np.where(total > 0, total, 1)
    flat = DIFFUSE * (near * np.abs(faces @ travel)).sum(axis=-1) / some
    shine = SPECULAR * (near * shines).sum(axis=-1) / some
    return diffuse + most * (flat - diffuse), gloss + most * (shine - gloss)


def _soft_grid(volume, field, opacity, travel, inputs, mask):
    """Light at the nodes of the coarse grid (nz, ny, nx) of soft light."""
    extent, dimensions = np.array(volume.extent), np.array(volume.dimensions)
    counts = np.clip(np.ceil(NODES * extent / extent.max()).astype(int), 2, dimensions)
    bins = np.clip(np.floor(255 * field + 0.5), 0, 255).astype(int)
    dense = np.minimum(opacity.real, LARGEST_OPACITY)
    table = -np.log1p(-dense).astype(opacity.dtype)
    if np.iscomplexobj(opacity):
        table = table + 1j * np.where(opacity.real < LARGEST_OPACITY, opacity.imag / (1 - dense), 0)
    looked_up = SHADOW * table[bins] / volume.voxel_size
    if volume.hidden is not None:
        looked_up[volume.hidden] = 0
    if mask is not None:
        looked_up[~mask] = 0
    z, y, x = (_around(n, m) for n, m in zip(counts[::-1], field.shape, strict=True))
    extinction = looked_up[z][:, :, y][:, :, :, :, x].mean(axis=(1, 3, 5))
    extinction = extinction * _shares(volume, inputs, counts)
    spacing = extent / (counts - 1)
    around = [
        np.array(way) / np.linalg.norm(way)
        for way in itertools.product((-1, 0, 1), repeat=3)
        if np.count_nonzero(way) in (1, 3)
    ]
    ambient = np.mean([_swept(extinction, way / spacing) for way in around], axis=0)
    light = AMBIENT * ambient + DISTANT * _swept(extinction, travel / spacing)
    return np.where(light.real > 1, 1, light)


def _around(nodes, voxels):
    """Voxels (nodes, 4) along an axis that stand for those around each node."""
    size = (voxels - 1) / (nodes - 1)
    found = []
    for node in range(nodes):
        first = max(math.ceil((node - 0.5) * size), 0)
        last = min(math.floor((node + 0.5) * size) + 1, voxels)
        parts = range(AROUND_NODE)
        found.append([first + (2 * p + 1) * (last - first) // (2 * AROUND_NODE) for p in parts])
    return np.array(found)


def _shares(volume, inputs, counts):
    """Share of the space around each node (nz, ny, nx) that is shown."""
    along, middles, sides, crop = [], [], [], inputs.crop or CropBox()
    for low, high, count in zip(crop.low, crop.high, counts, strict=True):
        begin = np.maximum(np.arange(count) - 0.5, 0)
        end = np.minimum(np.arange(count) + 0.5, count - 1)
        kept = np.minimum(end, high * (count - 1)) - np.maximum(begin, low * (count - 1))
        along.append(np.clip(kept, 0, None) / (end - begin))
        middles.append((begin + end) / 2 / (count - 1) - 0.5)
        sides.append((end - begin) / (count - 1))
    x, y, z = along
    shares = z[:, None, None] * y[:, None] * x
    if inputs.clip is not None:
        # The volume of a cell below a plane, by its corners: all but 0 normals divide.
        turns = np.array(inputs.clip.normal) * volume.extent
        middle = np.stack(np.meshgrid(*middles[::-1], indexing="ij"))[::-1]
        widths = np.stack(np.meshgrid(*sides[::-1], indexing="ij"))[::-1]
        widths *= np.maximum(abs(turns), 1e-4 * abs(turns).max())[:, None, None, None]
        depth = inputs.clip.offset * volume.radius - np.tensordot(turns, middle, 1)
        total = np.zeros_like(shares)
        for corner in itertools.product((0, 1), repeat=3):
            beyond = depth + np.tensordot(0.5 - np.array(corner), widths, 1)
            total += (-1) ** sum(corner) * np.maximum(beyond, 0) ** 3 / 6
        shares = shares * np.clip(total / widths.prod(axis=0), 0, 1)
    return shares


def _swept(extinction, steps):
    """Share of a distant light that arrives at each node, from layer to layer of an axis."""
    order = np.argsort(-np.abs(steps), kind="stable")
    axes = tuple(2 - order)
    along, u, v = steps[order]
    turn = slice(None, None, 1 if along > 0 else -1)
    layers = np.transpose(extinction, axes)[turn]
    u, v, length = u / abs(along), v / abs(along), 1 / abs(along)
    out = np.ones_like(layers)
    for n in range(1, len(layers)):
        came = _shifted(np.pad(out[n - 1], 2, constant_values=1), u, v)
        met = _shifted(np.pad(layers[n - 1], 2), u, v)
        out[n] = came * np.exp(-met * length)
    return np.transpose(out[turn], np.argsort(axes))


def _shifted(padded, u, v):
    """Interpolate a layer, padded by two, where the light of each node comes from."""
    rows, columns = (n - 4 for n in padded.shape)
    top, left = math.floor(-u), math.floor(-v)
    down, right = -u - top, -v - left
    across = (1 - right) * padded[:, 2 + left : 2 + left + columns]
    across = across + right * padded[:, 3 + left : 3 + left + columns]
    upper, lower = across[2 + top : 2 + top + rows], across[3 + top : 3 + top + rows]
    return (1 - down) * upper + down * lower


def _at_nodes(grid, places, dimensions):
    """Light at places in voxels."""
    counts = np.array(grid.shape[::-1])
    at = places * (counts - 1) / (np.array(dimensions) - 1)
    if np.iscomplexobj(grid):
        return interpolated(grid.real, at) + 1j * interpolated(grid.imag, at)
    return interpolated(grid, at)


def derivative(volume, inputs, size, sample_distance, lighting, edit):
    """Return a picture (rows, columns, 4), and its exact derivative along an edit of the TF.

    The edit is of opacities per voxel length.
    """
    tiny = 1e-170
    opacity = inputs.opacity_tf.sample(volume.scalar_range).astype(np.float64)
    least = (1 - LARGEST_OPACITY) ** sample_distance
    opacity = opacity + 1j * tiny * edit
    found = picture(volume, inputs, size, sample_distance, lighting, None, opacity, least)
    return np.clip(found.real, 0, 1), found.imag / tiny
