"""Motion blur of a pygfx scene, live: an effect pass that records a method into pygfx's encoder."""

from __future__ import annotations

from typing import Any, Literal, Unpack

import numpy as np
import wgpu

from .. import gpu
from ..camera import MAX_INDEX, MOST_BODIES, Camera, Reprojections
from ..errors import InputError
from ..extras import needed_by
from ..gpu import wgsl
from ..gpu.textures import TexturePool
from ..gpu_frame.views import FrameViews
from ..methods import METHODS
from ..methods.keywords import BlurKeywords, MethodName
from ..pipeline.blur import Blur
from ..shutter import Shutter

with needed_by("wgmb.hosts.pygfx"):
    import pygfx
    from pygfx.renderers.wgpu import EffectPass

FILE = "hosts/pygfx.wgsl"
FORMAT = "rgba16float"  # of results: every device can write and filter it


class MotionBlurPass(EffectPass):
    """Blurs the motion since the last frame that was drawn.

    `camera`: of the scene. `method`: one that takes frames (tap, tiles, fusion, reproject, gather).
    With `renderer` and `scene`, objects whose material writes the pick buffer (`pick_write=True`)
    move by themselves; all others move with the camera only. `shutter`, `samples`, `options`: see
    Blur. One pass serves one renderer.

    Only the last frame is known, so each motion goes on as it was; a shutter with
    `phase="end"` takes the past alone. A frame in which nothing moves keeps its bits.
    """

    USES_DEPTH = True
    wgsl = """
        @fragment
        fn fs_main(varyings: Varyings) -> @location(0) vec4<f32> {
            return textureLoad(colorTex, vec2i(varyings.position.xy), 0);
        }
    """

    def __init__(
        self,
        camera: pygfx.Camera,
        method: MethodName = "tiles",
        *,
        renderer: pygfx.WgpuRenderer | None = None,
        scene: pygfx.WorldObject | None = None,
        shutter: Shutter | float = 180,
        samples: int | Literal["auto"] | None = None,
        **options: Unpack[BlurKeywords],
    ):
        super().__init__()
        if method in METHODS and "scene" in METHODS[method].needs:
            able = ", ".join(name for name, m in METHODS.items() if "scene" not in m.needs)
            raise InputError(f"method {method!r} needs a scene of wgmb's own; use {able}")
        if (renderer is None) != (scene is None):
            raise InputError("objects need both `renderer` and `scene`")
        self.camera = camera
        self.blur = Blur(
            method,
            shutter=shutter,
            samples=samples,
            device=self._device,
            output=FORMAT,
            **options,
        )
        self.blur._velocity.in_place = True  # pygfx submits a frame before it draws the next one
        self._images = TexturePool(self._device)
        self._views: dict[str, wgpu.GPUTextureView] = {}
        self._bodies = None if scene is None else Bodies(self._device, renderer, scene)
        self._before: Camera | None = None
        self._number = 0

    def reset(self) -> None:
        """Forget the last frame: after a cut, the next frame is not blurred."""
        self._before = None

    def render(
        self,
        command_encoder: wgpu.GPUCommandEncoder,
        color_tex: wgpu.GPUTextureView,
        depth_tex: wgpu.GPUTextureView,
        target_tex: wgpu.GPUTextureView,
    ) -> None:
        """Record the pass; pygfx calls it."""
        here, before = self._camera_now(), self._before
        self._before = here
        shown = color_tex
        if before is not None and not _same(here, before):
            color, depth = self._kept("color", color_tex), self._kept("depth", depth_tex)
            shown = self._blurred(command_encoder, color, depth, here, before)
        super(EffectPass, self).render(command_encoder, colorTex=shown, targetTex=target_tex)

    def _kept(self, name: str, view: wgpu.GPUTextureView) -> wgpu.GPUTextureView:
        """The view, or one like it from before: pygfx makes one a frame, and each needs groups."""
        kept = self._views.get(name)
        if kept is None or kept.texture is not view.texture:
            kept = self._views[name] = view
        return kept

    def _camera_now(self) -> Camera:
        camera: Any = self.camera
        view = np.asarray(camera.view_matrix, np.float64)
        clip = np.asarray(camera.projection_matrix, np.float64) @ view
        bodies = {} if self._bodies is None else self._bodies.matrices()
        return Camera(clip, view, bodies)

    def _blurred(
        self,
        encoder: wgpu.GPUCommandEncoder,
        color: wgpu.GPUTextureView,
        depth: wgpu.GPUTextureView,
        here: Camera,
        before: Camera,
    ) -> wgpu.GPUTextureView:
        size = color.size[0], color.size[1]
        self._number += 1
        number = self._number % 64 if self.blur.jitter else 0  # fewer buffers: noise repeats
        objects = None
        if self._bodies is not None:
            objects = self._bodies.encode(encoder, self.blur.frame_bindings(size, number))
        frame = FrameViews(
            color=color,
            depth=depth,
            object_id=objects,
            camera=Reprojections(here, prev=before, depth_kind="clip"),
        )
        output = self._images.view("output", size, FORMAT)
        self.blur.encode(encoder, frame, output, number=number)
        return output


