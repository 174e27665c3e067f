"""Unsupported files: their kind by content or suffix, and how to convert them."""

from collections import Counter
from collections.abc import Collection
from pathlib import Path

from model.volume_files.dicom_tags import is_dicom

_FIJI = "open it in Fiji, which has Bio-Formats, and save it as TIFF"
_PARAVIEW = "open it in ParaView, apply Resample To Image, and save that as .vti"
_IMAGES = (
    "make one stack of the images, for example in Fiji with File > Import > Image Sequence, and "
    "save it as TIFF"
)
_UNPACK = "unpack it first, and open what is in it"

_ROWS = (
    (".czi .zvi", "a Zeiss microscope's file", _FIJI),
    (".lif .lof .xlef", "a Leica microscope's file", _FIJI),
    (".nd2", "a Nikon microscope's file", "open it in Fiji, or convert it with the package nd2"),
    (".oib .oif .oir .vsi", "an Olympus microscope's file", _FIJI),
    (".svs .ndpi .scn .mrxs", "a slide scanner's file", _FIJI),
    (".pic", "a Bio-Rad microscope's file", _FIJI),
    (".dm3 .dm4 .ser .emd", "an electron microscope's file",
     "convert it with HyperSpy, or in Fiji"),
    (".txrm .xrm .txm", "a Zeiss X-ray microscope's file",
     "export it as TIFF or DICOM in its own program"),
    (".vgi .vgl .vol", "a volume of VGStudio or Avizo's kind",
     "open the voxels next to it as a raw file"),
    (".isq .aim", "a Scanco scanner's file", "convert it with the package itk-ioscanco"),
    (".am .amira .amiramesh", "Amira's format", "save it as NRRD in Amira or Fiji"),
    (".vtu .vtp .vts .vtr .vtm", "another data set of VTK", _PARAVIEW),
    (".pvti .pvtu .pvd .vth .vthb", "a VTK file that names others", _PARAVIEW),
    (".stl .ply .obj .off .gltf .glb", "a surface, not a volume",
     "sample it on a grid, for example with ParaView"),
    (".vdb", "OpenVDB's format", "convert it with the package pyopenvdb, and save it with NumPy"),
    (".fits .fit .fts", "a FITS file", "save its cube as .npy with astropy"),
    (".mnc .mnc2", "MINC's format", "convert it with mnc2nii"),
    (".mif", "MRtrix's format", "convert it with mrconvert to .nii.gz"),
    (".par", "a Philips scanner's file", "convert it with dcm2niix"),
    (".head .brik", "AFNI's format", "convert it with 3dAFNItoNIFTI"),
    (".mat", "MATLAB's old format", "save it in MATLAB with -v7.3, or with niftiwrite"),
    (".hdf4", "an HDF4 file", "convert it with h4toh5"),
    (".grib .grb .grib2 .grb2", "a GRIB file", "convert it with cdo -f nc4 copy"),
    (".cdf5", "a NetCDF file of the 64-bit data format (CDF-5)", "convert it with nccopy -k nc4"),
    (".n5", "an N5 container", "convert it to OME-Zarr, or to TIFF with Fiji's N5 plug-in"),
    (".pkl .pickle .pt .pth", "a Python object, which is not loaded",
     "save its array with numpy.save"),
    (".edf", "an ESRF data file", "convert it with the package fabio"),
    (".png .jpg .jpeg .bmp .gif .webp .jp2", "a flat image", _IMAGES),
    (".avi .mp4 .mov", "a movie", _IMAGES),
    (".zip .7z .rar .tar .tgz .xz .zst", "an archive", _UNPACK),
    (".gz .bz2", "a compressed file", _UNPACK),
    (".csv .txt .xlsx", "a table or text", "save its numbers with NumPy"),
    (".pdf", "a document", "choose a volume"),
)  # fmt: skip
KINDS = {suffix: (what, remedy) for suffixes, what, remedy in _ROWS for suffix in suffixes.split()}
"""Kinds of files, and programs that convert them, by suffix."""

_STARTS: dict[bytes, str] = {
    b"\x89PNG": ".png", b"\xff\xd8\xff": ".jpg", b"BM": ".bmp", b"GIF8": ".gif", b"%PDF": ".pdf",
    b"PK\x03\x04": ".zip", b"7z\xbc\xaf": ".7z", b"Rar!": ".rar", b"\xfd7zXZ": ".xz",
    b"ZISRAWFILE": ".czi", b"\xda\xce\xbe\n": ".nd2", b"SIMPLE  =": ".fits", b"\x1f\x8b": ".gz",
    b"CDF\x05": ".cdf5", b"\x0e\x03\x13\x01": ".hdf4", b"GRIB": ".grib",
    b"solid ": ".stl", b"ply\n": ".ply", b"# AmiraMesh": ".am", b"# Avizo": ".am",
}  # fmt: skip
"""Suffixes by the files' first bytes."""

SLICES = (".dcm", ".ima", ".dicom", ".tif", ".tiff")
DEEPEST, MOST_LOOKED_AT = 4, 20  # levels of folders, and files of each, searched for slices


def suffix_of(path: Path) -> str:
    """Return a file's suffix in lower case, with both parts of ``".nii.gz"``."""
    suffixes = path.suffixes[-2:] if path.suffix.lower() == ".gz" else path.suffixes[-1:]
    return "".join(suffixes).lower()


def foreign_advice(path: Path) -> str:
    """Return the kind of an unsupported file, and what to do; empty if unknown."""
    found = ""
    if path.is_file():
        with path.open("rb") as file:
            start = file.read(16)
        found = next((suffix for begin, suffix in _STARTS.items() if start.startswith(begin)), "")
    known = KINDS.get(path.suffix.lower()) or KINDS.get(found)
    return "" if known is None else f"this is {known[0]}, which is not read here; {known[1]}"


def folder_of_slices(folder: Path, depth: int = 0) -> Path | None:
    """Return the first folder, at a folder or below it, whose first file is a slice."""
    if not folder.is_dir() or folder.is_symlink() or depth > DEEPEST:
        return None
    inside = sorted(path for path in folder.iterdir() if path.name[0] != ".")
    for path in inside[:2]:
        if path.is_file() and (suffix_of(path) in SLICES or is_dicom(path)):
            return folder
    for path in inside[:MOST_LOOKED_AT]:
        if found := folder_of_slices(path, depth + 1):
            return found
    return None


def folder_advice(folder: Path, volume_suffixes: Collection[str]) -> str:
    """Describe a folder without slices, and what to do; empty if unknown."""
    if (folder / "attributes.json").is_file():
        return "this is {}, which is not read here; {}".format(*KINDS[".n5"])
    inside = sorted(path for path in folder.iterdir() if path.name[0] != ".")
    files = [path for path in inside if path.is_file()]
    if found := next((path for path in files if suffix_of(path) in volume_suffixes), None):
        return f"the folder holds no slices, but volumes, such as {found.name}; open one of them"
    if found := next(filter(None, map(folder_of_slices, inside)), None):
        return (
            f"the folder holds no slices, but folders with slices, such as "
            f"{found.relative_to(folder)}; open one of them"
        )
    counts = Counter(path.suffix.lower() for path in files if path.suffix.lower() in KINDS)
    if not counts:
        return ""
    suffix, count = counts.most_common(1)[0]
    if KINDS[suffix][1] == _IMAGES:
        return f"the folder holds {count} images ({suffix}), which are not read here; {_IMAGES}"
    return f"the folder holds {count} files of the kind '{suffix}': {KINDS[suffix][1]}"
