"""The formats to fuzz: how to make valid files of each, and how tfscope reads them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import h5py
import imagecodecs
import numpy as np
import test_containers
import test_labels
import test_nifti
import tifffile
import volume_writers as writers
from volume_writers import dataset, item, save_dicom, scaled

from app.state.preferences import Preferences
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.paper import build_generator
from model.networks.size import NetworkSize
from model.samples.sample_store import BLOCK, SampleBatch, SampleStore
from model.scene.scene import Scene
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from tests.fuzz.child import read_model, read_preferences, read_store, read_tf, read_volume
from tests.fuzz.mutations import mutated, mutated_json

VOXELS = np.random.default_rng(1).integers(0, 4000, (9, 10, 11), dtype=np.uint16)


@dataclass(frozen=True)
class Format:
    """A kind of file or folder: writes examples, reads one; files of some suffixes are mutated."""

    make: Callable[[Path], list[Path]]
    read: Callable[[Path], str]
    suffixes: tuple[str, ...] = ()
    mutate: Callable[..., bytes] = mutated


def _volumes(*makers):
    return Format(lambda folder: [make(folder) for make in makers], read_volume)


def _by(write, name, *options, array=VOXELS, **more):
    """Return a maker of a file by a writer of a name and an array."""
    return lambda folder: write(folder / name, array, *options, **more)


def _tiff(path, array, **options):
    tifffile.imwrite(path, array, **options)
    return path


STACKS = np.stack([VOXELS, VOXELS + 1], axis=1)
IMAGEJ = {"axes": "ZCYX", "spacing": 2.0}
OME = {"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeZ": 2.0}


def _frames(path, array, syntax, encoder=None):
    """Write a file of compressed frames, or an enhanced one."""
    tags = {"ImagePositionPatient": [0, 0, 0], "SpacingBetweenSlices": 2.0}
    if encoder is not None:
        tags["encoded"] = [encoder(np.ascontiguousarray(plane)) for plane in array]
    else:
        places = [item(ImagePositionPatient=[0.0, 0.0, 2.0 * z]) for z in range(len(array))]
        groups = [item(PlanePositionSequence=place)[0] for place in places]
        tags["PerFrameFunctionalGroupsSequence"] = groups
    syntax = f"1.2.840.10008.1.2.{syntax}"
    return save_dicom(path, dataset(array, syntax=syntax, frames=len(array), **tags))


def _nibabel(name):
    kind = test_nifti.WRITERS[name]
    return _by(test_nifti.save, name, array=VOXELS.astype(np.int16), kind=kind)


def _hdf5(folder):
    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("group/values", data=VOXELS, chunks=(3, 5, 11), compression="gzip")
        file["mask"] = (VOXELS > 9).astype(np.uint8)
        file["group/values"].attrs["_FillValue"] = 7
    return folder / "a.h5"


def _cf(folder, form):
    """Write a packed variable with coordinates, as xarray does."""
    data, packing, *_ = test_containers.CLIMATE["packed"]
    path = folder / ("cf.zarr" if form == "zarr" else f"{form}.nc")
    if form == "zarr":
        data.to_zarr(path, encoding=packing, zarr_format=2, consolidated=False)
    else:
        data.to_netcdf(path, engine=form, encoding=packing)
    return path


def _by_programs(folder, name):
    """Write a file as a program lays it out in HDF5."""
    with h5py.File(folder / name, "w") as file:
        test_containers.HDF5[name][0](file)
    return folder / name


PROGRAMS = ("imaris.ims", "bdv.h5", "ilastik.h5", "openpmd.h5", "cells.vtkhdf")
LABELS = (test_labels.workbench, test_labels.snap, test_labels.slicer, test_labels.ome)


def _make_tf(folder):
    span = (0.0, 255.0)
    colors = ColorTF(span, ((0.0, 0.0, 0.0, 0.0), (255.0, 1.0, 0.5, 0.0)))
    modes = OpacityTF(span, (GaussianMode(50.0, 9.0, 0.5), GaussianMode(150.0, 20.0, 0.1)))
    points = OpacityTF(span, points=((0.0, 0.0), (99.0, 0.2), (255.0, 1.0)))
    paths = [folder / "modes.json", folder / "points.json"]
    for path, opacity in zip(paths, (modes, points), strict=True):
        TransferFunction(opacity, colors).save(path)
    return paths


def _make_model(folder):
    size, scene = NetworkSize(0.05, 16, 16), Scene.of(Volume(VOXELS), image_size=16)
    metrics = {"holdout": {"rmse": 0.05}, "sensitivity_agreement": {}}
    card = ModelCard(scene, "draft", size, {"samples_seen": 1}, metrics, {"torch": "2"})
    save_model(folder / "model", card, build_generator(size, scene))
    return [folder / "model"]


def _make_store(folder):
    rng, scene = np.random.default_rng(2), Scene.of(Volume(VOXELS), image_size=16)
    store = SampleStore.create(folder / "s.zarr", scene, 7, {"train": 2 * BLOCK, "holdout": 9})
    shapes = {n: a.shape[1:] for n, a in store.read("train", range(0)).arrays.items()}
    for split in ("train", "holdout"):
        for block in store.missing_blocks(split):
            arrays = {n: 200 * rng.random((len(block), *s)) for n, s in shapes.items()}
            arrays["rgba"] = arrays["rgba"].astype(np.uint8)
            store.write_block(split, block, SampleBatch.of(arrays))
    return [store.path]


def _make_preferences(folder):
    preferences = Preferences(folder)
    preferences.note_opened("f", Path("/data/a.nrrd"))
    preferences.note_volume("f", up_axis="+y", view=View(), models=("/data/m",))
    preferences.finish()
    return [folder / "settings.json", folder / "volumes" / "f.json"]


def _itk(*files):
    return [_by(writers.write_itk, *file) for file in files]


VTI = [("Appended", "None"), ("Appended", "ZLib", True), ("Appended", "LZ4"),
       ("Binary", "ZLib"), ("Ascii", "None")]  # fmt: skip

FORMATS = {
    "nrrd": _volumes(*_itk(("a.nrrd",), ("b.nrrd", True))),
    "metaimage": _volumes(*_itk(("a.mha",), ("b.mha", True))),
    "nifti": _volumes(*_itk(("a.nii",), ("b.nii.gz",)), _nibabel("c.nii"), _nibabel("f.mgh")),
    "vti": _volumes(*(_by(writers.write_vti, f"{n}.vti", *o) for n, o in enumerate(VTI))),
    "vtk": _volumes(*(_by(writers.write_legacy, f"{n}.vtk", n) for n in (True, False))),
    "tiff": _volumes(
        *(_by(writers.write_tiff, f"{c}.tif", compression=c) for c in (None, "zlib", "lzw")),
        _by(_tiff, "hyperstack.tif", array=STACKS, imagej=True, metadata=IMAGEJ),
        _by(_tiff, "a.ome.tif", metadata=OME, tile=(16, 16), compression="zlib"),
    ),
    "dicom": _volumes(_by(writers.write_dicom, "series")),
    "dicom-frames": _volumes(
        _by(_frames, "enhanced.dcm", "1"),
        _by(_frames, "jpegls.dcm", "4.80", imagecodecs.jpegls_encode),
        _by(_frames, "ljpeg.dcm", "4.70", imagecodecs.ljpeg_encode),
        _by(_frames, "jpeg2k.dcm", "4.90", imagecodecs.jpeg2k_encode),
    ),
    "numpy": _volumes(_by(writers.write_npy, "a.npy"), _by(writers.write_npz, "a.npz")),
    "hdf5": _volumes(_hdf5),
    "hdf5-programs": _volumes(*(partial(_by_programs, name=name) for name in PROGRAMS)),
    "netcdf": _volumes(partial(_cf, form="scipy"), partial(_cf, form="h5netcdf")),
    "zarr": _volumes(
        *(_by(writers.write_zarr, f"a{form}.zarr", form) for form in (2, 3)),
        partial(_cf, form="zarr"),
        _by(writers.write_ome_zarr, "ome.zarr", array={"0": VOXELS}, scales=[scaled(2, 0.5, 0.5)]),
    ),
    "labels": _volumes(*LABELS),
    "mrc": _volumes(_by(writers.write_mrc, "a.mrc")),
    "tf": Format(_make_tf, read_tf, mutate=mutated_json),
    "card": Format(_make_model, read_model, (".json",), mutated_json),
    "weights": Format(_make_model, read_model, (".safetensors",)),
    "store": Format(_make_store, read_store),
    "preferences": Format(_make_preferences, read_preferences, mutate=mutated_json),
}
