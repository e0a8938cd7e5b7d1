"""One motion, written in every program's convention, is read as the same displacements."""

import numpy as np
import pytest

import make_frames as make
from make_vectors import BOTH, ONE, moving, side_by_side, told
from wgmb import InputError
from wgmb.sequence.layers import vectors
from wgmb.sequence.layers.vectors import Vectors

pytestmark = pytest.mark.fast


def read(channels, wanted) -> tuple[np.ndarray, np.ndarray]:
    """to_prev and to_next."""
    both = vectors.read(channels, wanted)
    assert both.dtype == np.float32
    return both[..., :2], both[..., 2:]


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


# ---- where vectors are valid ----------------------------------------------------------------

MASKED = {  # channel that holds the mask, and what to say
    "MV_Alpha": {},
    "MV_Alpha.A": {},
    "ViewLayer.mv_alpha.R": {},
    "known.X": {"mask": "known"},
    "odd.R": {"mask": "odd.R"},
}


def masked(name: str, values: np.ndarray, convention="plain", **more) -> np.ndarray:
    channels = make.written(convention, *moving()) | {name: values.astype("f4")}
    return vectors.read(channels, told(convention, **more))


@pytest.mark.parametrize("name", MASKED)
def test_where_vectors_are_not_valid_nothing_moves(name):
    mask = np.random.default_rng(1).integers(0, 2, (make.HEIGHT, make.WIDTH))
    got = masked(name, mask, **MASKED[name])
    np.testing.assert_array_equal(got, side_by_side(moving()) * mask[..., None])


def test_the_alpha_of_rsmbs_vectors_is_their_mask():
    mask = np.random.default_rng(2).integers(0, 2, (make.HEIGHT, make.WIDTH))
    channels = make.written("rsmb", *moving())
    black = {k: (v * mask).astype("f4") for k, v in channels.items()}  # would be a long streak
    got = vectors.read(black | {"rsmb.A": mask.astype("f4")}, told("rsmb"))
    np.testing.assert_allclose(got[..., 2:], moving()[1] * mask[..., None], atol=1e-4)
    other = make.written("vray", *moving()) | {"velocity.A": mask.astype("f4")}
    assert vectors.mask_of(other, told("vray")) is None  # only rsmb's says so


def test_an_edge_moves_as_what_is_valid_beside_it():
    mask = np.zeros((make.HEIGHT, make.WIDTH))
    mask[10:20, 10:20] = 1
    mask[10:20, 20] = 0.4
    mask[30, 30] = 0.5  # nothing valid beside it
    got, motion = masked("MV_Alpha", mask), side_by_side(moving())
    np.testing.assert_array_equal(got[10:20, 20], motion[10:20, 19])
    assert not got[30, 30].any()
    assert not got[:, 21:].any()


def test_a_mask_may_be_left_out_and_an_empty_one_is():
    zero = np.zeros((make.HEIGHT, make.WIDTH))
    motion = side_by_side(moving())
    np.testing.assert_array_equal(masked("MV_Alpha", zero), motion)  # nobody filled it
    np.testing.assert_array_equal(masked("MV_Alpha", 1 + zero), motion)
    zero[5] = 1
    np.testing.assert_array_equal(masked("MV_Alpha", zero, mask="none"), motion)
    assert not masked("known.X", 0 * zero, mask="known").any()  # this one was asked for


def test_a_mask_that_is_not_there_is_refused_with_a_list_of_what_there_is():
    channels = make.written("plain", *moving())
    with pytest.raises(InputError, match=r"no vector mask layer 'nope'.*to_next.*to_prev"):
        vectors.read(channels, told("plain", mask="nope"))
