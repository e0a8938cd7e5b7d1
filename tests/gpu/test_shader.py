"""WGSL is the one place of truth: Python reads it as the GPU does."""

import itertools
import random
import re
from dataclasses import dataclass

import numpy as np
import pytest
import wgpu

import parts
from wgmb import ShaderError, gpu
from wgmb.gpu import wgsl

LEAVES = ["f32", "u32", "i32", "vec2f", "vec2u", "vec3f", "vec3u", "vec4f", "vec4<i32>", "mat4x4f",
          "array<vec4f, 3>"]  # fmt: skip
FILES = sorted(p.relative_to(wgsl.ROOT).as_posix() for p in wgsl.ROOT.rglob("*.wgsl"))
LONGEST = "gather/layers/layers.wgsl", "gather/search/resolve.wgsl", "methods/volume.wgsl"
ENTERED = [
    pytest.param(f, marks=pytest.mark.full if f.endswith(LONGEST) else ())
    for f in FILES
    if wgsl.load(f).entry_points()
]
ONE = "const WG_X: u32 = 1u;\nconst WG_Y: u32 = 1u;\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(wgsl, "ROOT", tmp_path)
    wgsl.load.cache_clear()
    yield tmp_path
    wgsl.load.cache_clear()


INNER = "struct Inner {\n    a: vec3f,\n    b: u32,\n    c: array<vec4f, 2>,\n}\n"
LEAVES += ["Inner", "array<Inner, 2>"]


def words(kind):
    """WGSL suffixes that read every 32-bit word of a field."""
    if kind == "Inner":
        return [".a.x", ".a.y", ".a.z", ".b"] + [f".c[{i}].{c}" for i in (0, 1) for c in "xyzw"]
    if kind == "array<Inner, 2>":
        return [f"[{i}]{w}" for i in (0, 1) for w in words("Inner")]
    if kind in ("f32", "u32", "i32"):
        return [""]
    if kind.startswith("vec"):
        return [f".{c}" for c in "xyzw"[: int(kind[3])]]
    rows = 4 if kind == "mat4x4f" else 3
    return [f"[{i}].{c}" for i in range(rows) for c in "xyzw"]


def places(kind: np.dtype) -> list[int]:
    """Offsets of every 32-bit word that holds a value [bytes]."""
    if kind.subdtype:
        item, shape = kind.subdtype
        return [i * item.itemsize + at for i in range(np.prod(shape)) for at in places(item)]
    if kind.fields:
        return [offset + at for item, offset in kind.fields.values() for at in places(item)]
    return [0]


def run(device, source, size=(1, 1), **own):
    kernel = gpu.Kernel(device, source)
    encoder = device.create_command_encoder()
    kernel.run(encoder, "main", gpu.FrameBindings(size, {}), **own)
    gpu.submit(device, encoder)


