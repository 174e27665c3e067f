"""Maps on disk: samples of codes and their places, found again by a key.

t-SNE moves its points by a third of the map for a change in the last digits of one code, so a
map is stored with its codes, and never computed twice.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from pathlib import Path

import numpy as np

from model.errors import LatentError, reason
from model.files import write_atomically
from model.latent.codes import SAMPLES, Codes
from model.latent.embedding import ITERATIONS, PERPLEXITY, Places

MAP_FILE = "map.npz"
FORMAT = 1


def map_key(codec_digest: str, count: int = SAMPLES, seed: int = 0) -> str:
    """Key of the map of a codec, given by the SHA-256 of its weights.

    Versions of libraries are stored with a map, but do not belong to its key: a map stays
    where it is after an update.
    """
    facts = [FORMAT, codec_digest, count, seed, PERPLEXITY, ITERATIONS]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def save_map(path: Path, key: str, codes: Codes, places: Places) -> None:
    """Write the codes (n, d) and places (n, 2) of a map, in half precision.

    Raises
    ------
    LatentError
        When the file cannot be written.
    """
    import sklearn

    versions = json.dumps({"scikit-learn": sklearn.__version__, "numpy": np.__version__})
    content = io.BytesIO()
    np.savez_compressed(
        content,
        key=np.array(key),
        versions=np.array(versions),
        codes=codes.astype(np.float16),
        places=places.astype(np.float16),
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content.getvalue())
    except OSError as error:
        raise LatentError(
            f"{path}: the map cannot be written ({reason(error)}); "
            "it will be computed again next time."
        ) from error


def load_map(path: Path, key: str) -> tuple[Codes, Places]:
    """Read the codes (n, d) and places (n, 2) of a map, as they were stored.

    Raises
    ------
    LatentError
        When there is no map, or one that is damaged or of another codec.
    """
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as stored:
            found = str(stored["key"])
            codes = stored["codes"].astype(np.float32)
            places = stored["places"].astype(np.float32)
    except OSError as error:
        raise LatentError(f"{path}: the map cannot be read ({reason(error)}).") from error
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise LatentError(f"{path}: the file is no map, or damaged ({error}).") from error
    if found != key:
        raise LatentError(f"{path}: the map belongs to another codec.")
    fits = codes.ndim == 2 and places.shape == (len(codes), 2) and len(codes) > 0
    if not (fits and np.isfinite(codes).all() and np.isfinite(places).all()):
        raise LatentError(f"{path}: the map is damaged: codes {codes.shape}, {places.shape}.")
    return codes, places
