"""Storage of the last transfer function (TF) of every volume between runs."""

from __future__ import annotations

from contextlib import suppress
from itertools import chain, count
from pathlib import Path

from app.state.user_folder import user_folder
from model.errors import TransferFunctionError, reason
from model.scene.transfer_function import TransferFunction


class TransferFunctionStore:
    """A folder with one TF file per volume.

    Parameters
    ----------
    folder : Path
        Created by the first save.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @classmethod
    def of_user(cls) -> TransferFunctionStore:
        """Return the store in the user's application data folder."""
        return cls(user_folder() / "transfer_functions")

    def path(self, fingerprint: str) -> Path:
        """Return the path of a volume's TF file."""
        return self._folder / f"{fingerprint[:32]}.json"

    def save(self, fingerprint: str, transfer_function: TransferFunction) -> None:
        """Save a volume's TF.

        Raises
        ------
        TransferFunctionError
            When it cannot be written.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TransferFunctionError(
                f"{self._folder}: the folder cannot be made ({reason(error)}); "
                "transfer functions are not kept between runs."
            ) from error
        transfer_function.save(self.path(fingerprint))

    def load(self, fingerprint: str) -> TransferFunction | None:
        """Return a volume's TF, or None if there is none.

        Raises
        ------
        TransferFunctionError
            When the file is invalid, and has been renamed. A file that cannot be read
            or renamed stays in place, and a later save would overwrite it.
        """
        path = self.path(fingerprint)
        if not path.exists():
            return None
        try:
            return TransferFunction.load(path)
        except TransferFunctionError as error:
            if not isinstance(error.__cause__, OSError):
                with suppress(OSError):
                    path.replace(_free(path.with_suffix(".damaged")))
            raise


def _free(path: Path) -> Path:
    """Return an unused path similar to the given one."""
    names = chain([path], (path.with_suffix(f".{i}{path.suffix}") for i in count(2)))
    return next(name for name in names if not name.exists())
