"""Frames without vectors at another rate, averaged: `--fps-in`, `--flow none`."""

import numpy as np
import pytest
from PIL import Image

import make_frames as make
from wgmb.color.highlights import Expansion
from wgmb.color.srgb import linear, to_display


def stills(folder, count=9):
    """PNG frames 1, 2, ... of noise; and their pattern, and their light."""
    rng, shown = np.random.default_rng(0), []
    for n in range(1, count + 1):
        shown.append(rng.integers(0, 256, (8, 12, 3), np.uint8))
        Image.fromarray(shown[-1]).save(folder / f"a.{n}.png")
    return folder / "a.#.png", [linear(one / np.float32(255)) for one in shown]


@pytest.mark.parametrize("highlights", [1, 8])
def test_frames_without_vectors_are_averaged_by_their_shares(tmp_path, capsys, highlights):
    shot, light = stills(tmp_path)
    words = "--fps-in", 240, "--fps", 60, "--flow", "none", "--shutter", 360
    words = "blur", shot, "-o", tmp_path / "b.#.png", *words, "--highlights", highlights
    code, _, err = make.inside(capsys, *words, "--cuts", "only:1")
    assert code == 0 and "none: pictures are averaged" in err, err
    assert make.names_in(tmp_path)[9:] == ["b.1.png", "b.2.png", "b.3.png"]
    around = [Expansion(highlights).expanded(one) for one in light[2:7]]
    mean = np.average(around, 0, weights=[1, 2, 2, 2, 1])
    want = to_display(Expansion(highlights).compressed(mean), 8)
    with Image.open(tmp_path / "b.2.png") as image:
        assert np.abs(np.asarray(image).astype(int) - want).max() <= 1


@pytest.mark.parametrize(
    ("options", "weights"),
    [
        ("--shutter 720", {1: 1, 2: 2, 3: 1}),
        ("--shutter 720 --fps-in 30 --fps 30", {1: 1, 2: 2, 3: 1}),
        ("--shutter 360 --phase start", {2: 1, 3: 1}),
    ],
)
def test_frames_of_the_same_rate_are_averaged_where_the_shutter_reaches_beyond_one(
    tmp_path, capsys, options, weights
):
    shot, light = stills(tmp_path, 5)
    words = "blur", shot, "-o", tmp_path / "b.#.png", "--flow", "none", "--cuts", "only:1"
    code, _, err = make.inside(capsys, *words, *options.split())
    assert code == 0 and "none: pictures are averaged" in err, err
    assert [name for name in make.names_in(tmp_path) if name[0] == "b"] == [
        f"b.{n}.png" for n in range(1, 6)
    ]
    want = to_display(np.average([light[n] for n in weights], 0, weights=[*weights.values()]), 8)
    with Image.open(tmp_path / "b.3.png") as image:
        assert np.abs(np.asarray(image).astype(int) - want).max() <= 1
    code, _, err = make.inside(capsys, *words, *options.split(), "--resume")
    assert code == 0 and "5 already done" in err, err


def test_job_files_hold_no_averages(tmp_path, capsys):
    shot, _ = stills(tmp_path, 3)
    words = "job", shot, "-o", tmp_path / "b.#.png", "--flow", "none", "--shutter", 720
    code, _, err = make.inside(capsys, *words, "--job", tmp_path / "j.json")
    assert code == 2 and "job files do not support --flow none" in err, err


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ("", "--flow none would leave each as it is: it averages frames of a higher rate"),
        ("--fps-in 24 --fps 24 --shutter 360", "such as --fps-in 240 and --fps 60, or over a"),
        ("--shutter 720 --rolling down", "a rolling shutter needs frames of the output's own rate"),
        ("--shutter 720 --workers 2", "--flow none cannot be combined with --workers"),
        ("--fps-in 240 --fps 60 --holdout a.1.png", "--holdout needs motion; --flow none averages"),
    ],
)
def test_frames_that_no_motion_blurs_are_refused_in_one_line(
    tmp_path, capsys, monkeypatch, options, why
):
    shot, _ = stills(tmp_path)
    monkeypatch.chdir(tmp_path)
    words = "blur", shot, "-o", tmp_path / "b.#.png", "--flow", "none", *options.split()
    code, _, err = make.inside(capsys, *words)
    assert code == 2 and why in err and err.count("\n") == 1, err
    assert len(make.names_in(tmp_path)) == 9
