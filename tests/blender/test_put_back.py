"""Every setting is as before: after a run, after one that was stopped anywhere, after a failure."""

import contextlib
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import scenes
import wgmb_blender
from wgmb_blender import job, operators, rendering
from wgmb_blender.changed import changed
from wgmb_blender.comparison import COMPARISON
from wgmb_blender.settings import wanted_of
from wgmb_blender.wanted import Report
from wgmb_blender.wgmb_worker.problem import ProblemError, StoppedError

FIVE = scenes.FIVE
PLAIN = {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"}
# 4.2 itself counts a user too many of each object when a scene is copied and removed; loading a
# file counts anew.
MISCOUNTED = {"users"} if bpy.app.version < (4, 5, 0) else set()
VARIES = MISCOUNTED | {
    "frame_current_final",
    "frame_float",
    "session_uid",
    "is_updated",
    "is_updated_data",
}


def values(owner) -> dict:
    """Every plain property of something in Blender."""
    found = {}
    for p in owner.bl_rna.properties:
        if p.type in PLAIN and p.identifier not in VARIES:
            value = getattr(owner, p.identifier)
            plain = isinstance(value, (bool, int, float, str, set))
            found[p.identifier] = value if plain else tuple(np.ravel(value))
    return found


def everything(scene) -> dict:
    """The settings of a scene, its cameras, compositor and data-blocks."""
    render = scene.render
    groups = {
        "scene": scene,
        "render": render,
        "image": render.image_settings,
        "stereo": render.image_settings.stereo_3d_format,
        "film": render.ffmpeg,
        "cycles": scene.cycles,
        "view": scene.view_settings,
        "lens": scene.camera.data,
    }
    groups |= {f"layer {layer.name}": layer for layer in scene.view_layers}
    groups |= {f"object {one.name}": one for one in scene.objects}
    tree = getattr(scene, "compositing_node_group" if FIVE else "node_tree")
    nodes = [(n.name, n.type, len(n.inputs), len(n.outputs)) for n in tree.nodes] if tree else None
    blocks = {
        kind: sorted(one.name for one in getattr(bpy.data, kind))
        for kind in ("scenes", "images", "node_groups", "objects", "collections", "cameras")
    }
    # Rendering makes these itself.
    blocks["images"] = [n for n in blocks["images"] if n not in ("Render Result", "Viewer Node")]
    return {name: values(one) for name, one in groups.items()} | {"nodes": nodes} | blocks


def difference(before: dict, after: dict) -> list[str]:
    told = []
    for name, old in before.items():
        new = after[name]
        if isinstance(old, dict):
            told += [f"{name}.{k}: {v!r} -> {new[k]!r}" for k, v in old.items() if new[k] != v]
        elif old != new:
            told.append(f"{name}: {old!r} -> {new!r}")
    return told


@contextlib.contextmanager
def unchanged(scene):
    before = everything(scene)
    yield
    assert difference(before, everything(scene)) == []


def small(tmp_path, kind="PNG", depth="8", **how):
    """A scene that uses much that the add-on touches; two frames of 32 x 18."""
    scene = scenes.crossing(size=(64, 36))
    scene.render.resolution_percentage = 50
    scene.cycles.samples = 1
    scene.frame_start, scene.frame_end = 4, 5
    scene.frame_set(7, subframe=0.25)
    scenes.output(scene, tmp_path, kind, depth, **how)
    render = scene.render
    render.use_motion_blur, render.use_border, render.use_sequencer = True, True, True
    render.border_min_x, render.border_max_y = 0.1, 0.9
    if not FIVE:
        scene.use_nodes = True
    else:
        tree = bpy.data.node_groups.new("comp", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
        node = tree.nodes.new("CompositorNodeRLayers")
        tree.links.new(node.outputs["Image"], tree.nodes.new("NodeGroupOutput").inputs[0])
    held = bpy.data.collections.new("held")
    scene.collection.children.link(held)
    held.objects.link(bpy.data.objects["Cube"])
    scene.wgmb.kept.add().collection = held
    scene.wgmb.overscan, scene.wgmb.method = 3, "tap"
    return scene


def film(tmp_path):
    scene = small(tmp_path, "FFMPEG", depth=None, mode="RGB", media="VIDEO")
    made = scene.render.ffmpeg
    made.format, made.codec, made.constant_rate_factor = "MPEG4", "H264", "HIGH"
    made.audio_codec = "AAC"
    return scene


KINDS = {
    "png": small,
    "exr": lambda folder: small(folder, "OPEN_EXR", depth="16"),
    "multilayer": lambda folder: small(
        folder, "OPEN_EXR_MULTILAYER", depth="16", media="MULTI_LAYER_IMAGE"
    ),
    "jpeg": lambda folder: small(folder, "JPEG", depth=None, mode="RGB"),
    "film": film,
}


@pytest.mark.parametrize("kind", KINDS)
def test_after_a_run(tmp_path, kind):
    scene = KINDS[kind](tmp_path)
    with unchanged(scene):
        assert bpy.ops.wgmb.render_and_blur() == {"FINISHED"}
    made = [p.name for p in tmp_path.iterdir() if p.is_file()]
    assert len(made) == (1 if kind == "film" else 2)


@pytest.mark.parametrize("kind", ["png", "film"])
def test_after_one_that_is_stopped_at_any_step(tmp_path, kind):
    scene = KINDS[kind](tmp_path)
    scene.wgmb.samples = 1
    stop = 0
    with unchanged(scene):
        while True:
            report = Report()
            steps = job.steps(scene, replace(wanted_of(scene), frames=(4,), handles=False), report)
            for _ in range(stop):
                if next(steps, None) is None:
                    break
            else:
                steps.close()
                stop += 1
                continue
            break
    assert stop > 4
    assert report.done == [4]


def test_after_a_frame_that_fails_and_the_others_are_done(tmp_path):
    scene = small(tmp_path)
    bpy.ops.wgmb.render_and_blur()
    scene.frame_end = 7
    sharp = tmp_path / "sharp"
    sharp.joinpath("sharp_0005.exr").write_bytes(b"junk")
    with unchanged(scene):
        report = Report()
        for _ in job.steps(scene, replace(wanted_of(scene), is_rendering=False), report):
            pass
    assert report.done == [4, 6]
    assert list(report.failed) == [5, 7]
    assert "sharp_0005.exr" in report.failed[5]
    assert report.failed[7] == f"Frame 7: there is no {sharp / 'sharp_0007.exr'}"
    assert report.lines[-1] == "2 frames blurred"


def test_after_blender_could_not_render(tmp_path, monkeypatch):
    scene = small(tmp_path)

    def fail(scene, number, paths):
        assert not scene.render.use_motion_blur
        raise ProblemError("no memory")
        yield

    with unchanged(scene), pytest.raises(ProblemError, match="no memory"):
        list(job.steps(scene, wanted_of(scene), Report(), fail))


def test_after_nested_changes_of_the_same_things():
    scene = scenes.crossing()
    image = scene.render.image_settings
    with unchanged(scene):
        more = [(image, "media_type", "MULTI_LAYER_IMAGE")] if FIVE else []
        with changed([*more, (image, "file_format", "OPEN_EXR_MULTILAYER")]):
            more = [(image, "media_type", "IMAGE")] if FIVE else []
            with changed([*more, (image, "file_format", "PNG"), (image, "color_depth", "16")]):
                assert image.color_depth == "16"
            assert image.file_format == "OPEN_EXR_MULTILAYER"


# ---- the operators, with stand-ins for the window -----------------------------------------------


class Window:
    """Blender's window as a modal operator sees it, and the operator's messages."""

    def __init__(self, scene):
        self.told, self.reports = [], []
        manager = SimpleNamespace(
            event_timer_add=lambda every, window: "timer",
            event_timer_remove=lambda timer: self.told.append("timer removed"),
            modal_handler_add=lambda operator: None,
            progress_begin=lambda low, high: None,
            progress_update=lambda value: self.told.append(value),
            progress_end=lambda: self.told.append("progress ended"),
            windows=[],
        )
        self.context = SimpleNamespace(
            scene=scene,
            window=object(),
            window_manager=manager,
            workspace=SimpleNamespace(status_text_set=self.told.append),
            screen=None,
        )

    def run(self, kind, monkeypatch, stop_after=None):
        """Run an operator's own functions; returns its result and how many events it took."""
        monkeypatch.setattr(operators.bpy, "app", _App(bpy.app))
        one = SimpleNamespace(report=lambda level, text: self.reports.append((level, text)))
        for name in ("begin", "steps", "execute", "_told", "_failed", "_end"):
            setattr(one, name, getattr(kind, name).__get__(one))
        done, events = kind.invoke(one, self.context, None), 0
        while done & {"RUNNING_MODAL", "PASS_THROUGH"}:
            events += 1
            key = "ESC" if stop_after is not None and events > stop_after else "TIMER"
            if events % 3 == 0 and key == "TIMER":
                key = "MOUSEMOVE"
            done = kind.modal(one, self.context, SimpleNamespace(type=key))
        return done, events


class _App:
    """bpy.app, but for being in the background."""

    background = False

    def __init__(self, app):
        self._app = app

    def __getattr__(self, name):
        return getattr(self._app, name)


def test_the_window_runs_to_the_end(tmp_path, monkeypatch):
    scene = small(tmp_path)
    window = Window(scene)
    with unchanged(scene):
        done, _ = window.run(operators.WGMB_OT_render_and_blur, monkeypatch)
    assert done == {"FINISHED"}
    assert window.reports[-1] == ({"INFO"}, "2 frames blurred")
    assert window.told[-3:] == ["timer removed", "progress ended", None]
    texts = [t for t in window.told if isinstance(t, str) and t.startswith("Motion blur: ")]
    assert texts[0] == "Motion blur: Opening the GPU, 0%   Esc: cancel"
    assert "Motion blur: Rendering frame 3, 0%   Esc: cancel" in texts
    assert any(t.startswith("Motion blur: Blurring frame 5, ") for t in texts)
    assert {p.name for p in tmp_path.glob("*.png")} == {"blurred_0004.png", "blurred_0005.png"}


def test_esc_at_every_event(tmp_path, monkeypatch):
    scene = small(tmp_path)
    scene.frame_end, scene.wgmb.handles, scene.wgmb.samples = 4, False, 1
    stop = 0
    with unchanged(scene):
        while True:
            window = Window(scene)
            done, _ = window.run(operators.WGMB_OT_render_and_blur, monkeypatch, stop)
            if done == {"FINISHED"}:
                break
            assert done == {"CANCELLED"}
            assert window.reports[-1] == ({"WARNING"}, "Stopped; finished frames are kept")
            assert window.told[-3:] == ["timer removed", "progress ended", None]
            stop = stop + 1 if stop < 12 else stop * 2
    assert stop > 4


def test_finished_frames_stay(tmp_path, monkeypatch):
    scene = small(tmp_path)
    steps = job.steps(scene, wanted_of(scene), Report())
    while next(steps)[1] != "Blurring frame 5":
        pass
    steps.close()
    assert [p.name for p in tmp_path.glob("*.png")] == ["blurred_0004.png"]
    assert len(list((tmp_path / "sharp").glob("*.exr"))) == 4


def test_a_rendering_that_is_stopped_in_its_own_window(tmp_path, monkeypatch):
    """Blender tells by a handler that it was; what else hangs there stays."""
    scene = small(tmp_path)
    handlers = bpy.app.handlers
    before = [list(h) for h in (handlers.render_complete, handlers.render_cancel)]
    with unchanged(scene):
        steps = rendering.beside(scene, 4, [tmp_path / "x.png"])
        monkeypatch.setattr(rendering, "bpy", _Stopping())
        with pytest.raises(StoppedError):
            list(steps)
        scene.frame_set(7, subframe=0.25)
    assert before == [list(h) for h in (handlers.render_complete, handlers.render_cancel)]


class _Stopping:
    """A Blender whose user presses Esc as soon as it renders."""

    app = bpy.app

    class ops:
        class render:
            @staticmethod
            def render(*how, **more):
                for hook in list(bpy.app.handlers.render_cancel):
                    hook(bpy.context.scene)


# ---- compare, and the register -------------------------------------------------------------


def test_compare_shows_both_halves(tmp_path):
    scene = small(tmp_path)
    scene.frame_set(5)
    scene.wgmb.method = "gather"
    scene.render.use_border, scene.cycles.samples = False, 4
    scene.render.motion_blur_shutter = 1.0
    before = everything(scene)
    assert bpy.ops.wgmb.compare() == {"FINISHED"}
    image = bpy.data.images[COMPARISON]
    assert tuple(image.size) == (64, 18)
    values = np.array(image.pixels[:]).reshape(18, 64, 4)
    left, right = values[:, :32], values[:, 32:]
    assert 0.003 < np.abs(left - right).mean() < 0.2
    assert np.abs(np.diff(right, axis=1)).mean() < np.abs(np.diff(left, axis=1)).mean()
    bpy.data.images.remove(image)
    assert difference(before, everything(scene)) == []
    assert not list(tmp_path.iterdir())


def test_the_register_leaves_nothing_behind():
    def there():
        names = [n for n in dir(bpy.types) if "wgmb" in n.lower()]
        hooks = sum(len(h) for h in vars(type(bpy.app.handlers)).values() if isinstance(h, list))
        return names, hooks, hasattr(bpy.types.Scene, "wgmb"), dir(bpy.ops.wgmb)

    here = there()
    wgmb_blender.unregister()
    gone = there()
    assert gone[0] == [] and not gone[2] and gone[3] == []
    wgmb_blender.register()
    assert there() == here


def test_the_add_on_enabled_twice_is_a_sentence_and_harms_nothing(tmp_path):
    with pytest.raises(RuntimeError, match="is enabled already, from another place"):
        wgmb_blender.register()
    small(tmp_path)
    assert bpy.ops.wgmb.render_and_blur() == {"FINISHED"}


def test_the_stop_button_and_one_run_at_a_time(tmp_path, monkeypatch):
    """Blender itself takes an Esc that comes as a frame ends; the button's press is not lost."""
    scene = small(tmp_path)
    assert operators.WGMB_OT_render_and_blur.poll(bpy.context)
    assert bpy.ops.wgmb.stop() == {"CANCELLED"}
    window, seen = Window(scene), []

    def press(text):
        if text is not None and "Blurring frame 5" in text:
            seen.append(operators.WGMB_OT_compare.poll(bpy.context))
            assert bpy.ops.wgmb.stop() == {"FINISHED"}

    window.context.workspace.status_text_set = press
    with unchanged(scene):
        done, _ = window.run(operators.WGMB_OT_render_and_blur, monkeypatch)
    assert done == {"CANCELLED"} and seen[0] is False
    assert window.reports[-1] == ({"WARNING"}, "Stopped; finished frames are kept")
    assert [p.name for p in tmp_path.glob("*.png")] == ["blurred_0004.png"]
    assert operators.WGMB_OT_render_and_blur.poll(bpy.context)
