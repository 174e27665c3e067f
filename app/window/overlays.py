"""Overlays of images: cube, legend, scale bar, opacity image, difference; and the background."""

from dataclasses import replace
from functools import lru_cache, partial
from typing import Literal, get_args

from PySide6.QtCore import QObject, QRect
from PySide6.QtGui import QPainter

from app.controls import Painted
from app.engines.requests import ReferenceSettings
from app.glosses import SENTENCES
from app.image_view.engine_pane import EnginePane, OpacityInset
from app.image_view.image_canvas import ImageCanvas
from app.image_view.orientation_cube import OrientationCube
from app.latent_browser.cell_grid import CellGrid
from app.picture import BLACK, WHITE, Background, is_bright
from app.sensitivity_view.field_cover import are_alike, paint_bar
from app.state.edited_tf import PaneName
from app.state.settings import BackgroundChoice
from app.window.context import Context
from app.window.figure import Comparison, Image, Marks, Subject, legend_of
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF, TransferFunction

BACKGROUNDS: dict[BackgroundChoice, Background] = {
    "black": BLACK,
    "gradient": "gradient",
    "white": WHITE,
}

Overlay = Literal["cube", "legend", "scale_bar", "opacity_images"]  # settings of what may be shown


class Overlays(QObject):
    """Shows overlays on each pane's image as the settings say, if there is a volume."""

    def __init__(self, context: Context, grid: CellGrid) -> None:
        super().__init__(context.window)
        self._panes, self._grid, self._state = context.panes, grid, context.state
        self._canvases = canvases = [pane.canvas for pane in context.panes]
        self._preferences, self._asked = context.preferences, context.sensitivity
        self.subject = Subject()
        self._previewed: OpacityTF | None = None
        self._cubes = [OrientationCube(context.state, canvas) for canvas in canvases]
        for pane, cube in zip(self._panes, self._cubes, strict=True):
            # While something moves, with each image: both are painted anyway.
            pane.imageShown.connect(lambda *_, cube=cube: cube.follow())
        self._right = canvases[-1]
        self.insets = [OpacityInset(pane) for pane in self._panes]
        for pane in self._panes:
            pane.canvas.decorations.append(partial(self._paint, pane))
        self.refresh()

    @property
    def background(self) -> Background:
        """Background of the images."""
        return BACKGROUNDS[self._preferences.settings.background]

    @property
    def legend_tf(self) -> TransferFunction:
        """The legend's TF: the edited one, or that of the picture that covers the image."""
        tf = self._state.transfer_function
        return tf if self._previewed is None else replace(tf, opacity=self._previewed)

    def has(self, overlay: Overlay) -> bool:
        """Whether an overlay is shown."""
        return bool(getattr(self._preferences.settings, overlay))

    def toggle(self, overlay: Overlay) -> None:
        """Show or hide an overlay."""
        self._preferences.set(**{overlay: not self.has(overlay)})
        self.refresh()

    def choose_background(self, choice: BackgroundChoice) -> None:
        """Set the images' background."""
        self._preferences.set(background=choice)
        self.refresh()

    def preview(self, opacity: OpacityTF | None) -> None:
        """Set the legend to another opacity TF's picture; None for the image's own."""
        self._previewed = opacity
        self._right.update()

    def start_volume(self, subject: Subject) -> None:
        """Update the overlays for another volume."""
        self.subject = subject
        self.refresh()

    def lie_over(self, canvas: ImageCanvas) -> None:
        """Show cube and legend over the rightmost canvas."""
        self._right = canvas
        self.refresh()

    def refresh(self) -> None:
        """Follow the settings."""
        shows_cube = self.has("cube") and self.subject.scale is not None
        for canvas, cube in zip(self._canvases, self._cubes, strict=True):
            cube.setVisible(shows_cube and canvas is self._right)
        for pane, inset in zip(self._panes, self.insets, strict=True):
            inset.is_shown = self.has("opacity_images")
            pane.background = self.background
            pane.canvas.update()
        self._grid.background = self.background
        self._asked.set_over_bright(is_bright(self.background))

    def _paint(self, pane: EnginePane, painter: QPainter, _square: QRect) -> None:
        state, subject = self._state, self.subject
        has_legend = self.has("legend") and pane.canvas is self._right
        scale = subject.scale if self.has("scale_bar") else None
        marks = self._marks(pane, painter) if has_legend or scale or subject.line else None
        if marks is None:
            return
        if has_legend:
            legend = legend_of(self.legend_tf)
            if state.tf_input.compares:
                legend = legend_of(*filter(None, map(state.tf_input.of, get_args(PaneName))))
            marks.legend(legend, subject.units)
        if scale is not None:
            marks.scale_bar(scale.bar(state.view, state.inputs.part))
        marks.line(subject, state.view)

    def _marks(self, pane: EnginePane, painter: QPainter) -> Marks | None:
        canvas = pane.canvas
        there, text = canvas.picture_rect & canvas.rect(), canvas.fontInfo().pixelSize()
        return Marks.over(painter, there, text, self.background)

    def paint_line(self, pane: EnginePane, painter: QPainter) -> None:
        """Paint the ruler's line over what covers a pane's image."""
        if self.subject.line and (marks := self._marks(pane, painter)) is not None:
            marks.line(self.subject, self._state.view)