def _same(a: Camera, b: Camera) -> bool:
    """Return True if nothing that is in both has moved."""
    if not np.array_equal(a.clip_from_world, b.clip_from_world):
        return False
    both = a.bodies.keys() & b.bodies.keys()
    return all(np.array_equal(a.bodies[k], b.bodies[k]) for k in both)


def _is_picked(thing: Any) -> bool:
    """Return True if the object is in the pick buffer."""
    return bool(getattr(getattr(thing, "material", None), "pick_write", False))


class Bodies:
    """The objects of a scene as bodies: an index for each, its matrix, its pixels.

    pygfx ids are random numbers of 20 bits; a body keeps its index while it is in the scene.
    """

    def __init__(self, device: wgpu.GPUDevice, renderer: Any, scene: Any):
        self._device, self._renderer, self._scene = device, renderer, scene
        self._images = TexturePool(device)
        self._index: dict[int, int] = {}  # by id
        self._table = np.zeros(wgsl.load(FILE).integer("IDS"), np.uint32)
        usage = wgpu.BufferUsage
        self._buffer = device.create_buffer_with_data(
            label="bodies", data=self._table, usage=usage.STORAGE | usage.COPY_DST
        )
        self._pick: wgpu.GPUTexture | None = None

    def matrices(self) -> dict[int, np.ndarray]:
        """`world_from_object` of every object in the pick buffer, by index.

        Objects that cannot be inverted, and those beyond the most bodies, belong to the world.
        """
        things = {o.id: o for o in self._scene.iter() if _is_picked(o)}
        if things.keys() != self._index.keys():
            self._number(things)
        matrices = {
            index: np.array(things[id].world.matrix, np.float64)
            for id, index in self._index.items()
            if index
        }
        return {k: m for k, m in matrices.items() if np.linalg.cond(m) < 1e12}

    def _number(self, things: dict[int, Any]) -> None:
        """Give new objects an index that is free; 0, the world, where there is none."""
        kept = {id: index for id, index in self._index.items() if id in things}
        used, free = set(kept.values()), iter(range(1, min(MOST_BODIES, MAX_INDEX) + 1))
        for id in things.keys() - kept.keys():
            kept[id] = next((index for index in free if index not in used), 0)
        self._index = kept
        self._table[:] = 0
        self._table[list(kept)] = list(kept.values())
        self._device.queue.write_buffer(self._buffer, 0, self._table)

    def encode(
        self, encoder: wgpu.GPUCommandEncoder, bindings: gpu.FrameBindings
    ) -> wgpu.GPUTextureView | None:
        """Record each pixel's index; None where the renderer has no pick buffer of this size."""
        picked = self._renderer._blender.get_texture("pick")  # pygfx has no public way to it
        if picked is None or picked.size[:2] != bindings.size:
            return None
        copy = self._copy_of(picked)
        encoder.copy_texture_to_texture({"texture": picked}, {"texture": copy}, picked.size)
        objects = self._images.view("objects", bindings.size, "r32uint")
        gpu.kernel(self._device, FILE).run(
            encoder, "main", bindings, pick=self._view, bodies=self._buffer, object=objects
        )
        return objects

    def _copy_of(self, picked: wgpu.GPUTexture) -> wgpu.GPUTexture:
        """A texture for the pick buffer, which shaders cannot read."""
        if self._pick is None or self._pick.size != picked.size:
            usage = wgpu.TextureUsage
            self._pick = self._device.create_texture(
                label="pick",
                size=picked.size,
                format=picked.format,
                usage=usage.COPY_DST | usage.TEXTURE_BINDING,
            )
            self._view = self._pick.create_view()
        return self._pick
