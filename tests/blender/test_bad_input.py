"""Bad input is a sentence in Blender's own reports, before anything is rendered."""

import re
from dataclasses import replace

import bpy
import pytest

import scenes
from test_put_back import difference, everything, small
from wgmb_blender import command, folders, job, process
from wgmb_blender.settings import wanted_of
from wgmb_blender.wanted import Report
from wgmb_blender.wgmb_worker.problem import ProblemError, plain


def no_camera(scene, folder):
    scene.camera = None
    return "The scene has no camera: add one, then render again"


def no_engine(scene, folder):
    scene.render.engine = "BLENDER_WORKBENCH"
    return "This render engine has no Vector pass: choose Cycles or EEVEE"


def no_output(scene, folder):
    (folder / "file").write_text("x")
    scene.render.filepath = str(folder / "file" / "blurred_")
    return f"Cannot write into {folder / 'file'}: "


def no_folder(scene, folder):
    (folder / "file").write_text("x")
    scene.wgmb.sharp = str(folder / "file" / "sharp_")
    return f"Cannot write into {folder / 'file'}: "


def no_file(scene, folder):
    scene.wgmb.sharp = "//sharp/"
    return "Save the file first"


def no_name(scene, folder):
    scene.wgmb.sharp = str(folder / "s_##.exr")
    return "the number is four # at the end of the name"


def no_layer(scene, folder):
    scene.view_layers[0].use = False
    return "No view layer is used"


def no_region(scene, folder):
    scene.render.border_min_x = scene.render.border_max_x = 0.5
    return "The render region is empty"


def no_edges(scene, folder):
    scene.camera.data.type = "PANO"
    return "is a panoramic camera"


def no_constant_lens(scene, folder):
    scenes.animate(scene.camera.data, "sensor_width", lambda n: 30 + n)
    return "sensor_width of Camera is animated"


def no_other_name(scene, folder):
    scenes.output(scene, folder)
    scene.render.filepath = scene.wgmb.sharp
    return "is a sharp frame, and the blurred one would replace it"


WRONG = [no_camera, no_engine, no_output, no_folder, no_file, no_name, no_layer, no_region,
         no_edges, no_constant_lens, no_other_name]  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG, ids=lambda f: f.__name__)
def test_it_is_told_before_anything_is_rendered(tmp_path, wrong):
    scene = small(tmp_path)
    text = wrong(scene, tmp_path)
    frame = scene.frame_current
    with pytest.raises(RuntimeError, match=re.escape(text)) as error:
        bpy.ops.wgmb.render_and_blur()
    assert str(error.value).startswith("Error: ")
    assert str(error.value).strip().count("\n") == 0
    assert not list(tmp_path.rglob("*.exr")) and not list(tmp_path.rglob("*.png"))
    assert scene.render.use_motion_blur and scene.frame_current == frame
    # The command line says the same, with the exit code of wrong usage.
    assert command.command([]) == 2


def test_no_frames(tmp_path):
    scene = small(tmp_path)
    with pytest.raises(ProblemError, match="There are no frames"):
        next(job.steps(scene, replace(wanted_of(scene), frames=()), Report()))


def test_no_adapter(tmp_path, monkeypatch, capfd):
    scene = small(tmp_path)
    process.end_kept()
    monkeypatch.setenv("WGMB_ADAPTER", "no such thing")
    before = everything(scene)
    with pytest.raises(RuntimeError, match="No Vulkan, Metal or DirectX 12 driver found"):
        bpy.ops.wgmb.render_and_blur()
    assert difference(before, everything(scene)) == []
    assert command.command([]) == 3
    assert "motion blur cannot run here" in capfd.readouterr().err
    process.end_kept()


