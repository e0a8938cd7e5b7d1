"""The standard: WGSL as Chrome's compiler takes it, and devices without anything beyond it."""

import json

import numpy as np
import pytest

import parts
import standard
import wgmb
from images import crossing, frame_of
from wgmb import Blur, gpu
from wgmb.gpu import wgsl

FILES = sorted(str(p.relative_to(wgsl.ROOT)) for p in wgsl.ROOT.rglob("*.wgsl"))


@pytest.fixture
def dawn():
    parts.need("dawn")
    return standard.compiled


def alone(text: str, name: str = "a.wgsl", files=None) -> dict:
    return {
        "name": name, "files": files or [[name, 1]], "text": text,
        "groups": None, "entryPoints": [], "constants": {},
    }  # fmt: skip


def test_every_file_compiles_alone(dawn):
    sources = [wgsl.load(name) for name in FILES]
    answer = dawn([alone(s.text, s.name, s.files) for s in sources])
    assert answer["texts"] == []
    assert answer["modules"] == len(FILES)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("fn f(a: u32) -> u32 { return a << 1u ^ a; }", "parenthesis"),
        ("fn f() { g(); }", "unresolved"),
        ("fn f() -> u32 { return 1u; let a = 1u; }", "unreachable"),
    ],
)
def test_what_the_standard_refuses_or_warns_of_is_found(dawn, text, said):
    (line,) = dawn([alone(f"\n{text}")])["texts"]
    assert line.startswith("a.wgsl:2:")
    assert said in line


def test_more_than_the_standard_guarantees_is_found(dawn):
    bindings = "".join(
        f"@group(0) @binding({i}) var t{i}: texture_storage_2d<r32float, write>;\n"
        for i in range(5)
    )
    uses = " ".join(f"textureStore(t{i}, vec2u(0), vec4f(0));" for i in range(5))
    text = f"{bindings}@compute @workgroup_size(1, 1)\nfn main() {{ {uses} }}\n"
    source = wgsl.WgslSource(text, (("five.wgsl", 1),))
    answer = dawn([standard.described(source, {})])
    assert any("storage textures" in line for line in answer["texts"])


def test_a_kernel_that_is_made_is_recorded(device):
    gpu.kernel(device, "methods/tap.wgsl", {"Output": "rgba16float"}, CURVED=False)
    rows = [row for row in standard.recorded.values() if row["name"] == "methods/tap.wgsl"]
    (row,) = [r for r in rows if "rgba16float" in r["text"] and r["constants"] == {"CURVED": 0.0}]
    assert row["entryPoints"] == ["main"]
    json.dumps(row)


@pytest.fixture(scope="module")
def plain_device():
    """A device with what the standard guarantees, and no feature."""
    return gpu.choose_adapter().request_device_sync(required_limits=standard.LIMITS)


@pytest.fixture(scope="module")
def filtering_device():
    return gpu.choose_adapter().request_device_sync(
        required_limits=standard.LIMITS, required_features=["float32-filterable"]
    )


IMAGES = [name for name, method in wgmb.METHODS.items() if "scene" not in method.needs]
SCENES = [name for name, method in wgmb.METHODS.items() if "scene" in method.needs]


@pytest.mark.parametrize("method", IMAGES)
def test_image_methods_do_with_what_the_standard_guarantees(
    method, device, filtering_device, plain_device
):
    frame = frame_of([crossing((54, 96), offset) for offset in (0, -1, 1)])
    want = Blur(method, samples=6, device=device)(frame)
    np.testing.assert_array_equal(Blur(method, samples=6, device=filtering_device)(frame), want)
    got = Blur(method, samples=6, device=plain_device)(frame)  # half floats where they are filtered
    assert np.abs(got - want).max() < 4e-3
    assert np.abs(got - want).mean() < 3e-4


@pytest.mark.parametrize("method", [*SCENES, *IMAGES])
def test_scenes_do_with_what_the_standard_guarantees(
    method, device, filtering_device, plain_device
):
    scene = wgmb.scene.make("torusphere" if method == "volume" else "crossing")
    want, filtering, plain = (
        wgmb.Render(scene, Blur(method, samples=4, device=d), size=(64, 36))(0.25)
        for d in (device, filtering_device, plain_device)
    )
    np.testing.assert_array_equal(filtering, want)
    np.testing.assert_allclose(plain, want, atol=4e-3)
