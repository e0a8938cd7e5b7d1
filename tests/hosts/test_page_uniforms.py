"""The page's uniforms.js: the bytes that Python computes, in node, without a GPU."""

import base64
import json
import shlex
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

import page_export
import parts
import standard
from wgmb import gpu, scene
from wgmb.cli import app
from wgmb.gpu import wgsl
from wgmb.gpu_frame.bindings import FrameConstants
from wgmb.methods import volume
from wgmb.scene.gbuffer import SceneOnGpu
from wgmb.settings import size_of
from wgmb.shutter import CURVES, Shutter

pytestmark = pytest.mark.fast
STATES = 200
RELATIVE = 1e-6  # where sine, exponential or power of the two differ in the last bit of a double
TYPES = {
    "frame": ("common/frame.wgsl", "Frame"),
    "shutter": ("common/shutter.wgsl", "Shutter"),
    "scene": ("methods/volume.wgsl", "Volumes"),
}


def states() -> list[dict]:
    """Random ones, the edges among them more often than by chance."""
    rng = np.random.default_rng(16)

    def some(*edges, low: float, high: float) -> float:
        if rng.random() < 0.3:
            return float(rng.choice(edges))
        return float(rng.uniform(low, high))

    phases = ("start", "centre", "end")
    return [
        {
            "time": some(0, 7.5, 0.0625, 50, -25, low=-10, high=110),
            "camera": [some(0, low=-7, high=7), some(0, -1, 0.75, low=-1, high=0.75)],
            "density": str(rng.choice(["exact", "published"])),
            "fps": some(24, 25, 30, 60, 23.976, low=1, high=120),
            "width": int(rng.integers(1, 700)),
            "height": int(rng.integers(1, 400)),
            "samples": int(some(4, 8, 16, 32, low=1, high=300)),
            "number": int(rng.integers(-5, 2000)),
            "jitter": some(0, 1, low=0, high=1),
            "maxBlur": None if rng.random() < 0.5 else some(0, 64, low=0, high=500),
            "shutter": {
                "curve": str(rng.choice(list(CURVES))),
                "degrees": some(0, 180, 288, 360, 720, 1440, low=0, high=1440),
                "phase": some(0, low=-2, high=2) if rng.random() < 0.3 else str(rng.choice(phases)),
            },
        }
        for _ in range(STATES)
    ]


class Recorder:
    """In place of a device: a buffer is its bytes."""

    def create_buffer_with_data(self, *, data, label="", usage=0) -> bytes:
        return np.ascontiguousarray(data).tobytes()


def group_zero(state: dict) -> dict[str, bytes]:
    """The buffers that Blur binds for every pass."""
    samples, jitter, max_blur = state["samples"], state["jitter"], state["maxBlur"]
    constants = FrameConstants(Recorder(), samples, samples, jitter, max_blur)
    constants.expose(Shutter(**state["shutter"]))
    return constants.bindings((state["width"], state["height"]), state["number"]).resources


