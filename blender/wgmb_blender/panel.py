"""The panel in the output properties; it draws and does nothing else."""

from __future__ import annotations

import bpy

from . import preview, running, sharp


class WGMB_PT_motion_blur(bpy.types.Panel):
    """Motion Blur (wgmb)."""

    bl_label = "Motion Blur (wgmb)"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "output"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings and the buttons."""
        layout, scene = self.layout, context.scene
        own = scene.wgmb
        layout.use_property_split = True
        layout.use_property_decorate = False
        draw_exposure(layout, scene)
        column = layout.column()
        column.prop(own, "method")
        row = column.row()
        row.prop(own, "is_auto")
        row = column.row()
        row.active = not own.is_auto
        row.prop(own, "samples")
        row = column.row()
        row.active = own.method == "gather"
        row.prop(own, "light")
        column = layout.column()
        column.prop(own, "sharp")
        column.prop(own, "handles")
        column.prop(own, "overscan")
        if sharp.has_compositor(scene):
            column.prop(own, "compositing")
        draw_kept(layout.column(), own)
        draw_buttons(layout.column())


def draw_buttons(column: bpy.types.UILayout) -> None:
    """Draw the buttons that begin a run, or the progress of the one under way."""
    now = running.now()
    if now is None:
        column.operator("wgmb.render_and_blur", icon="RENDER_ANIMATION")
        column.operator("wgmb.blur_rendered", icon="FILE_REFRESH")
        column.operator("wgmb.compare", icon="IMAGE_DATA")
        column.operator("wgmb.preview", icon="HIDE_OFF", depress=preview.is_on())
        if preview.text():
            column.label(text=preview.text())
    else:
        row = column.row()
        row.progress(factor=now.share, text=now.text)
        row.operator("wgmb.stop", text="", icon="CANCEL")


def draw_exposure(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """The scene's own motion blur settings, which the blur follows."""
    render, column = scene.render, layout.column()
    column.label(text="Exposure, as in Render Properties, Motion Blur")
    column.prop(render, "motion_blur_position")
    column.prop(render, "motion_blur_shutter")
    if render.engine == "CYCLES":
        column.prop(scene.cycles, "rolling_shutter_type", text="Rolling Shutter")
        if scene.cycles.rolling_shutter_type != "NONE":
            column.prop(scene.cycles, "rolling_shutter_duration")
    header, curve = layout.panel("wgmb_shutter_curve", default_closed=True)
    header.label(text="Shutter Curve")
    if curve is not None:
        curve.template_curve_mapping(render, "motion_blur_shutter_curve")
    layout.label(text="Blender's own motion blur is off while frames are rendered", icon="INFO")


def draw_kept(column: bpy.types.UILayout, own: bpy.types.PropertyGroup) -> None:
    """The collections that stay sharp."""
    row = column.row()
    row.label(text="Keep Sharp")
    row.operator("wgmb.keep", text="", icon="ADD")
    for i, item in enumerate(own.kept):
        row = column.row(align=True)
        row.prop(item, "collection", text="")
        row.operator("wgmb.keep_no_more", text="", icon="REMOVE").index = i


def register() -> None:
    """Show the panel."""
    bpy.utils.register_class(WGMB_PT_motion_blur)


def unregister() -> None:
    """Hide it."""
    bpy.utils.unregister_class(WGMB_PT_motion_blur)
