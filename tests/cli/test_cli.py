"""The command line: what it says, where it says it, and the exit codes."""

import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import make_frames as make
import wgmb
from wgmb.cli import app


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, 4))


def one_line(err: str) -> bool:
    return err.startswith("wgmb: ") and err.count("\n") == 1 and err.endswith("\n")


@pytest.mark.parametrize("name", app.COMMANDS)
def test_the_table_of_commands_has_the_first_line_of_their_help(name):
    (line, *_) = (app.make_app(name)[name].help or "").splitlines()
    assert line == app.COMMANDS[name]


def test_the_table_of_commands_loads_none_of_them():
    script = "import sys; from wgmb.cli import app; app.main(['--help']); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True
    )
    loaded = {name.partition(".")[0] for name in done.stdout.splitlines()[-1].split()}
    assert not loaded & {"wgpu", "numpy", "OpenEXR", "av", "tifffile", "PIL", "imgui_bundle"}
    assert "PyOpenColorIO" not in loaded


@pytest.mark.parametrize("command", [[], ["blur"], ["info"], ["devices"]])
def test_help_of_every_command_shows_an_example(capsys, command):
    code, out, err = make.inside(capsys, *command, "--help")
    assert (code, err) == (0, "")
    assert "Example" in out


def test_help_of_every_command_is_there(capsys):
    _, out, _ = make.inside(capsys, "--help")
    for name in app.COMMANDS:
        assert name in out
        assert "Example" in make.inside(capsys, name, "--help")[1], name


@pytest.mark.parametrize(
    "arguments",
    [["frobnicate"], ["blur"], ["blur", "x.exr"], ["info"], ["devices", "more"],
     ["blur", "x.exr", "-o", "y.exr", "--frobnicate"], ["blur", "x.exr", "-o", "y.exr", "--bits"],
     ["blur", "x.exr", "-o", "y.exr", "--shutter", "much"],
     ["blur", "x.exr", "-o", "y.exr", "--vector-flip", "z"]],
    ids=" ".join,
)  # fmt: skip
def test_wrong_usage_is_one_line_and_2(capsys, arguments):
    code, out, err = make.inside(capsys, *arguments)
    assert (code, out) == (2, "")
    assert one_line(err)


@pytest.mark.parametrize(
    "options",
    ["--shutter nan", "--shutter -1", "--phase middle", "--phase nan", "--curve nofile.csv",
     "--samples 0", "--samples 100000", "--jitter 2", "--jitter nan", "--max-blur -1",
     "--max-blur nan", "--method nope", "--vectors maya", "--vector-scale inf",
     "--vector-offset nan",
     "--far nan", "--bits 12", "--fps 0", "--fps nan", "--fps 1/0", "--fps 1e-400",
     "--frames x", "--frames 1-9",
     "--camera nofile.json", "--rolling-duration nan --rolling up", "--path crooked",
     "--also no.####.exr --vectors x"],
)  # fmt: skip
def test_senseless_values_are_one_line_and_2_and_leave_nothing(tmp_path, capsys, shot, options):
    out_folder = tmp_path / "out"
    code, out, err = make.inside(capsys, "blur", shot, "-o", out_folder / "o.####.png",
                                 *options.split())  # fmt: skip
    assert (code, out) == (2, "")
    assert one_line(err)
    assert not out_folder.exists() or make.names_in(out_folder) == []


def test_blur_says_nothing_on_stdout_and_one_line_on_stderr(tmp_path, shot):
    done = make.command("blur", shot, "-o", tmp_path / "o.####.exr")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr.startswith("3 frames in ")
    assert done.stderr.count("\n") == 1


def test_quiet_says_nothing_at_all(tmp_path, capsys, shot):
    said = make.inside(capsys, "blur", shot, "-o", tmp_path / "o.####.exr", "-q")
    assert said == (0, "", "")


def test_quiet_still_says_errors(tmp_path, capsys):
    code, out, err = make.inside(capsys, "blur", "no.exr", "-o", tmp_path / "o.exr", "-q")
    assert (code, out) == (2, "")
    assert one_line(err)


def test_verbose_says_adapter_settings_and_what_the_vectors_mean(tmp_path, capsys, shot):
    _, out, err = make.inside(capsys, "blur", shot, "-o", tmp_path / "o.####.exr", "-v")
    assert out == ""
    assert "adapter: " in err
    assert "vectors: blender, tested" in err
    assert '"shutter": 180' in err


