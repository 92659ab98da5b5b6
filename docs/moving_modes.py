"""Draws docs/modes.gif: two modes of the generated tailgate, side by side, over one period."""

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageSequence

import chladni
from chladni.io.package_files import mesh_path
from chladni.view import paper, scene

DOCS = Path(__file__).parent
MODES = (7, 9)  # the first elastic one, and one of the frame above the window
FRAMES, WIDE = 16, 380  # of each side [px]


def main() -> None:
    """Each mode as ``chladni render --gif`` draws it."""
    model = chladni.load(mesh_path("tailgate_20mm.bdf"), "mm-t-s")
    modal = model.normal_modes(max(MODES))
    motion = model.motion(modal.shapes)
    with tempfile.TemporaryDirectory() as folder:
        sides = [
            _frames(
                scene.mode_gif(
                    Path(folder) / f"{k}.gif", model.seen, motion[:, :, k - 1],
                    modal.frequency[k - 1], f"mode {k}", FRAMES,
                )
            )
            for k in MODES
        ]  # fmt: skip
    tall = max(side[0].shape[0] for side in sides)
    pairs = zip(*sides, strict=True)
    images = [np.concatenate([_padded(one, tall) for one in pair], axis=1) for pair in pairs]
    paper.save_gif(images, DOCS / "modes.gif")


def _frames(path: Path) -> list[np.ndarray]:
    """The pictures of a GIF (height, ``WIDE``, 3)."""
    with Image.open(path) as gif:
        size = (WIDE, round(WIDE * gif.height / gif.width))
        return [
            np.asarray(frame.convert("RGB").resize(size, Image.Resampling.LANCZOS))
            for frame in ImageSequence.Iterator(gif)
        ]


def _padded(image: np.ndarray, tall: int) -> np.ndarray:
    """White below, up to a height."""
    return np.pad(image, ((0, tall - len(image)), (0, 0), (0, 0)), constant_values=255)


if __name__ == "__main__":
    main()
