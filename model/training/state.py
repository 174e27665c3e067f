"""The resumable state of a training run, saved atomically.

``training.json`` names the file of its tensors and is written last. So a process that is killed
leaves the previous or the new state.
"""

import json
import signal
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import safetensors
import safetensors.torch
import torch
from filelock import FileLock, Timeout
from torch import Tensor

from model.errors import TrainingError, os_errors_as
from model.files import write_atomically
from model.json_files import read_json
from model.training.stage import Stage

FORMAT_VERSION = 5

STATE_FILE = "training.json"


@dataclass
class Progress:
    """Progress of a run: its stage or "done", and the seconds and samples of all sessions."""

    stage: str = "opacity"
    seconds: float = 0.0
    samples: int = 0
    batch: int = 0  # batches done in this stage

    def enter(self, stage: str) -> None:
        """Move to the first batch of a stage."""
        self.stage, self.batch = stage, 0


def save_state(
    folder: Path, progress: Progress, recipe: dict[str, Any], stages: list[Stage]
) -> None:
    """Write the state of a run."""
    tensors: dict[str, Tensor] = {}
    for stage in stages:
        for name, value in _stage_tensors(stage).items():
            tensors[f"{stage.name}.{name}"] = value.detach().cpu().contiguous().clone()
    name = f"training-{progress.samples}.safetensors"
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / name, safetensors.torch.save(tensors))
    header = {
        "tfscope_training": FORMAT_VERSION,
        "tensors": name,
        "steps": {stage.name: stage.steps for stage in stages},
        "parts": {stage.name: stage.parts for stage in stages},
        "progress": asdict(progress),
        "recipe": recipe,
    }
    write_atomically(folder / STATE_FILE, json.dumps(header, indent=2).encode())
    for old in folder.glob("training-*.safetensors"):
        if old.name != name:
            old.unlink()


def check_new(folder: Path) -> None:
    """Raise :class:`model.errors.TrainingError` when a folder holds a run."""
    if (folder / STATE_FILE).exists():
        raise TrainingError(
            f"{folder}: the folder holds a training run; go on with it, or choose another folder.",
            resume="",
        )


def load_progress(folder: Path) -> tuple[Progress, dict[str, Any]]:
    """Read the progress and the recipe of a run."""
    header = _header(folder)
    return Progress(**header["progress"]), header["recipe"]


def load_stage(folder: Path, stage: Stage) -> None:
    """Restore a stage from the saved state of a run."""
    header = _header(folder)
    path = folder / header["tensors"]
    try:
        with safetensors.safe_open(path, "pt") as file:
            for part, owner in _parts(stage).items():
                prefix = f"{stage.name}.{part}."
                own = {
                    key.removeprefix(prefix): file.get_tensor(key)
                    for key in file.keys()  # noqa: SIM118  (not a dict)
                    if key.startswith(prefix)
                }
                if isinstance(owner, torch.optim.Optimizer):
                    _load_optimizer(owner, own)
                else:
                    owner.load_state_dict(own)
    except (OSError, KeyError, RuntimeError, ValueError, safetensors.SafetensorError) as error:
        raise TrainingError(
            f"{path}: the run cannot be resumed, its state is damaged ({error}); "
            "start again in another folder."
        ) from error
    stage.steps = header["steps"][stage.name]
    stage.parts = header.get("parts", {}).get(stage.name, 1)


def _header(folder: Path) -> dict[str, Any]:
    path = folder / STATE_FILE
    if not path.is_file():
        raise TrainingError(
            f"{folder}: there is no training run to resume ({STATE_FILE} is missing); "
            "start one instead."
        )
    try:
        header: dict[str, Any] = read_json(path)
        if header["tfscope_training"] != FORMAT_VERSION:
            raise ValueError(f"format {header['tfscope_training']}, not {FORMAT_VERSION}")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise TrainingError(f"{path}: the run cannot be resumed ({error}).") from error
    return header


def _parts(stage: Stage) -> dict[str, torch.nn.Module | torch.optim.Optimizer]:
    """Parts that have tensors, by their names in the file."""
    parts = {
        "generator": stage.generator,
        "discriminator": stage.discriminator,
        "average": stage.average.network,
        "generator_optimizer": stage.generator_optimizer,
        "discriminator_optimizer": stage.discriminator_optimizer,
    }
    return {name: part for name, part in parts.items() if part is not None}


def _stage_tensors(stage: Stage) -> dict[str, Tensor]:
    tensors: dict[str, Tensor] = {}
    for part, owner in _parts(stage).items():
        state = owner.state_dict()
        if isinstance(owner, torch.optim.Optimizer):
            each = state["state"].items()
            state = {f"{index}.{name}": v for index, values in each for name, v in values.items()}
        tensors |= {f"{part}.{name}": value for name, value in state.items()}
    return tensors


@torch.no_grad()
def _load_optimizer(optimizer: torch.optim.Optimizer, tensors: dict[str, Tensor]) -> None:
    parameters = [p for group in optimizer.param_groups for p in group["params"]]
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        index, name = key.split(".", 1)
        if value.ndim:
            # The fused optimizer requires moments in the same memory order as the weights.
            value = torch.empty_like(parameters[int(index)]).copy_(value)
        state.setdefault(int(index), {})[name] = value
    optimizer.load_state_dict(
        {"state": state, "param_groups": optimizer.state_dict()["param_groups"]}
    )


LOCK_FILE = "training.lock"


@contextmanager
def training_in(folder: Path) -> Iterator[None]:
    """Keep other processes from training in a folder."""
    lock = FileLock(folder / LOCK_FILE, timeout=0)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire()
        except Timeout:
            raise TrainingError(
                f"{folder}: another process is training there; wait for it, stop it, "
                "or choose another folder."
            ) from None
    try:
        yield
    finally:
        lock.release()


def writing(folder: Path) -> AbstractContextManager[None]:
    """Raise :class:`TrainingError` if a run's folder cannot be written."""
    what = f"{folder}: the run cannot be written"
    return os_errors_as(TrainingError, what, "make room or choose another folder")


@contextmanager
def interruption() -> Iterator[threading.Event]:
    """Set an event at the first Ctrl-C, instead of raising; a second one raises at once."""
    asked = threading.Event()

    def note(_number: int, _frame: FrameType | None) -> None:
        asked.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, note)
    try:
        yield asked
    finally:
        if is_main and signal.getsignal(signal.SIGINT) is note:
            signal.signal(signal.SIGINT, signal.default_int_handler)
