"""The science: scenes, renderers, networks and everything measured on them; without Qt."""

import sys

# OpenVINO reports its import to an analytics host and writes a user id below the home folder,
# unless its telemetry package is missing. Set before all imports, as torch may import it, too.
sys.modules.setdefault("openvino_telemetry", None)  # type: ignore[arg-type]
# torch imports triton with its first optimizer, for a compiler that is not used here. After Mesa
# has drawn, that import would end the process, as each of the two loads its own LLVM.
sys.modules.setdefault("triton", None)  # type: ignore[arg-type]
