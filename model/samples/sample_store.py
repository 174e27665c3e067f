"""The sample store: rendered samples of one scene in a Zarr folder.

A store has one group per split, ``train`` and ``holdout``, each with arrays of equal length N:

- the scene's varying inputs, as :mod:`model.scene.inputs` declares them;
- ``rgba`` (N, S, S, 4) uint8: the image, premultiplied, row 0 at the top.

Sample i of a split depends only on the scene, the seed and i. Samples are written in blocks of one
Zarr chunk; a block is marked in ``complete`` once all of its arrays are on disk, and unfinished
ones are rendered again. Every chunk has a checksum and is written even if it is all zero, as Zarr
reads a lost chunk as zeros.
"""

from __future__ import annotations

import itertools
from collections.abc import Generator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import Crc32cCodec, ZstdCodec

from model.errors import DatasetError, first_line, os_errors_as
from model.samples.sampling import Split
from model.scene.inputs import Arrays, varying
from model.scene.scene import FORMAT_VERSION, Scene

BLOCK = 32  # number of samples per block, the unit of rendering and writing
SPLITS: tuple[Split, ...] = ("holdout", "train")  # the splits, in rendering order
POOL_BLOCKS = 64  # number of blocks that are shuffled together when a split is read in random order


@dataclass(frozen=True)
class SampleBatch:
    """N samples: arrays of scene inputs as stored, and images (N, S, S, 4), premultiplied."""

    inputs: Arrays
    rgba: NDArray[np.uint8]
    encoded: Arrays = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rgba)

    def __getitem__(self, index: Any) -> SampleBatch:
        """Select samples by a slice or an index array."""
        return SampleBatch.of({name: array[index] for name, array in self.arrays.items()})

    @property
    def arrays(self) -> Arrays:
        """Inputs and images by name."""
        encoded = {ENCODED + name: array for name, array in self.encoded.items()}
        return {**self.inputs, **encoded, IMAGES: self.rgba}

    @classmethod
    def of(cls, arrays: Arrays) -> SampleBatch:
        """Build a batch from :attr:`arrays`."""
        own = {n: a for n, a in arrays.items() if n != IMAGES and not n.startswith(ENCODED)}
        encoded = {n.removeprefix(ENCODED): a for n, a in arrays.items() if n.startswith(ENCODED)}
        return cls(own, arrays[IMAGES], encoded)

    @classmethod
    def concatenate(cls, batches: list[SampleBatch]) -> SampleBatch:
        """Concatenate batches in order."""
        names = batches[0].arrays
        return cls.of({n: np.concatenate([b.arrays[n] for b in batches]) for n in names})


IMAGES = "rgba"
ENCODED = "encoded_"  # prefix of the names of encoded inputs, which are not stored
COUNTED = "view"  # array whose length is the intended number of samples
MOST_SAMPLES = 100_000_000  # largest number of samples of a split