def test_frames_that_are_missing_in_the_middle(tmp_path, capfd):
    scene = small(tmp_path)
    scene.frame_end = 8
    for _ in job.steps(scene, replace(wanted_of(scene), is_blurring=False), Report()):
        pass
    gone = tmp_path / "sharp" / "sharp_0006.exr"
    gone.unlink()
    capfd.readouterr()
    assert command.command(["--use-rendered"]) == 1
    heard = capfd.readouterr()
    assert heard.err == f"wgmb: Frame 6: there is no {gone}\n"
    assert "wgmb: 4 frames blurred\n" in heard.out
    assert "wgmb: 40% Blurring frame 6\n" in heard.out
    names = sorted(p.name for p in tmp_path.glob("*.png"))
    assert names == [f"blurred_{n:04d}.png" for n in (4, 5, 7, 8)]


def test_no_sharp_frames_at_all(tmp_path):
    scene = small(tmp_path)
    report = Report()
    for _ in job.steps(scene, replace(wanted_of(scene), is_rendering=False), report):
        pass
    assert (report.done, list(report.failed)) == ([], [4, 5])


def test_a_film_is_not_made_of_some_of_its_frames(tmp_path):
    from test_put_back import film

    scene = film(tmp_path)
    for _ in job.steps(scene, replace(wanted_of(scene), is_blurring=False), Report()):
        pass
    (tmp_path / "sharp" / "sharp_0005.exr").unlink()
    report = Report()
    with pytest.raises(ProblemError, match="The film was not made: Frame 5: there is no"):
        list(job.steps(scene, replace(wanted_of(scene), is_rendering=False), report))
    assert [p.name for p in (tmp_path / "sharp" / "sharp_blurred").iterdir()] == [
        "composite_000004.exr"
    ]
    assert report.notes[-1].endswith(f"are in {tmp_path / 'sharp' / 'sharp_blurred'}")


def test_frames_of_another_size(tmp_path):
    scene = small(tmp_path)
    for _ in job.steps(scene, replace(wanted_of(scene), is_blurring=False), Report()):
        pass
    scene.render.resolution_x += 20
    report = Report()
    for _ in job.steps(scene, replace(wanted_of(scene), is_rendering=False), report):
        pass
    assert "was it rendered with others?" in report.failed[4]


def test_vectors_that_are_0_are_told(tmp_path):
    """As Cycles writes them with its own motion blur on."""
    scene = small(tmp_path)
    scene.wgmb.kept.clear()
    scene.wgmb.overscan = 0
    for n in (4, 5):
        list(blurred_on(scene, n, tmp_path))
    report = Report()
    for _ in job.steps(scene, replace(wanted_of(scene), is_rendering=False), report):
        pass
    assert report.done == [4, 5]
    assert any("All vectors are 0" in note for note in report.notes)


def blurred_on(scene, number, folder):
    """Render a frame as someone does who left motion blur on."""
    from wgmb_blender import picture, rendering, sharp
    from wgmb_blender.changed import changed

    files = sharp.sharp_frames(scene.wgmb.sharp)
    path = files.path(number)
    changes = [
        change
        for change in sharp._settings(scene, str(path.with_suffix("")), False, False, False)
        if change[1] != "use_motion_blur"
    ]
    changes += picture.changes(scene, picture.picture_of(scene))
    with changed(changes):
        yield from rendering.at_once(scene, number, [path])


def test_frames_without_vectors(tmp_path):
    scene = small(tmp_path)
    scene.wgmb.kept.clear()
    from wgmb_blender import picture, rendering, sharp
    from wgmb_blender.changed import changed

    path = sharp.sharp_frames(scene.wgmb.sharp).path(4)
    changes = [
        change
        for change in sharp._settings(scene, str(path.with_suffix("")), False, False, False)
        if change[1] != "use_pass_vector"
    ]
    changes += picture.changes(scene, picture.picture_of(scene, scene.wgmb.overscan))
    with changed(changes):
        list(rendering.at_once(scene, 4, [path]))
    report = Report()
    wanted = replace(wanted_of(scene), is_rendering=False, frames=(4,))
    for _ in job.steps(scene, wanted, report):
        pass
    assert report.failed[4] == "Frame 4: sharp_0004.exr has no Vector pass"


