"""Names of options in code, in files and on the command line.

They are separate, as the modules that they name import torch, which would slow the command line's
help.
"""

from typing import Literal

DeviceChoice = Literal["auto", "cpu", "cuda"]  # devices that networks run on; see `choose_device`
BackendName = Literal["eager", "openvino"]  # inference libraries

Precision = Literal["float32", "bfloat16"]
PrecisionChoice = Literal["auto", "float32", "bfloat16"]  # of layers and optimization steps
PresetName = Literal["draft", "compact", "large", "paper"]  # see `PRESETS`
StudyName = Literal["baselines", "latent-dim", "l1-weight"]  # the paper's studies; see `STUDIES`