def test_a_convention_that_was_found_wrong_is_said_without_asking(tmp_path, capsys):
    for n in (1, 2):
        channels = make.frame(n, "nuke")
        for name in ("forward.u", "backward.u"):
            channels[name] = -channels[name]
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    _, _, err = make.inside(capsys, "blur", tmp_path / "s.####.exr", "-o", tmp_path / "o.####.exr")
    assert "flip x" in err


def test_vectors_that_are_0_everywhere_are_said_without_asking(tmp_path, capsys):
    for n in (1, 2):
        channels = make.frame(n, "nuke")
        for name in ("forward.u", "forward.v", "backward.u", "backward.v"):
            channels[name] *= 0
        make.write_exr(tmp_path / f"s.{n:04d}.exr", channels)
    code, out, _ = make.inside(capsys, "info", tmp_path / "s.####.exr")
    assert code == 0
    assert "own motion blur" in out
    line = ("blur", tmp_path / "s.####.exr", "-o", tmp_path / "o.####.exr")
    code, _, err = make.inside(capsys, *line)
    assert code == 0
    assert "own motion blur" in err
    assert "own motion blur" not in make.inside(capsys, *line, "--overwrite", "-q")[2]


def test_cuts_that_change_nothing_are_said(tmp_path, capsys, shot):
    line = ("blur", shot, "-o", tmp_path / "o.####.exr", "--cuts", "3,40,50")
    code, _, err = make.inside(capsys, *line)
    assert code == 0
    assert "no shot begins at the cuts 40,50: the frames are 1 to 3\n" in err
    assert "camera cut before frame 3\n" in err


@pytest.mark.parametrize(
    ("cuts", "said"),
    [
        ("only:99", "--cuts only:99: no cut is searched for, so the frames are one shot"),
        ("none", ""),
    ],
)
def test_cuts_that_switch_the_search_off_say_what_they_do(tmp_path, capsys, shot, cuts, said):
    """It said that it changed nothing; `none` was refused."""
    words = "--method", "tap", "--cuts", cuts
    code, _, err = make.inside(capsys, "blur", shot, "-o", tmp_path / "o.####.exr", *words)
    assert code == 0
    assert (said in err) and ("one shot" in err) == bool(said)


def test_settings_are_written_into_every_frame(tmp_path, capsys, shot):
    make.inside(capsys, "blur", shot, "-o", tmp_path / "o.####.exr", "--shutter", 90, "--holdout",
                "ViewLayer.Depth=3")  # fmt: skip
    for n in (1, 2, 3):
        text = make.plain_header(tmp_path / f"o.{n:04d}.exr")["wgmb"]
        assert '"shutter": 90.0' in text
        assert "ViewLayer.Depth=3" in text


def test_info_lists_layers_sizes_convention_and_speeds(capsys, shot):
    code, out, err = make.inside(capsys, "info", shot)
    assert (code, err) == (0, "")
    for what in ("64 x 48", "ViewLayer.Combined", "ViewLayer.Depth", "ViewLayer.Vector",
                 "float16", "float32", "blender, tested", "1-3 (3)"):  # fmt: skip
        assert what in out
    speed = np.hypot(*make.VELOCITY)
    assert f"the fastest is {speed:.1f}" in out
    assert "half are under 0.0" in out


def test_info_of_one_file_says_that_it_could_not_test(capsys, shot):
    code, out, _ = make.inside(capsys, "info", shot.replace("####", "0002"))
    assert code == 0
    assert "no neighbouring frame" in out


def test_info_lists_a_file_that_has_vectors_only(tmp_path, capsys):
    path = make.write_exr(tmp_path / "mv.exr", make.written("nuke", *make.motion(1)))
    code, out, _ = make.inside(capsys, "info", path)
    assert code == 0
    assert "forward" in out


def test_info_of_a_still_says_what_it_is(tmp_path, capsys):
    Image.new("RGB", (20, 10)).save(tmp_path / "a.png")
    code, out, err = make.inside(capsys, "info", tmp_path / "a.png")
    assert (code, err) == (0, "")
    assert "20 x 10" in out


