"""The volumes shipped with tfscope, and the transfer function (TF) that any volume opens with."""

from dataclasses import dataclass
from pathlib import Path

from model.scene.default_tf import AIR_HU, TISSUE_HU, body_range, default_transfer_function
from model.scene.labels import label_tf
from model.scene.ranges import fit_to_range, stretch_to_range
from model.scene.scene import LightDirection, Lighting
from model.scene.tf_presets import looks_like_hu
from model.scene.transfer_function import Range, TransferFunction
from model.scene.volume import Volume

RESOURCES = Path(__file__).resolve().parents[2] / "resources"

DEFAULT_VOLUME = RESOURCES / "volumes" / "reacting_jet_temperature_112x112x192_float32.nrrd"

SCAN = RESOURCES / "volumes" / "lidc_chest_256x256x133_int16.nrrd"  # shown where nothing is named


@dataclass(frozen=True)
class Sample:
    """A shipped volume: its file, its subject, and its first azimuth, elevation and light."""

    path: Path
    title: str
    angles: tuple[float, float]
    light: LightDirection
    lighting: Lighting = "path"

    @property
    def tf(self) -> TransferFunction:
        """The TF that was designed for it."""
        return TransferFunction.load(self.path.with_suffix(".tf.json"))


_VOLUMES = RESOURCES / "volumes"
SAMPLES = (
    Sample(SCAN, "Chest CT (LIDC)", (0.0, 8.0), LightDirection(-50, 40)),
    Sample(DEFAULT_VOLUME, "Reacting jet, temperature", (30.0, 8.0), LightDirection(-60, 35)),
    Sample(_VOLUMES / "fly_212x232x144_uint8.nrrd", "Fly (micro-CT)", (190.0, 22.0),
           LightDirection(-40, 45)),
    Sample(_VOLUMES / "shell_116x48x225_uint8.nrrd", "Sea shell, cut open (micro-CT)",
           (150.0, 8.0), LightDirection(45, 35)),
)  # fmt: skip
"""The shipped volumes, in the order in which they are offered."""

SCAN_HU = (-1000.0, 1500.0)  # range of the shipped scan's TF, in Hounsfield units


def shipped_volumes() -> list[Path]:
    """Return the files of the shipped volumes."""
    return [sample.path for sample in SAMPLES]


def sample_of(volume: Volume) -> Sample | None:
    """Return the sample with a volume's name, dimensions and type, or None."""
    x, y, z = volume.dimensions
    stem = f"{volume.name.replace(' ', '_')}_{x}x{y}x{z}_{volume.linear.voxels.dtype}"
    return next((each for each in SAMPLES if each.path.stem == stem), None)


def title_of(path: Path) -> str:
    """Return the subject of a shipped volume."""
    return next(sample.title for sample in SAMPLES if sample.path.name == path.name)


def picture_of(path: Path) -> Path:
    """Return the file of a shipped volume's picture, 192 pixels wide and high."""
    return path.with_suffix(".png")


LEAST_OPACITY = 0.5  # opacity that a designed TF must reach at a volume's values to be used
LOWEST_HU = -4096.0  # lower values are no HU, not even outside a scanner's field of view


def first_transfer_function(volume: Volume) -> TransferFunction:
    """Return the designed TF of a shipped volume or a CT scan, else one from the histogram.

    CT scans look like the shipped one if their values are Hounsfield units (HU), by unit or range,
    or on another scale that their peaks reveal.
    """
    if volume.file.is_labels and volume.scale == "linear":
        return label_tf(volume)
    designed = None
    if sample := sample_of(volume):
        designed = sample.tf
    elif values := _scan_values(volume):
        designed = stretch_to_range(SAMPLES[0].tf, values)
    if designed is not None and designed.scale == volume.scale:
        fitted = fit_to_range(designed, volume.scalar_range)
        if fitted.opacity.sample().max() >= LEAST_OPACITY:
            return fitted
    return default_transfer_function(volume)


def _scan_values(volume: Volume) -> Range | None:
    """Values of the shipped scan's lowest and greatest HU; None if this is no CT scan."""
    units = volume.units.strip().upper()
    if units == "HU":
        return SCAN_HU
    if units or volume.scale != "linear":
        return None
    if volume.data_range[0] >= LOWEST_HU and looks_like_hu(volume.data_range):
        return SCAN_HU if volume.distribution.is_whole else None
    body = body_range(volume)
    if body is None:
        return None
    slope = (body[1] - body[0]) / (TISSUE_HU - AIR_HU)
    low, high = (body[0] + slope * (hu - AIR_HU) for hu in SCAN_HU)
    return low, high