TIP = (
    f"Error (RMSE) against the ground truth, in the square that both images show. "
    f"{SENTENCES['RMSE']} Difference (D) shows where."
)
TIP_B = (
    f"Difference (RMSE) from A, over the pixels where A or B shows something. "
    f"{SENTENCES['RMSE']} Difference (D) shows where."
)
SHOWN = 0.0005  # least difference that is not 0 in the shown digits
_picture = lru_cache(maxsize=1)(Comparison.picture)
FOLLOWS = "difference follows when both images are complete"
UNUSUAL = "It is far above the model's errors in tests, which had no such TF or view."


class ImageError(QObject):
    """Compares two images at rest, and shows their difference as a number in a caption.

    They are the generator's and the ground truth, or B and A. On request, each pixel's difference
    is shown over the generator's image or B.

    Nothing is compared if the generator was trained under another light, in an orthographic view,
    or if only a part of the volume is shown: models are not trained for these.
    """

    is_wanted = Painted(False, "compare")  # whether to show the difference if there is one

    def __init__(self, context: Context, overlays: Overlays) -> None:
        super().__init__(context.window)
        self._overlays = overlays
        self._generator, self._reference, self._pane_b = context.panes
        self._state, self._workspace = context.state, context.workspace
        self._context = context
        self._shown: dict[EnginePane, tuple[SceneInputs, Image, ReferenceSettings | None]] = {}
        self._compared: Comparison | None = None
        for pane in context.panes:
            pane.imageShown.connect(partial(self._take, pane))
            pane.canvas.decorations.append(partial(self._paint, pane))
        self._state.inputsChanged.connect(self.follow)
        self._state.tf_input.paneChanged.connect(self._end_with_b)

    @property
    def pane(self) -> EnginePane:
        """Pane whose image is compared with the reference's."""
        return self._pane_b if self._state.tf_input.compares else self._generator

    @property
    def shown(self) -> Comparison | None:
        """The comparison whose difference is shown."""
        return self._compared if self.is_wanted else None

    @property
    def compared(self) -> Comparison | None:
        """The compared image and the reference's; None if they cannot be compared."""
        return found if isinstance(found := self._compare(), Comparison) else None

    def _compare(self) -> Comparison | str:
        """Return the comparison of the images, or what to say if there is none."""
        pair = self.pane, self._reference
        state, is_b = self._state, self.pane is self._pane_b
        wanted = state.inputs_of(self.pane.name), state.inputs_of("A")
        if not is_b:
            if any(each.isHidden() for each in pair):
                return ""
            if self._workspace.model.lighting != self._workspace.reference.settings.lighting:
                return "no difference: the ground truth has another light"
            if not wanted[0].part.is_whole or wanted[0].mask:
                return "no difference of a part of the volume"
            if wanted[0].view.is_orthographic:
                return "no difference in an orthographic view"
        if not self._shown.keys() >= {*pair} or self.pane.rgba is None:
            return FOLLOWS
        (inputs, drawn, _), (others, truth, _) = map(self._shown.__getitem__, pair)
        is_old = any(self._shown[pane][2] != self._settings_of(pane) for pane in pair)
        # A finer image follows.
        is_old |= is_b and any(pane.canvas.progress is not None for pane in pair)
        if is_b or self._workspace.model.draws_path:
            # One of them may be of the pane's size before.
            is_old |= not are_alike(drawn.shape, truth.shape)
        if is_old or (inputs, others) != wanted:
            return FOLLOWS
        found = Comparison(drawn, truth, is_b)
        # The old one keeps what was computed.
        return self._compared if self._compared and found.is_of(self._compared) else found

    def _take(self, pane: EnginePane, inputs: SceneInputs, image: Image) -> None:
        self._shown[pane] = inputs, image[..., :3], self._settings_of(pane)
        if not self._state.live and pane in (self.pane, self._reference):
            self.compare()

    def _settings_of(self, pane: EnginePane) -> ReferenceSettings | None:
        """Return what an image depends on besides its inputs; a model's on nothing."""
        work = self._workspace.reference
        if pane is self._generator and not self._workspace.model.draws_path:
            return None
        return work.settings_b if pane is self._pane_b else work.settings

    def compare(self) -> None:
        """Compare the images if both are there."""
        compared = self._compare()
        if not self.is_wanted:
            _picture.cache_clear()
        if isinstance(compared, str):
            self._clear(compared)
            return
        error = compared.error
        said, tip, is_unusual = f"error {error:.3f}".replace(" 0.", " ."), TIP, False
        if compared.is_of_b:
            said = "same as A" if error < SHOWN else said.replace("error", "differs from A by")
            tip = TIP_B
        elif not error and self._workspace.reference.settings.lighting == "path":
            # With one sample, the ground truth is the generator's own picture.
            said = ""
        elif self._workspace.model.is_unusual(error):
            tip, is_unusual = f"{TIP} {UNUSUAL}", True
        self.pane.set_note(said, tip, is_unusual)
        self._compared = compared
        self._context.update_images()

    def _paint(self, pane: EnginePane, painter: QPainter, _square: QRect) -> None:
        canvas, compared, wiped = pane.canvas, self.shown, self._reference.canvas.wiped
        over = self.pane if wiped is None else self._reference
        if compared is None or pane is not over or canvas.cover is not None:
            return
        text = f"{' to '.join(compared.ends)}: {compared.title}"
        picture = _picture(compared, pane.background)
        if wiped is not None:
            # On B's side of the line.
            painter.setClipRect(canvas.rect().adjusted(wiped[1] + 1, 0, 0, 0))
        painter.drawImage(canvas.rect_of(picture), picture)
        self._overlays.paint_line(pane, painter)
        painter.setClipping(False)
        paint_bar(painter, canvas.picture_rect & canvas.rect(), compared.bar(pane.background), text)

    def follow(self) -> None:
        """Stop comparing images that are not the present state's."""
        # The focus may have moved from A to B; the images are the same.
        if isinstance(found := self._compare(), str):
            self._clear(found)

    def _clear(self, why: str) -> None:
        """Show no error; if the difference is wanted, say why there is none."""
        notes = {self._generator: "", self._pane_b: ""}
        notes[self.pane] = why * self.is_wanted
        if self._compared is None and all(pane.note == note for pane, note in notes.items()):
            return
        self._compared = None
        _picture.cache_clear()
        for pane, note in notes.items():
            pane.set_note(note)
        self._context.update_images()

    def _end_with_b(self) -> None:
        """Show no difference once B is closed: a model's image comes first, and so does a new B."""
        self.is_wanted = self.is_wanted and self._state.tf_input.compares

    def forget(self, pane: EnginePane) -> None:
        """Stop comparing a pane's image until it is drawn again."""
        self._shown.pop(pane, None)
        self.follow()
