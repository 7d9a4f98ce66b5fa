"""The network that proposes gates, and its loss.

A small convolutional network of the kind of CenterNet (X. Zhou, D. Wang, P. Krähenbühl, "Objects as points",
2019) on depthwise separable convolutions, with features of five scales added from coarse to fine. For every
cell of 4 x 4 pixels: whether the centre of a gate is there, and where the gate's four corners are from it.
"""

from __future__ import annotations

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

WIDTHS = (8, 16, 24, 32, 48, 64)
"""Channels at 1/2, 1/4, ... 1/64 of the image's size; the last ones see all of an image."""


def _conv(inputs: int, outputs: int, size: int = 3, stride: int = 1, groups: int = 1) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, size, stride, size // 2, groups=groups, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU())


def _separable(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(_conv(inputs, inputs, stride=stride, groups=inputs), _conv(inputs, outputs, size=1))


class GateNetwork(nn.Module):
    """From images, BGR 0..1, shape (n, 3, rows, columns), to maps, shape (n, 9, rows / 4, columns / 4).

    The first map is the logit of "a gate's centre is here"; the others are the offsets right and down of its
    upper left, upper right, lower right and lower left corner from the middle of the cell, in `OFFSET_PX`.
    """

    def __init__(self, widths: tuple[int, ...] = WIDTHS) -> None:
        super().__init__()
        half, quarter, *_ = widths
        self.stem = nn.Sequential(_conv(3, half, stride=2), _separable(half, quarter, stride=2))
        self.first = nn.Sequential(_separable(quarter, quarter), _separable(quarter, quarter))
        self.down = nn.ModuleList(
            nn.Sequential(_separable(one, two, stride=2), _separable(two, two), _separable(two, two))
            for one, two in pairwise(widths[1:])
        )
        self.up = nn.ModuleList(_conv(two, one, size=1) for one, two in pairwise(widths[1:]))
        self.merge = nn.ModuleList(_separable(one, one) for one in widths[1:-1])
        self.head = nn.Sequential(_separable(quarter, 32), nn.Conv2d(32, 9, 1))
        nn.init.constant_(self.head[-1].bias, 0.0)
        with torch.no_grad():
            self.head[-1].bias[0] = -5.0

    def forward(self, images: Tensor) -> Tensor:
        """The maps of images."""
        levels = [self.first(self.stem(images))]
        for down in self.down:
            levels.append(down(levels[-1]))
        coarse = levels[-1]
        for k in reversed(range(len(self.up))):
            fine = levels[k]
            spread = functional.interpolate(self.up[k](coarse), scale_factor=2.0, mode="nearest")
            coarse = self.merge[k](fine + spread[:, :, : fine.shape[2], : fine.shape[3]])
        return self.head(coarse)


def loss_of(
    maps: Tensor, heat: Tensor, weight: Tensor, offsets: Tensor, size: Tensor
) -> tuple[Tensor, Tensor]:
    """Focal loss of the centres (as CornerNet's), and the corners' mean distance by the gate's size.

    Args:
        maps: of the network.
        heat: 1 at centres, falling to 0 around them, shape (n, rows, columns).
        weight: 0 where a centre may be or not, else 1.
        offsets: of the corners, in `OFFSET_PX`, shape (n, 8, rows, columns).
        size: of the gate in the same unit; 0 where there is none.
    """
    logit = maps[:, 0]
    chance = torch.sigmoid(logit).clamp(1e-4, 1.0 - 1e-4)
    centre = (heat > 0.999).float()
    gain = centre * (1 - chance) ** 2 * torch.log(chance)
    miss = (1 - centre) * (1 - heat) ** 4 * chance**2 * torch.log(1 - chance)
    found = -((gain + miss) * weight).sum() / centre.sum().clamp(min=1.0)
    inside = (size > 0).float()
    share = heat * inside
    apart = functional.smooth_l1_loss(maps[:, 1:], offsets, reduction="none", beta=0.02).mean(dim=1)
    placed = (apart / size.clamp(min=0.2) * share).sum() / share.sum().clamp(min=1.0)
    return found, placed
