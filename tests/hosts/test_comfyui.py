"""The ComfyUI pack with a stand-in for ComfyUI: its schema, images, videos, stops and errors."""

import asyncio
import importlib
import io
import json
import re
import sys
import threading
import tomllib
from fractions import Fraction
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

import fake_comfy
import make_clips
import make_frames
import wgmb
from fake_comfy import tensor
from wgmb.gpu import device as devices
from wgmb.gpu import kernels
from wgmb.video.read.reader import VideoReader

PACK = Path(__file__).parents[2] / "comfyui"
SIZE, COUNT = (97, 55), 5  # odd


@pytest.fixture
def server(monkeypatch, tmp_path):
    return fake_comfy.install(monkeypatch, str(tmp_path / "temp"))


@pytest.fixture
def pack(server, monkeypatch):
    """The pack, loaded as ComfyUI does: from a folder of any name."""
    name = "custom_nodes.some-name"
    spec = spec_from_file_location(
        name, PACK / "__init__.py", submodule_search_locations=[str(PACK)]
    )
    module = module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, f"{name}.nodes", raising=False)
    spec.loader.exec_module(module)
    yield importlib.import_module(f"{name}.nodes")
    sys.modules.pop(f"{name}.nodes", None)


def nodes_of(pack):
    entry = sys.modules[pack.__package__].comfy_entrypoint
    nodes = asyncio.run(asyncio.run(entry()).get_node_list())
    return {node.define_schema().node_id: node.define_schema() for node in nodes}


def images(count=COUNT):
    y, x = np.mgrid[: SIZE[1], : SIZE[0]].astype(np.float32)
    tones = [make_frames.texture(x - 4.0 * n, y) for n in range(count)]
    return tensor(np.clip(np.stack(tones), 0, 1).astype(np.float32))


GIVEN = {"shutter": 180.0, "fps_out": 0.0, "flow": "none", "curve": "box"}


def test_the_schema_has_what_a_user_sets(pack):
    schemas = nodes_of(pack)
    assert list(schemas) == ["WgmbMotionBlur", "WgmbMotionBlurVideo"]
    ports = {port.id: port for port in schemas["WgmbMotionBlur"].inputs}
    assert list(ports) == ["images", "shutter", "fps_in", "fps_out", "flow", "curve", "holdout"]
    assert (ports["shutter"].said["default"], ports["shutter"].said["max"]) == (180, 1440)
    assert ports["holdout"].said["optional"]
    outputs = [(port.io_type, port.display_name) for port in schemas["WgmbMotionBlur"].outputs]
    assert outputs == [("IMAGE", "images"), ("FLOAT", "fps")]
    for schema in schemas.values():
        ids = [port.id for port in [*schema.inputs, *schema.outputs]]
        assert len(set(ids)) == len(ids) and all(ids)


def test_images_are_those_of_blur_pictures_at_the_other_rate(pack, server):
    given = images()
    made, fps = pack.MotionBlur.execute(given, **GIVEN | {"flow": "dis", "fps_out": 60.0},
                                        fps_in=24.0)  # fmt: skip
    want = wgmb.blur_pictures(given.numpy(), fps_in=24, fps=60, flow="dis", shutter=180)
    np.testing.assert_array_equal(made, np.stack(list(want)))
    assert (len(made), fps) == (13, 60.0)
    (bar,) = server.bars
    assert (bar.done, bar.total) == (13, 13)


def test_a_mask_stays_sharp_and_a_curve_counts(pack):
    given, mask = images(), np.zeros((1, *SIZE[::-1]), np.float32)
    mask[:, :, 40:] = 1
    how = GIVEN | {"flow": "dis", "shutter": 360.0}
    made, fps = pack.MotionBlur.execute(given, **how, fps_in=24.0, holdout=tensor(mask))
    assert fps == 24.0
    np.testing.assert_allclose(made[2][:, 48:], given[2][:, 48:], atol=1e-3)
    assert np.abs(made[2][:, :30] - given[2][:, :30]).max() > 0.02
    other, _ = pack.MotionBlur.execute(given, **how | {"curve": "triangle"}, fps_in=24.0)
    assert np.abs(other[2][:, :30] - made[2][:, :30]).max() > 0.005


@pytest.mark.parametrize("source", ["path", "bytes", "part"])
def test_a_file_becomes_a_file_with_its_sound(pack, server, tmp_path, source):
    path = make_clips.write(tmp_path / "in.mp4", tone=0.5)
    given = io.BytesIO(path.read_bytes()) if source == "bytes" else str(path)
    trim = (0.125, 0.25) if source == "part" else (0.0, 0.0)
    video = fake_comfy.VideoFromFile(given, trim)
    (made,) = pack.MotionBlurVideo.execute(video, **GIVEN | {"fps_out": 12.0})
    result = VideoReader(made.get_stream_source())
    assert len(result) == (3 if source == "part" else 6) and result.rate == 12
    assert [stream.kind for stream in result.streams] == ["audio"]
    assert server.bars[0].done == len(result)
    assert Path(made.get_stream_source()).is_relative_to(tmp_path / "temp")