def test_frames_before_0(tmp_path):
    scene = small(tmp_path)
    report = Report()
    for _ in job.steps(scene, replace(wanted_of(scene), frames=(-2, -1)), report):
        pass
    assert (report.done, report.failed) == ([-2, -1], {})
    names = {p.name for p in tmp_path.glob("*.png")}
    assert names == {p.name for n in (-2, -1) for p in [blender_name(scene, n)]}


def blender_name(scene, number):
    from wgmb_blender.saving import paths_of
    from wgmb_blender.wgmb_worker.recipe import View

    return paths_of(scene, [View()], number)[0]


def test_overwrite_off_leaves_what_is_there(tmp_path):
    scene = small(tmp_path)
    assert bpy.ops.wgmb.render_and_blur() == {"FINISHED"}
    (tmp_path / "blurred_0004.png").write_bytes(b"mine")
    (tmp_path / "blurred_0005.png").unlink()
    scene.render.use_overwrite = False
    sharp = {p: p.stat().st_mtime_ns for p in (tmp_path / "sharp").iterdir()}
    report = Report()
    for _ in job.steps(scene, wanted_of(scene), report):
        pass
    assert (report.skipped, report.done) == ([4], [5])
    assert (tmp_path / "blurred_0004.png").read_bytes() == b"mine"
    assert sharp == {p: p.stat().st_mtime_ns for p in (tmp_path / "sharp").iterdir()}


def test_an_output_that_cannot_be_written_ends_the_run(tmp_path):
    scene = small(tmp_path)
    before = everything(scene)
    steps = job.steps(scene, wanted_of(scene), Report())
    while next(steps)[1] != "Blurring frame 4":
        pass
    (tmp_path / "blurred_0004.png").mkdir()
    with pytest.raises(ProblemError, match=r"Blender: |Blender did not write"):
        list(steps)
    assert difference(before, everything(scene)) == []


def test_messages_have_no_marks_of_python():
    assert plain(ValueError("`skip_missing`\n leaves")) == "skip_missing leaves"


@pytest.mark.parametrize(
    "words",
    [["--frames", "x"], ["--samples", "0"], ["--scene", "none"], ["--method", "best"], ["--no"]],
    ids=lambda words: words[0],
)
def test_wrong_words_on_the_command_line(tmp_path, words, capfd):
    small(tmp_path)
    assert command.command(words) == 2
    assert capfd.readouterr().err.strip()
    assert not list(tmp_path.rglob("*.exr"))


def test_the_command_renders_on_one_machine_and_blurs_on_another(tmp_path, capfd):
    scene = small(tmp_path)
    assert command.command(["--frames", "4-5", "--render-only"]) == 0
    assert len(list((tmp_path / "sharp").glob("*.exr"))) == 4
    assert not list(tmp_path.glob("*.png"))
    capfd.readouterr()
    assert command.command(["--frames", "5", "--use-rendered", "--samples", "auto"]) == 0
    assert [p.name for p in tmp_path.glob("*.png")] == ["blurred_0005.png"]
    out = capfd.readouterr().out
    assert "wgmb: 0% Blurring frame 5\n" in out and "wgmb: 1 frame blurred\n" in out
    assert scene.name == bpy.context.scene.name


def test_the_command_has_no_window(tmp_path):
    """Some functions of Blender's take one for granted, and `blender -c` has none."""
    small(tmp_path)
    with bpy.context.temp_override(window=None):
        assert command.command(["--frames", "4"]) == 0
    assert [p.name for p in tmp_path.glob("*.png")] == ["blurred_0004.png"]


def test_a_link_that_lies_in_the_way_is_not_written_through(tmp_path):
    made, victim, place = (tmp_path / name for name in ("made", "victim", "out.exr"))
    made.write_bytes(b"new")
    victim.write_bytes(b"precious")
    (tmp_path / ".out.exr.part").symlink_to(victim)
    folders.put_in_place(made, place)
    assert (victim.read_bytes(), place.read_bytes()) == (b"precious", b"new")
    assert not made.exists()
