"""Laws that hold for every method that blurs frames, whatever it does inside."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Unpack

import numpy as np
import pytest
from numpy.typing import NDArray

from ..errors import InputError
from ..frame import Frame
from ..methods.contract import Method
from ..methods.keywords import MethodName
from ..methods.options import options_of
from ..pipeline.arguments import method_of
from ..pipeline.one_frame import FrameKeywords, blur
from ..shutter import Shutter

Image = NDArray[np.float32]  # linear: (height, width, 3)
Tested = MethodName | type[Method]
ZERO = 2**-12  # what f32 sampling may differ by


def blurred(
    color: Image,
    to_next: Image | None = None,
    *,
    method: Tested,
    shutter: Shutter | float = 180,
    samples: int | Literal["auto"] | None = None,
    **more: Unpack[FrameKeywords],
) -> Image:
    """The blur of a frame with a flat depth."""
    more["depth"] = np.full(color.shape[:2], 5, "f4")
    return blur(color, to_next, method=method, shutter=shutter, samples=samples, **more)


def moving(picture: Image, x: float = 12.0, y: float = 0.0):
    """One motion of the whole picture [px]."""
    motion = np.zeros((*picture.shape[:2], 2), "f4")
    return motion + np.array([x, y], "f4")


def edge(at: int = 64, height: int = 64, width: int = 128):
    """White to the left of column `at`, black to its right."""
    picture = np.zeros((height, width, 3), "f4")
    picture[:, :at] = 1
    return picture


def profile(picture: Image):
    """The mean of each column."""
    return picture.mean(axis=(0, 2))


BAD = [np.nan, np.inf, -np.inf, 1e-42, 3e38, -3e38]


class MethodLaws:
    """The laws as tests of `tested`, the class of a method or its name.

    A class of tests inherits them, and sets `tested`; or it has a fixture `method` of its own,
    which may have several. A law that a method does not keep on purpose is overridden, with the
    reason.
    Pictures are linear float32, (height, width, 3); each method is given a flat depth, too.
    """

    tested: ClassVar[Tested]

    @pytest.fixture
    def method(self) -> Tested:
        """The method that is tested."""
        return self.tested

    @pytest.fixture
    def noise(self) -> Image:
        """A picture without any structure: 64 x 48 pixels, 0 to 1."""
        return np.random.default_rng(1).random((48, 64, 3), "f4")

    def test_no_motion_changes_nothing(self, method: Tested, noise: Image):
        assert np.array_equal(blurred(noise, moving(noise, 0), method=method), noise)

    def test_constant_colour_stays_constant(self, method: Tested, noise: Image):
        grey = np.full_like(noise, 0.25)
        np.testing.assert_allclose(blurred(grey, moving(grey), method=method), 0.25, atol=ZERO)

    @pytest.mark.parametrize("phase", ["start", "centre", "end"])
    def test_closed_shutter_freezes_motion(self, method: Tested, noise: Image, phase: str):
        shutter = Shutter(0, phase)
        out = blurred(noise, moving(noise), shutter=shutter, method=method)
        assert np.array_equal(out, noise)

    def test_same_input_same_bits(self, method: Tested, noise: Image):
        a, b = (blurred(noise, moving(noise), method=method, jitter=1.0) for _ in range(2))
        assert np.array_equal(a, b)

    def test_jitter_changes_with_the_frame(self, method: Tested, noise: Image):
        a, b = (blurred(noise, moving(noise), method=method, jitter=1.0, number=n) for n in (1, 2))
        assert not np.array_equal(a, b)

    def test_jitter_does_not_change_the_mean(self, method: Tested, noise: Image):
        a, b = (blurred(noise, moving(noise), method=method, jitter=j) for j in (0.0, 1.0))
        assert abs(a.mean() - b.mean()) < 2e-3

    @pytest.mark.parametrize("curve", ["box", "triangle", "cosine"])
    def test_moving_edge_becomes_the_shutter_integral(self, method: Tested, curve: str):
        """A step edge moving at v px a frame turns into a ramp: the integral of the shutter."""
        speed, picture = 32.0, edge()
        shutter = Shutter(360, curve=curve)
        out = profile(
            blurred(picture, moving(picture, speed), shutter=shutter, samples=256, method=method)
        )
        times, integral = shutter.integral()
        # The edge has passed x by the time (x - 64) / speed; before that, x is dark.
        x = np.arange(128) + 0.5
        want = 1 - np.interp((x - 64) / speed, times, integral)
        assert np.abs(out - want)[32:96].max() < 0.02

    @pytest.mark.parametrize("axis", [0, 1])
    @pytest.mark.parametrize("sign", [1, -1])
    def test_late_shutter_moves_things_forward(self, method: Tested, axis: int, sign: int):
        """Open only after the instant: an edge that moves right, or down, appears further on."""
        picture = edge(height=128) if axis else edge(height=128).transpose(1, 0, 2).copy()
        x, y = (16 * sign, 0) if axis else (0, 16 * sign)
        late = Shutter(36, 0.45)
        out = blurred(picture, moving(picture, x, y), shutter=late, samples=64, method=method)
        line = out.mean(axis=(1 - axis, 2))
        where = 64 + sign * 7.2
        assert line[int(where) - 4] > 0.95
        assert line[int(where) + 4] < 0.05

    def test_opening_at_the_frame_is_ahead_of_closing_at_it(self, method: Tested):
        picture = edge()
        ahead, behind = (
            profile(blurred(picture, moving(picture), shutter=Shutter(180, p), method=method)).sum()
            for p in ("start", "end")
        )
        assert ahead - behind == pytest.approx(6, abs=0.3)  # half of 12 px a frame

    def test_one_side_alone_means_a_straight_path(self, method: Tested, noise: Image):
        forth = blurred(noise, moving(noise, 5, 3), method=method)
        back = blurred(noise, to_prev=moving(noise, -5, -3), method=method)
        both = blurred(noise, moving(noise, 5, 3), to_prev=moving(noise, -5, -3), method=method)
        assert np.array_equal(forth, back)
        assert np.array_equal(forth, both)

    def test_alpha_is_blurred_like_colour(self, method: Tested, noise: Image):
        alpha = noise[..., :1]
        rgba = np.concatenate([noise * alpha, alpha], axis=2)
        out = blurred(rgba, moving(rgba), method=method)
        grey = blurred(np.repeat(alpha, 3, axis=2), moving(rgba), method=method)
        np.testing.assert_allclose(out[..., 3], grey[..., 0], atol=ZERO)

    def test_energy_is_kept_under_one_motion(self, method: Tested):
        picture = np.zeros((64, 96, 3), "f4")
        picture[28:36, 44:52] = 1000.0
        out = blurred(picture, moving(picture, 9, 4), samples=64, method=method)
        assert out.sum() == pytest.approx(picture.sum(), rel=0.01)

    def test_what_is_kept_stays_sharp_and_out_of_its_neighbours(self, method: Tested, noise: Image):
        picture = noise * 0.1
        picture[20:28, 30:38] = 100.0
        holdout = np.zeros(noise.shape[:2], "f4")
        holdout[20:28, 30:38] = 1
        out = blurred(picture, moving(picture, 20), holdout=holdout, method=method)
        assert np.array_equal(out[holdout > 0], picture[holdout > 0])
        assert out[holdout == 0].max() < 0.11

    @pytest.mark.parametrize("zoom", [0.0, 0.3, -0.3])
    @pytest.mark.parametrize("kept", ["checker", "ring", "block"])
    def test_white_stays_white_whatever_is_kept(self, method: Tested, kept: str, zoom: float):
        """A nearer bar moves over a moving background: nothing darkens, nothing brightens."""
        y, x = np.mgrid[:48, :80].astype("f4") + 0.5
        to_next = np.stack([6 + (x - 40) * zoom, 3 + (y - 24) * zoom], axis=2)
        bar = (abs(x - 40) < 10) & (abs(y - 24) < 12)
        to_next[bar] = (20, 0)
        holdout = {
            "checker": (x // 3 + y // 3) % 2,
            "ring": (x > 27) & (x < 31),
            "block": (abs(x - 32) < 2) & (abs(y - 22) < 2),
        }[kept].astype("f4")
        white = np.ones((48, 80, 3), "f4")
        depth = np.where(bar, 3.0, 10.0).astype("f4")
        out = blur(white, to_next, holdout=holdout, depth=depth, method=method)
        np.testing.assert_allclose(out, 1, atol=ZERO)

    def test_half_kept_is_half_way(self, method: Tested, noise: Image):
        holdout = np.full(noise.shape[:2], 0.5, "f4")
        out = blurred(noise, moving(noise), holdout=holdout, method=method)
        want = (blurred(noise, moving(noise), method=method) + noise) / 2
        np.testing.assert_allclose(out, want, atol=ZERO)

    @pytest.mark.parametrize("factor", [0.0, 0.5, 2.0])
    def test_scale_multiplies_motion(self, method: Tested, noise: Image, factor: float):
        scale = np.full(noise.shape[:2], factor, "f4")
        out = blurred(noise, moving(noise), scale=scale, method=method)
        want = blurred(noise, moving(noise, 12 * factor), method=method)
        np.testing.assert_allclose(out, want, atol=ZERO)

    def test_the_longest_streak_is_limited(self, method: Tested, noise: Image):
        out = blurred(noise, moving(noise, 400, 300), max_blur=5.0, method=method)
        want = blurred(noise, moving(noise, 8, 6), method=method)  # 10 px a frame, half of it open
        np.testing.assert_allclose(out, want, atol=1e-3)
        free = blurred(noise, moving(noise, 4, 3), max_blur=5.0, method=method)
        np.testing.assert_allclose(
            free, blurred(noise, moving(noise, 4, 3), method=method), atol=ZERO
        )

    @pytest.mark.parametrize("way, late", [("down", (1, 0)), ("up", (-1, 0)), ("right", (0, 1)),
                                           ("left", (0, -1))])  # fmt: skip
    def test_rolling_shutter_slants_what_moves_across(
        self, method: Tested, way: str, late: tuple[int, int]
    ):
        """The side that is exposed later shows what moves further on."""
        along_rows = late[0] != 0
        picture = edge(height=128) if along_rows else edge(height=128).transpose(1, 0, 2).copy()
        x, y = (20, 0) if along_rows else (0, 20)
        shutter = Shutter(1, rolling=way, rolling_duration=0.8)
        out = blurred(picture, moving(picture, x, y), shutter=shutter, samples=8, method=method)
        lines = out[..., 0].sum(axis=1 if along_rows else 0)
        slant = (lines[120] - lines[7]) * sum(late)
        assert slant == pytest.approx(20 * 0.8 * 113 / 128, abs=1.0)
        assert lines[63] == pytest.approx(64, abs=0.6)  # the middle keeps its time

    def test_half_floats_are_taken(self, method: Tested, noise: Image):
        half = noise.astype("f2")
        out = blurred(half, moving(half).astype("f2"), method=method)
        want = blurred(half.astype("f4"), moving(half), method=method)
        assert out.dtype == np.float32
        np.testing.assert_allclose(out, want, atol=ZERO)

    @pytest.mark.parametrize("value", BAD)
    @pytest.mark.parametrize("where", ["color", "to_next", "to_prev", "holdout", "scale"])
    def test_a_bad_value_spoils_nothing(
        self, method: Tested, noise: Image, where: str, value: float
    ):
        inputs: dict[str, Any] = {
            "color": noise,
            "to_next": moving(noise, 6, 2),
            "to_prev": moving(noise, -6, -2),
            "holdout": np.zeros(noise.shape[:2], "f4"),
            "scale": np.ones(noise.shape[:2], "f4"),
        }
        clean = blurred(**inputs, method=method)
        spoilt = {k: v.copy() for k, v in inputs.items()}
        for c in range(spoilt[where].shape[2] if spoilt[where].ndim == 3 else 1):
            at = (20 + 3 * c, 30) + ((c,) if spoilt[where].ndim == 3 else ())
            spoilt[where][at] = value
        out = blurred(**spoilt, method=method)
        assert np.isfinite(out).all()
        far = np.ones(noise.shape[:2], bool)
        far[12:38, 18:44] = False
        np.testing.assert_allclose(out[far], clean[far], atol=ZERO)

    @pytest.mark.parametrize("value", [1.01e30, 1e34, 1e38, 3.4e38, -3.4e38])
    @pytest.mark.parametrize("variant", [None, "published"])
    def test_colours_that_are_too_bright_to_be_added_weigh_nothing(
        self,
        method: Tested,
        noise: Image,
        value: float,
        variant: str | None,
    ):
        known = options_of(method_of(method).Options).get("variant")
        options = {"variant": variant} if variant and known and variant in known.choices else {}
        spoilt = noise.copy()
        spoilt[20:22, 30:33] = value
        spoilt[20, 40] = -value
        spoilt[40:] = value
        given: dict[str, Any] = {"shutter": 360, "samples": 8, "method": method, **options}
        out = blurred(spoilt, moving(noise, 6, 2), **given)
        assert np.isfinite(out).all()
        infinite = np.where(abs(spoilt) > 1e30, np.float32(np.inf), spoilt)
        assert np.array_equal(out, blurred(infinite, moving(noise, 6, 2), **given))

    def test_the_brightest_colours_can_be_added(self, method: Tested, noise: Image):
        bright = np.where(noise > 0.5, np.float32(1e30), np.float32(-1e30))
        assert not Frame(bright).bad
        for shutter in (180, 720):
            out = blurred(bright, moving(noise, 6, 2), shutter=shutter, method=method)
            assert np.isfinite(out).all()

    @pytest.mark.parametrize("value", [*BAD, 0.0, -1.0])
    def test_a_bad_depth_spoils_nothing(self, method: Tested, noise: Image, value: float):
        depth = np.full(noise.shape[:2], 5, "f4")
        clean = blur(noise, moving(noise, 6, 2), depth=depth, method=method)
        depth[20, 30] = value
        out = blur(noise, moving(noise, 6, 2), depth=depth, method=method)
        far = np.ones(noise.shape[:2], bool)
        far[12:28, 22:38] = False
        np.testing.assert_allclose(out[far], clean[far], atol=ZERO)
        assert np.isfinite(out).all()

    def test_a_lone_good_pixel_fills_its_bad_neighbours(self, method: Tested):
        color = np.full((32, 32, 3), np.nan, "f4")
        color[16, 16] = 0.5
        out = blurred(color, moving(color, 8), method=method)
        assert out[16, 16] == pytest.approx(0.5, abs=1e-3)
        assert out[16, 17] == pytest.approx(0.5, abs=1e-3)
        assert not out[0].any()

    @pytest.mark.parametrize("curve", ["box", "cosine"])
    def test_auto_takes_as_many_samples_as_it_needs(self, method: Tested, noise: Image, curve: str):
        """7.5 px of streak, a little jitter: as good as 64 samples to a pixel's own share of it.

        Two samples of `gather` are read at four places, which is three times as good.
        """
        smooth = np.repeat(np.repeat(noise[::4, ::4], 4, axis=0), 4, axis=1)
        shutter = Shutter(180, curve=curve)
        auto, all_ = (
            blurred(smooth, moving(smooth, 15), samples=n, shutter=shutter, method=method)
            for n in ("auto", 64)
        )
        few = blurred(smooth, moving(smooth, 15), samples=2, shutter=shutter, method=method)
        share = 0.3 if method_of(method).name == "gather" else 0.15
        assert np.abs(auto - all_).mean() < share * np.abs(few - all_).mean()

    def test_auto_leaves_what_stands_still_to_the_bit(self, method: Tested, noise: Image):
        assert np.array_equal(
            blurred(noise, moving(noise, 0), samples="auto", method=method), noise
        )

    def test_missing_inputs_are_named(self, method: Tested, noise: Image):
        if "motion" not in method_of(method).needs:
            pytest.skip("it needs no motion")
        with pytest.raises(InputError, match=r"needs .*motion"):
            blur(noise, method=method)

    @pytest.mark.parametrize("phase", [0.5, "centre"])
    def test_constant_colour_stays_constant_around_what_is_kept(self, method: Tested, phase: str):
        grey = np.full((48, 64, 3), 0.25, "f4")
        holdout = np.zeros((48, 64), "f4")
        holdout[:, 20:] = 1
        holdout[:, 30] = 0
        out = blurred(
            grey, moving(grey, -20), holdout=holdout, shutter=Shutter(90, phase), method=method
        )
        np.testing.assert_allclose(out[:, :60], 0.25, atol=2**-12)

    def test_what_comes_back_to_its_place_has_moved(self, method: Tested, noise: Image):
        """Next frame it is where it is now; in between it was 5 px away."""
        out = blurred(noise, moving(noise, 0), to_prev=moving(noise, 40), samples=64,
                      shutter=Shutter(360, "start"), method=method)  # fmt: skip
        assert np.abs(out - noise).max() > 0.1

    def test_jitter_keeps_samples_within_their_share_of_time(self, method: Tested):
        """A shutter that opens at 0 sees nothing from before; the edge moves right."""
        picture = 1 - edge()
        shutter = Shutter(360, "start", lambda x: np.exp(-5 * x))
        out = blurred(picture, moving(picture, 16), shutter=shutter, samples=1, jitter=1.0,
                      method=method)  # fmt: skip
        assert out[:, :63].max() == 0

    @pytest.mark.parametrize("curve", ["box", "triangle", "cosine"])
    @pytest.mark.parametrize("way", ["down", "up"])
    def test_every_curve_rolls(self, method: Tested, curve: str, way: str):
        """An instant at the edges of the picture is 0.4 intervals off, and things move by it."""
        picture = edge(height=128)
        shutter = Shutter(1, curve=curve, rolling=way, rolling_duration=0.8)
        out = blurred(picture, moving(picture, 20), shutter=shutter, method=method)
        lines = out[..., 0].sum(axis=1)
        sign = 1 if way == "down" else -1
        assert sign * (lines[120] - lines[7]) == pytest.approx(20 * 0.8 * 113 / 128, abs=0.5)

    @pytest.mark.parametrize("curve", ["triangle", "cosine"])
    def test_jitter_moves_the_samples_of_every_curve(
        self, method: Tested, noise: Image, curve: str
    ):
        shutter = Shutter(360, curve=curve)
        still, moved = (
            blurred(noise, moving(noise), shutter=shutter, jitter=j, method=method, number=3)
            for j in (0.0, 1.0)
        )
        assert np.abs(still - moved).max() > 0.01

    def test_a_pixel_is_not_still_because_it_ends_at_rest(self, method: Tested, noise: Image):
        """Rolling lets the first row, which would open at 0, close at 0."""
        shutter = Shutter(180, "start", rolling="down", rolling_duration=48 / 47)
        out = blurred(noise, moving(noise, 20), shutter=shutter, method=method)
        assert np.abs(out - noise)[0].max() > 0.1


class TestMethod(MethodLaws):
    """The laws of the method that `--wgmb-method` names."""

    @pytest.fixture
    def method(self, pytestconfig: pytest.Config) -> str:
        """The method of the command line."""
        name = pytestconfig.getoption("--wgmb-method", None)
        if not name:
            pytest.skip("no --wgmb-method NAME, an option of `pytest -p wgmb.testing`")
        return name
