"""Train the network that proposes gates, and write it for OpenCV.

    python -m training.gates.train DATA OUT --seconds 1500

`DATA` is a folder of `scenes.py`. `OUT` gets `gates.onnx` and `training.csv`. It needs PyTorch and onnx.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch

from training.gates.network import GateNetwork, loss_of
from training.gates.samples import draw_batch

PARTS = (((128, 160), 32), ((240, 320), 8))
"""Sizes of the parts of images, and how many are a batch; every fourth batch is of the second kind."""
LEAST_RATE, BEST_RATE = 1e-5, 4e-3


def train(
    data: Path,
    out: Path,
    *,
    seconds: float,
    seed: int,
    start: Path | None = None,
    most_steps: int | None = None,
) -> GateNetwork:
    """Train for a time, or some steps, and write the network.

    Args:
        data: images and gates.
        out: folder for the network and the log.
        seconds: how long; the rate of learning rises over the first twentieth of it, and falls to its end.
        seed: of the first weights and of all that is drawn.
        start: weights of an earlier training (`gates.pt`) to go on from.
        most_steps: end after so many.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    stream = np.random.default_rng(seed)
    images = np.load(data / "images.npy", mmap_mode="r")
    gates = np.load(data / "gates.npy")
    network = GateNetwork()
    if start is not None:
        network.load_state_dict(torch.load(start))
    network = network.to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(network.parameters(), lr=BEST_RATE, weight_decay=1e-3)
    begun = saved = time.monotonic()
    step = seen = 0
    sums = np.zeros(3)
    out.mkdir(parents=True, exist_ok=True)
    with (out / "training.csv").open("w", encoding="utf-8") as log:
        log.write("seconds,step,images,centres,corners\n")
        while (share := (time.monotonic() - begun) / seconds) < 1.0 and step != most_steps:
            size, count = PARTS[step % 4 == 3]
            rate = BEST_RATE * min(1.0, share / 0.05) * 0.5 * (1.0 + np.cos(np.pi * share)) + LEAST_RATE
            for group in optimiser.param_groups:
                group["lr"] = rate
            batch = draw_batch(images, gates, count, size, stream)
            inputs, *targets = (
                torch.from_numpy(each)
                for each in (batch.images, batch.heat, batch.weight, batch.offsets, batch.size)
            )
            found, placed = loss_of(network(inputs.to(memory_format=torch.channels_last)), *targets)
            optimiser.zero_grad()
            (found + 4.0 * placed).backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
            step, seen = step + 1, seen + count
            sums += (found.item(), placed.item(), 1.0)
            if step % 100 == 0:
                log.write(
                    f"{time.monotonic() - begun:.0f},{step},{seen},"
                    f"{sums[0] / sums[2]:.4f},{sums[1] / sums[2]:.5f}\n"
                )
                log.flush()
                sums[:] = 0.0
            if time.monotonic() - saved > 120.0:
                write(network, out / "gates.onnx")
                saved = time.monotonic()
    write(network, out / "gates.onnx")
    return network


def write(network: GateNetwork, path: Path) -> None:
    """Write a network, with its normalisation folded into its weights, for images of 320 x 240."""
    network.eval()
    partial = path.with_suffix(".tmp")
    torch.onnx.export(network, (torch.zeros(1, 3, 240, 320),), str(partial), opset_version=13, dynamo=False)
    partial.replace(path)
    torch.save(network.state_dict(), path.with_suffix(".pt"))
    network.train()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seconds", type=float, default=1500.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=Path)
    options = parser.parse_args()
    train(options.data, options.out, seconds=options.seconds, seed=options.seed, start=options.start)


if __name__ == "__main__":
    main()
