"""wgmb for ComfyUI: motion blur of images and of videos."""

from comfy_api.latest import ComfyExtension

from .nodes import MotionBlur, MotionBlurVideo


class MotionBlurExtension(ComfyExtension):
    """The nodes of this pack."""

    async def get_node_list(self):
        """As ComfyUI asks for them."""
        return [MotionBlur, MotionBlurVideo]


async def comfy_entrypoint():
    """ComfyUI's entry into the pack."""
    return MotionBlurExtension()
