"""Train the network that judges parts of images around proposed gates, and write it for OpenCV.

    python -m training.gates.judge DATA OUT --proposals gates.onnx --seconds 900

`DATA` is a folder of `scenes.py`. What is judged are proposals of the other network, and true outlines that
are moved and scaled. `OUT` gets `judge.onnx` and `judge.csv`. It needs PyTorch and onnx.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from training.gates.samples import Floats, Image, changed
from vision.learned.crops import (
    AROUND,
    COLUMNS,
    FAR_AROUND,
    GRID_COLUMNS,
    GRID_ROWS,
    ROWS,
    box_around,
    cut_out,
)
from vision.learned.proposals import GateProposals, read_network

_IMAGES = 12
_OF_AN_IMAGE = 16
_KEPT, _BATCH, _STEPS = (
    16_000,
    128,
    3,
)  # crops that are kept, in a batch, and batches from one drawing to the next
_MIRRORED = [1, 0, 3, 2]  # corners after left and right are exchanged
_LEAST_CHANCE = 0.03
_LEAST_SPAN, _MARGIN = 0.22, 0.03  # of a crop: of a gate in it that is to be found, and beside its corners
_NEARLY = 0.5  # of a gate's size
BEST_RATE, LEAST_RATE = 3e-3, 1e-5


def _conv(inputs: int, outputs: int, stride: int = 2) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU())


class JudgeNetwork(nn.Module):
    """From crops, BGR 0..1, shape (n, 3, ROWS, COLUMNS), to numbers, 1 + 4 * GRID_ROWS * GRID_COLUMNS each.

    The first is the logit of "this is a gate"; then, for the upper left, upper right, lower right and lower
    left corner, how likely it is in each cell of a grid, row by row, as logits of one softmax.
    """

    def __init__(self) -> None:
        super().__init__()
        self.fine = nn.Sequential(_conv(3, 12), _conv(12, 24), _conv(24, 24, stride=1))
        self.coarse = nn.Sequential(_conv(24, 40), _conv(40, 40, stride=1))
        self.chance = nn.Sequential(
            nn.Flatten(), nn.Linear(40 * (ROWS // 8) * (COLUMNS // 8), 32), nn.ReLU(), nn.Linear(32, 1)
        )
        self.spread = nn.Conv2d(40, 24, 1)
        self.corners = nn.Sequential(_conv(24, 24, stride=1), nn.Conv2d(24, 4, 1), nn.Flatten())

    def forward(self, crops: Tensor) -> Tensor:
        """The numbers of crops."""
        fine = self.fine(crops)
        coarse = self.coarse(fine)
        spread = functional.interpolate(self.spread(coarse), scale_factor=2.0, mode="nearest")
        return torch.cat([self.chance(coarse), self.corners(fine + spread)], dim=1)


def draw_crops(
    images: Image, gates: Floats, network: object, stream: np.random.Generator
) -> tuple[Image, Floats]:
    """Draw crops of some images.

    Args:
        images: shape (n, rows, columns, 3).
        gates: of each, as `scenes.rows_of` gives them.
        network: that proposes.
        stream: of random numbers.

    Returns:
        The crops, shape (n, ROWS, COLUMNS, 3), and for each whether it is a gate (1, 0) and its corners, as
        the network gives them.
    """
    crops, targets = [], []
    for n in stream.integers(len(images), size=_IMAGES):
        image, seen = changed(images[n], gates[n][gates[n][:, 0] != 0.0], stream)
        quads = list(GateProposals(image, _LEAST_CHANCE, network).corners)
        quads = [quads[k] for k in stream.permutation(len(quads))[: _OF_AN_IMAGE // 2]]
        for gate in seen:
            if gate[0] > 0.0:
                quads += [_moved(gate[1:].reshape(4, 2), stream) for _ in range(_OF_AN_IMAGE // 4)]
        for quad in quads:
            box = box_around(
                quad + stream.normal(0.0, 0.4, 2), stream.uniform(0.9 * AROUND, 1.1 * FAR_AROUND)
            )
            target = _target(box, seen)
            if target is not None:
                crops.append(cut_out(image, box))
                targets.append(target)
    return np.stack(crops), np.array(targets, np.float32)


class _Crops:
    """Crops that were drawn lately; each is used several times, mirrored and in other colours and light."""

    def __init__(self, pixels: Image, targets: Floats) -> None:
        self._pixels, self._targets = pixels, targets

    def add(self, pixels: Image, targets: Floats, stream: np.random.Generator) -> None:
        """Add crops, in place of random others when there are enough."""
        if len(self._pixels) < _KEPT:
            self._pixels = np.concatenate([self._pixels, pixels])
            self._targets = np.concatenate([self._targets, targets])
        else:
            places = stream.integers(len(self._pixels), size=len(pixels))
            self._pixels[places], self._targets[places] = pixels, targets

    def batch(self, stream: np.random.Generator) -> tuple[Floats, Floats]:
        """Some of them, shape (n, 3, ROWS, COLUMNS), 0..1, and their targets."""
        chosen = stream.integers(len(self._pixels), size=_BATCH)
        pixels, targets = self._pixels[chosen].astype(np.float32), self._targets[chosen]
        mirrored = stream.random(_BATCH) < 0.5
        pixels[mirrored] = pixels[mirrored, :, ::-1]
        corners = targets[mirrored, 1:].reshape(-1, 4, 2)[:, _MIRRORED] * np.array([-1.0, 1.0], np.float32)
        targets[mirrored, 1:] = corners.reshape(-1, 8)
        if stream.random() < 0.3:
            pixels = pixels[..., stream.permutation(3)]
        light = stream.uniform(0.75, 1.25, (_BATCH, 1, 1, 3)) * stream.uniform(0.8, 1.2, (_BATCH, 1, 1, 1))
        pixels = np.clip(pixels * (light / 255.0).astype(np.float32), 0.0, 1.0)
        return np.ascontiguousarray(pixels.transpose(0, 3, 1, 2)), targets


def _moved(corners: Floats, stream: np.random.Generator) -> Floats:
    """A true outline, moved, scaled and its corners displaced, a little or much."""
    spans = np.maximum(corners.max(axis=0) - corners.min(axis=0), 4.0)
    much = stream.uniform(0.0, 1.0) ** 2
    middle = corners.mean(axis=0)
    scale = np.exp(stream.normal(0.0, 0.35 * much, 2))
    moved = middle + (corners - middle) * scale + stream.normal(0.0, 0.25 * much, 2) * spans
    return np.asarray(moved + stream.normal(0.0, 0.05, (4, 2)) * spans, np.float32)


def _target(box: tuple[float, float, float, float], gates: Floats) -> list[float] | None:
    """Whether a crop shows a gate, and where; None if that is not sure."""
    column, row, columns, rows = box
    nearest = None
    for gate in gates:
        corners = (gate[1:].reshape(4, 2) - (column, row)) / (columns, rows) - 0.5
        off = float(np.abs(corners.mean(axis=0)).max())
        if off < _NEARLY and (nearest is None or off < nearest[0]):
            nearest = (off, gate[0] > 0.0, corners)
    if nearest is None:
        return [0.0] * 9
    _, sure, corners = nearest
    spans = corners.max(axis=0) - corners.min(axis=0)
    if sure and np.abs(corners).max() < 0.5 - _MARGIN and spans.min() > _LEAST_SPAN:
        return [1.0, *corners.reshape(-1).tolist()]
    return None


def loss_of(numbers: Tensor, targets: Tensor) -> tuple[Tensor, Tensor]:
    """Cross entropies of "is a gate", and of the cells of its corners where it is one.

    A corner is in the four cells around it by the weights of bilinear interpolation, so the mean of the
    cells' middles by what the network learns is where the corner is.
    """
    is_gate = targets[:, 0]
    judged = functional.binary_cross_entropy_with_logits(numbers[:, 0], is_gate)
    gates = is_gate > 0.5
    places = (targets[gates, 1:].reshape(-1, 4, 2) + 0.5) * torch.tensor([GRID_COLUMNS, GRID_ROWS]) - 0.5
    columns, rows = torch.arange(GRID_COLUMNS), torch.arange(GRID_ROWS)
    across = (1.0 - (places[..., 0, None] - columns).abs()).clamp(min=0.0)
    down = (1.0 - (places[..., 1, None] - rows).abs()).clamp(min=0.0)
    wanted = (down[..., :, None] * across[..., None, :]).flatten(2)
    logs = functional.log_softmax(numbers[gates, 1:].reshape(-1, 4, GRID_ROWS * GRID_COLUMNS), dim=2)
    placed = -(wanted * logs).sum() / (4 * gates.sum()).clamp(min=1)
    return judged, placed


def train(
    data: Path,
    out: Path,
    proposals: Path,
    *,
    seconds: float,
    seed: int,
    start: Path | None = None,
    best_rate: float = BEST_RATE,
    most_steps: int | None = None,
) -> JudgeNetwork:
    """Train for a time, or some steps, and write the network; arguments are as in `train.train`."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    stream = np.random.default_rng(seed)
    images = np.load(data / "images.npy", mmap_mode="r")
    gates = np.load(data / "gates.npy")
    proposing = read_network(proposals)
    network = JudgeNetwork()
    if start is not None:
        network.load_state_dict(torch.load(start))
    optimiser = torch.optim.AdamW(network.parameters(), lr=best_rate, weight_decay=1e-3)
    begun = saved = time.monotonic()
    step, sums = 0, np.zeros(4)
    out.mkdir(parents=True, exist_ok=True)
    with (out / "judge.csv").open("w", encoding="utf-8") as log:
        log.write("seconds,step,crops,judged,corners,right\n")
        seen = 0
        crops = _Crops(*draw_crops(images, gates, proposing, stream))
        while (share := (time.monotonic() - begun) / seconds) < 1.0 and step != most_steps:
            rate = best_rate * min(1.0, share / 0.05) * 0.5 * (1.0 + np.cos(np.pi * share)) + LEAST_RATE
            for group in optimiser.param_groups:
                group["lr"] = rate
            if step % _STEPS == 0:
                crops.add(*draw_crops(images, gates, proposing, stream), stream)
            pixels, targets = (torch.from_numpy(each) for each in crops.batch(stream))
            numbers = network(pixels)
            judged, placed = loss_of(numbers, targets)
            optimiser.zero_grad()
            (judged + 0.5 * placed).backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
            step, seen = step + 1, seen + len(pixels)
            right = ((numbers[:, 0] > 0) == (targets[:, 0] > 0.5)).float().mean()
            sums += (judged.item(), placed.item(), right.item(), 1.0)
            if step % 100 == 0:
                mean = sums / sums[3]
                log.write(
                    f"{time.monotonic() - begun:.0f},{step},{seen},"
                    f"{mean[0]:.4f},{mean[1]:.5f},{mean[2]:.4f}\n"
                )
                log.flush()
                sums[:] = 0.0
            if time.monotonic() - saved > 60.0:
                write(network, out / "judge.onnx")
                saved = time.monotonic()
    write(network, out / "judge.onnx")
    return network


def write(network: JudgeNetwork, path: Path) -> None:
    """Write a network, with its normalisation folded into its weights, for any number of crops."""
    network.eval()
    partial = path.with_suffix(".tmp")
    torch.onnx.export(
        network, (torch.zeros(1, 3, ROWS, COLUMNS),), str(partial), opset_version=13, dynamo=False,
        input_names=["crops"], output_names=["numbers"],
        dynamic_axes={"crops": {0: "count"}, "numbers": {0: "count"}},
    )  # fmt: skip
    partial.replace(path)
    torch.save(network.state_dict(), path.with_suffix(".pt"))
    network.train()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--proposals", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=900.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=Path)
    parser.add_argument("--rate", type=float, default=BEST_RATE)
    options = parser.parse_args()
    train(
        options.data, options.out, options.proposals,
        seconds=options.seconds, seed=options.seed, start=options.start, best_rate=options.rate,
    )  # fmt: skip


if __name__ == "__main__":
    main()
