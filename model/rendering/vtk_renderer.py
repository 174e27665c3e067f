"""The reference renderer: VTK's ray caster, off screen.

It needs no display: images are drawn through EGL, or through OSMesa if EGL is missing. The ray
caster composites front to back (paper, Eqs. 2 and 3) and corrects each opacity for the sample
distance, so that a homogeneous slab of length l has opacity 1 - (1 - a)^(l / voxel size).

An OpenGL context belongs to the thread that created it: create, use and close a renderer in one
thread.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction, vtkPlane
from vtkmodules.vtkRenderingCore import (
    vtkColorTransferFunction,
    vtkLight,
    vtkRenderer,
    vtkVolume,
    vtkVolumeProperty,
)
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLGPUVolumeRayCastMapper

from model.errors import CannotDrawError, RenderError
from model.rendering.opacity_correction import per_sample
from model.rendering.opengl import drawing_errors, offscreen_window
from model.rendering.raster import Raster, blur_of
from model.rendering.scalars import (
    LABEL_NOISE,
    MISSING,
    marks_of,
    masked_scalars,
    noise_of,
    renderable_scalars,
)
from model.scene.clip_plane import WHOLE_PART, ShownPart
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.scene import LightDirection, Lighting
from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.view import View
from model.scene.volume import Volume

AMBIENT, DIFFUSE, SPECULAR, SPECULAR_POWER = 0.4, 0.9, 0.2, 20.0  # of gradient shading

NORMAL_CORRECTION = (
    "in_textureToEye[0] * vec4(shading_gradient.xyz, 0.0)",
    False,
    "in_modelViewMatrix * in_volumeMatrix[0] * vec4(shading_gradient.xyz, 0.0)",
    False,
)
"""Shader replacement that only rotates normals; VTK scales them by the volume's extents. The items
are the text to replace, whether to do so before VTK's own replacements, the new text, and whether
to replace every occurrence."""

NOISE = 3.0  # gradient at which its direction has half weight, in deviations of the noise
NATIVE_TYPES = (np.uint16, np.int16)  # scalar types that are rendered without conversion
TABLE_ENTRIES = 1024  # length of VTK's look-up tables on the GPU


class VtkRenderer:
    """Renders one volume under one lighting."""

    def __init__(
        self,
        volume: Volume,
        lighting: Lighting = "none",
        light: LightDirection | None = None,
        sample_distance: float = 0.5,
    ) -> None:
        if lighting in ("soft", "path"):
            name = "soft" if lighting == "soft" else "path-traced"
            raise CannotDrawError(
                f"VTK has no {name} light; choose direct light or the ray caster."
            )
        self.sample_distance = sample_distance
        self._volume = volume
        self._part = WHOLE_PART
        self._failure = ""
        self._scalars, tf_range = _texture_scalars(volume)
        texture_range = float(self._scalars.min()), float(self._scalars.max())
        self._table_range = _table_range(texture_range, tf_range)
        self._opacity = vtkPiecewiseFunction()
        self._color = vtkColorTransferFunction()
        self._mapper = vtkOpenGLGPUVolumeRayCastMapper()
        self._mapper.AutoAdjustSampleDistancesOff()
        self._mapper.LockSampleDistanceToInputSpacingOff()
        self._mapper.UseJitteringOff()
        self._renderer = vtkRenderer()
        self._renderer.SetBackground(0.0, 0.0, 0.0)
        self._renderer.SetBackgroundAlpha(0.0)
        self._renderer.AutomaticLightCreationOff()
        self._light = light or LightDirection()
        # A distant white light that moves with the camera.
        self._lamp = vtkLight()
        self._lamp.SetLightTypeToCameraLight()
        self._lamp.PositionalOff()
        self._lamp.SetFocalPoint(0.0, 0.0, 0.0)
        self._properties = vtkVolumeProperty()
        self._properties.SetScalarOpacity(self._opacity)
        self._properties.SetColor(self._color)
        self._properties.SetShade(lighting != "none")
        self._properties.SetAmbient(AMBIENT)
        self._properties.SetDiffuse(DIFFUSE)
        self._properties.SetSpecular(SPECULAR)
        self._properties.SetSpecularPower(SPECULAR_POWER)
        actor = vtkVolume()
        shader = actor.GetShaderProperty()
        self._uniforms = shader.GetFragmentCustomUniforms()
        self._set_shown(self._part)
        self._uniforms.SetUniformi("in_isNearest", 0)
        self._uniforms.SetUniformf("in_apart", sample_distance)
        self._uniforms.SetUniformf("in_blur", 0.0)
        actor.SetMapper(self._mapper)
        actor.SetProperty(self._properties)
        self._renderer.AddVolume(actor)
        self._mapper.SetMaskTypeToBinary()
        self._mask: Mask | None = None
        self._hide(None)
        replacements = [*_whole_rays(volume), _hiding(volume)]
        if texture_range != tf_range:
            replacements.append(_table_mapping(texture_range, tf_range))
        if lighting != "none":
            self._renderer.AddLight(self._lamp)
            noise = NOISE * noise_of(self._scalars) / (texture_range[1] - texture_range[0])
            lit = NORMAL_CORRECTION, _wide_gradient(volume), _solid_lighting(volume, noise)
            replacements.extend(lit)
        for replacement in replacements:
            shader.AddFragmentShaderReplacement(*replacement)
        self._window = offscreen_window()
        self._window.AddRenderer(self._renderer)

    def render(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> NDArray[np.float32]:
        """Render one image."""
        scalar_range = self._volume.scalar_range
        distance = sample_distance or self.sample_distance
        opacity = per_sample(inputs.opacity_tf.sample(scalar_range), distance)
        colors = inputs.color_tf.sample(scalar_range)
        is_nearest = inputs.is_nearest(self._volume)
        if is_nearest:
            # VTK does not interpolate its tables either: each entry has the nearest bin's value.
            bins = np.rint(np.linspace(0, TF_SAMPLES - 1, TABLE_ENTRIES)).astype(int)
            opacity, colors = opacity[bins], colors[bins]
        self._uniforms.SetUniformi("in_isNearest", int(is_nearest))
        self._properties.SetInterpolationType(int(not is_nearest))
        self._opacity.BuildFunctionFromTable(*self._table_range, len(opacity), opacity.tolist())
        self._color.BuildFunctionFromTable(*self._table_range, len(colors), colors.ravel().tolist())
        self._mapper.SetSampleDistance(distance)
        self._uniforms.SetUniformf("in_apart", distance)
        # VTK's opacity correction ignores opacities below 1e-4, so it is disabled.
        self._properties.SetScalarOpacityUnitDistance(distance)
        raster = Raster.of(size)
        self._uniforms.SetUniformf("in_blur", blur_of(inputs.view, self._volume, raster))
        self._point_camera(inputs.view, raster)
        self._show_part(inputs.part)
        if inputs.mask != self._mask:
            self._hide(inputs.mask)
            self._mask = inputs.mask
        self._lamp.SetPosition(*(inputs.light or self._light).towards())
        return self._drawn(raster.rows, raster.columns)

    def _drawn(self, rows: int, columns: int) -> NDArray[np.float32]:
        """Draw the scene as RGBA in steps of 1/255, row 0 at the top."""
        pixels = vtkUnsignedCharArray()
        self._check_failure()
        with drawing_errors() as errors:
            self._window.SetSize(columns, rows)
            self._window.Render()
            self._window.GetRGBACharPixelData(0, 0, columns - 1, rows - 1, 0, pixels, 0)
        if errors:
            # Kept, as VTK reports it only once, and then draws nothing silently.
            self._failure = errors[-1] if "ompile" in errors[-1] else errors[0]
            self._check_failure()
        if pixels.GetNumberOfTuples() != rows * columns:
            raise RenderError(
                f"VTK returned no image of {columns} x {rows} pixels; "
                "try a smaller size, or update the graphics driver."
            )
        bottom_up = vtk_to_numpy(pixels).reshape(rows, columns, 4)
        return np.ascontiguousarray(bottom_up[::-1]).astype(np.float32) / np.float32(255)

    def close(self) -> None:
        """Release the OpenGL context; the renderer cannot be used afterwards."""
        self._renderer.RemoveAllViewProps()
        self._window.Finalize()

    def _check_failure(self) -> None:
        if self._failure:
            raise CannotDrawError(
                f"VTK cannot draw {self._volume.name} on this machine ('{self._failure}'); choose "
                "the ray caster, crop or downsample the volume, or update the graphics driver."
            )

    def _point_camera(self, view: View, raster: Raster) -> None:
        _, up, back = view.basis()
        radius = self._volume.radius / self._volume.voxel_size
        distance = view.eye_distance(radius)
        center = _extent(self._volume) / 2
        camera = self._renderer.GetActiveCamera()
        camera.SetFocalPoint(*center)
        camera.SetPosition(*(center + distance * back))
        camera.SetViewUp(*up)
        (x, y), (half_width, half_height) = raster.center, raster.half_size
        tangent = view.tangent
        # Along the shorter side: VTK's angle is at most 179.9 degrees, too few for a tall part.
        camera.SetUseHorizontalViewAngle(half_height > half_width)
        shorter = min(half_width, half_height)
        camera.SetViewAngle(math.degrees(2 * math.atan(shorter * tangent)))
        camera.SetParallelProjection(view.is_orthographic)
        camera.SetParallelScale(half_height * tangent * view.camera_distance(radius))
        camera.SetWindowCenter((x - view.pan_x) / half_width, (y - view.pan_y) / half_height)
        # The whole bounding sphere, with a small margin.
        camera.SetClippingRange(view.near_distance(radius), distance + 1.01 * radius)

    def _show_part(self, part: ShownPart) -> None:
        """Clip the volume by the planes of a crop box, and by one at any angle."""
        if part == self._part:
            return
        self._part = part
        self._mapper.RemoveAllClippingPlanes()
        self._set_shown(part)
        extent, crop = _extent(self._volume), part.crop
        if part.clip is not None:
            normal = np.array(part.clip.normal)
            radius = self._volume.radius / self._volume.voxel_size
            self._clip(extent / 2 + part.clip.offset * radius * normal, -normal)
        for corner, sign in ((crop.low, 1.0), (crop.high, -1.0)):
            for axis, normal in enumerate(np.eye(3) * sign):
                # A plane in a face of the volume would only cost time, and rounding.
                if corner[axis] not in (0.0, 1.0):
                    self._clip(np.array(corner) * extent, normal)

    def _hide(self, mask: Mask | None) -> None:
        """Hide missing and masked voxels."""
        marks = marks_of(self._volume, mask)
        scalars = masked_scalars(self._scalars, self._volume, mask)
        self._mapper.SetInputData(_image_data(self._volume, scalars))
        self._mapper.SetMaskInput(_image_data(self._volume, marks) if len(marks) else None)

    def _clip(self, origin: NDArray[np.float64], normal: NDArray[np.float64]) -> None:
        """Show only the side of a plane to which its normal points."""
        plane = vtkPlane()
        plane.SetOrigin(*origin)
        plane.SetNormal(*normal)
        self._mapper.AddClippingPlane(plane)

    def _set_shown(self, part: ShownPart) -> None:
        """Pass the faces of the shown part to the shader, in voxels."""
        low, high = part.corners(self._volume)
        self._uniforms.SetUniform3f("in_shownLow", tuple(low))
        self._uniforms.SetUniform3f("in_shownHigh", tuple(high))
        self._uniforms.SetUniform4f("in_cut", tuple(part.plane(self._volume)))
        self._uniforms.SetUniform3f("in_cutNormal", part.normal)


def _texture_scalars(volume: Volume) -> tuple[NDArray[Any], Range]:
    """Return scalars of a type that VTK renders directly, and their range.

    Bytes become 16 bits: Mesa interpolates 8-bit textures with 8 bits, up to half a TF bin wrong.
    """
    scalars, scalar_range = renderable_scalars(volume, (*NATIVE_TYPES, np.uint8))
    return scalars.astype(np.uint16) if scalars.dtype == np.uint8 else scalars, scalar_range


def _table_range(texture_range: Range, tf_range: Range) -> Range:
    """Return the range over which TFs are passed to VTK.

    VTK samples a TF over the texture's range, but reads entry i at (i + 1/2) / TABLE_ENTRIES. So
    the range is widened by half an entry at each end, unless :func:`_table_mapping` maps it.
    """
    if texture_range != tf_range:
        return texture_range
    lo, hi = texture_range
    half_entry = (hi - lo) / (2 * (TABLE_ENTRIES - 1))
    return lo - half_entry, hi + half_entry


def _table_mapping(texture_range: Range, tf_range: Range) -> tuple[str, bool, str, bool]:
    """Return a shader replacement that spreads VTK's look-up tables over another range.

    VTK spreads them over the voxels' range, with few entries for TFs over a small part of it. Here
    they span the TFs' range, from the middle of the first entry to that of the last.
    """
    (first, last), (lo, hi) = texture_range, tf_range
    share = (TABLE_ENTRIES - 1) / TABLE_ENTRIES
    factor = share * (last - first) / (hi - lo)
    offset = share * (first - lo) / (hi - lo) + 0.5 / TABLE_ENTRIES
    mapped = f"vec2(scalar.w * {factor:.9e} + {offset:.9e}, 0"
    return "vec2(scalar.w, 0", False, mapped, True


def _whole_rays(volume: Volume) -> tuple[tuple[str, bool, str, bool], ...]:
    """Return shader replacements that weight a ray's last step by its part inside.

    VTK omits the last step. If the ray is shorter than a step or ends at a clipping plane, VTK
    counts the whole step, which makes parts thinner than a step far too opaque.
    """
    begin = "while (!g_exit)\n  {"
    count = "vec3({}.0, {}.0, {}.0)".format(*volume.dimensions)
    behind = f"""
    float maskShare = 0.0;
    vec3 wholeStep = g_dataPos;
    float insideStep = 1.0;
    for (int axis = 0; axis < 3; axis++)
    {{
      float along = g_dirStep[axis] * {count}[axis];
      float face = along > 0.0 ? in_shownHigh[axis] : in_shownLow[axis];
      if (along != 0.0)
      {{
        float over = (g_dataPos[axis] * {count}[axis] - 0.5 - face) / along;
        insideStep = min(insideStep, 1.0 - over);
      }}
    }}
    float leaving = dot(g_dirStep * {count}, in_cut.xyz);
    if (leaving > 0.0)
    {{
      float over = (dot(g_dataPos * {count} - 0.5, in_cut.xyz) - in_cut.w) / leaving;
      insideStep = min(insideStep, 1.0 - over);
    }}
    insideStep = max(insideStep, 0.0);
    g_dataPos -= (1.0 - insideStep) * g_dirStep;
    """
    opacity = "g_srcColor.a = computeOpacity(scalar);"
    part = """
      if (maskShare > 0.0)
      {
        float once = 1.0 - pow(max(1.0 - g_srcColor.a, 0.0), 1.0 / in_apart);
        g_srcColor.a = 1.0 - pow(max(1.0 - (1.0 - maskShare) * once, 0.0), in_apart);
      }
      if (insideStep < 1.0)
      {
        float clear = max(1.0 - g_srcColor.a, 0.0);
        g_srcColor.a = insideStep > 0.0 ? 1.0 - pow(clear, insideStep) : 0.0;
      }
    """
    last, past = "(g_dataPos - in_tex{}[0])", "(g_dataPos - g_dirStep - in_tex{}[0])"
    # Otherwise, rays that enter less than a step before the end are clipped away.
    start, entry = "startPosTex, in_texM", "startPosTex - g_rayJitter, {} + in_texM"
    return (
        (begin, False, begin + behind, True),
        (opacity, False, opacity + part, True),
        ("g_dataPos += g_dirStep;", False, "g_dataPos = wholeStep + g_dirStep;", True),
        (last.format("Max"), False, past.format("Max"), True),
        (last.format("Min"), False, past.format("Min"), True),
        (f"({start}ax", False, f"({entry.format('vec3(1e-5)')}ax", True),
        (f"({start}in", False, f"({entry.format('vec3(-1e-5)')}in", True),
    )


def _hiding(volume: Volume) -> tuple[str, bool, str, bool]:
    """Return a shader replacement that hides samples like the ray caster's `hidden_share`."""
    count = "vec3({}.0, {}.0, {}.0)".format(*volume.dimensions)
    code = f"""
  vec3 maskPlace = g_dataPos * {count} - 0.5;
  vec3 maskWeight = fract(maskPlace);
  maskWeight = in_isNearest != 0 ? step(vec3(0.5), maskWeight) : maskWeight;
  for (int n = 0; n < 8; n++)
  {{
    vec3 corner = vec3(float(n % 2), float(n / 2 % 2), float(n / 4));
    vec3 voxel = clamp(floor(maskPlace) + corner, vec3(0.0), {count} - 1.0);
    float mark = floor(255.0 * texture3D(in_mask, (voxel + 0.5) / {count}).r + 0.5);
    vec3 weight = mix(1.0 - maskWeight, maskWeight, corner);
    maskShare += mod(mark, 2.0) * weight.x * weight.y * weight.z;
  }}
  vec3 maskNearest = (floor(g_dataPos * {count}) + 0.5) / {count};
  bool isMissing = 255.0 * texture3D(in_mask, maskNearest).r > {MISSING - 0.5};
  vec4 maskValue = vec4(isMissing ? 0.0 : 1.0 - maskShare);
  """
    return "vec4 maskValue = texture3D(in_mask, g_dataPos);", False, code, True


