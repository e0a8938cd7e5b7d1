"""Senseless cameras: an error that names the file, and order."""

import json

import numpy as np
import pytest

import make_frames as make
from wgmb import CameraFile, InputError


def camera_json(tmp_path, **change) -> dict:
    path = make.write_cameras(tmp_path / "whole.json", range(1, 4))
    content = json.loads(path.read_text())
    for frame in content["frames"].values():
        frame |= change
    return content


EYE = np.eye(4).tolist()
ZERO = np.zeros((4, 4)).tolist()
TURNED = [[1, 0, 0, 0], [0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]]  # x, y, w alone: singular


def matrix(value) -> list:
    return [[1, 0, 0, value], *EYE[1:]]


BAD_CAMERAS = {
    "3 x 3": {"projection": np.eye(3).tolist()},
    "ragged": {"projection": [[1], [2, 3]]},
    "text": {"projection": "none"},
    "null": {"projection": None},
    "words": {"projection": [["a"] * 4] * 4},
    "nan": {"projection": matrix(float("nan"))},
    "infinite": {"projection": matrix(float("inf"))},
    "huge integer": {"projection": matrix(10**400)},
    "singular projection": {"projection": ZERO},
    "singular camera": {"camera_matrix_world": ZERO},
    "singular clip": {"clip_from_world": ZERO},
    "singular in the pixels": {"clip_from_world": TURNED},
    "tiny": {"camera_matrix_world": (np.eye(4) * 1e-310).tolist()},
    "objects a list": {"objects": []},
    "object null": {"objects": {"a": None}},
    "object without index": {"objects": {"a": {"matrix_world": EYE}}},
    "object without matrix": {"objects": {"a": {"index": 1}}},
    "index 1e10": {"objects": {"a": {"index": 10**10, "matrix_world": EYE}}},
    "index -1": {"objects": {"a": {"index": -1, "matrix_world": EYE}}},
    "index text": {"objects": {"a": {"index": "1", "matrix_world": EYE}}},
    "index fraction": {"objects": {"a": {"index": 1.5, "matrix_world": EYE}}},
    "singular object": {"objects": {"a": {"index": 1, "matrix_world": ZERO}}},
}


@pytest.mark.parametrize("name", BAD_CAMERAS)
def test_a_senseless_camera_fails_the_frame_with_the_files_name(tmp_path, capsys, name):
    path = tmp_path / "cam.json"
    path.write_text(json.dumps(camera_json(tmp_path, **BAD_CAMERAS[name])))
    index = np.ones((48, 64), "f4")
    make.write_exr(tmp_path / "c.0002.exr", make.frame(2, None) | {"IndexOB.X": index})
    code, out, err = make.inside(capsys, "blur", tmp_path / "c.####.exr", "--camera", path, "-o",
                                 tmp_path / "o.####.exr")  # fmt: skip
    assert code in (1, 2)
    assert out == ""
    assert make.error_lines(err)[0].startswith("wgmb: ")
    assert "cam.json" in err
    assert not (tmp_path / "o.0002.exr").exists()


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "3", "null", "{}", '{"frames": []}', '{"frames": {"x": {}}}', "[" * 100_000,
     '{"frames": {"1e999": {}}}', '{"frames": {"nan": {}}}', "\0\0", '{"frames": {"1": NaN}'],
    ids=range(13),
)  # fmt: skip
def test_what_is_no_camera_file_is_refused_by_name(tmp_path, text):
    (tmp_path / "cam.json").write_text(text)
    with pytest.raises(InputError, match=r"cam\.json"):
        CameraFile(tmp_path / "cam.json")


@pytest.mark.parametrize("frame", [None, 5, [], "x", {}])
def test_a_frame_without_a_camera_is_refused_by_name(tmp_path, frame):
    (tmp_path / "cam.json").write_text(json.dumps({"frames": {"1": frame, "2": frame}}))
    with pytest.raises(InputError, match=r"cam\.json"):
        CameraFile(tmp_path / "cam.json").around(1)


def test_a_camera_file_that_is_missing_a_folder_or_a_device_is_refused(tmp_path):
    for path in (tmp_path / "no.json", tmp_path, "/dev/zero"):
        with pytest.raises(InputError):
            CameraFile(path)
