"""Training of the network that proposes gates, and the data that it is trained on."""

import numpy as np
import pytest

from framerunner.vision_evaluation.camera_chain import CameraChain
from framerunner.vision_evaluation.labelled_images import labelled_images
from scenarios.random_scenarios import load_level
from training.gates.samples import CELL_PX, OFFSET_PX, draw_batch
from training.gates.scenes import MAX_GATES, rows_of

SIZE = (128, 160)


@pytest.fixture(scope="module")
def data():
    shown = list(labelled_images(load_level("calm"), 25, 3, CameraChain()))
    return np.stack([one.image for one in shown]), np.stack([rows_of(one) for one in shown])


def test_the_targets_are_where_the_gates_are(data):
    images, gates = data
    assert gates.shape == (25, MAX_GATES, 9)
    batch = draw_batch(images, gates, 60, SIZE, np.random.default_rng(1))
    centres = np.argwhere(batch.heat == 1.0)
    assert len(centres) > 20
    for k, row, column in centres:
        offsets = OFFSET_PX * batch.offsets[k, :, row, column].reshape(4, 2)
        # Upper left, upper right, lower right, lower left around a centre in this cell, also when mirrored.
        assert np.abs(offsets.mean(axis=0)).max() <= 0.5 * CELL_PX + 0.51
        assert (offsets[[1, 2], 0] > offsets[[0, 3], 0]).all()
        assert (offsets[[2, 3], 1] > offsets[[1, 0], 1]).all()


def test_it_trains(data, tmp_path):
    pytest.importorskip("torch")
    pytest.importorskip("onnx")
    from training.gates.train import train

    images, gates = data
    np.save(tmp_path / "images.npy", images)
    np.save(tmp_path / "gates.npy", gates)
    train(tmp_path, tmp_path / "out", seconds=60.0, seed=1, most_steps=2)
    assert (tmp_path / "out" / "gates.onnx").stat().st_size < 2_000_000
