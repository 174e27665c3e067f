"""The formats to fuzz: how to make valid files of each, and how tfscope reads them."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.fuzz.mutations import mutated, mutated_json

WRITERS = str(Path(__file__).parents[1] / "model" / "volume_files")


@dataclass(frozen=True)
class Format:
    """A kind of file or folder.

    Attributes
    ----------
    make : callable
        Writes valid examples into a folder, and returns their paths.
    read : callable
        Reads one as tfscope does; returns a digest of what must not change unnoticed, or "".
    suffixes : tuple of str
        Of a folder's files that are mutated; all if empty.
    mutate : callable
    """

    make: Callable[[Path], list[Path]]
    read: Callable[[Path], str]
    suffixes: tuple[str, ...] = ()
    mutate: Callable[..., bytes] = mutated


def _voxels() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 4000, (9, 10, 11), dtype=np.uint16)


def _volume(*makers: Callable[..., Path]) -> Callable[[Path], list[Path]]:
    return lambda folder: [make(folder, _voxels()) for make in makers]


def _itk(name: str, compressed: bool = False) -> Callable[..., Path]:
    def make(folder: Path, array: np.ndarray) -> Path:
        sys.path.insert(0, WRITERS)
        from volume_writers import write_itk

        return write_itk(folder / name, array, compressed=compressed)

    return make


def _vti(mode: str, compressor: str, encode: bool = False) -> Callable[..., Path]:
    def make(folder: Path, array: np.ndarray) -> Path:
        sys.path.insert(0, WRITERS)
        from volume_writers import write_vti

        name = f"{mode}-{compressor}-{encode}.vti"
        return write_vti(folder / name, array, mode, compressor, encode)

    return make


def _legacy(binary: bool) -> Callable[..., Path]:
    def make(folder: Path, array: np.ndarray) -> Path:
        sys.path.insert(0, WRITERS)
        from volume_writers import write_legacy

        return write_legacy(folder / f"{binary}.vtk", array, binary)

    return make


def _tiff(compression: str | None) -> Callable[..., Path]:
    def make(folder: Path, array: np.ndarray) -> Path:
        import tifffile

        path = folder / f"{compression}.tif"
        tifffile.imwrite(path, array, photometric="minisblack", compression=compression)
        return path

    return make


def _dicom(folder: Path, array: np.ndarray) -> Path:
    sys.path.insert(0, WRITERS)
    from volume_writers import write_dicom

    return write_dicom(folder / "series", array[:3])


def _read_volume(path: Path) -> str:
    from model.volume_files.source import VolumeSource

    VolumeSource(path).read()
    return ""


def _make_tf(folder: Path) -> list[Path]:
    from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

    span = (0.0, 255.0)
    colors = ColorTF(span, ((0.0, 0.0, 0.0, 0.0), (255.0, 1.0, 0.5, 0.0)))
    modes = OpacityTF(span, (GaussianMode(50.0, 9.0, 0.5), GaussianMode(150.0, 20.0, 0.1)))
    points = OpacityTF(span, points=((0.0, 0.0), (99.0, 0.2), (255.0, 1.0)))
    paths = [folder / "modes.json", folder / "points.json"]
    for path, opacity in zip(paths, (modes, points), strict=True):
        TransferFunction(opacity, colors).save(path)
    return paths


def _read_tf(path: Path) -> str:
    from model.scene.transfer_function import TransferFunction

    tf = TransferFunction.load(path)
    tf.opacity.sample()
    tf.color.sample()
    return ""


def _scene():  # type: ignore[no-untyped-def]
    from model.scene.scene import Scene
    from model.scene.volume import Volume

    return Scene.of(Volume(_voxels()), image_size=16)


def _make_model(folder: Path) -> list[Path]:
    from model.networks.build import build_generator
    from model.networks.card import ModelCard
    from model.networks.checkpoint import save_model
    from model.networks.size import NetworkSize

    size, scene = NetworkSize(0.05, 16, 16), _scene()
    metrics = {"alternatives": {"verdict": "as fast"}, "sensitivity_agreement": {}}
    card = ModelCard(scene, "draft", size, {"samples_seen": 1}, metrics, {"torch": "2"})
    save_model(folder / "model", card, build_generator(size, scene))
    return [folder / "model"]


def _read_model(path: Path) -> str:
    from model.networks.card import recorded_agreement, verdict_of
    from model.networks.checkpoint import load_model

    recorded_agreement(path)
    verdict_of(path)
    _, network = load_model(path)
    digest = hashlib.sha256()
    for value in network.state_dict().values():
        digest.update(value.numpy().tobytes())
    return digest.hexdigest()


def _make_store(folder: Path) -> list[Path]:
    from model.samples.sample_store import BLOCK, SampleBatch, SampleStore

    rng = np.random.default_rng(2)
    store = SampleStore.create(folder / "s.zarr", _scene(), 7, {"train": 2 * BLOCK, "holdout": 9})
    shapes = {n: a.shape[1:] for n, a in store.read("train", range(0)).arrays.items()}
    for split in ("train", "holdout"):
        for block in store.missing_blocks(split):  # type: ignore[arg-type]
            arrays = {n: 200 * rng.random((len(block), *s)) for n, s in shapes.items()}
            arrays["rgba"] = arrays["rgba"].astype(np.uint8)
            store.write_block(split, block, SampleBatch.of(arrays))  # type: ignore[arg-type]
    return [store.path]


def _read_store(path: Path) -> str:
    from model.samples.sample_store import SPLITS, SampleStore

    store = SampleStore(path)
    store.require_complete()
    digest = hashlib.sha256()
    for split in SPLITS:
        batch = store.read(split, range(store.count(split)))
        for name in sorted(batch.arrays):
            digest.update(batch.arrays[name].tobytes())
    return digest.hexdigest()


def _make_job(folder: Path) -> list[Path]:
    from model.training.job import TrainingJob

    TrainingJob(Path("out"), minutes=1.0, settings=("seed=3",)).save(folder / "job.json")
    return [folder / "job.json"]


def _read_job(path: Path) -> str:
    from model.training.job import TrainingJob

    TrainingJob.load(path)
    return ""


def _make_preferences(folder: Path) -> list[Path]:
    from app.state.preferences import PreferencesStore
    from app.state.remembered import KnownVolume, Remembered

    known = {"f": KnownVolume("/data/a.nrrd", "+y", "8x8x8_uint8", ("/data/m",))}
    remembered = Remembered(splitters={"main": (1, 2)}, recent_models=("/m",), volumes=known)
    PreferencesStore(folder / "preferences.json").save(remembered)
    return [folder / "preferences.json"]


def _read_preferences(path: Path) -> str:
    from app.state.preferences import PreferencesStore

    PreferencesStore(path).load().to_json()
    return ""


def _make_planted(folder: Path) -> list[Path]:
    (folder / "planted").write_bytes(b"good")
    return [folder / "planted"]


def _read_planted(path: Path) -> str:
    """Fail as the file's content says: the fuzz job's own test."""
    import os
    import time

    from model.errors import VolumeError

    said = path.read_bytes()
    if said == b"refused":
        raise VolumeError("refused")
    if said == b"error":
        raise KeyError("error")
    if said == b"crash":
        os.abort()
    if said == b"hang":
        time.sleep(60)
    if said == b"memory":
        np.ones(1 << 26).sum()
    return "other" if said == b"altered" else "same"


FORMATS = {
    "nrrd": Format(_volume(_itk("a.nrrd"), _itk("b.nrrd", True)), _read_volume),
    "metaimage": Format(_volume(_itk("a.mha"), _itk("b.mha", True)), _read_volume),
    "nifti": Format(_volume(_itk("a.nii"), _itk("b.nii.gz")), _read_volume),
    "vti": Format(
        _volume(
            _vti("Appended", "None"),
            _vti("Appended", "ZLib", True),
            _vti("Appended", "LZ4"),
            _vti("Binary", "ZLib"),
            _vti("Ascii", "None"),
        ),
        _read_volume,
    ),
    "vtk": Format(_volume(_legacy(True), _legacy(False)), _read_volume),
    "tiff": Format(_volume(_tiff(None), _tiff("zlib"), _tiff("lzw")), _read_volume),
    "dicom": Format(_volume(_dicom), _read_volume),
    "tf": Format(_make_tf, _read_tf, mutate=mutated_json),
    "card": Format(_make_model, _read_model, (".json",), mutated_json),
    "weights": Format(_make_model, _read_model, (".safetensors",)),
    "store": Format(_make_store, _read_store),
    "job": Format(_make_job, _read_job, mutate=mutated_json),
    "preferences": Format(_make_preferences, _read_preferences, mutate=mutated_json),
    "planted": Format(_make_planted, _read_planted),
}
"""By name; "planted" is the job's own test."""
