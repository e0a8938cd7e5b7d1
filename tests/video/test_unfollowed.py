"""A body that jumps farther than the search stays sharp: videos, logs and frames name it."""

import json

import av
import numpy as np
import pytest

import make_clips
import make_frames as make
import wgmb

pytest.importorskip("cv2")

WIDTH, HEIGHT, COUNT = 320, 180, 6
LINE = "something moves too far to be followed, or is in one picture only"


def jumping(step: int) -> list[np.ndarray]:
    """Pictures (height, width, 3) uint8 of a disc that jumps across a still texture."""
    rng = np.random.default_rng(1)
    ground = np.kron(rng.integers(30, 120, (HEIGHT // 6, -(-WIDTH // 6), 3)), np.ones((6, 6, 1)))
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    pictures = []
    for n in range(COUNT):
        far = np.hypot(x - (30 + step * n) % WIDTH, y - 90 - 30 * np.sin(0.9 * n))
        cover = np.clip(8 - far, 0, 1)[..., None]
        pictures.append(ground[:, :WIDTH] * (1 - cover) + np.array([230, 220, 50]) * cover)
    return [picture.astype(np.uint8) for picture in pictures]


def written(path, pictures):
    frames = [av.VideoFrame.from_ndarray(picture, "rgb24") for picture in pictures]
    make_clips.write(path, frames, codec="libx264", options={"crf": "12"})
    return path


@pytest.mark.parametrize(("step", "expected"), [(120, [1, 2, 3, 4]), (20, [])])
def test_a_jump_beyond_the_reach_is_named_and_smaller_ones_are_not(
    tmp_path, capsys, step, expected
):
    written(tmp_path / "in.mkv", jumping(step))
    log = tmp_path / "run.log"
    line = "blur", tmp_path / "in.mkv", "-o", tmp_path / "o.mkv", "--log-json", log
    code, _, err = make.inside(capsys, *line)
    assert code == 0
    said = [text for text in err.splitlines() if LINE in text]
    assert said == ([f"pictures 1-4: {LINE}: it stays sharp; a recording with more frames "
                     "per second would help"] if expected else [])  # fmt: skip
    (video,) = (e for e in map(json.loads, log.read_text().splitlines()) if e["event"] == "video")
    assert video["unfollowed"] == expected


def test_frames_without_vectors_name_theirs(tmp_path, capsys):
    from wgmb.io import stills

    for n, picture in enumerate(jumping(120)[:3], 1):
        image = stills.encode(picture.astype(np.float32) / 255, ".png", 8, "")
        (tmp_path / f"in.{n}.png").write_bytes(image)
    line = "blur", tmp_path / "in.#.png", "-o", tmp_path / "o.#.png"
    code, _, err = make.inside(capsys, *line)
    assert (code, LINE in err) == (0, True)


def test_held_areas_and_pictures_with_one_neighbour_are_left_out():
    """A counter in a display that is held; and the first picture, whose neighbour may hide it."""
    from wgmb.video.unfollowed import is_unfollowed

    grey = [picture[..., 0] for picture in jumping(120)]
    still, held = np.zeros((HEIGHT, WIDTH, 4), np.float32), np.ones((HEIGHT, WIDTH), np.float32)
    assert is_unfollowed(grey[1:4], still, None)
    assert not is_unfollowed(grey[1:4], still, held)
    assert not is_unfollowed([None, *grey[:2]], still, None)
    assert not is_unfollowed([grey[1]] * 3, still, None)
    counter = [picture.copy() for picture in grey[1:4]]
    for level, picture in zip((20, 120, 220), counter, strict=True):
        picture[:] = 60
        picture[40:60, 100:140] = level
    assert not is_unfollowed(counter, still, None)


def test_a_batch_names_each_video(tmp_path, capsys):
    for name, step in (("a.mkv", 120), ("b.mkv", 0)):
        written(tmp_path / name, jumping(step)[:4])
    line = "blur", tmp_path / "a.mkv", tmp_path / "b.mkv", "-o", f"{tmp_path}/out/"
    code, _, err = make.inside(capsys, *line)
    one, other = (text for text in err.splitlines() if " -> " in text)
    assert code == 0
    assert LINE in one and LINE not in other


def test_the_report_has_the_pictures(tmp_path):
    path = written(tmp_path / "in.mkv", jumping(120)[:4])
    report = wgmb.blur_video(path, tmp_path / "o.mkv")
    assert report.unfollowed == [1, 2]
