"""Every method honours the same small contract, checked without knowing any of them."""

import inspect

import pytest

import wgmb
from wgmb.gpu import wgsl

pytestmark = pytest.mark.fast


@pytest.mark.parametrize("name", sorted(wgmb.METHODS))
def test_contract(name):
    method = wgmb.METHODS[name]
    assert method.name == name
    assert method.__module__ == f"wgmb.methods.{name}"
    assert method.needs
    assert method.needs <= {"color", "motion", "depth", "scene"}
    assert method.uses <= {
        "neighbours", "depth", "normal", "progress",
        "diffuse_light", "diffuse_color", "glossy_light", "glossy_color",
    }  # fmt: skip
    assert list(inspect.signature(method.encode).parameters) == [
        "self", "encoder", "inputs", "output",
    ]  # fmt: skip
    folder = wgsl.ROOT / "methods"
    for shader in [folder / f"{name}.wgsl", *(folder / name).rglob("*.wgsl")]:
        assert not shader.exists() or shader.read_text().startswith("// ")
    public = {n for n in vars(method) if not n.startswith("_")}
    if "confidence" in public:  # a name for each channel of what it shows then
        red, green, blue, alpha = method.confidence
        assert len({red, green, blue, alpha}) == 4
    optional = {
        "samples", "adaptive", "quick", "confidence", "most_in_software", "spread", "margin",
        "bend", "repeats", "steps", "finds",
    }  # fmt: skip
    assert public - optional == {
        "name",
        "needs",
        "uses",
        "Options",
        "encode",
    }
    assert "Artefacts:" in (method.__doc__ or "")


def test_every_shader_of_a_method_belongs_to_one():
    files = {p.stem.split("_")[0] for p in (wgsl.ROOT / "methods").iterdir()}
    shared = {"five"}  # by tap and reproject
    assert files == set(wgmb.METHODS) | shared
