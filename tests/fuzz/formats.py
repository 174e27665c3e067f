"""The formats to fuzz: how to make valid files of each, and how tfscope reads them."""

import hashlib
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np

from tests.fuzz.mutations import mutated, mutated_json

WRITERS = Path(__file__).parents[1] / "model" / "volume_files"
sys.path.insert(0, str(WRITERS))


@dataclass(frozen=True)
class Format:
    """A kind of file or folder: writes valid examples, and reads one as tfscope does.

    Reading returns a digest of what must not change unnoticed, or "". Of a folder, files of any
    suffix are mutated, or of some.
    """

    make: Callable[[Path], list[Path]]
    read: Callable[[Path], str]
    suffixes: tuple[str, ...] = ()
    mutate: Callable[..., bytes] = mutated


def _voxels():
    return np.random.default_rng(1).integers(0, 4000, (9, 10, 11), dtype=np.uint16)


def _volumes(*makers):
    return Format(lambda folder: [make(folder, _voxels()) for make in makers], _read_volume)


def _by(module, make):
    """Return a maker of a file by what the readers' tests have in a module."""
    return lambda folder, array: make(import_module(module), folder, array)


def _written(writer, name, *options, **more):
    return _by(
        "volume_writers",
        lambda tests, folder, array: getattr(tests, f"write_{writer}")(
            folder / name, array, *options, **more
        ),
    )


def _vti(*options):
    return _written("vti", "-".join(map(str, options)) + ".vti", *options)


def _imagej(folder, array):
    import tifffile

    path = folder / "hyperstack.tif"
    stacks = np.stack([array, array + 1], axis=1)
    tifffile.imwrite(path, stacks, imagej=True, metadata={"axes": "ZCYX", "spacing": 2.0})
    return path


def _ome(folder, array):
    import tifffile

    path = folder / "a.ome.tif"
    metadata = {"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeZ": 2.0}
    tifffile.imwrite(path, array, metadata=metadata, tile=(16, 16), compression="zlib")
    return path


def _frames(syntax, encoder):
    """Return a maker of a file of compressed frames, or of an enhanced one."""

    def make(folder, array):
        import imagecodecs
        from volume_writers import dataset, item, save_dicom

        tags = {"ImagePositionPatient": [0, 0, 0], "SpacingBetweenSlices": 2.0}
        if encoder:
            encode = getattr(imagecodecs, encoder)
            tags["encoded"] = [encode(np.ascontiguousarray(plane)) for plane in array]
        else:
            places = [item(ImagePositionPatient=[0.0, 0.0, 2.0 * z]) for z in range(len(array))]
            groups = [item(PlanePositionSequence=place)[0] for place in places]
            tags["PerFrameFunctionalGroupsSequence"] = groups
        image = dataset(array, syntax=f"1.2.840.10008.1.2.{syntax}", frames=len(array), **tags)
        return save_dicom(folder / f"{syntax}.dcm", image)

    return make


def _nibabel(name):
    def make(tests, folder, array):
        return tests.save(folder / name, array.astype(np.int16), kind=tests.WRITERS[name])

    return _by("test_nifti", make)


def _hdf5(folder, array):
    import h5py

    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("group/values", data=array, chunks=(3, 5, 11), compression="gzip")
        file["mask"] = (array > 9).astype(np.uint8)
        file["group/values"].attrs["_FillValue"] = 7
    return folder / "a.h5"


def _cf(folder, array, form):
    """Write a packed variable with coordinates, as xarray does."""
    import xarray

    axes = {name: 2.5 * np.arange(n) for name, n in zip(("lev", "lat", "lon"), array.shape)}  # noqa: B905
    data = xarray.Dataset({"t": (tuple(axes), array / 2.0, {"units": "K"})}, axes)
    data.lev.attrs |= {"units": "hPa", "positive": "down"}
    packing = {"t": {"dtype": "i2", "scale_factor": 0.5, "_FillValue": -1}}
    if form == "zarr":
        data.to_zarr(folder / "cf.zarr", encoding=packing, zarr_format=2, consolidated=False)
        return folder / "cf.zarr"
    path = folder / f"{form}.nc"
    data.to_netcdf(path, engine=form, encoding=packing)  # type: ignore[call-overload]
    return path


