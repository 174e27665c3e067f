"""The main window: two synchronized images and the transfer-function editor below."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, SignalInstance
from PySide6.QtGui import (
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QKeyEvent,
    QKeySequence,
    QShortcut,
    QStatusTipEvent,
)
from PySide6.QtWidgets import QApplication, QMessageBox, QWidget

from app.engines.client import EngineState
from app.engines.engines import REAL_BUILDERS, Builders
from app.engines.exactness import STOPS
from app.state.latent_session import LatentChoices
from app.state.open_model import LIGHTS
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.window.figure import Subject
from app.window.menus import Menus
from app.window.scene_notices import OFFER
from app.window.window_parts import WindowParts
from model.rendering.scale_bar import Scale
from model.scene.transfer_function import OpacityTF


class MainWindow(WindowParts):
    """Shows the generator's image and the ground truth while the user edits view and TF."""

    def __init__(
        self, builders: Builders = REAL_BUILDERS, preferences: Preferences | None = None
    ) -> None:
        super().__init__(builders, preferences)
        self._alt_alone = self._b_returns = False  # B: once the latent browser is closed
        self.menus = Menus(self)
        tips: dict[QWidget, str] = {
            **{pane.canvas: "Images" for pane in self.context.panes},
            self.browser.map: "Map of TFs (B)",
            self.browser.grid: "Pictures of TFs (B)",
            self.editor: "Transfer function",
            self.sensitivity.findings: "Values and edits",
        }
        for widget, area in tips.items():
            widget.setStatusTip(area)
        for keys, step in (("F6", 1), ("Shift+F6", -1)):
            shortcut = QShortcut(QKeySequence(keys), self)
            shortcut.activated.connect(lambda step=step: self._move_focus(step))
        self.installEventFilter(self)
        self._connect()
        self.arrange()
        # Not the bar's first button: the images have the keys at first.
        self.reference.canvas.setFocus()
        self._show_model()
        if self.preferences.start_problem:
            self.context.fail(self.preferences.start_problem)

    def _connect(self) -> None:
        """Connect signals; what an opened volume leads to is below, in order."""
        workspace, work = self.workspace, self.workspace.reference
        fail = self.context.fail
        wires: list[tuple[SignalInstance, Callable[..., object]]] = [
            (workspace.opening.reading, self.files.note_reading),
            (workspace.opening.reading, lambda _name: self.empty_card.set_shown(False)),
            (workspace.opening.volumeRead, self._take_read),
            (workspace.volumeOpened, self._show_volume),
            (workspace.volumeStarted, self._start_volume),
            (workspace.rangeChanged, self._show_range),
            (workspace.scaleChanged, self._show_scale),
            (workspace.modelChanged, self._show_model),
            (workspace.hintChanged, lambda text: setattr(self.generator, "hint", text)),
            (workspace.problem, fail),
            (workspace.news, self.status.say),
            (work.settingsChanged, lambda _settings: self._show_light()),
            (work.preparation.progressed, self.status.show_preparation),
            (self.latent_state.choicesChanged, self._show_browser),
            (self.crop_card.shownChanged, self._show_crop_handles),
            (self.sensitivity_state.changed, self._show_crop_handles),
            (self.panes.arranged, self.arrange),
            (self.panes.bothAsked, workspace.ask_for_model),
            (self.state.tf_input.paneChanged, self._show_panes),
            (self.reference.canvas.resized, self._note_pixels),
            (self.generator.canvas.resized, self._note_pixels),
            (self.panes.arranged, self._note_pixels),
            (self.editor.menu.scale_wanted, workspace.opening.show_on_scale),
            (self.browser.problem, lambda text: fail(text, "browser")),
            (self.browser.preview.tfChanged, self._show_preview),
            (self.preferences.problem, fail),
        ]
        for signal, slot in wires:
            signal.connect(slot)
        self._show_browser(self.latent_state.choices)
        self._show_light()

    def _show_preview(self, tf: OpacityTF | None) -> None:
        self.overlays.preview(tf)
        self.sensitivity.labels[1].is_covered = tf is not None

    def _note_pixels(self) -> None:
        """Request images of the size of a visible pane, once it is laid out."""
        canvas = self.panes.images[0].canvas
        if canvas.width() >= canvas.minimumSizeHint().width():
            self.workspace.reference.set_pane_pixels(*canvas.pixels)

    @property
    def errors(self) -> list[str]:
        """Errors shown by the two images."""
        clients = dict.fromkeys(pane.client for pane in self.context.panes)
        return [client.text for client in clients if client.state is EngineState.FAILED]

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Show the effect of edits while Ctrl or W is held; end actions by Escape."""
        self._alt_alone = event.key() == Qt.Key.Key_Alt
        if event.key() == Qt.Key.Key_Control:
            self.sensitivity_state.show_effect(True)
        if event.key() == Qt.Key.Key_W and not event.modifiers():
            if not event.isAutoRepeat():
                self.sensitivity.what_if.start()
        elif not (event.key() == Qt.Key.Key_Escape and self._escape()):
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Show the images again, or mark where the value under the mouse is visible."""
        if event.key() == Qt.Key.Key_Control:
            self.sensitivity_state.show_effect(False)
        if event.key() == Qt.Key.Key_Alt and self._alt_alone and self.top_bar.is_folded:
            self.top_bar.open_menus()
        if event.key() == Qt.Key.Key_W and not event.isAutoRepeat():
            self.sensitivity.what_if.end()
        else:
            super().keyReleaseEvent(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Show the keys of the area under the mouse, which Qt sends as its status tip.

        As a filter: under Python 3.11, an error of a handler that Qt calls from within
        ``super().event()`` ends the process (PySide 6.8 to 6.11).
        """
        if watched is self and isinstance(event, QStatusTipEvent):
            # An area inside the editor is left for the editor, which Qt does not mention.
            left_for = self.editor.statusTip() if self.editor.underMouse() else "Images"
            self.status.area = event.tip() or left_for
            return True
        return False

    def changeEvent(self, event: QEvent) -> None:
        """Release held keys when another window gets the focus."""
        if event.type() == QEvent.Type.ActivationChange and not self.isActiveWindow():
            self.sensitivity.what_if.end()
        super().changeEvent(event)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Accept dragged files."""
        if any(url.isLocalFile() for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open dropped files: volumes, models and TFs."""
        event.acceptProposedAction()
        for url in event.mimeData().urls():
            if url.isLocalFile():
                self.files.open(Path(url.toLocalFile()))

    def closeEvent(self, event: QCloseEvent) -> None:
        """Hide the window at once, then wait for its threads."""
        if self.isVisible() and not (self._may_quit() and self.sessions.finish()):
            event.ignore()
            return
        self.saving.cancel()
        self.workspace.stop()
        self.memory.note()
        self.hide()
        self.workspace.join()
        self.saving.join()
        self.files.join()
        self.sessions.join()
        self.preferences.finish()
        event.accept()

    def _may_quit(self) -> bool:
        unfinished, yes = self.saving.unfinished, QMessageBox.StandardButton.Yes
        text = f"{unfinished}.\nQuit and stop it?"
        return not unfinished or QMessageBox.question(self, "Quit", text) == yes

    def _escape(self) -> bool:
        """End the last action, or dismiss the newest notice; return False if there is none."""
        # The status line shows the keys of the area under the mouse.
        is_over_map = self.browser.underMouse()
        if (is_over_map and self.browser.escape()) or self.ruler.end() or self.sensitivity.escape():
            return True
        if self.crop_card.is_shown:
            self.crop_card.set_shown(False)
            return True
        return self.browser.escape() or self.notice.dismiss_newest() or self.ruler.remove()

    def _move_focus(self, step: int) -> None:
        """Give the focus to the next area of the window, or to the one before."""
        areas = [area for area in self.areas() if _first_in(area) is not None]
        focus = QApplication.focusWidget()
        here = []
        if focus is not None:
            here = [n for n, a in enumerate(areas) if a is focus or a.isAncestorOf(focus)]
        # Without a focus, begin at the first area, or backwards at the last.
        start = here[-1] if here else (-1 if step > 0 else 0)
        wanted = _first_in(areas[(start + step) % len(areas)]) if areas else None
        if wanted is not None:
            wanted.setFocus(Qt.FocusReason.TabFocusReason)

    def _take_read(self, opened: OpenedVolume) -> None:
        # Errors of the previous file no longer apply.
        self.notice.clear()
        self.sessions.take_read(opened)

    def _show_browser(self, choices: LatentChoices) -> None:
        """Show the latent browser in the generator's place, or the generator again."""
        tf_input = self.state.tf_input
        if choices.shown:
            # In the narrower image it would hide what TFs show.
            self.up_axis_card.hide()
            self.panes.is_browsing = True
            self._b_returns = self._b_returns or tf_input.compares
            tf_input.compare(False)
            return
        if self._b_returns and not tf_input.compares:
            tf_input.compare(True)
            tf_input.focus("A")
        self._b_returns = False
        if self.panes.is_browsing:
            self.panes.is_browsing = False
            # Its question may still be open.
            self.up_axis_card.start_volume()

    def _show_crop_handles(self, _change: object) -> None:
        # While a region is drawn, the mouse draws.
        shown = self.crop_card.is_shown and self.sensitivity_state.tool is None
        for handles in self.crop_handles:
            handles.set_active(shown)
        self.menus.refresh()

    def arrange(self) -> None:
        """Show the controls that suit the visible images."""
        super().arrange()
        images = self.panes.images
        shown = self.generator in images, self.reference in images, self.panes.compares
        self.workspace.show_images(*shown)
        self.wipe.is_shown = self.panes.wipes
        self._show_focus()
        self.preferences.set(shown=self.panes.shown)
        self.menus.refresh()

    def _show_panes(self) -> None:
        """Show B if it is compared with A, and mark the edited one."""
        tf_input = self.state.tf_input
        if tf_input.compares and not self.panes.compares:
            # By undo, too: what it changes is seen.
            said = "You edit B now. Click in A to edit A again. C closes B."
            self.status.say(said if tf_input.pane == "B" and not self._b_returns else "")
            # The map of TFs takes its place.
            self.latent_state.choose(shown=False)
        elif self.panes.compares and not tf_input.compares:
            self.status.say("")
        self.panes.show_b(tf_input.compares)
        if not tf_input.compares:
            self.pane_b.forget()
            self.image_error.forget(self.pane_b)
        self._show_focus()
        self.image_error.compare()
        self.menus.refresh()

    def _show_focus(self) -> None:
        tf_input, compares = self.state.tf_input, self.panes.compares
        for pane, other in ((self.reference, self.pane_b), (self.pane_b, self.reference)):
            is_one = compares and not self.panes.wipes
            pane.canvas.is_edited = is_one and pane.name == tf_input.pane
            if pane.canvas.is_edited and other.canvas.hasFocus():
                # Its frame is the strongest.
                pane.canvas.setFocus()
        work = self.workspace.reference
        lights = work.settings.lighting, work.settings_b.lighting
        of_a, of_b = (f", {LIGHTS[each]}" * (lights[0] != lights[1]) for each in lights)
        self.reference.title = f"A{of_a}" if compares else "Ground truth"
        self.pane_b.title = f"B{of_b}"
        self.editor.show_pane(tf_input.pane if compares else "")

    def _show_light(self) -> None:
        """Name the reference's light, and the one that follows once it can be drawn."""
        work = self.workspace.reference
        for pane, settings, wanted in (
            (self.reference, work.settings, work.wanted),
            (self.pane_b, work.settings_b, work.wanted_b),
        ):
            shown, coming = settings.lighting, wanted.lighting
            self.brightness.set_lighting(pane.lit, shown)
            follows = "" if coming == shown else LIGHTS[coming]
            samples = STOPS[work.choices.stop].samples if shown == "path" else 0
            pane.set_light(LIGHTS[shown], follows, samples)
        self.image_error.follow()
        self._show_focus()

    def _show_model(self) -> None:
        """Make room for the generator's image, or give its room to the reference."""
        model = self.workspace.model
        self.panes.is_enough = model.shows_image is False
        is_absent = model.folder is None or model.awaits_path or model.is_foreign
        self.panes.has_model = not is_absent
        self.generator.title = "Denoised sample" if model.draws_path else "Generator"
        self.generator.set_drawer(model.drawer, model.errors)
        self.generator.set_light(LIGHTS[model.lighting])
        self.brightness.set_lighting("learned", model.lighting)
        self.browser.bar.more.setVisible(self.workspace.latent.session.model is not None)
        if not self.generator.client.is_ready:
            self.image_error.forget(self.generator)

    def _show_volume(self, opened: OpenedVolume) -> None:
        """Show an opened volume before its TF is set."""
        self._b_returns = False
        for pane in self.context.panes:
            pane.samples = 0  # of the volume before
        volume = opened.volume
        self.scene_notices.start_volume(volume)
        shape = " × ".join(str(n) for n in volume.dimensions)
        self.setWindowTitle(f"{volume.name} ({shape}) – tfscope")
        self.top_bar.volume.title, self.top_bar.volume.detail = volume.name, shape
        self.overlays.start_volume(Subject(volume.units, Scale.of(volume, opened.shown)))
        self.tools.setEnabled(True)
        self.reference.caption.show()
        self.status.start_volume()
        self.crop_card.set_volume(volume.dimensions)
        for handles in self.crop_handles:
            handles.set_volume(volume.dimensions)
        self.plot_memory.start(opened, self.workspace.is_next)
        self.editor.set_data(opened)

    def _start_volume(self) -> None:
        """Show an opened volume's notices and questions, now that its TF is set."""
        self.up_axis_card.start_volume()
        if not self.workspace.is_next:
            self.crop_card.set_shown(False)
        self.sessions.start_volume()
        opened = self.workspace.opened
        assert opened is not None
        self.slices.start_volume(opened)
        self.files.start_volume()
        self.scene_notices.offer_logarithm()
        self.scene_notices.offer_labels()
        self.menus.refresh()
        self.plot_memory.settle()

    def _show_range(self, opened: OpenedVolume) -> None:
        self.editor.area.histogram.set_data(opened.counts, opened.edges)
        self.editor.area.set_axis(self.editor.area.axis)
        self.slices.show_range(opened)
        self.menus.refresh()

    def _show_scale(self, opened: OpenedVolume) -> None:
        self.editor.set_scale(opened)
        # A band kept over the plot would mark other values.
        self.sensitivity_state.release()
        self.notice.clear(OFFER)


def _first_in(area: QWidget) -> QWidget | None:
    """Return the first widget of an area that Tab can reach; None if there is none."""
    for widget in (area, *area.findChildren(QWidget)):
        takes = bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus)
        if takes and widget.isVisible() and widget.isEnabled() and widget.focusProxy() is None:
            return widget
    return None