def test_frames_of_a_video_become_frames_with_its_sound(pack):
    sound = {"waveform": object(), "sample_rate": 48000}
    parts = fake_comfy.VideoComponents(images(), Fraction(24000, 1001), sound, {"a": "b"})
    (made,) = pack.MotionBlurVideo.execute(fake_comfy.VideoFromComponents(parts), **GIVEN)
    found = made.get_components()
    assert (found.frame_rate, found.audio, found.metadata) == (parts.frame_rate, sound, {"a": "b"})
    assert found.images.shape == parts.images.shape


@pytest.fixture
def own_device():
    """Devices that are opened in the test alone."""
    devices._device.cache_clear()
    yield
    devices._device.cache_clear()
    kernels.forget_kernels()


def test_a_lost_gpu_ends_one_run_and_the_next_one_has_a_new_one(
    pack, own_device, monkeypatch, tmp_path
):
    def lose(bar, count):
        pack.device().destroy()

    video = fake_comfy.VideoFromFile(str(make_clips.write(tmp_path / "in.mp4")))
    with monkeypatch.context() as patched:
        patched.setattr(pack.ProgressBar, "update", lose)
        with pytest.raises(wgmb.DeviceError, match="lost"):
            pack.MotionBlur.execute(images(30), **GIVEN, fps_in=24.0)
    assert pack.MotionBlur.execute(images(), **GIVEN, fps_in=24.0)[0].shape == images().shape
    pack.device().destroy()
    (made,) = pack.MotionBlurVideo.execute(video, **GIVEN)
    assert len(VideoReader(made.get_stream_source())) == 12


def test_a_stop_is_heard_while_a_picture_is_being_made(pack, server, monkeypatch):
    server.stops_after = 3
    goes_on, ended = threading.Event(), threading.Event()

    def slow(pictures, **settings):
        def made():
            try:
                for picture in pictures:
                    goes_on.wait(30)
                    yield picture
            finally:
                ended.set()

        run = made()
        return type("Run", (), {
            "how": "", "count": lambda self, n: n, "__iter__": lambda self: run,
            "close": lambda self: run.close(),
        })()  # fmt: skip

    monkeypatch.setattr(wgmb, "blur_pictures", slow)
    with pytest.raises(fake_comfy.InterruptError):
        pack.MotionBlur.execute(images(50), **GIVEN, fps_in=24.0)
    assert not ended.is_set()
    goes_on.set()
    assert ended.wait(30), "the work goes on although nobody wants it"


def test_errors_of_the_work_arrive(pack):
    with pytest.raises(wgmb.InputError, match="picture 0 must be"):
        pack.MotionBlur.execute(tensor(np.zeros((3, 8, 8, 2), np.float32)), **GIVEN, fps_in=24.0)


def test_a_container_without_vulkan_is_told_the_remedy(pack, monkeypatch):
    def none():
        raise wgmb.DeviceError("no GPU adapter; found none")

    monkeypatch.setattr(wgmb.gpu, "open_device", none)
    with pytest.raises(RuntimeError, match=r"found none\. .*NVIDIA_DRIVER_CAPABILITIES=all"):
        pack.MotionBlur.execute(images(), **GIVEN, fps_in=24.0)


def test_the_pack_is_of_wgmbs_version_and_brings_no_opencv():
    project = tomllib.loads((PACK / "pyproject.toml").read_text())
    assert project["project"]["version"] == wgmb.__version__
    assert project["project"]["dependencies"] == [f"wgmb[video] == {wgmb.__version__}"]
    own = tomllib.loads((PACK.parent / "pyproject.toml").read_text())["project"]
    needs = own["dependencies"] + own["optional-dependencies"]["video"]
    assert not [line for line in needs if re.match("opencv|torch", line)]
    assert (PACK / "LICENSE").read_text() == (PACK.parent / "LICENSE").read_text()
    name = project["project"]["name"]
    assert re.fullmatch(r"[a-z](-?[a-z0-9])+", name) and "comfyui" not in name


@pytest.mark.parametrize("path", sorted((PACK / "example_workflows").glob("*.json")),
                         ids=lambda path: path.stem)  # fmt: skip
def test_the_examples_fit_the_nodes(pack, path):
    flow, schemas = json.loads(path.read_text()), nodes_of(pack)
    by_number = {node["id"]: node for node in flow["nodes"]}
    for number, source, out, target, into, kind in flow["links"]:
        output = by_number[source]["outputs"][out]
        entry = by_number[target]["inputs"][into]
        assert number in output["links"] and entry["link"] == number
        assert output["type"] == entry["type"] == kind
    own = [node for node in flow["nodes"] if node["type"] in schemas]
    assert own
    for node in own:
        schema = schemas[node["type"]]
        widgets = [port for port in schema.inputs if port.io_type in ("FLOAT", "COMBO")]
        for port, value in zip(widgets, node["widgets_values"], strict=True):
            known = port.said.get("options")
            assert value in known if known else port.said["min"] <= value <= port.said["max"]
        assert {entry["name"] for entry in node["inputs"]} <= {port.id for port in schema.inputs}
        outputs = [(port.display_name, port.io_type) for port in schema.outputs]
        assert [(port["name"], port["type"]) for port in node["outputs"]] == outputs
