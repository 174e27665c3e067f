"""Time of the paper's networks, by backend, for one image and for sixteen."""

import argparse
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
from model.scene.scene import Scene
from model.training.options import PRESETS
from tests.benchmarks.rows import draw_scenes, parsed, print_rows, timed


@torch.inference_mode()
def main(arguments=None):
    """Draw random views and TFs by each backend and precision."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, help="(default: untrained networks of --preset)")
    parser.add_argument("--preset", default="paper", choices=PRESETS)
    backends = get_args(BackendName)
    parser.add_argument("--backend", action="append", choices=backends, help="may be repeated")
    parser.add_argument("--seconds", type=float, default=2.0, help="least time of a measurement")
    asked = parsed(parser, arguments)
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
        inputs = EncodedInputs.of(draw_scenes(scene, batch), scene)
        features = network.features(inputs.map(lambda tensor: tensor.to(device)))
        truth, *_ = network.decode(*features)
        first = None
        for name in asked.backend or backends:
            for precision in ("float32", "bfloat16") if name == "openvino" else ("float32",):
                backend = Backend(name, precision)
                why = obstacle(backend, device)
                if why is not None:
                    rows.append((batch, name, precision, why, None, None))
                    continue
                decode = partial(make_decode(network, backend, device), *features)
                # The first image takes the network's conversion.
                apart = float((decode()[0] - truth).abs().max()) * 255 / 2
                times = [timed(decode)[1]]
                while sum(times) < asked.seconds:
                    times.append(timed(decode)[1])
                mean = sum(times) / len(times)
                first = first or mean
                rows.append((batch, name, precision, 1e3 * mean, first / mean, apart))
    heading = ("images", "backend", "precision", "ms", "speed-up", "largest difference, 1/255")
    print_rows(f"{scene.image_size} x {scene.image_size}", heading, rows)


if __name__ == "__main__":
    main()
