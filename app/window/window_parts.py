"""What the menus of the window act on."""

from __future__ import annotations

from dataclasses import dataclass

from app.image_view.engine_pane import EnginePane
from app.image_view.reference_controls import ReferenceControls
from app.sensitivity_view.sensitivity_view import SensitivityView
from app.state.latent_state import LatentState
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.tf_editor.editor import TransferFunctionEditor
from app.window.crop_card import CropCard
from app.window.file_dialogs import FileDialogs
from app.window.file_opening import FileOpening
from app.window.image_error import ImageError
from app.window.movie_saving import MovieSaving
from app.window.overlays import Overlays
from app.window.pane_layout import PaneLayout
from app.window.picture_saving import PictureSaving
from app.window.session_files import SessionFiles
from app.window.top_bar import TopBar


@dataclass(frozen=True)
class WindowParts:
    """Parts of the window that menus act on."""

    opening: FileOpening
    files: FileDialogs
    pictures: PictureSaving
    movies: MovieSaving
    sessions: SessionFiles
    state: ViewerState
    workspace: Workspace
    preferences: Preferences
    generator: EnginePane
    reference: EnginePane
    bar: TopBar
    controls: ReferenceControls
    error: ImageError
    panes: PaneLayout
    overlays: Overlays
    crop: CropCard
    editor: TransferFunctionEditor
    sensitivity: SensitivityState
    view: SensitivityView
    latent: LatentState
