"""A small OpenColorIO config that tests write, colours to show with it, samples of a PNG."""

from pathlib import Path

import numpy as np

from wgmb.io import stills

FILM = """
ocio_profile_version: 2
roles: {{default: {name}, scene_linear: {name}}}
displays:
  Screen:
    - !<View> {{name: Film, colorspace: film}}
    - !<View> {{name: Log, colorspace: log}}
looks:
  - !<Look> {{name: Punchy, process_space: log,
      transform: !<CDLTransform> {{slope: [1.3, 1.2, 1.1]}}}}
colorspaces:
  - !<ColorSpace> {{name: {name}, aliases: [{alias}]}}
  - !<ColorSpace>
    name: log
    from_scene_reference: !<LogCameraTransform>
      {{base: 2, lin_side_break: 0.005, log_side_slope: 0.06, log_side_offset: 0.55,
        lin_side_slope: 1, lin_side_offset: 0.0001}}
  - !<ColorSpace>
    name: film
    from_scene_reference: !<GroupTransform>
      children:
        - !<ColorSpaceTransform> {{src: {name}, dst: log}}
        - !<FileTransform> {{src: film.cube, interpolation: tetrahedral}}
"""


def film_config(folder: Path, name="lin_rec709", alias="Linear Rec.709") -> Path:
    """A config as AgX's is made: a logarithm, then a table of 9 colours a side that mixes them."""
    (folder / "config.ocio").write_text(FILM.format(name=name, alias=alias))
    side = np.linspace(0, 1, 9)
    b, g, r = np.meshgrid(side, side, side, indexing="ij")
    rows = np.stack([r, g, b], axis=3).reshape(-1, 3)
    rows = (0.8 * rows + 0.2 * rows.mean(axis=1, keepdims=True)) ** 1.6
    lines = "\n".join("{:.6f} {:.6f} {:.6f}".format(*row) for row in rows)
    (folder / "film.cube").write_text(f"LUT_3D_SIZE 9\n{lines}\n")
    return folder / "config.ocio"


def light(channels=3, seed=3) -> np.ndarray:
    """Colours of 2^-8 to 2^6, with some that are negative or out of gamut."""
    rng = np.random.default_rng(seed)
    rgba = 2 ** rng.uniform(-8, 6, (40, 50, channels)).astype("f4")
    rgba[:4, :, 1] *= -0.05
    if channels == 4:
        rgba[..., 3] = rng.uniform(0.05, 1, rgba.shape[:2])
        rgba[..., :3] *= rgba[..., 3:]
    return rgba


def samples(path: Path) -> np.ndarray:
    """The integers in a PNG."""
    return stills._read_png(path.read_bytes(), lambda *_: None)