def _ome_zarr(tests, folder, array):
    scales = [tests.scaled(2.0, 0.5, 0.5)]
    return tests.write_ome_zarr(folder / "ome.zarr", {"0": array}, scales=scales)


def _by_programs(name):
    """Return a maker of a file as a program lays it out in HDF5."""

    def make(tests, folder, _array):
        with tests.h5py.File(folder / name, "w") as file:
            tests.HDF5[name][0](file)
        return folder / name

    return _by("test_containers", make)


def _labels(writer):
    """Return a maker of labels as a program writes them with their names and colours."""
    return _by("test_labels", lambda tests, folder, _array: getattr(tests, writer)(folder))


def _read_volume(path):
    from model.volume_files.source import VolumeSource

    VolumeSource(path=path).read()
    return ""


def _make_tf(folder):
    from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

    span = (0.0, 255.0)
    colors = ColorTF(span, ((0.0, 0.0, 0.0, 0.0), (255.0, 1.0, 0.5, 0.0)))
    modes = OpacityTF(span, (GaussianMode(50.0, 9.0, 0.5), GaussianMode(150.0, 20.0, 0.1)))
    points = OpacityTF(span, points=((0.0, 0.0), (99.0, 0.2), (255.0, 1.0)))
    paths = [folder / "modes.json", folder / "points.json"]
    for path, opacity in zip(paths, (modes, points), strict=True):
        TransferFunction(opacity, colors).save(path)
    return paths


def _read_tf(path):
    from model.scene.transfer_function import TransferFunction

    tf = TransferFunction.load(path)
    tf.opacity.sample()
    tf.color.sample()
    return ""


def _scene():
    from model.scene.scene import Scene
    from model.scene.volume import Volume

    return Scene.of(Volume(_voxels()), image_size=16)


def _make_model(folder):
    from model.networks.card import ModelCard
    from model.networks.checkpoint import save_model
    from model.networks.paper import build_generator
    from model.networks.size import NetworkSize

    size, scene = NetworkSize(0.05, 16, 16), _scene()
    metrics = {"holdout": {"rmse": 0.05}, "sensitivity_agreement": {}}
    card = ModelCard(scene, "draft", size, {"samples_seen": 1}, metrics, {"torch": "2"})
    save_model(folder / "model", card, build_generator(size, scene))
    return [folder / "model"]


def _read_model(path):
    from model.networks.card import recorded_agreement, recorded_errors
    from model.networks.checkpoint import load_model

    recorded_agreement(path)
    recorded_errors(path)
    _, network = load_model(path)
    digest = hashlib.sha256()
    for value in network.state_dict().values():
        digest.update(value.numpy().tobytes())
    return digest.hexdigest()


def _make_store(folder):
    from model.samples.sample_store import BLOCK, SampleBatch, SampleStore

    rng = np.random.default_rng(2)
    store = SampleStore.create(folder / "s.zarr", _scene(), 7, {"train": 2 * BLOCK, "holdout": 9})
    shapes = {n: a.shape[1:] for n, a in store.read("train", range(0)).arrays.items()}
    for split in ("train", "holdout"):
        for block in store.missing_blocks(split):
            arrays = {n: 200 * rng.random((len(block), *s)) for n, s in shapes.items()}
            arrays["rgba"] = arrays["rgba"].astype(np.uint8)
            store.write_block(split, block, SampleBatch.of(arrays))
    return [store.path]


