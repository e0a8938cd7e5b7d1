"""One motion, written in every program's convention, is read as the same displacements."""

from dataclasses import replace

import numpy as np
import pytest

import make_frames as make
from wgmb import InputError
from wgmb.io import vectors
from wgmb.io.vectors import Vectors

pytestmark = pytest.mark.fast

BOTH = ("blender", "nuke", "plain")  # the others write one direction only
ONE = ("arnold", "vray", "rsmb", "velocity")


def told(convention: str, **more) -> Vectors:
    """What to say of `make.written(convention)`."""
    if convention == "rsmb":
        more = {"scale": 2 * make.MAX_DISPLACE} | more
    return Vectors("plain" if convention == "velocity" else convention, **more)


def read(channels, wanted) -> tuple[np.ndarray, np.ndarray]:
    """to_prev and to_next."""
    both = vectors.read(channels, wanted)
    assert both.dtype == np.float32
    return both[..., :2], both[..., 2:]


def side_by_side(motion) -> np.ndarray:
    return np.concatenate(motion, axis=2)


def moving(rng_seed=0):
    """Two different displacements for every pixel, so that no mix-up stays unseen."""
    rng = np.random.default_rng(rng_seed)
    shape = (make.HEIGHT, make.WIDTH, 2)
    return (rng.uniform(-12, 12, shape).astype("f4"), rng.uniform(-12, 12, shape).astype("f4"))


@pytest.mark.parametrize("convention", [*BOTH, *ONE])
def test_every_convention_reads_the_same_motion(convention):
    to_prev, to_next = moving()
    got_prev, got_next = read(make.written(convention, to_prev, to_next), told(convention))
    np.testing.assert_allclose(got_next, to_next, atol=1e-4)
    # A side that is not there is the other's opposite: a straight path.
    np.testing.assert_allclose(got_prev, to_prev if convention in BOTH else -to_next, atol=1e-4)


@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_half_and_float_vectors_read_alike(kind):
    channels = {k: v.astype(kind) for k, v in make.written("nuke", *moving()).items()}
    for got, want in zip(read(channels, told("nuke")), moving(), strict=True):
        assert got.dtype == np.float32
        np.testing.assert_allclose(got, want, atol=0.01)


def test_vectors_come_as_backward_only_too():
    to_prev, to_next = moving()
    channels = {k: v for k, v in make.written("nuke", to_prev, to_next).items() if "backward" in k}
    got_prev, got_next = read(channels, told("nuke"))
    np.testing.assert_array_equal(got_prev, to_prev)
    np.testing.assert_array_equal(got_next, -to_prev)


@pytest.mark.parametrize(("flip", "signs"), [("x", (-1, 1)), ("y", (1, -1)), ("xy", (-1, -1))])
def test_flip_turns_both_directions_round(flip, signs):
    channels = make.written("blender", *moving())
    for got, want in zip(read(channels, told("blender", flip=flip)), moving(), strict=True):
        np.testing.assert_array_equal(got, want * np.array(signs, "f4"))


def test_offset_is_taken_away_before_scale_multiplies():
    to_prev, to_next = moving()
    channels = {k: v / 4 + 7 for k, v in make.written("velocity", to_prev, to_next).items()}
    _, got = read(channels, Vectors("plain", scale=4, offset=7))
    np.testing.assert_allclose(got, to_next, atol=1e-4)


def test_offset_0_undoes_a_conventions_own():
    channels = make.written("vray", *moving())
    channels = {k: v - 0.5 for k, v in channels.items()}
    _, got = read(channels, Vectors("vray", offset=0))
    np.testing.assert_allclose(got, moving()[1], atol=1e-4)


def test_a_layer_of_any_name_is_read_as_told():
    channels = {f"odd.{k[-1]}": v for k, v in make.written("blender", *moving()).items()}
    got = read(channels, Vectors("blender", layer="odd"))
    for a, b in zip(got, moving(), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    "wrong",
    [{"convention": "maya"}, {"flip": "z"}, {"scale": float("nan")}, {"scale": float("inf")},
     {"offset": float("nan")}],
)  # fmt: skip
def test_senseless_options_are_refused(wrong):
    with pytest.raises(InputError):
        Vectors(**wrong)


def test_missing_vectors_are_refused_with_a_list_of_what_there_is():
    channels = make.frame(1, None)
    with pytest.raises(InputError, match=r"forward.*backward.*available"):
        vectors.read(channels, told("nuke"))
    with pytest.raises(InputError, match="nope"):
        vectors.read(channels, Vectors("plain", layer="nope"))
    with pytest.raises(InputError, match="components"):
        vectors.read({**channels, "v.x": channels["Z"]}, Vectors("plain", layer="v"))


