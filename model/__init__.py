"""The science: scenes, renderers, networks and everything measured on them; knows no Qt."""

import sys

# OpenVINO reports its import to an analytics host and writes a user id below the home folder.
# Without this package of its own it does neither. First of all, as torch may import it, too.
sys.modules.setdefault("openvino_telemetry", None)  # type: ignore[arg-type]
# torch imports it with its first optimizer, for a compiler that is not used here. The process ends
# there where Mesa has drawn before: each brings an LLVM of its own.
sys.modules.setdefault("triton", None)  # type: ignore[arg-type]
