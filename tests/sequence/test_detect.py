"""The vector convention is found on the neighbouring frames, and doubt is reported."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import make_frames as make
from make_vectors import BOTH, ONE, moving, side_by_side, told
from wgmb import Clip, Passes, Vectors
from wgmb.sequence.layers import vector_test, vectors

pytestmark = pytest.mark.fast


def in_full(*cases):
    """Cases that are tried with all others only."""
    return [pytest.param(case, marks=pytest.mark.full) for case in cases]


def found_of(color, motion, prev, next_, wanted):
    """The finding of one frame."""
    return vector_test.decide(wanted, [vector_test.gathered(color, motion, prev, next_)])


def tried(convention, n=5, velocity=make.VELOCITY, wrong=None, sides=("prev", "next"), **given):
    """The finding about vectors that were read as `given`, after `wrong` damaged them."""
    to_prev, to_next = make.motion(n, velocity)
    if wrong is not None:
        to_prev, to_next = wrong(to_prev), wrong(to_next)
    wanted = told(convention, **given)
    motion = vectors.read(make.written(convention, to_prev, to_next), wanted)
    near = {s: make.picture(n + d, velocity) for s, d in (("prev", -1), ("next", 1)) if s in sides}
    found = found_of(make.picture(n, velocity), motion, near.get("prev"), near.get("next"),
                           wanted)  # fmt: skip
    return wanted, found


WRONGS = {
    "x": (lambda v: v * np.array([-1, 1], "f4"), {"flip": "x"}),
    "y": (lambda v: v * np.array([1, -1], "f4"), {"flip": "y"}),
    "xy": (lambda v: -v, {"flip": "xy"}),
    "half": (lambda v: v / 2, {"scale": 2.0}),
    "double": (lambda v: v * 2, {"scale": 0.5}),
}


@pytest.mark.parametrize("sides", [("prev", "next"), ("prev",), ("next",)])
@pytest.mark.parametrize("convention", [*BOTH, *ONE])
def test_right_vectors_are_found_right(convention, sides):
    wanted, found = tried(convention, sides=sides)
    assert found.sure
    assert found.vectors == wanted
    assert "tested" in found.text


@pytest.mark.parametrize("sides", [("prev", "next"), ("prev",)])
@pytest.mark.parametrize("convention", ["blender", "nuke", "arnold", "vray"])
@pytest.mark.parametrize("wrong", WRONGS)
def test_wrong_vectors_are_found_out_and_it_is_said(wrong, convention, sides):
    damage, cure = WRONGS[wrong]
    wanted, found = tried(convention, wrong=damage, sides=sides)
    assert found.sure
    assert found.vectors == replace(wanted, **cure)
    assert "because" in found.text
    assert all(str(v if k == "flip" else f"{v:g}") in found.text for k, v in cure.items())


def test_a_cure_undoes_what_the_user_said_wrongly():
    for wrong in ({"flip": "y"}, {"flip": "xy"}, {"scale": 2.0}):
        _, found = tried("nuke", **wrong)
        assert found.sure
        assert found.vectors == told("nuke")


@pytest.mark.parametrize("velocity", [(5.0, 0.0), (0.0, 5.0)])
def test_along_one_axis_no_flip_of_the_other_is_invented(velocity):
    wanted, found = tried("nuke", velocity=velocity)
    assert found.sure
    assert found.vectors == wanted


def test_on_still_frames_it_says_that_it_cannot_tell():
    wanted, found = tried("blender", velocity=(0.0, 0.0))
    assert not found.sure
    assert found.vectors == wanted
    assert "cannot be tested" in found.text


def test_on_a_picture_of_one_colour_it_says_that_it_cannot_tell():
    flat = np.full((make.HEIGHT, make.WIDTH, 4), 0.5, "f4")
    motion = np.full((make.HEIGHT, make.WIDTH, 4), 3.0, "f4")
    found = found_of(flat, motion, flat, flat, told("plain"))
    assert not found.sure
    assert found.vectors == told("plain")
    assert "not testable" in found.text


def test_on_a_single_frame_it_says_that_it_cannot_tell():
    wanted, found = tried("blender", sides=())
    assert not found.sure
    assert found.vectors == wanted
    assert "no neighbouring frame" in found.text


SEEDS = [0, *(pytest.param(n, marks=pytest.mark.full) for n in range(1, 5))]


@pytest.mark.parametrize("seed", SEEDS)
def test_vectors_of_noise_are_not_believed(seed):
    rng = np.random.default_rng(seed)
    motion = moving(seed)
    pictures = [rng.random((make.HEIGHT, make.WIDTH, 4)).astype("f4") for _ in range(3)]
    found = found_of(pictures[1], side_by_side(motion), pictures[0], pictures[2], told("plain"))
    assert not found.sure
    assert found.vectors == told("plain")
    assert "check them" in found.text


@pytest.mark.parametrize("seed", SEEDS)
def test_random_vectors_of_a_real_motion_are_not_believed(seed):
    pictures = [make.picture(n) for n in (4, 5, 6)]
    found = found_of(
        pictures[1], side_by_side(moving(seed)), pictures[0], pictures[2], told("plain")
    )
    assert not found.sure
    assert found.vectors == told("plain")


def test_bad_vectors_and_pixels_do_not_stop_the_test():
    to_prev, to_next = make.motion(5)
    to_prev[::5, ::7], to_next[::6, ::5] = np.nan, np.inf
    pictures = [make.picture(n) for n in (4, 5, 6)]
    pictures[1][::9], pictures[2][::8] = np.nan, np.inf
    found = found_of(
        pictures[1], side_by_side((to_prev, to_next)), pictures[0], pictures[2], told("plain")
    )
    assert found.vectors == told("plain")


# ---- the scale is searched for --------------------------------------------------------------


@pytest.mark.parametrize("flip", ["", "y", "xy"])
@pytest.mark.parametrize("frames", [0.12, 0.417, 0.8, 3.7, 8.0, *in_full(0.3, 1.37, 8.26)])
def test_vectors_of_any_part_of_a_frame_are_found_out(frames, flip):
    turned = np.array([-1 if axis in flip else 1 for axis in "xy"], "f4")
    _, found = tried("nuke", n=1, velocity=(11.0, 6.0), wrong=lambda v: v * turned * frames)
    assert found.sure
    assert found.notable
    assert found.vectors.flip == flip
    assert found.vectors.scale == pytest.approx(1 / frames, rel=0.02)
    ratio = f"{1 / found.vectors.scale:.3g}"
    claims = f"(vectors of {ratio} frames)" in found.text
    asks = f"they are {ratio} times as long as the motion, which is no known unit: check them"
    assert claims == (frames < 1 or frames == 8)
    assert (asks in found.text) != claims
    assert (
        f"`vector_scale={found.vectors.scale:g}`" in found.text.replace(" reads them so", "")
    ) != claims


@pytest.mark.parametrize("frames", [2.0, 2.5, *in_full(1.5, 4.0, 7.5, 10.0)])
def test_whole_and_half_numbers_of_frames_are_known_units(frames):
    _, found = tried("nuke", wrong=lambda v: v * frames)
    assert found.vectors.scale == pytest.approx(1 / frames)
    assert f"(vectors of {frames:g} frames), because" in found.text
    assert "check" not in found.text


def per_second(rate, flip=1, stated=None, velocity=(9.0, 5.0)):
    """The finding about vectors in pixels per second."""
    to_prev, to_next = (v * np.float32(rate) * (1, flip) for v in make.motion(2, velocity))
    near = [make.picture(n, velocity) for n in (1, 3)]
    motion = side_by_side((to_prev, to_next))
    one = vector_test.gathered(make.picture(2, velocity), motion, *near, rate=stated)
    return vector_test.decide(told("plain"), [one])


@pytest.mark.parametrize("flip", [-1, *in_full(1)])
@pytest.mark.parametrize("rate", [24, 60, *in_full(25, 30, 48, 50, 100, 120)])
def test_pixels_per_second_are_a_known_unit(rate, flip):
    found = per_second(rate, flip)
    assert found.sure
    assert found.vectors == told("plain", scale=round(1 / rate, 9), flip="y" if flip < 0 else "")
    assert f"(pixels per second, at {rate} frames per second), because" in found.text


def test_the_rate_of_the_file_is_a_known_unit_too():
    asks = "they are 17 times as long as the motion, which is no known unit: check them"
    assert f"{asks} (`vector_scale=0.0588`" in per_second(17).text
    found = per_second(17, stated=17.0)
    assert found.vectors.scale == pytest.approx(1 / 17)
    assert "(pixels per second, at 17 frames per second)" in found.text
    ntsc = 24 / 1.001
    assert "at 23.976 frames" in per_second(ntsc, stated=ntsc).text


@pytest.mark.parametrize("frames", [0.9, 1.0, 1.1])
def test_a_scale_that_is_hardly_better_than_1_is_not_invented(frames):
    """Noise hides the effect of a tenth more or less."""
    rng = np.random.default_rng(0)
    pictures = [
        make.picture(n) + rng.normal(0, 0.15, (make.HEIGHT, make.WIDTH, 4)) for n in (4, 5, 6)
    ]
    motion = side_by_side(make.motion(5)) * np.float32(frames)
    found = found_of(pictures[1], motion, pictures[0], pictures[2], told("plain"))
    assert found.sure
    assert found.vectors == told("plain")
    assert not found.notable


def evidence(n, wrong=lambda v: v, velocity=make.VELOCITY):
    to_prev, to_next = (wrong(v) for v in make.motion(n, velocity))
    near = [make.picture(n + side, velocity) for side in (-1, 1)]
    return vector_test.gathered(make.picture(n, velocity), side_by_side((to_prev, to_next)), *near)


def test_frames_are_taken_together_before_a_flip_is_decided():
    """One frame of three has vectors that are turned round; alone, it would turn all of them."""
    wrong = evidence(5, lambda v: v * np.array([1, -1], "f4"))
    assert vector_test.decide(told("plain"), [wrong]).vectors.flip == "y"
    together = vector_test.decide(told("plain"), [wrong, evidence(2), evidence(7)])
    assert together.vectors == told("plain")
    assert not together.notable


def test_no_more_pixels_are_compared_than_said(monkeypatch):
    compared = []
    look_up = vector_test.bilinear

    def counting(image, where):
        compared.append(len(where))
        return look_up(image, where)

    monkeypatch.setattr(vector_test, "bilinear", counting)
    monkeypatch.setattr(vector_test, "_PROBES", 300)
    monkeypatch.setattr(vector_test, "_ROUGHLY", 90)
    vector_test.decide(told("plain"), [evidence(n, lambda v: v / 2) for n in (2, 5, 7)])
    assert max(compared) == 100
    assert sum(n > 30 for n in compared) < 400


# ---- a sequence on disk ---------------------------------------------------------------------


def test_vectors_that_are_as_named_are_tested_on_one_frame(tmp_path):
    clip = Clip(make.write_sequence(tmp_path, range(1, 8)))
    assert "tested" in clip.finding
    assert not clip.is_finding_notable
    assert sorted(clip.sizes) == [1, 2]


def test_others_are_tested_on_the_first_the_middle_and_the_last(tmp_path):
    for n in range(1, 10):
        channels = make.frame(n, "nuke")
        for name, factor in (("u", 0.4), ("v", -0.4)):
            for side in ("forward", "backward"):
                channels[f"{side}.{name}"] *= np.float32(factor)
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    clip = Clip(tmp_path / "s.####.exr", frames="4")
    assert "nuke scale 2.5 flip y (vectors of 0.4 frames), because" in clip.finding
    assert clip.is_finding_notable
    assert {1, 5, 9} <= set(clip.sizes)
    got = clip.frame(clip.source(4)).motion[..., 2:]
    np.testing.assert_allclose(got, make.motion(4)[1], atol=0.02)


def test_the_rate_comes_from_the_frames(tmp_path):
    for n in (1, 2, 3):
        back, ahead = (v * np.float32(17) for v in make.motion(n))
        channels = make.colors(make.picture(n)) | make.written("nuke", back, ahead)
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels, {"framesPerSecond": Fraction(17)})
    clip = Clip(tmp_path / "s.####.exr")
    assert "(pixels per second, at 17 frames per second)" in clip.finding
    np.testing.assert_allclose(
        clip.frame(clip.source(2)).motion[..., 2:], make.motion(2)[1], atol=0.01
    )


# ---- vectors below a pixel ------------------------------------------------------------------


@pytest.mark.parametrize("light", [1.0, 0.02])
def test_the_unit_is_found_in_the_dark_and_where_little_changes(light):
    size = np.array([make.WIDTH, make.HEIGHT], "f4")
    pictures = [light * make.picture(n) for n in (4, 5, 6)]
    motion = side_by_side([v / size for v in make.motion(5)])
    found = found_of(pictures[1], motion, pictures[0], pictures[2], told("plain"))
    assert found.sure
    assert found.vectors == told("plain", scale=(make.WIDTH, make.HEIGHT))


def test_noise_in_the_dark_is_no_motion():
    rng = np.random.default_rng(0)
    still = 0.05 * make.picture(5)
    pictures = [still + rng.normal(0, 0.005, still.shape).astype("f4") for _ in range(3)]
    slow = np.full((make.HEIGHT, make.WIDTH, 4), 1e-3, "f4")
    found = found_of(pictures[1], slow, pictures[0], pictures[2], told("plain"))
    assert not found.notable
    assert "nothing moves" in found.text


@pytest.mark.parametrize(
    ("convention", "speed", "text"),
    [("rsmb", 0.1, "`vector_scale` must be twice the longest motion"),
     ("vray", 0.1, "`vector_scale` must be twice the longest motion"),
     ("plain", 0.1, f"`vector_scale={make.WIDTH},{make.HEIGHT}` makes them pixels"),
     ("plain", 3.0, ""), ("vray", 3.0, ""), ("blender", 0.1, ""), ("plain", 0.0, "")],
)  # fmt: skip
def test_a_unit_that_a_single_frame_does_not_tell_is_asked_for(convention, speed, text):
    motion = np.full((make.HEIGHT, make.WIDTH, 4), speed, "f4")
    found = found_of(make.picture(5), motion, None, None, Vectors(convention))
    assert text in found.text
    assert found.notable == bool(text)
    again = found_of(make.picture(5), motion, None, None, Vectors(convention, scale=64.0))
    assert not again.notable


@pytest.mark.parametrize("layer", ["motion", "to_next"])
@pytest.mark.parametrize("chosen", [{}, {"convention": "plain"}, {"flip": "y"}])
def test_a_direction_that_a_single_frame_does_not_tell_is_named(tmp_path, layer, chosen):
    ahead = make.motion(5)[1]
    planes = {f"{layer}.x": ahead[..., 0], f"{layer}.y": ahead[..., 1]}
    path = make.write_exr(tmp_path / "s.exr", make.colors(make.picture(5)) | planes)
    clip = Clip(path, passes=Passes(vectors=Vectors(**chosen)))
    assert clip.is_finding_notable == ("`vector_flip=y`" in clip.finding)
    assert clip.is_finding_notable == (layer == "motion" and not chosen)


# ---- vectors that are 0 everywhere ----------------------------------------------------------


def blank(folder, numbers=(1, 2, 3), picture=make.picture, velocity=make.VELOCITY, motion=0.0):
    """Frames whose vectors are `motion` everywhere."""
    for n in numbers:
        zero = np.full((make.HEIGHT, make.WIDTH, 2), motion, "f4")
        channels = make.colors(picture(n, velocity)) | make.written("nuke", zero, zero)
        make.write_exr(folder / f"s.{n:04d}.exr", channels)
    return folder / "s.####.exr"


@pytest.mark.parametrize("motion", [0.0, 0.03])  # 16-bit integers have no middle
def test_vectors_of_0_of_a_moving_picture_are_told(tmp_path, motion):
    clip = Clip(blank(tmp_path, motion=motion))
    assert clip.is_finding_notable
    assert "0 everywhere" in clip.finding
    assert "motion blur on" in clip.finding


def test_vectors_of_0_of_a_still_picture_are_right(tmp_path):
    clip = Clip(blank(tmp_path, velocity=(0.0, 0.0)))
    assert not clip.is_finding_notable
    assert "nothing moves" in clip.finding


def test_noise_is_no_motion(tmp_path):
    def noisy(n, velocity):
        noise = np.random.default_rng(n).normal(0, 0.1, (make.HEIGHT, make.WIDTH, 4))
        return np.clip(make.picture(0) + noise, 0, None)

    assert not Clip(blank(tmp_path, picture=noisy)).is_finding_notable


def test_vectors_that_are_0_in_some_frames_only_are_not_told(tmp_path):
    pattern = blank(tmp_path, (1, 2, 3, 4))
    make.write_exr(tmp_path / "s.0004.exr", make.frame(4, "nuke"))
    assert "0 everywhere" not in Clip(pattern).finding
