"""Names that one chooses among, in code, in files and on the command line.

They stand apart from what they name: that imports torch, for which a command line that only
explains its options must not wait.
"""

from __future__ import annotations

from typing import Literal

DeviceChoice = Literal["auto", "cpu", "cuda"]  # devices that networks run on; see `choose_device`
BackendName = Literal["eager", "openvino"]  # what draws a generator's images

Precision = Literal["float32", "bfloat16"]
PrecisionChoice = Literal["auto", "float32", "bfloat16"]
"""Digits that layers and optimization steps are computed in, and what one can ask for."""

PresetName = Literal["draft", "compact", "large", "paper"]
"""Sizes of networks and images; see :data:`model.training.options.PRESETS`."""

StudyName = Literal["baselines", "latent-dim", "l1-weight"]  # the paper's studies; see `STUDIES`
