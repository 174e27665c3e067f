"""The user's and the shipped volumes and models, and which of them belong together."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

from app.engines.messages import error_sentence
from app.state.open_model import LIGHTS
from app.state.preferences import Preferences
from model.errors import CheckpointError, TfscopeError
from model.generator.catalog import shipped_models
from model.networks.card import (
    MODEL_FILE,
    ModelCard,
    card_of,
    error_text,
    read_header,
    read_weights,
)
from model.scene.scene import Scene
from model.volume_files import SUFFIXES
from model.volume_files.finish import readable_name
from model.volume_files.shipped import shipped_volumes, title_of

MOST_NEIGHBORS = 1000  # number of files next to a model among which its volume is looked for


@dataclass(frozen=True)
class KnownModel:
    """A model of a volume that can be offered, and its errors as its card says them."""

    folder: Path
    name: str
    errors: str


class Library:
    """Finds the models of a volume and the volume of a model, without reading volumes."""

    def __init__(self, preferences: Preferences) -> None:
        self._preferences = preferences

    def models_of(self, fingerprint: str, remembered: Sequence[str]) -> list[KnownModel]:
        """Return the models of a volume: the one opened last, the user's, then shipped ones.

        `remembered` are folders that were opened with it, the newest first. Models that are
        missing, of another version, or of another volume are left out.
        """
        own, shipped = [Path(text) for text in remembered], shipped_models()
        found = []
        for folder in (*(each for each in own if each not in shipped), *shipped):
            card = _card(folder)
            if card is not None and card.scene.volume_fingerprint == fingerprint:
                is_shipped = folder in shipped
                name = folder.name.replace("_", " ") if is_shipped else folder.name
                # Among shipped models, the one in direct light comes first: it shows most.
                is_later = is_shipped and card.scene.lighting != "direct"
                rank = folder not in own[:1], is_shipped, is_later
                found.append((rank, KnownModel(folder, name, error_text(card.metrics))))
        return [model for _rank, model in sorted(found, key=itemgetter(0))]

    def shipped(self) -> list[tuple[KnownModel, Path]]:
        """Return the shipped models, named by volume and light, with their volumes."""
        found = []
        for folder in shipped_models():
            card = _card(folder)
            volume = None if card is None else _shipped_volume(card.scene)
            if card is None or volume is None:
                continue
            name = f"{title_of(volume)}, {LIGHTS[card.scene.lighting]}"
            found.append((KnownModel(folder, name, error_text(card.metrics)), volume))
        return found

    def volume_of(self, folder: Path) -> Path | None:
        """Return where a model's volume was open before, or one of its name nearby or shipped."""
        card = _card(folder)
        if card is None:
            return None
        scene = card.scene
        remembered = self._preferences.volume(scene.volume_fingerprint).path
        if remembered and Path(remembered).exists():
            return Path(remembered)
        near = (path for place in (folder, folder.parent) for path in _volume_files(place))
        return _named(near, {scene.volume_name}) or _shipped_volume(scene)

    def scene_of(self, folder: Path) -> Scene | None:
        """Return a model's scene, or None if its card cannot be read."""
        card = _card(folder)
        return None if card is None else card.scene

    def check_model(self, folder: Path) -> Scene:
        """Return the scene of a model that can be opened; quick, without torch.

        Compares the weights' SHA-256, some hundred MB in a second. Raises :class:`CheckpointError`,
        so that a working model is given up only for one that works.
        """
        try:
            _check_folder(folder)
            header = read_header(folder)
            card = card_of(folder, header)
            read_weights(folder, header)
        except TfscopeError:
            raise
        except Exception as error:  # a broken card must not cost a working model
            raise CheckpointError(
                f"{folder}: the model cannot be read ({error_sentence(error)}); choose another."
            ) from error
        return card.scene


def _check_folder(folder: Path) -> None:
    """Raise :class:`CheckpointError` if this is clearly no model folder."""
    if not folder.exists():
        raise CheckpointError(f"{folder}: there is no such folder; choose another.")
    if not folder.is_dir():
        raise CheckpointError(f"{folder}: this is a file; choose the folder of a trained model.")
    inside = sorted(path.parent.name for path in folder.glob(f"*/{MODEL_FILE}"))
    if inside and not (folder / MODEL_FILE).exists():
        names = ", ".join(f"'{name}'" for name in inside[:3]) + (" …" if inside[3:] else "")
        raise CheckpointError(
            f"{folder}: the folder holds models in folders of their own; choose one: {names}."
        )


def _card(folder: Path) -> ModelCard | None:
    try:
        return card_of(folder, read_header(folder))
    except (TfscopeError, OSError):
        return None


def _volume_files(place: Path) -> Iterator[Path]:
    try:
        paths = sorted(path for path in place.iterdir() if path.name.lower().endswith(SUFFIXES))
    except OSError:
        return
    yield from paths[:MOST_NEIGHBORS]


def _named(paths: Iterable[Path], names: set[str]) -> Path | None:
    return next((path for path in paths if readable_name(path) in names), None)


def _shipped_volume(scene: Scene) -> Path | None:
    """Return the shipped file of a scene's volume, known by the shipped models of it."""
    cards = [card for folder in shipped_models() if (card := _card(folder)) is not None]
    same = {
        c.scene.volume_name for c in cards if c.scene.volume_fingerprint == scene.volume_fingerprint
    }
    return _named(shipped_volumes(), same)
