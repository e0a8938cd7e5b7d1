"""The buttons: each `next` of a job at a timer's event, or all of them at once without a window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import bpy
from bpy.props import IntProperty

from . import job, preview, running
from .comparison import COMPARISON, PREVIEW, open_in_editor
from .rendering import Render, at_once, beside
from .settings import wanted_of
from .wanted import ERRORS, Report, Step, Wanted
from .wgmb_worker.problem import StoppedError, plain

_EVERY = 0.02  # seconds between two events


class Running:
    """Common part of the operators."""

    bl_options = {"REGISTER"}
    _steps: Iterator[Step] | None = None
    _timer: bpy.types.Timer | None = None
    _report: Report

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return False while Blender renders, or one of these operators is at work."""
        if running.now() is not None:
            cls.poll_message_set("Frames are being blurred")
            return False
        return context.scene is not None and not bpy.app.is_job_running("RENDER")

    def begin(self, context: bpy.types.Context, render: Render) -> Iterator[Step]:
        """Make the steps and the report; a preview ends, as its files may change."""
        preview.end()
        self._report = Report()
        return self.steps(context.scene, self._report, render)

    def steps(self, scene: bpy.types.Scene, report: Report, render: Render) -> Iterator[Step]:
        """Yield the steps of this operator."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do all of it."""
        try:
            for _ in self.begin(context, at_once):
                pass
        except ERRORS as error:
            return self._failed(error)
        return self._told(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Do it beside the window."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            self._steps = self.begin(context, beside)
        except ERRORS as error:
            return self._failed(error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(_EVERY, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 100)
        running.begin()
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Do a step, or stop."""
        now = running.now() or running.begin()
        if event.type == "ESC":
            now.is_stopping = True
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        # A frame that Blender renders ends by Esc itself; until then its settings are needed.
        if now.is_stopping and not bpy.app.is_job_running("RENDER"):
            return self._end(context, StoppedError("Stopped; finished frames are kept"))
        try:
            share, text = next(self._steps)
        except StopIteration:
            return self._end(context, None)
        except ERRORS as error:
            return self._end(context, error)
        except BaseException:
            self._end(context, None)
            raise
        if (now.share, now.text) != (share, text):
            now.share, now.text = share, text
            context.window_manager.progress_update(round(100 * share))
            context.workspace.status_text_set(f"Motion blur: {text}, {share:.0%}   Esc: cancel")
            running.redraw(context.window_manager)
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Put everything back where Blender ends the operator, on loading another file say."""
        self._end(context, None)

    def _end(self, context: bpy.types.Context, error: BaseException | None) -> set[str]:
        running.end()
        running.redraw(context.window_manager)
        self._steps.close()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        return self._told(context) if error is None else self._failed(error)

    def _told(self, context: bpy.types.Context) -> set[str]:
        for line in self._report.lines[:-1]:
            is_failure = line in self._report.failed.values()
            self.report({"ERROR" if is_failure else "INFO"}, line)
        for line in self._report.lines[-1:]:
            self.report({"INFO"}, line)
        return {"FINISHED"}

    def _failed(self, error: BaseException) -> set[str]:
        for line in self._report.lines if self._report.done or self._report.failed else ():
            self.report({"INFO"}, line)
        is_stop = isinstance(error, StoppedError)
        self.report({"WARNING" if is_stop else "ERROR"}, plain(error))
        return {"CANCELLED"}


class WGMB_OT_render_and_blur(Running, bpy.types.Operator):
    """Render the frames without motion blur, then blur them"""

    bl_idname = "wgmb.render_and_blur"
    bl_label = "Render and Blur"

    def steps(self, scene: bpy.types.Scene, report: Report, render: Render) -> Iterator[Step]:
        """Render and blur the scene's frames."""
        return job.steps(scene, wanted_of(scene), report, render)


class WGMB_OT_blur_rendered(Running, bpy.types.Operator):
    """Blur the sharp frames that are there; nothing is rendered"""

    bl_idname = "wgmb.blur_rendered"
    bl_label = "Blur Rendered Frames"

    def steps(self, scene: bpy.types.Scene, report: Report, render: Render) -> Iterator[Step]:
        """Blur the scene's frames."""
        wanted: Wanted = replace(wanted_of(scene), is_rendering=False)
        return job.steps(scene, wanted, report, render)


class WGMB_OT_compare(Running, bpy.types.Operator):
    """Render the current frame, and show it sharp and blurred side by side in the Image Editor"""

    bl_idname = "wgmb.compare"
    bl_label = "Compare at This Frame"

    def steps(self, scene: bpy.types.Scene, report: Report, render: Render) -> Iterator[Step]:
        """Render and blur one frame."""
        return job.compare(scene, wanted_of(scene), report, render)

    def _told(self, context: bpy.types.Context) -> set[str]:
        image = bpy.data.images.get(COMPARISON)
        if image is None or not open_in_editor(context.screen, image):
            self.report({"INFO"}, f"Open the image {COMPARISON!r} in an Image Editor")
        return super()._told(context)


class WGMB_OT_preview(bpy.types.Operator):
    """Show the current frame, blurred from its sharp file, in the Image Editor, and again whenever
    the frame or a setting changes; press again to end it"""

    bl_idname = "wgmb.preview"
    bl_label = "Live Preview"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return False while frames are blurred or rendered."""
        return Running.poll.__func__(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Begin or end it."""
        if preview.is_on():
            preview.end()
            return {"FINISHED"}
        image = preview.begin(context.scene)
        if not open_in_editor(context.screen, image):
            self.report({"INFO"}, f"Open the image {PREVIEW!r} in an Image Editor")
        return {"FINISHED"}


class WGMB_OT_stop(bpy.types.Operator):
    """Stop after the frame that is being rendered; Esc stops this one too"""

    bl_idname = "wgmb.stop"
    bl_label = "Stop"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Tell the one that is at work."""
        now = running.now()
        if now is None:
            return {"CANCELLED"}
        now.is_stopping = True
        return {"FINISHED"}


class WGMB_OT_keep(bpy.types.Operator):
    """Add a collection whose objects stay sharp"""

    bl_idname = "wgmb.keep"
    bl_label = "Add Collection"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add an empty row."""
        context.scene.wgmb.kept.add()
        return {"FINISHED"}


class WGMB_OT_keep_no_more(bpy.types.Operator):
    """Take a collection off the list"""

    bl_idname = "wgmb.keep_no_more"
    bl_label = "Remove Collection"
    bl_options = {"REGISTER", "UNDO"}

    index: IntProperty()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Remove a row."""
        context.scene.wgmb.kept.remove(self.index)
        return {"FINISHED"}


CLASSES = (
    WGMB_OT_render_and_blur,
    WGMB_OT_blur_rendered,
    WGMB_OT_compare,
    WGMB_OT_preview,
    WGMB_OT_stop,
    WGMB_OT_keep,
    WGMB_OT_keep_no_more,
)


def register() -> None:
    """Make the buttons known."""
    for one in CLASSES:
        bpy.utils.register_class(one)


def unregister() -> None:
    """Forget them."""
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