def kernel(shown: scene.Scene, shutter: Shutter, time: float, fps: float, size, monkeypatch):
    """Overrides, buffers and size of the dispatch of the method "volume", if all tiles were one."""
    made = []

    def every_tile(data, count, size, edges):
        rows, columns = (-(-n // edge) for n, edge in zip(size[::-1], edges[::-1], strict=True))
        return np.full((rows, columns), volume.CLOUD | volume.SHADOW)

    def remembered(device, file, texels=None, **constants):
        def run(encoder, entry, bindings, over, **buffers):
            arrays = {k: v.tobytes() for k, v in buffers.items() if isinstance(v, np.ndarray)}
            made.append((constants, buffers | arrays, over))

        return SimpleNamespace(run=run)

    monkeypatch.setattr(volume, "tile_kinds", every_tile)
    monkeypatch.setattr(volume.gpu, "kernel", remembered)
    on_gpu = SceneOnGpu(
        Recorder(), shown, size=size, time=time, fps=fps, span=shutter.span, antialias=1
    )
    inputs = SimpleNamespace(scene=on_gpu, shutter=shutter, bindings=gpu.FrameBindings(size, {}))
    volume.Volume(Recorder(), volume.Volume.Options()).encode(None, inputs, None)
    monkeypatch.undo()
    ((constants, buffers, size),) = made
    del buffers["output"]
    return constants, buffers, size


def kernel_of(state: dict, monkeypatch):
    """The kernel of a state."""
    shown = scene.make(
        "torusphere", cam_x=state["camera"][0], cam_y=state["camera"][1], density=state["density"]
    )
    size = state["width"], state["height"]
    return kernel(
        shown, Shutter(**state["shutter"]), state["time"], state["fps"], size, monkeypatch
    )


@pytest.fixture(scope="module")
def answers():
    """The bytes that JavaScript makes of the states."""
    if (node := standard.node_path()) is None:
        pytest.skip("node is missing")
    given = json.dumps({"exported": page_export.exported(), "states": states()})
    done = subprocess.run(
        [node, "uniforms.mjs"], input=given, cwd=standard.HERE, capture_output=True, text=True,
        timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return list(zip(states(), json.loads(done.stdout), strict=True))


def decoded(answer: dict) -> dict[str, bytes]:
    return {name: base64.b64decode(text) for name, text in answer["bytes"].items()}


def leaves(array: np.ndarray, name: str):
    """Every plain field of a structured array, with its name."""
    if array.dtype.names is None:
        yield name, np.ravel(array)
        return
    for field in array.dtype.names:
        yield from leaves(array[field], f"{name}.{field}")


def check_same(got: bytes, want: bytes, name: str) -> None:
    """The same bytes, but that floats may differ by RELATIVE."""
    assert len(got) == len(want), name
    if got == want:
        return
    dtype = wgsl.load(TYPES[name][0]).dtype(TYPES[name][1]) if name in TYPES else "<f4"
    pairs = zip(
        leaves(np.frombuffer(got, dtype), name),
        leaves(np.frombuffer(want, dtype), name),
        strict=True,
    )
    for (field, a), (_, b) in pairs:
        if b.dtype.kind == "f" and np.isfinite(b).all():
            np.testing.assert_allclose(a, b, rtol=RELATIVE, atol=0, err_msg=field)
        else:
            np.testing.assert_array_equal(a, b, err_msg=field)


def test_every_buffer_has_the_bytes_that_python_makes(answers, monkeypatch):
    equal = total = 0
    for state, answer in answers:
        got = decoded(answer)
        constants, buffers, size = kernel_of(state, monkeypatch)
        want = buffers | group_zero(state)
        assert got.keys() == want.keys()
        for name in want:
            check_same(got[name], want[name], name)
        equal += sum(got[name] == want[name] for name in want)
        total += len(want)
        assert answer["constants"] == {k: float(v) for k, v in constants.items()}
        edges = page_export.shader("methods/volume.wgsl")["workgroup"]
        assert [n // edge for n, edge in zip(size, edges, strict=True)] == answer["groups"]
    assert equal > 0.97 * total  # the rest are last bits


def test_the_states_reach_what_differs(answers):
    """Fast and slow, one volume and two, tables and closed forms: none was left out by chance."""
    kernels = [answer["constants"] for _, answer in answers]
    for name in ("MANY", "EXACT", "CURVE", "ORBITS", "TORI"):
        assert len({k[name] for k in kernels}) > 1, name
    assert any(k["MANY"] and k["CURVE"] == 2 for k in kernels)


def understood(program, line: str) -> dict:
    """The settings of a command line."""
    words = shlex.split(line)[1:]
    bound = program.parse_args(words, exit_on_error=False, print_error=False)[1]
    bound.apply_defaults()
    return bound.arguments


def test_the_page_has_its_shaders_and_their_layouts():
    exported = page_export.exported()
    assert json.loads(json.dumps(exported, allow_nan=False)) == exported
    shaders = exported["shaders"]
    assert {"methods/tap.wgsl", "methods/volume.wgsl", "viewer/draw/compose.wgsl"} <= shaders.keys()
    for name, one in shaders.items():
        assert one["entryPoints"] or (one["vertex"] and one["fragment"]), name
        assert one["files"][0] == [name, 1]
        for group in one["groups"]:
            kinds = {"buffer", "texture", "storageTexture", "sampler"}
            assert all(len(kinds & entry.keys()) == 1 for entry in group), name
    assert shaders["methods/tap.wgsl"]["aliases"] == {"output": "Output"}
    row = shaders["methods/volume.wgsl"]["structs"]["Volumes"]["fields"]["volumes"]
    assert (row["array"], row["of"]["fields"]["turning"]["fields"]["sum"]["type"]) == ([16], "u32")
    assert list(page_export.exported("gpu_frame/holdout.wgsl")["shaders"]) == [
        "gpu_frame/holdout.wgsl"
    ]


def test_command_lines_make_the_same_bytes(answers, monkeypatch):
    program = app.make_app("render", "blur")
    step = 8 if parts.TIER != "all" else 1
    for state, answer in answers[::step]:
        render, blur = (understood(program, line) for line in answer["lines"])
        what, output = render["options"], render["output"]
        fps = float(output.rate)
        shown = what.make("torusphere")
        ((_, time),) = what.moments(fps).items()
        shutter = render["shutter"].resolved(shown, fps).make()
        told = kernel(shown, shutter, time, fps, size_of(what.size), monkeypatch)
        assert told == kernel_of(state, monkeypatch)
        assert render["blur"].resolved(shown).method == "volume"
        assert blur["shutter"].resolved().make() == shutter
        options = blur["blur"]
        assert (options.method, options.samples, options.jitter) == (
            "tap",
            state["samples"],
            state["jitter"],
        )
        assert options.max_blur == state["maxBlur"]
