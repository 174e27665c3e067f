"""A latent space: a codec, the scalar values that its TFs lie over, and where its map is kept."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from model.errors import LatentError
from model.files import cache_folder
from model.latent.codec_folder import SHIPPED_CODEC, load_codec
from model.latent.codes import SAMPLES, Codes, NetworkCodec, TFCodec, sample_codes, samples_of
from model.latent.embedding import Places, principal_places
from model.latent.latent_map import LatentMap
from model.latent.stored_map import MAP_FILE, load_map, map_key, save_map
from model.latent.tf_frame import TFFrame
from model.samples.sampling import draw_opacity_tfs
from model.scene.scene import Scene
from model.scene.transfer_function import OpacityTF, Range
from model.scene.value_scale import ValueScale

KNOWN_TFS = 4000
"""Random TFs whose codes span the box that codes are sampled from."""

SAMPLING_SEED = 0

UNIT_SCENE = Scene("any volume", "", (0.0, 1.0), (0.0, 1.0), image_size=16)
"""Scene whose random TFs the shipped codec has learned: the family "drawn" over [0, 1]."""


@dataclass(frozen=True, eq=False)
class LatentSpace:
    """A codec that stands for the opacity TFs of one volume.

    Attributes
    ----------
    scene : Scene
        Determines the random TFs of the codec.
    digest : str
        SHA-256 of the codec's weights.
    folders : tuple of Path
        Where its map may be, the one to write to last.
    """

    codec: TFCodec
    frame: TFFrame
    scene: Scene
    digest: str
    folders: tuple[Path, ...]

    @classmethod
    def shipped(
        cls, scalar_range: Range, window: Range, scale: ValueScale = "linear"
    ) -> LatentSpace:
        """Return the shipped codec's, stretched to a volume's window of interesting values."""
        digest, codec = load_codec()
        frame = TFFrame(scalar_range, window, scale)
        return cls(codec, frame, UNIT_SCENE, digest, (SHIPPED_CODEC, _cache(digest)))

    @classmethod
    def of_model(cls, folder: Path) -> LatentSpace:
        """Return that of a model's own codec, over the whole scalar range of its volume."""
        from model.networks.card import read_header
        from model.networks.checkpoint import load_model

        card, network = load_model(folder)
        digest = str(read_header(folder).get("sha256", ""))
        frame = TFFrame(card.scene.scalar_range, card.scene.scalar_range, card.scene.scale)
        codec = NetworkCodec(network.codec)
        return cls(codec, frame, card.scene, digest, (folder, _cache(digest)))

    def tf_of(self, code: Codes) -> OpacityTF:
        """Return the opacity TF, with 256 points or one more, of a code (d,)."""
        return self.tfs_of(code[None])[0]

    def tfs_of(self, codes: Codes) -> list[OpacityTF]:
        """Return the opacity TFs of codes (n, d)."""
        return [self.frame.opacity_tf(opacities) for opacities in self.codec.decode(codes)]

    def code_of(self, opacity_tf: OpacityTF) -> Codes:
        """Return the code (d,) that is nearest to an opacity TF."""
        return self.codec.encode(self.frame.opacities(opacity_tf)[None])[0]

    def open_map(self, count: int = SAMPLES) -> LatentMap:
        """Return the stored map; without one, new samples along their principal axes.

        Raises
        ------
        LatentError
            When the codec cannot be mapped, see :func:`model.latent.codes.sample_codes`.
        """
        key = map_key(self.digest, count, SAMPLING_SEED)
        for folder in self.folders:
            try:
                codes, places = load_map(folder / _file_name(count, key), key)
                if codes.shape[1] == self._latent_dim:
                    return LatentMap(samples_of(self.codec, codes), places, is_final=True)
            except LatentError:
                # Missing or foreign: the next place, or a new map.
                continue
        known = draw_opacity_tfs(self.scene, SAMPLING_SEED, 0, KNOWN_TFS)
        samples = sample_codes(self.codec, known, count, SAMPLING_SEED)
        return LatentMap(samples, principal_places(samples.codes), is_final=False)

    def keep_map(self, codes: Codes, places: Places) -> None:
        """Store a finished map for the next time.

        Raises
        ------
        LatentError
            When the map cannot be written.
        """
        key = map_key(self.digest, len(codes), SAMPLING_SEED)
        save_map(self.folders[-1] / _file_name(len(codes), key), key, codes, places)

    @property
    def _latent_dim(self) -> int:
        return int(self.codec.encode(np.zeros((1, 256), dtype=np.float32)).shape[1])


def _file_name(count: int, key: str) -> str:
    """Return a map's file name; maps of other numbers of samples do not replace the usual one."""
    return MAP_FILE if count == SAMPLES else f"map-{key[:16]}.npz"


def _cache(digest: str) -> Path:
    return cache_folder() / "maps" / digest[:16]