def test_none_reads_no_vectors():
    assert vectors.named(make.frame(1, "nuke"), Vectors("none")) is None


# ---- detection ------------------------------------------------------------------------------


def detect(convention, n=5, velocity=make.VELOCITY, wrong=None, sides=("prev", "next"), **given):
    """What is found of vectors that were read as `given` says, after `wrong` damaged them."""
    to_prev, to_next = make.motion(n, velocity)
    if wrong is not None:
        to_prev, to_next = wrong(to_prev), wrong(to_next)
    wanted = told(convention, **given)
    motion = vectors.read(make.written(convention, to_prev, to_next), wanted)
    near = {s: make.picture(n + d, velocity) for s, d in (("prev", -1), ("next", 1)) if s in sides}
    found = vectors.detect(make.picture(n, velocity), motion, near.get("prev"), near.get("next"),
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
    wanted, found = detect(convention, sides=sides)
    assert found.sure
    assert found.vectors == wanted
    assert "tested" in found.text


@pytest.mark.parametrize("sides", [("prev", "next"), ("prev",)])
@pytest.mark.parametrize("convention", ["blender", "nuke", "arnold", "vray"])
@pytest.mark.parametrize("wrong", WRONGS)
def test_wrong_vectors_are_found_out_and_it_is_said(wrong, convention, sides):
    damage, cure = WRONGS[wrong]
    wanted, found = detect(convention, wrong=damage, sides=sides)
    assert found.sure
    assert found.vectors == replace(wanted, **cure)
    assert "because" in found.text
    assert all(str(v if k == "flip" else f"{v:g}") in found.text for k, v in cure.items())


def test_a_cure_undoes_what_the_user_said_wrongly():
    for wrong in ({"flip": "y"}, {"flip": "xy"}, {"scale": 2.0}):
        _, found = detect("nuke", **wrong)
        assert found.sure
        assert found.vectors == told("nuke")


@pytest.mark.parametrize("velocity", [(5.0, 0.0), (0.0, 5.0)])
def test_along_one_axis_no_flip_of_the_other_is_invented(velocity):
    wanted, found = detect("nuke", velocity=velocity)
    assert found.sure
    assert found.vectors == wanted


def test_on_still_frames_it_says_that_it_cannot_tell():
    wanted, found = detect("blender", velocity=(0.0, 0.0))
    assert not found.sure
    assert found.vectors == wanted
    assert "cannot be tested" in found.text


def test_on_a_picture_of_one_colour_it_says_that_it_cannot_tell():
    flat = np.full((make.HEIGHT, make.WIDTH, 4), 0.5, "f4")
    motion = np.full((make.HEIGHT, make.WIDTH, 4), 3.0, "f4")
    found = vectors.detect(flat, motion, flat, flat, told("plain"))
    assert not found.sure
    assert found.vectors == told("plain")
    assert "not testable" in found.text


def test_on_a_single_frame_it_says_that_it_cannot_tell():
    wanted, found = detect("blender", sides=())
    assert not found.sure
    assert found.vectors == wanted
    assert "no neighbouring frame" in found.text


@pytest.mark.parametrize("seed", range(5))
def test_vectors_of_noise_are_not_believed(seed):
    rng = np.random.default_rng(seed)
    motion = moving(seed)
    pictures = [rng.random((make.HEIGHT, make.WIDTH, 4)).astype("f4") for _ in range(3)]
    found = vectors.detect(
        pictures[1], side_by_side(motion), pictures[0], pictures[2], told("plain")
    )
    assert not found.sure
    assert found.vectors == told("plain")
    assert "check them" in found.text


@pytest.mark.parametrize("seed", range(5))
def test_random_vectors_of_a_real_motion_are_not_believed(seed):
    pictures = [make.picture(n) for n in (4, 5, 6)]
    found = vectors.detect(
        pictures[1], side_by_side(moving(seed)), pictures[0], pictures[2], told("plain")
    )
    assert not found.sure
    assert found.vectors == told("plain")


def test_bad_vectors_and_pixels_do_not_stop_the_test():
    to_prev, to_next = make.motion(5)
    to_prev[::5, ::7], to_next[::6, ::5] = np.nan, np.inf
    pictures = [make.picture(n) for n in (4, 5, 6)]
    pictures[1][::9], pictures[2][::8] = np.nan, np.inf
    found = vectors.detect(
        pictures[1], side_by_side((to_prev, to_next)), pictures[0], pictures[2], told("plain")
    )
    assert found.vectors == told("plain")
