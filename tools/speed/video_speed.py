"""The cost of `wgmb blur --flow none` beside that of the decoder and the encoder alone.

    python tools/speed/video_speed.py                     a clip made for it: 1080p, 240 to 60
    python tools/speed/video_speed.py clip.mp4 --fps 60   another one
    python tools/speed/video_speed.py --rounds 5          medians of so many rounds; 3 by default

Codecs alone: PyAV decodes every picture of the clip, and encodes the same pictures as wgmb, which
lie in memory, with its settings. Start: wgmb with four pictures. Without the start: the difference
of the two. Kernel: the shader that averages, alone, with its pictures on the device; without a GPU
it runs on the CPU. All in turns, in processes of their own. CPU is user and system time; wall times
depend on what else is running.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import av  # noqa: E402
import numpy as np  # noqa: E402

SIZE, RATE, COUNT = (1920, 1080), 240, 240
# Python keeps what it compiled, as where wgmb is installed.
ENVIRONMENT = {name: value for name, value in os.environ.items()
               if name != "PYTHONDONTWRITEBYTECODE"}  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("clip", nargs="?", type=Path)
    parser.add_argument("--fps", default="60")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--alone", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--kernel", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.alone:
        codecs_alone(*map(Path, given.alone))
    elif given.kernel:
        kernel_alone(Path(given.kernel[0]), int(given.kernel[1]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            compare(given.clip or made(Path(folder, "in.mp4")), Path(folder), given)


def compare(clip: Path, folder: Path, given: argparse.Namespace) -> None:
    """Time everything in turns."""
    exact, scratch = folder / "exact.mkv", folder / "scratch.mp4"
    blur = [
        "-P",
        "-m",
        "wgmb",
        "blur",
        clip,
        "--flow",
        "none",
        "--shutter",
        "360",
        "--fps",
        given.fps,
    ]
    blur += ["--overwrite", "--quiet", "-o"]
    me = Path(__file__)
    lines = {
        "wgmb": [*blur, folder / "wgmb.mp4"],
        "codecs alone": [me, "--alone", clip, exact, scratch],
        "start": [*blur, scratch, "--frames", "0-3"],
        "kernel": [me, "--kernel", clip, given.fps],
    }
    timed([sys.executable, *blur, exact, "--codec", "ffv1"])
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in lines}
    for _ in range(given.rounds):
        for name, line in lines.items():
            taken[name].append(timed([sys.executable, *line]))
    found = {name: [statistics.median(t) for t in zip(*one, strict=True)]
             for name, one in taken.items()}  # fmt: skip
    alone, whole, start = (found[name] for name in ("codecs alone", "wgmb", "start"))
    found["without the start"] = [one - other for one, other in zip(whole, start, strict=True)]
    bits = clip.stat().st_size * 8 / float(length(clip)) / 1e6
    print(
        f"{bits:.0f} Mbit/s\n\n| | CPU [s] | wall [s] | CPU beside codecs | wall |\n"
        "|---|---|---|---|---|"
    )
    for name, (cpu, wall) in found.items():
        print(f"| {name} | {cpu:.2f} | {wall:.2f} | {cpu / alone[0]:.2f} | {wall / alone[1]:.2f} |")


def timed(line: list[object]) -> tuple[float, float]:
    """CPU and wall time of a process [s]; what it prints as numbers instead, if it does."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    run = subprocess.run(
        list(map(str, line)), cwd=ROOT, env=ENVIRONMENT, check=True, capture_output=True, text=True
    )
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if run.stdout:
        cpu, wall = map(float, run.stdout.split())
        return cpu, wall
    return cpu_of(after) - cpu_of(before), wall


def cpu_of(used: resource.struct_rusage) -> float:
    """User and system time."""
    return used.ru_utime + used.ru_stime


def length(clip: Path) -> Fraction:
    """Of a clip [s]."""
    with av.open(str(clip)) as container:
        return Fraction(container.duration or 1, av.time_base)


def codecs_alone(clip: Path, exact: Path, scratch: Path) -> None:
    """Decode the clip, and encode the pictures of `exact`, which were decoded before."""
    from wgmb.video.read.reader import VideoReader
    from wgmb.video.write.encoders import chosen
    from wgmb.video.write.format import VideoFormat
    from wgmb.video.write.writer import VideoWriter

    reader = VideoReader(exact)
    pictures = [picture for _, picture in reader]
    size, rate = reader.size, reader.rate
    form = VideoFormat(chosen(scratch), reader.coding, size, rate, 1 / rate)
    writer = VideoWriter(scratch, scratch.with_suffix(".part.mp4"), form)
    before, began = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    every = 0
    with av.open(str(clip)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        share = len(pictures) / max(1, len(VideoReader(clip)))
        done = 0
        for _ in container.decode(stream):
            every += 1
            while done < min(len(pictures), round(every * share)):
                writer.add(pictures[done], done / reader.rate)
                done += 1
    writer.close()
    after = resource.getrusage(resource.RUSAGE_SELF)
    print(cpu_of(after) - cpu_of(before), time.perf_counter() - began)


def kernel_alone(clip: Path, fps: int) -> None:
    """Average as many pictures as the clip's result has, which stay on the device.

    An exposure begins and ends in the middle of a picture where a frame has an even number.
    """
    from wgmb import gpu
    from wgmb.video.planes import Average
    from wgmb.video.read.reader import VideoReader

    reader = VideoReader(clip)
    count = max(1, round(float(reader.rate) / fps))
    pictures = [picture for _, picture in reader.pictures(0, count - count % 2)]
    shares = [1 / count] * len(pictures)
    if count % 2 == 0:
        shares[0] = shares[-1] = 0.5 / count
    average = Average(gpu.open_device(None))
    average(pictures, shares, reader.coding)
    before, began = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    for _ in range(round(len(reader) / count)):
        average(pictures, shares, reader.coding)
    after = resource.getrusage(resource.RUSAGE_SELF)
    print(cpu_of(after) - cpu_of(before), time.perf_counter() - began)


def made(path: Path) -> Path:
    """A second of a detailed picture that pans, with a sign that stays, and grain."""
    rng = np.random.default_rng(1)
    width, height = SIZE
    world = detailed(rng, height, width + 8 * COUNT)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"preset": "veryfast", "crf": "18"}
        for number in range(COUNT):
            luma = world[:, 4 * number :][:, :width] + rng.integers(-4, 5, (height, width))
            luma[60:120, 60:400] = 235
            rows = np.concatenate([luma, np.full((height // 2, width), 128)])
            frame = av.VideoFrame.from_ndarray(rows.astype(np.uint8), format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def detailed(rng: np.random.Generator, height: int, width: int) -> np.ndarray:
    """(height, width) luma: noise of all sizes."""
    found = np.zeros((height, width), np.float32)
    for size in (1, 2, 4, 8, 16, 32, 64, 128):
        small = rng.random((-(-height // size), -(-width // size)), np.float32)
        found += size**0.5 * np.kron(small, np.ones((size, size), np.float32))[:height, :width]
    found -= found.min()
    return (30 + 190 * found / found.max()).astype(np.int16)


if __name__ == "__main__":
    main()
