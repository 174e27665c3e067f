"""Drawing of figures and movies, which are then saved or copied."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject
from PySide6.QtGui import QGuiApplication, QImage
from PySide6.QtWidgets import QDialog, QProgressDialog

from app.engines.background import LatestCall
from app.engines.client import Channels, EngineState
from app.engines.messages import Result
from app.engines.requests import PictureRequest, Quality, SupersededError
from app.number_box import short
from app.picture import pixels_of, save_image, suffixes
from app.state.settings import FigureSettings
from app.state.slow_answers import SlowAnswers
from app.window.context import Context, ask_for_place
from app.window.figure import (
    GAP,
    Comparison,
    FigureChoice,
    Rgba,
    Size,
    Subject,
    Which,
    figure,
    panels,
)
from app.window.figure_dialog import PREVIEW, FigureDialog, duration
from app.window.overlays import ImageError, Overlays
from app.window.sessions import Sessions
from model.errors import RenderError
from model.rendering.movie_file import SUFFIXES, write_movie
from model.rendering.raster import Raster, middle_square
from model.rendering.scale_bar import DEPTH_TEXT
from model.scene.inputs import SceneInputs
from model.scene.orientation import turntable

KEY = "figures"  # of notices about figures

FIGURE_FILTER = "PNG images (*.png);;JPEG images (*.jpg *.jpeg);;TIFF images (*.tif *.tiff)"
MOVIE_FILTER = "Movies (*.mp4);;Animated images (*.gif)"

FIGURE_SAMPLES, PREVIEW_SAMPLES = 64, 4  # of each pixel in path-traced light, at first

STEPS = 1000  # of a figure's progress
LEAST_PART = 0.03  # least share of a figure or movie from which its remaining time is estimated


@dataclass
class _Job:
    """A figure or movie that is being drawn, frame by frame."""

    choice: FigureChoice
    place: Path | None
    frames: list[SceneInputs]
    subject: Subject
    chosen: Any  # the user's choice: if its engine is replaced, the next one draws the same
    texts: dict[str, str]  # of its file, by name
    compared: Comparison | None = None  # the screen's, for a difference alone
    images: dict[str, tuple[Rgba, float]] = field(default_factory=dict)
    lights: dict[str, str] = field(default_factory=dict)  # of the images, in words
    scale: float | None = None  # end of the difference's colours: all of a movie has the first's
    error: float | None = None  # estimated error of the reference's image; None without an estimate
    drawn: int = 0
    pictures: SimpleQueue[NDArray[np.uint8] | None] = field(default_factory=SimpleQueue)
    reduced: Size | None = None  # width and height of a preview
    is_given_up: bool = False
    begun: float = field(default_factory=monotonic)
    pace: float = 0.0  # seconds that a sample of a preview's pixel took

    @property
    def names(self) -> list[str]:
        """Names of the images needed: none for a difference alone, which is on the screen."""
        return [name for name in self.choice.names if name != "difference"]

    @property
    def lacking(self) -> list[str]:
        return [name for name in self.names if name not in self.images]

    @property
    def kind(self) -> str:
        return "movie" if self.choice.seconds else "figure"

    def left(self, part: float) -> str:
        """Text with the time that is left, from the finished share; empty if it is unknown."""
        if part < LEAST_PART:
            return ""
        seconds = (monotonic() - self.begun) * (1 - part) / part
        return f"\nAbout {duration(seconds)} left"

    def written(self) -> Iterator[NDArray[np.uint8]]:
        """Yield a movie's pictures as they are drawn; raise if it is cancelled."""
        while (picture := self.pictures.get()) is not None:
            yield picture
        if self.is_given_up:
            raise SupersededError


