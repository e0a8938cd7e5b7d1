"""Fixtures of the tests: a device, pictures, a comparison that shows its failures, their order."""

import json
import os

import imageio.v3 as iio
import numpy as np
import pytest
import wgpu

import sampler
import standard
import tiers
from wgmb import gpu, interpreter

np.seterr(all="raise", under="ignore")
collect_ignore = ["blender"]  # test_blender.py runs them in Blender's own Python
if "PYTEST_XDIST_WORKER" in os.environ:  # the workers have shared out the cores already
    os.environ["LP_NUM_THREADS"] = "1"

os.environ.pop("OCIO", None)  # a config of whoever runs the tests
pytest.register_assert_rewrite("viewer_hand")
interpreter.name_runtime_folder()  # as `wgmb` does; the programs that tests start inherit it
standard.record()  # every kernel that a test makes; they are sent through Dawn in the end

# Files that take longest are begun first, so that all workers end at about the same time; those
# whose kernels another file compiles too come last, and find them in the driver's cache.
FIRST = ("test_blender", "test_flow", "test_twins", "test_page", "test_window",
         "test_viewer_controls", "test_viewer_perceived", "test_viewer_pictures", "test_farm",
         "test_faults", "test_interruptions", "test_volume", "test_reference", "test_blur_video",
         "test_perceive", "test_standard")  # fmt: skip
LAST = ("test_flow_repeats", "test_moving_light", "test_docs", "test_experiments", "test_pygfx",
        "test_gather", "test_reach", "test_shot_reader", "test_crowded_tiles",
        "test_flow_lights")  # fmt: skip


def pytest_configure(config):
    config.pluginmanager.register(tiers)


def pytest_collection_modifyitems(items):
    rank = {name: place for place, name in enumerate((*FIRST, None, *LAST))}
    items.sort(key=lambda item: rank.get(item.path.stem, rank[None]))


@pytest.fixture(autouse=True)
def _without_a_gpu(request, monkeypatch):
    """A test that says it is fast opens no adapter."""
    if request.node.get_closest_marker("fast"):
        for name in ("enumerate_adapters_sync", "request_adapter_sync"):
            monkeypatch.setattr(wgpu.gpu, name, lambda *_, **__: pytest.fail("not fast: a GPU"))


@pytest.fixture(scope="session")
def device():
    return gpu.open_device()


@pytest.fixture
def as_without_a_gpu(device, monkeypatch):
    """The ways of software, on any device."""
    monkeypatch.setattr(gpu, "SOFTWARE", device.adapter_info["adapter_type"])


@pytest.fixture
def as_with_a_gpu(monkeypatch):
    """The ways of a GPU, on any device."""
    monkeypatch.setattr(gpu, "SOFTWARE", "no device")


@pytest.fixture(scope="session")
def mixing(device):
    """The greatest error of a colour of 0..1 that this device's sampler mixes of four texels."""
    return 2 * sampler.greatest_error(device)


@pytest.fixture(scope="session")
def noise():
    return np.random.default_rng(1).random((48, 64, 3), "f4")


def difference(got, want) -> tuple[float, float]:
    """Greatest and mean absolute difference; infinite where the shapes or a NaN differ."""
    got, want = np.asarray(got, np.float64), np.asarray(want, np.float64)
    if got.shape != want.shape or not np.isfinite(got).all():
        return float("inf"), float("inf")
    apart = np.abs(got - want)
    return float(apart.max()), float(apart.mean())


@pytest.fixture
def close(tmp_path):
    """close(got, want, atol): on failure the pictures and 8 x their difference are kept."""

    def check(got, want, atol: float):
        most, mean = difference(got, want)
        if most <= atol:
            return
        for name, picture in (("got", got), ("want", want)):
            _show(tmp_path / f"{name}.png", np.asarray(picture, np.float64))
        if np.shape(got) == np.shape(want):
            _show(tmp_path / "difference.png", 8 * np.abs(np.asarray(got, "f8") - want))
        pytest.fail(
            f"differ by up to {most:.3g}, {mean:.3g} in the mean, allowed {atol:g}: {tmp_path}"
        )

    return check


def _show(path, picture):
    plane = np.nan_to_num(np.atleast_3d(picture))[..., :3]
    if plane.shape[2] == 2:
        plane = np.dstack([plane, 0 * plane[..., :1]])
    iio.imwrite(path, (255 * np.clip(plane, 0, 1)).astype("u1").squeeze())


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """A worker of xdist has ended: take over the kernels that it recorded."""
    for key, row in json.loads(getattr(node, "workeroutput", {}).get("kernels", "[]")):
        standard.recorded[json.dumps(key)] = row


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """All kernels that were made keep to the standard; if not, the session has failed."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["kernels"] = json.dumps(list(standard.recorded.items()))
        return
    lines, failed = standard.verdict()
    session.config.stash[_VERDICT] = lines
    if failed:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


_VERDICT = pytest.StashKey[list[str]]()


def pytest_terminal_summary(terminalreporter, config):
    if lines := config.stash.get(_VERDICT, []):
        terminalreporter.section("kernels by the standard")
        for line in lines:
            terminalreporter.write_line(line)