class SampleStore:
    """A sample store on disk; another folder, or another version, is a :class:`DatasetError`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_dir():
            raise DatasetError(f"{path}: there is no data set here; render one first.")
        try:
            self._root = zarr.open_group(path, mode="r+")
            header: dict[str, Any] = dict(self._root.attrs)
            version = header["tfscope_dataset"]
            if version != FORMAT_VERSION:
                raise DatasetError(
                    f"{path}: the data set has format {version!r}; this tfscope reads "
                    f"{FORMAT_VERSION}, so make it anew or update tfscope."
                )
            self.seed = int(header["seed"])
            self.scene = Scene.from_json(header["scene"])
        except DatasetError:
            raise
        except Exception as error:
            # Zarr does not check its input, so errors are of many kinds.
            raise DatasetError(
                f"{path}: the folder is not a tfscope data set ({first_line(error)})."
            ) from error
        for split in SPLITS:
            self._check_arrays(split)

    @classmethod
    def create(cls, path: Path, scene: Scene, seed: int, counts: dict[Split, int]) -> SampleStore:
        """Create a store, or open an existing one to continue or enlarge it."""
        if path.exists() and (not path.is_dir() or any(path.iterdir())):
            store = cls(path)
            if store.scene != scene or store.seed != seed:
                raise DatasetError(
                    f"{path}: the data set was made for another volume, size, lighting or seed; "
                    "choose another folder, or the same options to go on with it."
                )
        else:
            _create_store(path, scene, seed)
            store = cls(path)
        for split, count in counts.items():
            if count > store.count(split):
                store._resize(split, count)
        return store

    def count(self, split: Split) -> int:
        """Return the intended number of samples of a split."""
        return int(self._array(split, COUNTED).shape[0])

    def missing_blocks(self, split: Split) -> list[range]:
        """Return the incomplete blocks, as ranges of sample indices."""
        blocks = _blocks(self.count(split))
        complete = self._flags(split, len(blocks))
        return [
            block
            for block, flag in zip(blocks, complete, strict=True)
            if flag != len(block) or self._lost(split, block.start // BLOCK)
        ]

    def reopen_damaged(self) -> int:
        """Mark lost or altered samples as not rendered; return their number."""
        found = 0
        for split in SPLITS:
            missing = set(self.missing_blocks(split))
            flags = self._flags(split, len(_blocks(self.count(split))))
            # Not those that were never rendered.
            found += sum(len(block) for block in missing if flags[block.start // BLOCK])
            for block in _blocks(self.count(split)):
                if block in missing:
                    continue
                try:
                    self.read(split, block)
                except DatasetError:
                    self._array(split, "complete")[block.start // BLOCK] = 0
                    found += len(block)
        return found

    def missing_samples(self) -> int:
        """Return the number of samples, in both splits, not rendered yet."""
        return sum(len(b) for split in SPLITS for b in self.missing_blocks(split))

    def rendered_samples(self) -> int:
        """Return the number of samples, in both splits, already rendered."""
        return sum(self.count(split) for split in SPLITS) - self.missing_samples()

    def require_complete(self) -> None:
        """Raise :class:`DatasetError` unless all samples are rendered."""
        missing = self.missing_samples()
        if missing:
            raise DatasetError(
                f"{self.path}: {missing} samples are not rendered yet; render it to its end first."
            )

    def require_holdout(self, count: int) -> None:
        """Raise :class:`DatasetError` if samples are missing or hold-out ones are too few."""
        self.require_complete()
        there = self.count("holdout")
        if count > there:
            raise DatasetError(
                f"{self.path}: only {there} hold-out samples are there, not {count}; "
                "measure fewer, or add some to the data set.",
                count=str(there),
            )

    def read(self, split: Split, indices: range) -> SampleBatch:
        """Read consecutive samples; lost or altered ones are a :class:`DatasetError`."""
        span = slice(indices.start, indices.stop)
        for number in range(span.start // BLOCK, -(-span.stop // BLOCK)):
            if lost := self._lost(split, number):
                block = _blocks(self.count(split))[number]
                raise self._damaged(split, block, f"{lost} is missing")
        remedy = "make the data set available again, or make it anew"
        try:
            with os_errors_as(DatasetError, f"{self.path}: samples cannot be read", remedy):
                names = _shapes(self.scene)
                arrays = {n: np.asarray(self._array(split, n)[span]) for n in names}
            return SampleBatch.of(arrays)
        except DatasetError:
            raise
        except Exception as error:
            # Checksums and decoders raise errors of many kinds.
            raise self._damaged(split, indices, first_line(error)) from error

    def write_block(self, split: Split, block: range, batch: SampleBatch) -> None:
        """Write one block and then mark it complete."""
        span = slice(block.start, block.stop)
        remedy = "make room and start again to go on"
        with os_errors_as(DatasetError, f"{self.path}: samples cannot be written", remedy):
            for name, values in batch.arrays.items():
                self._array(split, name)[span] = values
            self._array(split, "complete")[block.start // BLOCK] = len(block)

    def _lost(self, split: Split, number: int) -> str:
        """Return a block's missing file; empty if the block is complete."""
        for name, (shape, _) in _shapes(self.scene).items():
            file = self.path.joinpath(split, name, "c", str(number), *"0" * len(shape))
            if not file.is_file():
                return str(file.relative_to(self.path))
        return ""

    def _damaged(self, split: Split, samples: range, how: str) -> DatasetError:
        return DatasetError(
            f"{self.path}: the {split} samples {samples.start} to {samples.stop - 1} are lost or "
            f"altered ({how}); make the data set again with the same options, which renders what "
            "is damaged anew and keeps the rest."
        )

    def shuffled(
        self, split: Split, seed: list[int], batch_size: int, skip: int = 0
    ) -> Generator[SampleBatch]:
        """Yield a split in random order, endlessly, without holding it in memory.

        Blocks are read in random order; batches are drawn at random from a pool of them. Samples
        that do not fill a pool's last batch are skipped in this pass.
        """
        all_blocks = _blocks(self.count(split))
        pool_blocks = max(POOL_BLOCKS, -(-batch_size // BLOCK))
        for epoch in itertools.count():
            rng = np.random.default_rng([*seed, epoch])
            order = rng.permutation(len(all_blocks))
            for start in range(0, len(order), pool_blocks):
                blocks = [all_blocks[i] for i in order[start : start + pool_blocks]]
                shuffle = rng.permutation(sum(map(len, blocks)))
                batches = np.split(shuffle, range(batch_size, len(shuffle), batch_size))
                full = [b for b in batches if len(b) == batch_size]
                if skip >= len(full):
                    skip -= len(full)
                    continue
                pool = SampleBatch.concatenate([self.read(split, b) for b in blocks])
                yield from (pool[indices] for indices in full[skip:])
                skip = 0

    def _array(self, split: Split, name: str) -> zarr.Array[Any]:
        try:
            array = self._root.get(f"{split}/{name}")
        except Exception:
            # Damaged metadata raises errors of many kinds.
            array = None
        if not isinstance(array, zarr.Array):
            raise DatasetError(
                f"{self.path}: the array {split}/{name} is missing or damaged; "
                "make the data set anew."
            )
        return array.with_config({"write_empty_chunks": True})

    def _check_arrays(self, split: Split) -> None:
        """Refuse arrays that do not match :func:`_arrays`."""
        count = self.count(split)
        if count > MOST_SAMPLES:
            raise DatasetError(
                f"{self.path}: a store cannot have {count} {split} samples; give fewer."
            )
        for name, (shape, chunks, dtype) in _arrays(self.scene, count).items():
            array = self._array(split, name)
            # A killed resize leaves the others longer than the counted one.
            length, *sample = array.shape
            found = tuple(sample), array.chunks, array.dtype
            if length < shape[0] or found != (shape[1:], chunks, np.dtype(dtype)):
                raise DatasetError(
                    f"{self.path}: the array {split}/{name} has a wrong shape or type "
                    f"({array.shape} {array.dtype}); make the data set anew."
                )

    def _flags(self, split: Split, count: int) -> NDArray[np.uint8]:
        """Read the flags of the first blocks; unreadable ones are 0."""
        array = self._array(split, "complete")
        try:
            return np.asarray(array[:count], dtype=np.uint8)
        except Exception:
            # Damaged chunks raise errors of many kinds: read the flags one by one.
            flags = np.zeros(count, dtype=np.uint8)
            for index in range(count):
                with suppress(Exception):
                    flags[index] = array[index]
            return flags

    def _resize(self, split: Split, count: int) -> None:
        # If killed in between, the counted array must not be longer than the others.
        others = [name for name in _shapes(self.scene) if name != COUNTED]
        names = ["complete", *others, COUNTED]
        for name in names if count > self.count(split) else reversed(names):
            array = self._array(split, name)
            length = len(_blocks(count)) if name == "complete" else count
            array.resize((length, *array.shape[1:]))


def _blocks(count: int) -> list[range]:
    return [range(start, min(start + BLOCK, count)) for start in range(0, count, BLOCK)]


def _create_store(path: Path, scene: Scene, seed: int) -> None:
    """Create an empty store atomically, by renaming a temporary folder."""
    partial = path.with_name(path.name + ".partial")
    what = f"{path}: the data set cannot be written"
    with os_errors_as(DatasetError, what, "choose another place"):
        root = zarr.open_group(partial, mode="w")
        root.attrs.update({"tfscope_dataset": FORMAT_VERSION, "seed": seed, "scene": asdict(scene)})
        for split in SPLITS:
            group = root.create_group(split)
            for name, (shape, chunks, dtype) in _arrays(scene, 0).items():
                codecs = ZstdCodec(), Crc32cCodec()
                group.create_array(
                    name, shape=shape, chunks=chunks, dtype=dtype, compressors=codecs
                )
        if path.exists():
            path.rmdir()
        partial.rename(path)


def _shapes(scene: Scene) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape and type of one sample in each array."""
    inputs = {field.name: (field.shape, field.dtype) for field in varying(scene)}
    return {**inputs, IMAGES: ((scene.image_size, scene.image_size, 4), "uint8")}


def _arrays(scene: Scene, count: int) -> dict[str, tuple[tuple[int, ...], tuple[int, ...], str]]:
    """Shape, chunks and type of the arrays of a split with this many samples."""
    arrays = {n: ((count, *s), (BLOCK, *s), t) for n, (s, t) in _shapes(scene).items()}
    # One flag per chunk, so that two processes never write the same file.
    return {**arrays, "complete": ((len(_blocks(count)),), (1,), "uint8")}
