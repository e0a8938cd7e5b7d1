"""Small synthetic frames with known motion, written without wgmb, and the command run on them.

A textured square moves over a textured background, 64 x 48 pixels. `to_prev`, `to_next`
[px, y down] are exact; `written` turns them into the numbers that each program would write.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenEXR

WIDTH, HEIGHT = 64, 48
VELOCITY = (4.0, 2.0)  # pixels per frame, y down
MAX_DISPLACE = 16.0  # of the rsmb convention
COMMAND = [sys.executable, "-P", "-m", "wgmb"]


def texture(x, y, seed: float = 0.0) -> np.ndarray:
    """A colour 0.1..0.9 for every place, alike nowhere else nearby."""
    waves = [np.sin(0.9 * x + 0.37 * y + seed + c) * np.cos(0.53 * y - 0.29 * x + 2 * seed + c)
             for c in (0.0, 1.3, 2.9)]  # fmt: skip
    return (0.5 + 0.4 * np.stack(waves, axis=-1)).astype(np.float32)


def _square(number: int, velocity) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    x0, y0 = (-velocity[i] * number for i in (0, 1))
    own_x, own_y = x + x0, y + y0  # places on the moving thing
    inside = (own_x >= 8) & (own_x < 36) & (own_y >= 8) & (own_y < 32)
    return own_x, own_y, inside


def picture(number: int, velocity=VELOCITY) -> np.ndarray:
    """Frame `number`: (height, width, 4) float32, linear, premultiplied."""
    own_x, own_y, inside = _square(number, velocity)
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    rgb = np.where(inside[..., None], texture(own_x, own_y, 5.0), texture(x, y))
    return np.concatenate([rgb, np.ones((HEIGHT, WIDTH, 1), np.float32)], axis=2)


def motion(number: int, velocity=VELOCITY) -> tuple[np.ndarray, np.ndarray]:
    """Exact to_prev and to_next of frame `number`."""
    _, _, inside = _square(number, velocity)
    to_next = inside[..., None] * np.array(velocity, np.float32)
    return -to_next, to_next


def written(convention: str, to_prev: np.ndarray, to_next: np.ndarray) -> dict[str, np.ndarray]:
    """The channels in which a program would write this motion."""
    (px, py), (nx, ny) = (np.moveaxis(v, 2, 0) for v in (to_prev, to_next))
    none = np.zeros_like(nx)
    return {
        "blender": {"ViewLayer.Vector.X": px, "ViewLayer.Vector.Y": -py,
                    "ViewLayer.Vector.Z": -nx, "ViewLayer.Vector.W": ny},
        "nuke": {"forward.u": nx, "forward.v": -ny, "backward.u": px, "backward.v": -py},
        "arnold": {"motionvector.R": nx, "motionvector.G": -ny, "motionvector.B": none},
        "vray": {"velocity.R": nx + 0.5, "velocity.G": 0.5 - ny, "velocity.B": none + 0.5},
        "rsmb": {"rsmb.R": 0.5 + nx / (2 * MAX_DISPLACE), "rsmb.G": 0.5 - ny / (2 * MAX_DISPLACE)},
        "plain": {"to_prev.x": px, "to_prev.y": py, "to_next.x": nx, "to_next.y": ny},
        "velocity": {"velocity.x": nx, "velocity.y": ny},
    }[convention]  # fmt: skip


def colors(rgba: np.ndarray, layer: str = "", kind=np.float16) -> dict[str, np.ndarray]:
    """The picture's channels."""
    lead = f"{layer}." if layer else ""
    return {lead + c: rgba[..., i].astype(kind) for i, c in enumerate("RGBA"[: rgba.shape[2]])}


def frame(number: int, convention: str | None = "blender", velocity=VELOCITY) -> dict:
    """All channels of a frame as `convention`'s program names them, with depth 10."""
    layer = "ViewLayer.Combined" if convention == "blender" else ""
    channels = colors(picture(number, velocity), layer)
    channels["ViewLayer.Depth.Z" if convention == "blender" else "Z"] = np.full(
        (HEIGHT, WIDTH), 10, np.float32
    )
    if convention is not None:
        channels |= written(convention, *motion(number, velocity))
    return channels


def part(channels: dict, attributes: dict | None = None, *, name: str = "", data=None,
         display=None, compression=OpenEXR.ZIP_COMPRESSION) -> OpenEXR.Part:  # fmt: skip
    """A part of an EXR file; the windows are (left, top, right, bottom)."""
    height, width = next(iter(channels.values())).shape
    data = data or (0, 0, width - 1, height - 1)
    header = {"compression": compression, "type": OpenEXR.scanlineimage} | (attributes or {})
    for key, box in (("dataWindow", data), ("displayWindow", display or data)):
        header[key] = np.array(box[:2], np.int32), np.array(box[2:], np.int32)
    return OpenEXR.Part(header, {k: np.ascontiguousarray(v) for k, v in channels.items()}, name)


def write_exr(path: Path, channels: dict, attributes: dict | None = None, **options) -> Path:
    """One part, one file."""
    return write_parts(path, [part(channels, attributes, **options)])


def write_parts(path: Path, parts: list) -> Path:
    """Several parts, one file."""
    OpenEXR.File(parts).write(str(path))
    return path