@pytest.mark.parametrize(
    "seed", [*range(75), *(pytest.param(n, marks=pytest.mark.full) for n in range(75, 300))]
)
def test_python_and_gpu_agree_on_struct_layout(device, seed, folder):
    rng = random.Random(seed)
    fields = [(f"m{i}", rng.choice(LEAVES)) for i in range(rng.randint(1, 9))]
    body = "".join(f"    {n}: {k},\n" for n, k in fields)
    reads = [f"p.{name}{w}" for name, kind in fields for w in words(kind)]
    code = "".join(f"    out[{i}] = bitcast<u32>({r});\n" for i, r in enumerate(reads))
    (folder / "probe.wgsl").write_text(
        f"{ONE}{INNER}struct Probe {{\n{body}}}\n@group(1) @binding(0) var<uniform> p: Probe;\n"
        "@group(1) @binding(1) var<storage, read_write> out: array<u32>;\n"
        f"@compute @workgroup_size(1)\nfn main() {{\n{code}}}\n"
    )
    source = wgsl.load("probe.wgsl")
    kind = source.dtype("Probe")
    data, want = np.zeros(kind.itemsize // 4, "<u4"), np.arange(1, len(reads) + 1, dtype="<u4")
    data[[at // 4 for at in places(kind)]] = want
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    out = device.create_buffer(size=4 * len(reads), usage=usage)
    uniform = device.create_buffer_with_data(data=data, usage=wgpu.BufferUsage.UNIFORM)
    run(device, source, p=uniform, out=out)
    assert np.array_equal(np.frombuffer(device.queue.read_buffer(out), "<u4"), want)


FIELDS = (
    ONE + "struct Values {\n    a: f32,\n    b: vec3u,\n    c: array<vec4f, 2>,\n}\n"
    "@group(1) @binding(0) var<uniform> p: Values;\n"
    "@group(1) @binding(1) var<storage, read> q: array<u32>;\n"
    "@group(1) @binding(2) var<storage, read_write> out: array<f32>;\n"
    "@compute @workgroup_size(1)\nfn main() {\n"
    "    let all = array(p.a, f32(p.b.x), f32(p.b.y), f32(p.b.z), p.c[0].x, p.c[0].w, p.c[1].x);\n"
    "    for (var i = 0; i < 7; i++) { out[i] = all[i]; }\n    out[7] = f32(q[1]);\n}\n"
)


@dataclass
class Values:
    a: float
    b: tuple[int, int]


@pytest.mark.parametrize(
    ("given", "want"),
    [
        ({}, [0, 0, 0, 0, 0, 0, 0]),
        ({"a": 2.5, "b": (1, 2, 3)}, [2.5, 1, 2, 3, 0, 0, 0]),
        ({"b": [7], "c": [(4, 0, 0, 5)]}, [0, 7, 0, 0, 4, 5, 0]),  # the first elements alone
        (Values(1.5, (8, 9)), [1.5, 8, 9, 0, 0, 0, 0]),
    ],
)
def test_a_uniform_is_made_of_its_fields_and_a_buffer_of_an_array(device, folder, given, want):
    (folder / "fields.wgsl").write_text(FIELDS)
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    out = device.create_buffer(size=32, usage=usage)
    run(device, wgsl.load("fields.wgsl"), p=given, q=np.array([3, 6], np.uint32), out=out)
    assert np.frombuffer(device.queue.read_buffer(out), "<f4").tolist() == [*want, 6]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"d": 1}, r"p has the fields \['a', 'b', 'c'\], got \['d'\]"),
        (np.zeros(1, np.float32), "p is .*, got float32"),
        (3, "p has the fields .*, got 3"),
    ],
)
def test_fields_that_a_struct_does_not_have_are_errors(device, folder, given, says):
    (folder / "fields.wgsl").write_text(FIELDS)
    with pytest.raises(ShaderError, match=f"fields.wgsl: {says}"):
        run(device, wgsl.load("fields.wgsl"), p=given, q=None, out=None)


def test_a_binding_that_is_nothing_of_a_gpu_is_an_error(device, folder):
    (folder / "fields.wgsl").write_text(FIELDS)
    with pytest.raises(ShaderError, match=r"fields\.wgsl: cannot bind str as q"):
        run(device, wgsl.load("fields.wgsl"), p={}, q="none", out=None)


