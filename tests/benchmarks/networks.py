"""Time of the paper's networks, by backend, for one image and for sixteen."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import get_args

import torch

from model.generator.backends import Backend, make_decode, obstacle
from model.networks.blocks import choose_device, place
from model.networks.checkpoint import load_model
from model.networks.generator_network import EncodedInputs
from model.networks.names import BackendName
from model.networks.paper import build_generator
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.training.options import PRESETS
from tests.benchmarks.rows import print_machine, print_rows, timed


@torch.inference_mode()
def main(arguments: Sequence[str] | None = None) -> None:
    """Draw random views and TFs by each backend and precision."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, help="(default: untrained networks of --preset)")
    parser.add_argument("--preset", default="paper", choices=PRESETS)
    backends = get_args(BackendName)
    parser.add_argument("--backend", action="append", choices=backends, help="may be repeated")
    parser.add_argument("--seconds", type=float, default=2.0, help="least time of a measurement")
    asked = parser.parse_args(arguments)
    print_machine()
    size = PRESETS[asked.preset]
    scene = Scene("", "", (0.0, 1.0), (0.0, 1.0), size.image_size)
    if asked.model is None:
        network = build_generator(size, scene)
    else:
        card, network = load_model(asked.model)
        scene = card.scene
    device = choose_device("auto")
    network = place(network, device).eval()
    rows = []
    for batch in (1, 16):
        samples = [draw_sample(scene, 0, "holdout", number) for number in range(batch)]
        inputs = EncodedInputs.of(samples, scene).map(lambda tensor: tensor.to(device))
        features = network.features(inputs)
        truth, *_ = network.decode(*features)
        first = None
        for name in asked.backend or backends:
            for precision in ("float32", "bfloat16") if name == "openvino" else ("float32",):
                backend = Backend(name, precision)
                why = obstacle(backend, device)
                if why is not None:
                    rows.append((batch, name, precision, why, None, None))
                    continue
                decode = make_decode(network, backend, device)
                # The first image takes the network's conversion.
                image = decode(*features)[0].clone()
                seconds, calls = 0.0, 0
                while seconds < asked.seconds or not calls:
                    seconds, calls = seconds + timed(partial(decode, *features))[1], calls + 1
                first = first or seconds / calls
                apart = float((image - truth).abs().max()) * 255 / 2
                rows.append(
                    (batch, name, precision, 1e3 * seconds / calls, first * calls / seconds, apart)
                )
    heading = ("images", "backend", "precision", "ms", "over torch", "largest difference, 1/255")
    print_rows(f"{scene.image_size} x {scene.image_size}", heading, rows)


if __name__ == "__main__":
    main()