def _solid_lighting(volume: Volume, noise: float) -> tuple[str, bool, str, bool]:
    """Return a shader replacement that lights solid material like the ray caster."""
    count = "vec3({}.0, {}.0, {}.0)".format(*volume.dimensions)
    before = "finalColor.xyz = in_ambient[lightingComponent] * ambient +"
    # For one light, the lamp. A ratio first, as fourth powers of small numbers underflow.
    code = f"""
  vec3 change = shading_gradient.xyz * in_cellSpacing[0];
  float slope = length(change);
  float noise = in_isNearest != 0 ? {NOISE * LABEL_NOISE} : {noise:.9e};
  float ratio = slope > 0.0 ? noise / slope : 0.0;
  float counts = slope > 0.0 ? 1.0 / (1.0 + ratio * ratio * ratio * ratio) : 0.0;
  diffuse = counts > 0.0 ? mix(vec3(0.5), diffuse, counts) : vec3(0.5);
  specular = counts > 0.0 ? counts * specular : vec3(0.0);
  vec3 place = g_dataPos * {count} - 0.5;
  vec3 deep = min(place - in_shownLow, in_shownHigh - place);
  vec4 near = clamp(2.0 - 2.0 * vec4(deep, in_cut.w - dot(place, in_cut.xyz)), 0.0, 1.0);
  float nearest = max(max(near.x, near.w), max(near.y, near.z));
  if (nearest > 0.0)
  {{
    vec3 faceDiffuse = vec3(0.0);
    vec3 faceSpecular = vec3(0.0);
    vec3 cut = vec3(0.0);
    for (int axis = 0; axis < 4; axis++)
    {{
      vec3 face = cut;
      if (axis < 3)
      {{
        face = normalize((in_modelViewMatrix * in_volumeMatrix[0])[axis].xyz);
        cut += in_cutNormal[axis] * face;
      }}
      float across = dot(face, vertLightDirection);
      float along = dot(-viewDirection, 2.0 * across * face - vertLightDirection);
      faceDiffuse += near[axis] * abs(across);
      if (along > 0.0)
      {{
        faceSpecular += near[axis] * pow(along, in_shininess[lightingComponent]);
      }}
    }}
    float total = near.x + near.y + near.z + near.w;
    diffuse = mix(diffuse, faceDiffuse / total, nearest);
    specular = mix(specular, faceSpecular / total, nearest);
  }}
  """
    return before, False, code + before, True