class FigureSaving(QObject):
    """Asks for the options of a figure or movie, has it drawn, and saves or copies it."""

    def __init__(
        self, context: Context, overlays: Overlays, error: ImageError, sessions: Sessions
    ) -> None:
        super().__init__(context.window)
        self._context, self._overlays = context, overlays
        self._error, self._sessions = error, sessions
        self._panes = dict(zip(("generator", "reference", "b"), context.panes, strict=True))
        self._job: _Job | None = None
        self.progress: QProgressDialog | None = None
        clients = {name: pane.client for name, pane in self._panes.items()}
        self._channels = Channels(clients, "figure", self._take, self)
        self._slow_answers = SlowAnswers(self._channels.values(), self)
        self._slow_answers.changed.connect(self._show_part)
        self._writing = LatestCall("movie", self, self._movie_written, self._fail)
        self._comparing = LatestCall("comparison", self, self._take_compared, self._fail)
        self._previews = Channels(clients, "figure preview", self._take_preview, self)
        self._preview: tuple[FigureDialog, _Job] | None = None
        for name, pane in self._panes.items():
            pane.client.stateChanged.connect(partial(self._follow, name))

    @property
    def unfinished(self) -> str:
        """Work that closing the window would lose, as text; empty if none."""
        job = self._job
        if job is None:
            return "A movie is being written" if self._writing.is_running else ""
        return f"{job.place.name if job.place else 'A figure to be copied'} is being drawn"

    def ask(self, copies: bool = False) -> None:
        """Ask what to show, how and where, and save or copy it; or copy it as shown."""
        sizes, first = self.sizes(), self.first_choice()
        if self.unfinished or not sizes:
            running = self.unfinished and f"{self.unfinished}. Wait for it, or cancel it."
            self._context.fail(running or "There is no image to save yet; wait for one.", KEY)
            return
        if copies:
            which = first.which if first.which in sizes else next(iter(sizes))
            width, height = sizes[which]
            choice = replace(first, width=width, height=height, which=which, seconds=0.0)
            self.draw(replace(choice, is_beside=False), None, as_shown=True)
            return
        dialog = FigureDialog(sizes, first, self._context.window)
        for name, pane in self._panes.items():
            dialog.which_box.setItemText(dialog.which_box.findData(name), pane.title)
        dialog.preview = partial(self._ask_for_preview, dialog)
        dialog.preview(dialog.choice())
        place, is_chosen = None, False
        while not is_chosen and dialog.exec() == QDialog.DialogCode.Accepted:
            place = None if dialog.copies else self._ask_for_place(dialog.choice())
            # Without a place, the user returns to the dialog.
            is_chosen = dialog.copies or place is not None
        self._preview = None
        self._previews.cancel()
        dialog.deleteLater()
        if is_chosen:
            self.draw(dialog.choice(), place)

    def _ask_for_place(self, choice: FigureChoice) -> Path | None:
        filters, endings, name = FIGURE_FILTER, suffixes(), "figure"
        if choice.seconds:
            filters, endings, name = MOVIE_FILTER, SUFFIXES, "turntable"
        return ask_for_place(self._context, "Save figure", filters, endings, name)

    def first_choice(self) -> FigureChoice:
        """The dialog's first choice: the last one, or the screen's."""
        last, overlays = self._context.preferences.settings.figure, self._overlays
        if last is None:
            compares = self._context.state.tf_input.compares
            marks = overlays.has("legend") or compares, overlays.has("scale_bar")
            last = FigureSettings(legend=marks[0], scale_bar=marks[1])
        which, ground = self._which(), last.background
        ground = overlays.background if ground == "window" else ground
        work = self._context.workspace.reference
        is_traced = "path" in (work.settings.lighting, work.settings_b.lighting)
        samples = (last.samples or FIGURE_SAMPLES) if is_traced else 0
        seconds = 0.0 if which == "difference" else last.seconds
        width, height = last.own_size or (last.longer_side, 0)
        how = which, samples, seconds, last.rate, last.session
        return FigureChoice(width, height, ground, last.legend, last.scale_bar, *how)

    def sizes(self) -> dict[Which, Size]:
        """Width and height in screen pixels of all that can be drawn now."""
        found: dict[Which, Size] = {}
        compares = self._context.state.tf_input.compares
        two: tuple[Which, ...] = ("reference", "b" if compares else "generator")
        for which in two:
            pane = self._panes[which]
            image = pane.canvas.image
            is_ready = pane.client.is_ready or pane.client.state is EngineState.LOADING
            if image is not None and is_ready:
                # An image that is still refined has fewer pixels, or those before a resize.
                is_exact, own = pane.engine == "exact", (image.width(), image.height())
                found[which] = pane.canvas.pixels if is_exact else own
        if compares and len(found) == 2:
            width, height = found["reference"]
            if self._panes["reference"].canvas.wiped:
                found["wiped"] = width, height
            found["a_b"] = round(2 * width / (1 - GAP)), height
            found["a_b_difference"] = round(3 * width / (1 - 2 * GAP)), height
        elif len(found) == 2:
            side = min(found["reference"])
            found["both"] = round(2 * side / (1 - GAP)), side
            if self._error.compared is not None:
                found["difference"] = side, side
        return found

    def draw(self, choice: FigureChoice, place: Path | None, as_shown: bool = False) -> None:
        """Save a figure to a file, or without one copy it; remember a choice of the dialog."""
        if not as_shown:
            self._remember(choice)
        self._end()
        state = self._context.state
        frames = [state.inputs_of("A")]
        if choice.seconds:
            x, y, z = map(float, state.pivot)
            axes = state.up_axis, state.proportions, (x, y, z)
            views = turntable(state.view, choice.frame_count, *axes)
            frames = [replace(frames[0], view=view) for view in views]
        job = self._job = self._new_job(choice, place, frames)
        if as_shown:
            self._take_shown(job)
        if not job.lacking:
            self._compose(job)
            return
        what = f"Drawing {choice.width} × {choice.height} pixels …"
        if choice.seconds and place is not None:
            what = f"Drawing the pictures of {place.name} …"
            self._writing.ask(partial(write_movie, place, job.written(), choice.rate))
            self._show_progress("Save movie", what, len(frames))
        self._context.status.say(what)
        self._ask(self._channels, job, choice.samples)

    def cancel(self) -> None:
        """Cancel the drawing."""
        if self._job is not None:
            self._context.status.say(f"The {self._job.kind} was cancelled.")
        self._end()

    def join(self) -> None:
        """Wait until the threads that write movies and compare images have ended."""
        self._writing.join()
        self._comparing.join()

    def _new_job(self, choice: FigureChoice, place: Path | None, frames: list[SceneInputs]) -> _Job:
        titles, b = {n: p.title for n, p in self._panes.items()}, self._context.state.inputs_of("B")
        canvas, view = self._panes["reference"].canvas, frames[0].view
        wipe = canvas.wiped[1] / canvas.width() if canvas.wiped else 0.0
        subject = replace(self._overlays.subject, titles=titles, b=b, view=view, wipe=wipe)
        # So that the figure has the numbers of the screen.
        compared = self._error.compared if choice.which == "difference" else None
        texts = self._sessions.texts_for(place) if choice.session else {}
        return _Job(choice, place, frames, subject, self._chosen, texts, compared)

    @property
    def _chosen(self) -> tuple[object, ...]:
        workspace, opened = self._context.workspace, self._context.workspace.opened
        look, volume = self._context.state.tf_input.look, opened and opened.volume
        return volume, workspace.model.folder, workspace.reference.choices, look

    def _take_shown(self, job: _Job) -> None:
        """Take those images of the screen that need not be drawn again."""
        for name in job.names:
            pane = self._panes[name]
            if (image := pane.whole) is not None:
                # Next to the generator's square, only what that shows, too.
                image = middle_square(image) if job.choice.which == "both" else image
                job.images[name] = image, self._brightness(name)
                job.lights[name] = pane.light_text(pane.samples)

    def _ask(self, channels: Channels[str], job: _Job, samples: int) -> None:
        """Request the missing images of a job's next frame at this size."""
        work, whole = self._context.workspace.reference, panels(job.choice)[-1].size()
        size = whole * (job.reduced[0] / job.choice.width if job.reduced else 1.0)
        raster = Raster(max(size.width(), 1), max(size.height(), 1))
        for name in job.lacking:
            each = 1 if name == "generator" else max(samples, 1)
            quality = Quality(raster.shorter, raster=raster, samples=each)
            inputs, settings = job.frames[job.drawn], None
            job.lights[name] = self._panes[name].light_text(each)
            if name == "b" and job.subject.b is not None:
                inputs = replace(job.subject.b, view=inputs.view)
                settings = None if work.settings_b == work.settings else work.settings_b
            channels[name].ask(PictureRequest(inputs, quality, settings=settings))

    def _which(self) -> Which:
        if self._context.state.tf_input.compares:
            shown: Which = "wiped" if self._panes["reference"].canvas.wiped else "a_b"
            return "a_b_difference" if self._error.is_wanted else shown
        seen = [name for name, pane in self._panes.items() if pane.isVisible()]
        if "generator" not in seen:
            return "reference"
        if self._error.is_wanted:
            return "difference"
        return "both" if "reference" in seen else "generator"

    def _remember(self, choice: FigureChoice) -> None:
        last = self._context.preferences.settings.figure or FigureSettings()
        # The window's changes with it.
        ground = "window" if choice.background == self._overlays.background else choice.background
        size = choice.width, choice.height
        width, height = shown = self.sizes().get(choice.which, size)
        # A movie's sides are even. Rounded sides may differ by a pixel, if rounded twice by three.
        is_shown = size in (shown, (width // 2 * 2, height // 2 * 2))
        longer, own = 0 if is_shown else max(size), None
        if abs(choice.width * height - choice.height * width) > 3 * max(shown):
            longer, own = 0, size
        samples, seconds = choice.samples or last.samples, choice.seconds or last.seconds
        how = samples, seconds, choice.rate, choice.session
        kept = FigureSettings(longer, own, ground, choice.legend, choice.scale_bar, *how)
        self._context.preferences.set(figure=kept)

    def _take(self, name: str, result: Result) -> None:
        job = self._job
        if job is None or self._channels[name].is_pending:
            return
        if result.value is None:
            self._fail(result.error or f"The {job.kind} could not be drawn. Try a smaller one.")
            return
        job.images[name] = result.value, self._brightness(name)
        if name == "reference":
            job.error = None if result.image is None else result.image.error
        if not job.lacking:
            self._compose(job)

    def _compose(self, job: _Job) -> None:
        """Compose a frame from its images; then draw the next one, or deliver all."""
        if job.choice.which == "difference" and job.compared is None:
            self._fail("There is no difference to save yet. Wait until both images are final.")
        elif "difference" in job.choice.names:
            compared = job.compared or Comparison.of(job.images, job.scale)
            # Of a large figure it takes seconds.
            self._comparing.ask(lambda: (job, compared, compared.colored))
        else:
            self._take_compared((job, None, None))

    def _take_compared(self, found: tuple[_Job, Comparison | None, Any]) -> None:
        job, compared, _ = found
        choice, is_preview = job.choice, self._preview is not None and job is self._preview[1]
        if not (is_preview or job is self._job):
            return
        try:
            inputs = job.frames[job.drawn]
            image = figure(choice, job.images, inputs, job.subject, compared, job.reduced)
        except RenderError as error:
            self._fail(str(error))
            return
        if self._preview is not None and is_preview:
            self._preview[0].show_preview(image, job.pace)
            return
        job.scale = None if compared is None else compared.scale
        job.drawn += 1
        if not choice.seconds:
            self._end()
            _add_texts(image, job)
            if job.place is None:
                QGuiApplication.clipboard().setImage(image)
                self._context.status.say("Copied.")
            else:
                self._context.saved(KEY, save_image, job.place, image)
            return
        job.images.clear()
        job.pictures.put(pixels_of(image))
        self._show_done(job, job.drawn / len(job.frames))
        if self._job is not job:
            # Cancelled while the progress bar was painted.
            return
        if job.drawn == len(job.frames):
            self._job = None
            job.pictures.put(None)
            self._context.status.say("Writing the movie …")
        else:
            self._ask(self._channels, job, choice.samples)

    def _movie_written(self, path: Path) -> None:
        self._close_progress()
        self._context.status.say(f"Saved {path.absolute()}.")

    def _follow(self, name: str, _state: object) -> None:
        """Ask a restarted engine; cancel if it is to draw something else."""
        job, client, preview = self._job, self._panes[name].client, self._preview
        is_started = client.state is EngineState.LOADING
        if preview is not None and is_started:
            self._preview = None
            self._ask_for_preview(preview[0], preview[0].choice())
        if job is None or name not in job.lacking or client.is_ready:
            return
        follows = is_started or client.state is EngineState.WAITING
        if job.chosen != self._chosen or not follows:
            changed = "volume, light or quality changed"
            self._fail(f"The {job.kind} was cancelled: {changed}. Save it again.")
        elif is_started:
            # Its light may have changed.
            titles = {**job.subject.titles, name: self._panes[name].title}
            job.subject = replace(job.subject, titles=titles)
            self._ask(self._channels, job, job.choice.samples)

    def _show_part(self, part: float | None) -> None:
        """Show the progress of a figure that takes long."""
        job = self._job
        if job is None or part is None or job.choice.seconds:
            return
        if self.progress is None:
            name = "the figure" if job.place is None else job.place.name
            what = f"Drawing {name}, {job.choice.width} × {job.choice.height} pixels …"
            self._show_progress("Save figure", what, STEPS)
        self._show_done(job, part)

    def _show_done(self, job: _Job, part: float) -> None:
        if self.progress is not None:
            self.progress.setLabelText(self.progress.labelText().split("\n")[0] + job.left(part))
            self.progress.setValue(round(part * self.progress.maximum()))

    def _show_progress(self, title: str, text: str, steps: int) -> None:
        self.progress = progress = QProgressDialog(text, "Cancel", 0, steps, self._context.window)
        progress.setWindowTitle(title)
        progress.setMinimumDuration(0)
        # The last step is not the end; closing by itself, it would report a cancellation.
        progress.setAutoClose(False)
        progress.setAutoReset(False)
        progress.canceled.connect(self.cancel)
        progress.setValue(0)

    def _close_progress(self) -> None:
        progress, self.progress = self.progress, None
        if progress is not None:
            progress.blockSignals(True)
            progress.close()
            progress.deleteLater()

    def _fail(self, text: str) -> None:
        self._end()
        self._context.status.say("")
        self._context.fail(text, KEY)

    def _end(self) -> None:
        job, self._job = self._job, None
        self._writing.forget()
        self._channels.cancel()
        if job is not None:
            job.is_given_up = True
            job.pictures.put(None)
        self._close_progress()

    def _brightness(self, name: str) -> float:
        return self._context.state.brightness.of(self._panes[name].lit)

    def _ask_for_preview(self, dialog: FigureDialog, choice: FigureChoice) -> None:
        scale = min(PREVIEW[0] / choice.width, PREVIEW[1] / choice.height)
        width, height = (max(round(scale * side), 1) for side in (choice.width, choice.height))
        job = self._new_job(choice, None, [self._context.state.inputs_of("A")])
        job.reduced = width, height
        old = job if self._preview is None else self._preview[1]
        self._preview = dialog, job
        if (old.choice.which, old.reduced) == (choice.which, job.reduced):
            job.images, job.pace = old.images, old.pace
        if not job.lacking:
            self._compose(job)
        else:
            self._ask(self._previews, job, min(choice.samples, PREVIEW_SAMPLES))

    def _take_preview(self, name: str, result: Result) -> None:
        if self._preview is None or result.value is None or self._previews[name].is_pending:
            return
        job = self._preview[1]
        job.images[name] = result.value, self._brightness(name)
        if name != "generator":
            # A generator takes as long for any size.
            pixels = math.prod(job.reduced or (1,))
            job.pace += result.seconds / (pixels * result.request.quality.samples)
        if not job.lacking:
            self._compose(job)


def _add_texts(image: QImage, job: _Job) -> None:
    """Name in a figure's file its session, light, error, and what its scale bar holds for."""
    choice = job.choice
    for name, text in job.texts.items():
        image.setText(name, text)
    if choice.scale_bar:
        image.setText("Scale bar", f"Holds {DEPTH_TEXT}")
    if choice.which == "difference":
        return
    are_more = len(job.names) > 1
    titles = {n: f"{job.subject.titles[n].partition(',')[0]}: " * are_more for n in job.names}
    image.setText("Light", "; ".join(titles[name] + job.lights[name] for name in job.names))
    if job.error is not None and math.isfinite(job.error):
        text = f"Estimated RMSE of colours from 0 to 1, by noise: {short(job.error)}."
        image.setText("Error", titles["reference"] + text)