def write_sequence(
    folder: Path, numbers, convention: str | None = "blender", velocity=VELOCITY
) -> str:
    """Frames shot.0001.exr, ... in `folder`; the pattern that stands for them."""
    for n in numbers:
        write_exr(folder / f"shot.{n:04d}.exr", frame(n, convention, velocity))
    return str(folder / "shot.####.exr")


def write_depth_sequence(
    folder: Path, numbers=(1, 2, 3), depth: float = 10.0, index: np.ndarray | None = None, **options
) -> Path:
    """Frames c.0001.exr, ... with depth and without vectors; the pattern that stands for them."""
    for n in numbers:
        channels = frame(n, None) | {"Z": np.full((HEIGHT, WIDTH), depth, "f4")}
        if index is not None:
            channels["IndexOB.X"] = index.astype("f4")
        write_exr(folder / f"c.{n:04d}.exr", channels, **options)
    return folder / "c.####.exr"


def plain_read(path: Path) -> dict[str, np.ndarray]:
    """Every channel of a one-part EXR file, read without wgmb."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: c.pixels.copy() for name, c in file.channels().items()}


def plain_header(path: Path, index: int = 0) -> dict:
    """The header of a part, read without wgmb."""
    with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
        return dict(file.parts[index].header)


def projection(width: int = WIDTH, height: int = HEIGHT, angle: float = 60.0) -> np.ndarray:
    """OpenGL perspective, 0.1 to 100, `angle` degrees wide."""
    f = 1 / np.tan(np.radians(angle) / 2)
    near, far = 0.1, 100.0
    return np.array([[f, 0, 0, 0], [0, f * width / height, 0, 0],
                     [0, 0, (far + near) / (near - far), 2 * far * near / (near - far)],
                     [0, 0, -1, 0]])  # fmt: skip


def write_cameras(path: Path, numbers, step: float = 0.5, **more) -> Path:
    """A camera that goes `step` to the right every frame, looking along -z."""
    frames = {}
    for n in numbers:
        world = np.eye(4)
        world[0, 3] = step * n
        frames[str(n)] = {
            "camera_matrix_world": world.tolist(),
            "projection": projection().tolist(),
        } | {k: v(n) for k, v in more.items()}
    path.write_text(json.dumps({"frames": frames}))
    return path


def command(*arguments, env: dict | None = None, **options) -> subprocess.CompletedProcess:
    """`wgmb` as a process of its own."""
    line = [*COMMAND, *map(str, arguments)]
    env = os.environ | (env or {})
    return subprocess.run(line, capture_output=True, text=True, timeout=120, env=env, **options)


def inside(capsys, *arguments) -> tuple[int, str, str]:
    """`wgmb` in this process: exit code, what it said on stdout and on stderr."""
    from wgmb.cli import app

    capsys.readouterr()
    code = app.main([str(a) for a in arguments])
    said = capsys.readouterr()
    return code, said.out, said.err


def names_in(folder: Path) -> list[str]:
    """Names of the files in a folder."""
    return sorted(p.name for p in folder.iterdir())


def add_attributes(path: Path, raw: dict[str, tuple[str, bytes]]) -> Path:
    """Put attributes (name: type, value's bytes) into a one-part scan line file by hand.

    The OpenEXR module can write few types; renderers write them all.
    """
    data = path.read_bytes()
    at = 8
    while data[at]:  # to the end of the header
        kind = data.index(b"\0", at) + 1
        size = data.index(b"\0", kind) + 1
        at = size + 4 + int.from_bytes(data[size : size + 4], "little")
    extra = b"".join(attribute_bytes(name, *rest) for name, rest in raw.items())
    table = np.frombuffer(data, "<u8", 1, at + 1)
    count = (int(table[0]) - at - 1) // 8
    offsets = np.frombuffer(data, "<u8", count, at + 1) + np.uint64(len(extra))
    rest = data[at + 1 + 8 * count :]
    path.write_bytes(data[:at] + extra + b"\0" + offsets.tobytes() + rest)
    return path


def attribute_bytes(name: str, kind: str, value: bytes) -> bytes:
    """An attribute as it stands in a file's header."""
    return f"{name}\0{kind}\0".encode() + len(value).to_bytes(4, "little") + value


def error_lines(err: str) -> list[str]:
    """The message of a command that failed, which is no traceback."""
    assert "Traceback" not in err
    return err.splitlines()


def begun(line, has_begun, **options) -> subprocess.Popen:
    """A run of which `has_begun()` is true, and which has more to do."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    process = subprocess.Popen([*COMMAND, *map(str, line)], text=True, **pipes)
    ends = time.monotonic() + 120
    while not has_begun():
        assert time.monotonic() < ends
        assert process.poll() is None, process.communicate()
        time.sleep(0.002)
    return process


def disc_before_squares(count, speed):
    """Grey pictures (120, 240) uint8 of a disc of noise that moves by `speed` px a picture."""
    y, x = np.mgrid[:120, :240]
    squares = (np.random.default_rng(1).random((12, 24)) * 60).astype(np.uint8)
    squares = np.kron(squares, np.ones((10, 10), np.uint8)) + np.uint8(20)
    noise = (np.random.default_rng(2).random((120, 240)) * 110 + 120).astype(np.uint8)
    for n in range(count):
        is_disc = np.hypot(x - 120 - speed * (n - 2), y - 60) < 22
        yield np.where(is_disc, np.roll(noise, speed * n, axis=1), squares)