def _wide_gradient(volume: Volume) -> tuple[str, bool, str, bool]:
    """Return a shader replacement that gives labels and large voxels the ray caster's normals."""
    count = "vec3({}.0, {}.0, {}.0)".format(*volume.dimensions)
    before = "vec4 shading_gradient = computeGradient(g_dataPos, component, in_volume[0], 0);"
    code = f"""
  if (in_isNearest != 0 || in_blur > 0.0)
  {{
    vec3 at = clamp(g_dataPos * {count} - 0.5, vec3(0.0), {count} - 1.0);
    float own = texture3D(in_volume[0], (floor(at + 0.5) + 0.5) / {count}).r;
    vec3 towards = vec3(0.0);
    for (int n = 0; n < 64; n++)
    {{
      vec3 voxel = floor(at) + vec3(float(n % 4), float(n / 4 % 4), float(n / 16)) - 1.0;
      vec3 inside = clamp(voxel, vec3(0.0), {count} - 1.0);
      float value = texture3D(in_volume[0], (inside + 0.5) / {count}).r;
      vec3 u = at - voxel;
      vec3 t = abs(u);
      vec3 near = max(1.0 - t, 0.0);
      vec3 rest = 2.0 - t;
      vec3 w = near + in_blur * (min(t, rest) - 2.0 * near);
      vec3 d = -sign(u) * min(t, rest);
      if (in_isNearest != 0)
      {{
        value = value == own ? 1.0 : 0.0;
        vec3 isNear = vec3(lessThan(t, vec3(1.0)));
        w = mix(rest * rest * rest / 6.0, 2.0 / 3.0 - t * t + 0.5 * t * t * t, isNear);
        d = mix(-0.5 * rest * rest * sign(u), u * (1.5 * t - 2.0), isNear);
      }}
      towards += value * vec3(d.x * w.y * w.z, w.x * d.y * w.z, w.x * w.y * d.z);
    }}
    towards *= in_isNearest != 0 ? 1.0 : in_volume_scale[0].r;
    shading_gradient.xyz = towards / in_cellSpacing[0];
  }}
  """
    return before, False, before + code, True


def _extent(volume: Volume) -> NDArray[np.float64]:
    """A volume's lengths along x, y and z in voxel sizes, the unit of all lengths in VTK."""
    return np.array(volume.extent) / volume.voxel_size


def _image_data(volume: Volume, scalars: NDArray[Any]) -> vtkImageData:
    """Wrap the scalars in a vtkImageData without copying.

    Its first voxel is at 0, as VTK's single-precision matrices are inaccurate far from 0; views
    look at the volume's centre anyway.
    """
    image = vtkImageData()
    image.SetDimensions(*volume.dimensions)
    image.SetSpacing(*(np.array(volume.spacing) / volume.voxel_size))
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(scalars).reshape(-1)))
    return image
