"""Names that one chooses among, in code, in files and on the command line.

They stand apart from what they name: that imports torch, for which a command line that only
explains its options must not wait.
"""

from __future__ import annotations

from typing import Literal

DeviceChoice = Literal["auto", "cpu", "cuda"]  # devices that networks run on; see `choose_device`
BackendName = Literal["eager", "openvino"]  # what draws a generator's images

Precision = Literal["float32", "bfloat16"]
PrecisionChoice = Literal["auto", "float32", "bfloat16"]  # of layers and optimization steps
PresetName = Literal["draft", "compact", "large", "paper"]  # see `PRESETS`
StudyName = Literal["baselines", "latent-dim", "l1-weight"]  # the paper's studies; see `STUDIES`
