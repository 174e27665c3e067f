"""Replacements in the shader of VTK's ray caster: normals, and light on solid material."""

from __future__ import annotations

import numpy as np

from model.rendering.gradient_noise import EVEN, certain_gradient
from model.scene.crop import CropBox
from model.scene.volume import Volume

NORMAL_CORRECTION = (
    "in_textureToEye[0] * vec4(shading_gradient.xyz, 0.0)",
    False,
    "in_modelViewMatrix * in_volumeMatrix[0] * vec4(shading_gradient.xyz, 0.0)",
    False,
)
"""Shader replacement that corrects surface normals.

VTK scales normals by the volume's extents along the axes of the view; with this
replacement they are only rotated. The items are the text to replace, whether to
do so before VTK's own replacements, the new text, and whether to replace every
occurrence.
"""

SHADED = "finalColor.xyz = in_ambient[lightingComponent] * ambient +"
"""Where VTK's shader has the diffuse and specular light on a sample."""

SOLID_SHADING = (
    """
  {
    float square = dot(shading_gradient.xyz, shading_gradient.xyz);
    float share = min(square * CERTAIN, 1.0);
    share *= share;
    if (!(square > 0.0)) { diffuse = vec3(0.0); specular = vec3(0.0); }
    diffuse = mix(EVEN * in_lightDiffuseColor[0], diffuse, share);
    specular *= share;
    vec3 way = vec3(1e30);
    if (g_dirStep.x != 0.0)
      way.x = (g_dataPos.x - (g_dirStep.x > 0.0 ? shownLow.x : shownHigh.x)) / g_dirStep.x;
    if (g_dirStep.y != 0.0)
      way.y = (g_dataPos.y - (g_dirStep.y > 0.0 ? shownLow.y : shownHigh.y)) / g_dirStep.y;
    if (g_dirStep.z != 0.0)
      way.z = (g_dataPos.z - (g_dirStep.z > 0.0 ? shownLow.z : shownHigh.z)) / g_dirStep.z;
    float nearest = min(way.x, min(way.y, way.z));
    share = clamp(2.0 - nearest * stepInVoxels, 0.0, 1.0);
    if (share > 0.0)
    {
      vec3 face = way.x == nearest ? vec3(sign(g_dirStep.x), 0.0, 0.0)
                : way.y == nearest ? vec3(0.0, sign(g_dirStep.y), 0.0)
                                   : vec3(0.0, 0.0, sign(g_dirStep.z));
      face = normalize((in_modelViewMatrix * in_volumeMatrix[0] * vec4(face, 0.0)).xyz);
      float cosine = abs(dot(face, in_lightDirection[0]));
      vec3 mirrored = normalize(2.0 * cosine * face - in_lightDirection[0]);
      float shine = pow(max(dot(-viewDirection, mirrored), 0.0), in_shininess[lightingComponent]);
      diffuse = mix(diffuse, cosine * in_lightDiffuseColor[0], share);
      specular = mix(specular, shine * in_lightSpecularColor[0], share);
    }
  }
  """
    + SHADED
)
"""Shader replacement for solid material, which has no gradient, as the ray caster shades it.

See :class:`model.rendering.raycast.shading.Light`. The faces are in texture coordinates.
"""


def solid_shading(noise: float, scale: float) -> tuple[str, bool, str, bool]:
    """Return the shader replacement for solid material.

    Parameters
    ----------
    noise : float
        See :func:`model.rendering.gradient_noise.gradient_noise`.
    scale : float
        Scalar ranges of the TFs in the range of the texture's values.
    """
    certain = (scale / certain_gradient(noise)) ** 2
    text = SOLID_SHADING.replace("CERTAIN", f"{certain:.9e}").replace("EVEN", f"{EVEN:.9e}")
    return SHADED, False, text, False


def in_texture(volume: Volume, crop: CropBox) -> tuple[list[float], list[float]]:
    """Return a crop box's least and greatest corner in coordinates of VTK's texture.

    The first voxel's centre is half a voxel behind 0, and the last one's as far before 1.
    """
    counts = np.array(volume.dimensions)
    corners = [(np.array(corner) * (counts - 1) + 0.5) / counts for corner in (crop.low, crop.high)]
    return corners[0].tolist(), corners[1].tolist()
