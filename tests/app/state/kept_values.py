"""Values of all that is kept between runs, none of them the usual one."""

from ramp import make_tf

from app.state.sensitivity_state import NamedRegion
from app.state.settings import FigureSettings, LookOfB, Settings, VolumeMemory
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.region import Outline
from model.scene.scene import LightDirection
from model.scene.view import View


def region(name):
    return NamedRegion(name, Outline.rectangle(0.1, 0.1, 0.4, 0.3))


SETTINGS = Settings(
    drawing="raycast", stop="exact", reference_size=1024, denoises=False, legend=True,
    scale_bar=True, background="white", cube=False, opacity_images=True,
    shown="reference", swapped=True, slices=True, large_slice=0, trackball=True,
    colors_follow_modes=False,
    last_folder="/data", window_geometry="AdnQywAD", editor_share=0.25,
    theme="light", single_keys=False, figure=FigureSettings(0, (850, 1000)),
    recent_volumes=("/data/a.nrrd", "/data/ü \udce9.nrrd"), recent_models=("/data/model",),
    recent_transfer_functions=("/data/tf.json",), recent_sessions=("/data/a.tfscope",),
    places={"/data/a.nrrd": "f1"},
)  # fmt: skip
MEMORY = VolumeMemory(
    path="/data/a.raw", models=("/data/model",), tf=make_tf(140.0),
    tf_b=make_tf(120.0), compares=True, pane="B", look_b=LookOfB("path", "vtk"), up_axis="-y",
    raw_layout="8x8x8_uint8", choice="t=2",
    view=View(30.0, -20.0, 5.0, 1.5, 0.1, 0.0, is_orthographic=True),
    lighting="soft", light=LightDirection(50.0, -20.0), light_b=LightDirection(10.0, 0.0),
    brightness=1.5, light_seconds={"soft": 0.2}, crop=CropBox((0.1, 0.0, 0.0), (1.0, 0.5, 1.0)),
    clip=ClipPlane((1.0, -2.0, 0.3), 0.25),
    interpolates=False, draws_missing=True, shows_model=False, mask="f1.mask.nrrd",
    regions=(region("ribs"), region("spine")), active_region="ribs", region_count=4,
    value_scale="logarithmic", opacity_scale="logarithmic", visible=(110.0, 180.0),
    cross_hair=(0.25, 0.5, 1.0), slice_colors="overlay", gray_window=(105.0, 150.0),
)  # fmt: skip