KINDS = [
    "var x: texture_2d<f32>", "var x: texture_2d<u32>", "var x: texture_2d_array<f32>",
    "var x: texture_2d_array<u32>", "var x: texture_storage_2d<rgba16float, write>",
    "var x: texture_storage_2d<r32uint, write>", "var<storage, read> x: array<vec4f>",
    "var x: texture_storage_2d_array<rgba32float, write>", "var<storage, read_write> x: array<u32>",
    "var<uniform> x: vec4f",
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_none_is_bound_as_what_the_shader_declares(device, folder, kind):
    def read(name):
        if "storage," in kind:
            return f"{name}[0]"
        return name if "uniform" in kind else f"textureDimensions({name})"

    other = kind.replace(" x", " y")
    (folder / "kinds.wgsl").write_text(
        f"{ONE}@group(1) @binding(0) {kind};\n@group(1) @binding(1) {other};\n"
        "@group(1) @binding(2) var<storage, read_write> out: array<u32>;\n@compute "
        f"@workgroup_size(1)\nfn main() {{\n    _ = {read('x')};\n    _ = {read('y')};\n"
        "    out[0] = 5u;\n}\n"
    )
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    out = device.create_buffer(size=4, usage=usage)
    source = wgsl.load("kinds.wgsl")
    run(device, source, x=None, y=None, out=out)
    assert np.frombuffer(device.queue.read_buffer(out), "<u4") == 5
    kernel, frame = gpu.Kernel(device, source), gpu.FrameBindings((1, 1), {})
    first, second = (kernel.prepared("main", frame, x=None, y=None, out=out) for _ in range(2))
    assert first.resources["x"] is second.resources["x"]  # kept, so that bind groups are too
    shared = first.resources["x"] is first.resources["y"]
    assert shared == (
        "write" not in kind and "uniform" not in kind
    )  # no pass writes one resource by two names


def test_a_pass_may_be_recorded_again_and_runs_over_a_size(device, folder):
    (folder / "count.wgsl").write_text(
        "const WG_X: u32 = 4u;\nconst WG_Y: u32 = 2u;\n"
        "@group(1) @binding(0) var<storage, read_write> out: array<atomic<u32>>;\n"
        "@compute @workgroup_size(WG_X, WG_Y)\nfn main() { atomicAdd(&out[0], 1u); }\n"
    )
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    out = device.create_buffer(size=4, usage=usage)
    kernel = gpu.Kernel(device, wgsl.load("count.wgsl"))
    frame = gpu.FrameBindings((4, 2), {})
    assert kernel.prepared("main", frame, out=out).workgroups == (1, 1)
    again = kernel.prepared("main", frame, (9, 3), out=out)
    assert again.workgroups == (3, 2)
    for want in (48, 96):
        encoder = device.create_command_encoder()
        again.record(encoder)
        gpu.submit(device, encoder)
        assert np.frombuffer(device.queue.read_buffer(out), "<u4") == want
    counts = device.create_buffer_with_data(
        data=np.array([0, 2, 1, 1], np.uint32), usage=wgpu.BufferUsage.INDIRECT
    )
    encoder = device.create_command_encoder()
    kernel.run(encoder, "main", frame, {"buffer": counts, "offset": 4, "size": 12}, out=out)
    gpu.submit(device, encoder)
    assert np.frombuffer(device.queue.read_buffer(out), "<u4") == 96 + 16


@pytest.mark.parametrize("file", ENTERED)
def test_every_shader_compiles_with_every_override(device, file):
    names = re.findall(r"^override (\w+): bool", wgsl.load(file).text, re.M)
    many = list(itertools.product((0, 1), repeat=len(names)))
    most = 1 if parts.TIER == "default" else 64
    for values in random.Random(7).sample(many, min(len(many), most)):
        kernel = gpu.Kernel(device, wgsl.load(file), dict(zip(names, values, strict=True)))
        for entry in kernel.source.entry_points():
            assert kernel.pipeline(entry) is kernel.pipeline(entry)


def test_only_entry_points_that_run_are_compiled(device, folder, monkeypatch):
    (folder / "two.wgsl").write_text(
        ONE + "".join(f"@compute @workgroup_size(1)\nfn {name}() {{}}\n" for name in ("main", "b"))
    )
    made, make = [], type(device).create_compute_pipeline

    def counted(device, **how):
        made.append(how["compute"]["entry_point"])
        return make(device, **how)

    monkeypatch.setattr(type(device), "create_compute_pipeline", counted)
    run(device, wgsl.load("two.wgsl"))
    assert made == ["main"]


MOST_LINES = 60  # of a function, from its name to its last brace


def long_functions(text):
    """(name, lines) of those with more than MOST_LINES lines; one begins and ends a line."""
    whole = re.findall(
        r"^fn (\w+)(.*?)^\}", re.sub(r"^(fn .*\})$", "", text, flags=re.M), re.M | re.S
    )
    return [(n, lines) for n, body in whole if (lines := body.count("\n") + 1) > MOST_LINES]


@pytest.mark.fast
def test_no_function_of_a_shader_is_long():
    at_most = "fn f() {\n" + "    a();\n" * (MOST_LINES - 2) + "}\n"
    assert not long_functions("fn one() { a(); }\n" + at_most)
    assert long_functions(at_most.replace("}", "    a();\n}")) == [("f", MOST_LINES + 1)]
    assert not {f: found for f in FILES if (found := long_functions((wgsl.ROOT / f).read_text()))}


@pytest.mark.parametrize("file", FILES)
def test_every_shader_begins_with_what_it_does(file):
    lines = itertools.takewhile(
        lambda line: line.startswith("// "), (wgsl.ROOT / file).read_text().splitlines()
    )
    text = " ".join(line[3:] for line in lines)
    assert re.match(r"[A-Z][^.]{10,}\.", text), text


def test_an_error_names_the_included_file(device, folder):
    (folder / "inc.wgsl").write_text("const A: f32 = 1.0;\nfn broken() -> f32 { return A + 1u; }\n")
    (folder / "main.wgsl").write_text(
        f"//#include inc.wgsl\n{ONE}"
        "@compute @workgroup_size(1)\nfn main() { let x = broken(); }\n"
    )
    with pytest.raises(ShaderError, match=r"inc\.wgsl:2"):
        gpu.Kernel(device, wgsl.load("main.wgsl"))


def test_an_error_in_the_file_itself_keeps_its_line(device, folder):
    (folder / "inc.wgsl").write_text("const A: f32 = 1.0;\n")
    (folder / "main.wgsl").write_text(
        f"//#include inc.wgsl\n{ONE}@compute @workgroup_size(1)\nfn main() {{ let x = A +; }}\n"
    )
    with pytest.raises(ShaderError, match=r"main\.wgsl:5"):
        gpu.Kernel(device, wgsl.load("main.wgsl"))


def test_a_missing_include_names_both_files(folder):
    (folder / "main.wgsl").write_text("//#include nope.wgsl\n")
    with pytest.raises(ShaderError, match=r"main\.wgsl: no such file wgsl/nope\.wgsl"):
        wgsl.load("main.wgsl")


def test_a_file_included_twice_is_there_once(folder):
    (folder / "c.wgsl").write_text("const C: u32 = 7u;\n")
    (folder / "b.wgsl").write_text("//#include c.wgsl\n")
    (folder / "a.wgsl").write_text("//#include b.wgsl\n//#include c.wgsl\n")
    assert wgsl.load("a.wgsl").text.count("const C") == 1
    assert wgsl.load("a.wgsl").constant("C") == 7


@pytest.mark.parametrize(
    "kind, text",
    [
        ("array<vec3f, 2>", ""),
        ("S", "struct S {\n @size(32) a: f32,\n}"),
        ("f16", ""),
        ("mat3x3f", ""),
        ("vec2<f16>", ""),
        ("vec3<bool>", ""),
    ],
)
def test_what_is_not_supported_is_refused(kind, text):
    with pytest.raises(ShaderError):
        wgsl.layout(kind, text)


def test_a_missing_constant_is_named():
    with pytest.raises(ShaderError, match="no constant NOPE in gpu_frame/holdout"):
        wgsl.load("gpu_frame/holdout.wgsl").constant("NOPE")


@pytest.mark.parametrize("given", [{}, {"p": None, "q": None}])
def test_too_few_or_too_many_names_are_listed(device, folder, given):
    (folder / "m.wgsl").write_text(
        f"{ONE}@group(1) @binding(0) var<uniform> p: vec4f;\n"
        "@compute @workgroup_size(1)\nfn main() { let x = p; }\n"
    )
    with pytest.raises(ShaderError, match=r"binds \['p'\], got"):
        run(device, wgsl.load("m.wgsl"), **given)


@pytest.mark.parametrize(
    "file", sorted(p.relative_to(wgsl.ROOT).as_posix() for p in wgsl.ROOT.rglob("*.wgsl"))
)
def test_every_scalar_constant_can_be_read(file):
    source = wgsl.load(file)
    for name in re.findall(r"^const (\w+)\s*:\s*[fiu]32", source.text, re.M):
        assert np.isfinite(source.constant(name))


def test_a_texture_is_read_from_storage_if_it_was_made_for_it(device):
    usage = wgpu.TextureUsage.TEXTURE_BINDING
    sampled = device.create_texture(size=(4, 4, 1), format="rgba32float", usage=usage)
    usage |= wgpu.TextureUsage.STORAGE_BINDING
    both = device.create_texture(size=(4, 4, 1), format="rgba32float", usage=usage)
    formats = [gpu.stored(texture.create_view()) for texture in (sampled, both)]
    assert formats == ["given", "rgba32float"]
    source = wgsl.load("methods/gather/layers/edges.wgsl")
    for format, kind in zip(
        formats, ("texture_2d<f32>", "texture_storage_2d<rgba32float, read>"), strict=True
    ):
        read = source.with_texels(motion=format).reading_storage(4)
        assert {b.name: b.type for b in read.bindings()}["motion"] == kind
        assert read.standard.text == source.with_texels(motion=format).text


@pytest.mark.parametrize("most", [0, 4, 99])
def test_no_more_textures_are_read_from_storage_than_a_device_takes(most):
    source = wgsl.load("methods/gather/shading/compose.wgsl")
    kinds = [b.type for b in source.reading_storage(most).bindings()]
    written = sum("texture_storage" in b.type for b in source.bindings())
    marked = len(re.findall(r"// stored as (?!given)", source.text))
    assert sum("texture_storage" in kind for kind in kinds) == max(
        written, min(most, written + marked)
    )