def test_info_says_windows_and_bad_pixels(tmp_path, capsys):
    channels = make.frame(1, "nuke")
    channels["R"][3, 4] = np.nan
    channels["forward.u"][5, :3] = np.inf
    path = make.write_exr(
        tmp_path / "a.exr", channels, data=(-3, 2, 60, 49), display=(0, 0, 79, 59)
    )
    code, out, _ = make.inside(capsys, "info", path)
    assert code == 0
    assert "(-3, 2, 60, 49)" in out
    assert "1 pixel of color" in out
    assert "3 pixels of motion" in out or "3 pixels of to_next" in out
    assert "nan" not in out


def test_info_warns_of_motion_beyond_belief(tmp_path, capsys):
    to_prev, to_next = (np.full((48, 64, 2), s * 30, "f4") for s in (-1, 1))
    path = make.write_exr(
        tmp_path / "a.exr", make.frame(1, None) | make.written("nuke", to_prev, to_next)
    )
    assert "quarter of the width" in make.inside(capsys, "info", path)[1]


def test_the_command_takes_the_mask_and_says_which(tmp_path, capsys):
    channels = make.frame(1, "nuke") | {"known.Y": np.zeros((make.HEIGHT, make.WIDTH), "f4")}
    channels["MV_Alpha.R"] = np.ones((make.HEIGHT, make.WIDTH), "f4")
    path = make.write_exr(tmp_path / "a.exr", channels)
    _, out, _ = make.inside(capsys, "info", path)
    assert "vectors are used where MV_Alpha.R is 1" in out
    _, out, _ = make.inside(capsys, "info", path, "--vector-mask", "known")
    assert "vectors are used where known.Y is 1" in out
    assert "the fastest is 0.0" in out


def test_info_draws_the_motion(tmp_path, capsys, shot):
    code, out, _ = make.inside(capsys, "info", shot, "-o", tmp_path / "m.png")
    assert code == 0
    assert "m.png" in out
    picture = np.asarray(Image.open(tmp_path / "m.png")).astype(int)
    assert picture.shape == (48, 64, 3)
    assert picture[5, 2].max() == 0  # the background stands still
    right_and_down = picture[20, 20]
    assert right_and_down.max() > 200
    assert right_and_down[0] == right_and_down.max()  # red is right, yellow-green down


def test_info_draws_nothing_where_nothing_is_known_to_move(tmp_path, capsys):
    path = make.write_exr(tmp_path / "a.exr", make.frame(1, None))
    code, _, err = make.inside(capsys, "info", path, "-o", tmp_path / "m.png")
    assert code == 2
    assert one_line(err)
    assert "a.exr" in err
    assert not (tmp_path / "m.png").exists()


@pytest.mark.parametrize("name", ["m.exr", "m", "nofolder/m.png"])
def test_a_drawing_that_cannot_be_written_is_one_line_that_names_it(tmp_path, capsys, shot, name):
    code, _, err = make.inside(capsys, "info", shot, "-o", tmp_path / name)
    assert code in (1, 2)
    assert one_line(err)
    assert name in err
    assert ".part" not in err


def test_devices_lists_adapters_and_marks_the_default(capsys):
    code, out, err = make.inside(capsys, "devices")
    assert (code, err) == (0, "")
    assert sum(line.startswith("* ") for line in out.splitlines()) == 1
    assert "0: " in out


@pytest.mark.parametrize("adapter", ["99", "no such card"])
def test_an_adapter_that_is_not_there_is_3_with_a_list(tmp_path, capsys, shot, adapter):
    code, out, err = make.inside(capsys, "blur", shot, "-o", tmp_path / "o.####.exr", "--adapter",
                                 adapter)  # fmt: skip
    assert (code, out) == (3, "")
    assert one_line(err)
    assert "found 0: " in err


def test_version_is_on_stdout(capsys):
    assert make.inside(capsys, "--version") == (0, f"{wgmb.__version__}\n", "")


def test_output_that_nobody_can_take_is_no_traceback(shot):
    with open("/dev/full", "w") as full:
        said = subprocess.run([*make.COMMAND, "info", shot], stdout=full, stderr=subprocess.PIPE,
                              text=True, timeout=60)  # fmt: skip
    assert said.returncode == 1
    assert one_line(said.stderr)
