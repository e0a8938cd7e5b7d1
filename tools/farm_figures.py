"""Figures of farms: what sharing a shot costs, what a killed worker loses, and 64 workers at once.

    python tools/farm_figures.py               all of them; takes minutes
    python tools/farm_figures.py share kill    some: share, work, kill, farm
    python tools/farm_figures.py farm --frames 5000 --workers 16

share: 1,000 frames of 64 x 48 on two workers, CPU over that of one process (wanted: at most 1.2).
work: CPU of one process over that of two workers, from about 20 s of work a worker on (0.9).
kill: kill -9 of a worker at a random moment, 20 times: complete, the same bytes, nothing left over.
farm: a simulated farm whose workers wait as for a GPU: the scheduler's share, the driver's memory.

CPU is user and system time from the opening of the GPU on, compiled shaders included; the second
pair of figures is of all processes from their start to their end. Wall times depend on what else
the machine does.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import hashlib
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "made"), str(ROOT / "tools")]

import measured_farm  # noqa: E402

import make_frames as make  # noqa: E402


def shot(folder: Path, count: int, scale: int = 1) -> str:
    """Frames of 64 x 48 pixels, or `scale` times as wide and high, that are three pictures."""
    folder.mkdir(parents=True)
    for n in range(1, 4):
        channels = {k: v.repeat(scale, 0).repeat(scale, 1) for k, v in make.frame(n).items()}
        make.write_exr(folder / f"of.{n}.exr", channels)
    for n in range(1, count + 1):
        (folder / f"s.{n:04d}.exr").hardlink_to(folder / f"of.{(n - 1) % 3 + 1}.exr")
    return str(folder / "s.####.exr")


def adopt() -> None:
    """Become the parent of processes whose own has ended, so that their CPU is counted."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER


def own_children() -> set[int]:
    """The children of this process."""
    tasks = Path("/proc/self/task").iterdir()
    return {int(child) for task in tasks for child in (task / "children").read_text().split()}


def blurred(pattern: str, out: Path, *more: object) -> float:
    """Run `wgmb blur`; returns the CPU seconds of all its processes, from start to end."""
    adopt()
    others = own_children()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    line = [sys.executable, "-P", "-m", "wgmb", "blur", pattern, "-o", out / "o.####.exr", "-q"]
    line += ["--vectors", "blender", *more]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    subprocess.run(list(map(str, line)), check=True, env=env)
    while orphans := own_children() - others:
        with contextlib.suppress(ChildProcessError):
            os.waitpid(orphans.pop(), 0)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def digest(folder: Path) -> str:
    """Of all files in a folder, with their names."""
    found = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        found.update(path.name.encode() + b"\0" + path.read_bytes())
    return found.hexdigest()[:12]


def compare(what: str, folder: Path, pattern: str, method: str) -> None:
    """Print the CPU of two workers beside that of one process, with and without starting them."""
    from wgmb.farm.farm import Farm, as_farm_job

    whole = blurred(pattern, folder / "a", "--method", method)
    shared = blurred(pattern, folder / "b", "--method", method, "--workers", 2)
    job = measured_farm.job_of(pattern, folder / "one", method)
    cpu = time.process_time()
    job.run()()
    one = time.process_time() - cpu
    log = folder / "cpu"
    os.environ["WGMB_STUB_LOG"] = str(log)
    job = as_farm_job(measured_farm.job_of(pattern, folder / "two", method))
    Farm(workers=2, plugin=measured_farm.Timed).blur(job)
    each: dict[str, list[float]] = {}
    for line in log.read_text().splitlines():
        process, seconds = line.split()
        each.setdefault(process, []).append(float(seconds))
    two = sum(map(max, each.values()))
    tasks = sum(map(len, each.values())) - len(each)
    same = len({digest(folder / name) for name in ("a", "b", "one", "two")}) == 1
    print(
        f"{what}: one process {one:.1f} s CPU, two workers {two:.1f} s "
        f"({two / len(each):.0f} s each, {tasks} parts): {two / one:.2f} times, "
        f"{one / two:.2f} of it work; with starting Python, dask and the GPU: {whole:.1f} s and "
        f"{shared:.1f} s; {'same bytes' if same else 'OTHER BYTES'}",
        flush=True,
    )


def share(folder: Path) -> None:
    """1,000 small frames on two workers."""
    pattern = shot(folder / "in", 1000)
    compare("share  1,000 frames 64 x 48, tap", folder, pattern, "tap")


def work(folder: Path) -> None:
    """More work a worker."""
    for count in (60, 320):
        base = folder / str(count)
        pattern = shot(base / "in", count, scale=6)
        compare(f"work   {count} frames 384 x 288, gather", base, pattern, "gather")


