"""wgpu beside Blender's own use of the GPU."""

from __future__ import annotations

from functools import cache


@cache
def leave_opengl() -> None:
    """Keep wgpu from OpenGL; call it before anything that looks for adapters.

    Blender draws its window with OpenGL. Where wgpu looks for adapters of OpenGL in the same
    process, its driver layer finds the context in use and ends Blender.
    """
    from wgpu.backends.wgpu_native.extras import set_instance_extras

    try:
        set_instance_extras(backends=["Vulkan", "Metal", "DX12"])
    except RuntimeError:  # another add-on has looked already, and lived
        return