def _read_store(path):
    from model.samples.sample_store import SPLITS, SampleStore

    store = SampleStore(path)
    store.require_complete()
    digest = hashlib.sha256()
    for split in SPLITS:
        batch = store.read(split, range(store.count(split)))
        for name in sorted(batch.arrays):
            digest.update(batch.arrays[name].tobytes())
    return digest.hexdigest()


def _make_preferences(folder):
    from app.state.preferences import Preferences
    from model.scene.view import View

    preferences = Preferences(folder)
    preferences.note_opened("f", Path("/data/a.nrrd"))
    preferences.note_volume("f", up_axis="+y", view=View(), models=("/data/m",))
    preferences.finish()
    return [folder / "settings.json", folder / "volumes" / "f.json"]


def _read_preferences(path):
    from app.state.preferences import KeptFile
    from app.state.settings import Settings, VolumeMemory

    KeptFile(path, Settings if path.name == "settings.json" else VolumeMemory)
    return ""


def _make_planted(folder):
    (folder / "planted").write_bytes(b"good")
    return [folder / "planted"]


def _read_planted(path):
    """Fail as the file's content says: the fuzz job's own test."""
    from model.errors import VolumeError

    match path.read_bytes():
        case b"refused":
            raise VolumeError("refused")
        case b"error":
            raise KeyError("error")
        case b"crash":
            os.abort()
        case b"hang":
            time.sleep(60)
        case b"memory":
            np.ones(1 << 26).sum()
        case b"altered":
            return "other"
    return "same"


FORMATS = {
    "nrrd": _volumes(_written("itk", "a.nrrd"), _written("itk", "b.nrrd", True)),
    "metaimage": _volumes(_written("itk", "a.mha"), _written("itk", "b.mha", True)),
    "nifti": _volumes(
        _written("itk", "a.nii"), _written("itk", "b.nii.gz"), _nibabel("c.nii"), _nibabel("f.mgh")
    ),
    "vti": _volumes(
        _vti("Appended", "None"),
        _vti("Appended", "ZLib", True),
        _vti("Appended", "LZ4"),
        _vti("Binary", "ZLib"),
        _vti("Ascii", "None"),
    ),
    "vtk": _volumes(_written("legacy", "a.vtk", True), _written("legacy", "b.vtk", False)),
    "tiff": _volumes(
        *(_written("tiff", f"{kind}.tif", compression=kind) for kind in (None, "zlib", "lzw")),
        *(_imagej, _ome),
    ),
    "dicom": _volumes(_written("dicom", "series")),
    "dicom-frames": _volumes(
        _frames("1", ""),
        _frames("4.80", "jpegls_encode"),
        _frames("4.70", "ljpeg_encode"),
        _frames("4.90", "jpeg2k_encode"),
    ),
    "numpy": _volumes(_written("npy", "a.npy"), _written("npz", "a.npz")),
    "hdf5": _volumes(_hdf5),
    "hdf5-programs": _volumes(
        *map(_by_programs, ("imaris.ims", "bdv.h5", "ilastik.h5", "openpmd.h5", "cells.vtkhdf"))
    ),
    "netcdf": _volumes(partial(_cf, form="scipy"), partial(_cf, form="h5netcdf")),
    "zarr": _volumes(
        *(_written("zarr", "a2.zarr", 2), _written("zarr", "a3.zarr", 3)),
        *(partial(_cf, form="zarr"), _by("volume_writers", _ome_zarr)),
    ),
    "labels": _volumes(*map(_labels, ("workbench", "snap", "slicer", "ome"))),
    "mrc": _volumes(_written("mrc", "a.mrc")),
    "tf": Format(_make_tf, _read_tf, mutate=mutated_json),
    "card": Format(_make_model, _read_model, (".json",), mutated_json),
    "weights": Format(_make_model, _read_model, (".safetensors",)),
    "store": Format(_make_store, _read_store),
    "preferences": Format(_make_preferences, _read_preferences, mutate=mutated_json),
    "planted": Format(_make_planted, _read_planted),
}
"""By name; "planted" is the job's own test."""