def children(process: int) -> list[int]:
    """The processes that descend from one."""
    found = []
    with contextlib.suppress(FileNotFoundError):  # it has ended
        for task in Path(f"/proc/{process}/task").iterdir():
            for child in map(int, (task / "children").read_text().split()):
                found += [child, *children(child)]
    return found


def kill(folder: Path, times: int = 20) -> None:
    """Workers killed at random."""
    from wgmb.farm.farm import Farm, as_farm_job

    pattern = shot(folder / "in", 96)
    blurred(pattern, folder / "whole", "--method", "tap")
    whole = digest(folder / "whole")
    tally = {"complete": 0, "same bytes": 0, "nothing left over": 0, "killed": 0}
    luck = random.Random(1)
    runs = 0
    while tally["killed"] < times and runs < 10 * times:  # some end before the shot
        runs += 1
        out = folder / f"out{runs}"
        job = as_farm_job(measured_farm.job_of(pattern, out))
        died, begun, over = [], threading.Event(), threading.Event()

        def shoot(wait: float, begun=begun, over=over, died=died) -> None:
            begun.wait()
            if over.wait(wait):
                return
            workers = [p for p in children(os.getpid()) if measured_farm.is_worker(p)]
            if workers:
                os.kill(luck.choice(workers), signal.SIGKILL)
                died.append(1)

        thread = threading.Thread(target=shoot, args=(luck.uniform(0.0, 2.0),))
        thread.start()
        report = Farm(workers=2).blur(job, lambda n, state, begun=begun: begun.set())
        over.set()
        begun.set()
        thread.join()
        tally["killed"] += len(died)
        tally["complete"] += not report.failed and not report.stopped
        names = {p.name for p in out.iterdir()}
        tally["nothing left over"] += not [n for n in names if not n.startswith("o.")]
        tally["same bytes"] += digest(out) == whole
        shutil.rmtree(out)
    told = ", ".join(f"{what} {count}" for what, count in tally.items())
    print(f"kill   of {runs} runs of 96 frames on two workers: {told}", flush=True)


def farm(folder: Path, frames: int, workers: int, seconds: float) -> None:
    """Workers that wait."""
    from wgmb.farm.farm import Farm

    job = measured_farm.long_job(folder, frames)
    memory: list[tuple[int, float]] = []
    done = [0]

    def tick(number: int, state: str) -> None:
        done[0] += 1
        if done[0] % max(frames // 10, 1) == 0:
            memory.append((done[0], measured_farm.memory_of(os.getpid())))

    place = Farm(workers=workers, plugin=measured_farm.Waiting, patience=600)
    os.environ["WGMB_STUB_SECONDS"] = str(seconds)
    started, cpu = time.monotonic(), 0.0

    def first(number: int, state: str) -> None:
        nonlocal started, cpu
        if not done[0]:
            started, cpu = time.monotonic(), time.process_time()
        tick(number, state)

    report = place.blur(job, first)
    took, used = time.monotonic() - started, time.process_time() - cpu
    assert len(report.done) == frames, report
    waited = frames * seconds
    at = ", ".join(f"{count}: {mib:.0f}" for count, mib in memory)
    print(f"farm   {frames} frames of {seconds:g} s on {workers} simulated workers: {took:.0f} s, "
          f"{waited / workers / took:.0%} of it in the workers' waiting; driver and scheduler used "
          f"{used:.1f} s CPU, {used / waited:.2%} of the workers' time, "
          f"{1000 * used / frames:.2f} ms a frame", flush=True)  # fmt: skip
    print(f"farm   memory of driver and scheduler [MiB] after so many frames: {at}", flush=True)


def main() -> None:
    """Print the figures that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", nargs="*", default=["share", "work", "kill", "farm"])
    parser.add_argument("--frames", type=int, default=100_000, help="of farm")
    parser.add_argument("--workers", type=int, default=64, help="of farm")
    parser.add_argument("--seconds", type=float, default=0.1, help="of farm, a frame")
    parser.add_argument("--times", type=int, default=20, help="of kill")
    asked = parser.parse_args()
    for what in asked.what:
        with tempfile.TemporaryDirectory(prefix="wgmb-farm-") as name:
            folder = Path(name)
            if what == "share":
                share(folder)
            elif what == "work":
                work(folder)
            elif what == "kill":
                kill(folder, asked.times)
            elif what == "farm":
                farm(folder, asked.frames, asked.workers, asked.seconds)
            else:
                parser.error(f"{what}: choose share, work, kill, farm")


if __name__ == "__main__":
    main()
