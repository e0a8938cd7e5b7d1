"""The nodes: images in and out, a video in and out with its sound."""

import logging
import os
import tempfile
from dataclasses import replace
from fractions import Fraction
from functools import cache

import folder_paths
from comfy.model_management import throw_exception_if_processing_interrupted
from comfy.utils import ProgressBar
from comfy_api.latest import InputImpl, io

import wgmb
from wgmb.threads import Stop, ahead

CATEGORY = "image/video"
THREAD = "wgmb"  # pictures are made in it, so that a stop is heard at once
_REMEDY = (
    "wgmb draws with Vulkan. In a container, pass the GPU's graphics as well: "
    "NVIDIA_DRIVER_CAPABILITIES=all, and the package libvulkan1; without a GPU, "
    "mesa-vulkan-drivers draws on the CPU"
)


def device():
    """The GPU, a new one where it was lost; an error that names the remedy where there is none."""
    try:
        found = wgmb.gpu.open_device()
    except wgmb.DeviceError as error:
        raise RuntimeError(f"{error}. {_REMEDY}.") from None
    is_software = found.adapter_info["adapter_type"] == wgmb.gpu.SOFTWARE
    _tell(found.adapter.summary, is_software)
    return found


@cache
def _tell(name, is_software):
    """Log which GPU it is, once."""
    logging.info("wgmb: %s", name)
    if is_software:
        logging.warning("wgmb: Vulkan sees no GPU, so this is slow. %s.", _REMEDY)


def shared_inputs():
    """The settings of both nodes."""
    return [
        io.Float.Input(
            "shutter", default=180.0, min=0.0, max=1440.0, step=5.0,
            tooltip="Degrees of an output frame's interval during which the shutter is open. 180: "
            "half of it, as in films. 360: all of it.",
        ),
        io.Float.Input(
            "fps_out", default=0.0, min=0.0, max=1000.0, step=0.001,
            tooltip="Frames per second of the result. 0: as many as there are.",
        ),
        io.Combo.Input(
            "flow", options=["auto", "search", "dis", "none"], default="auto",
            tooltip="Where motion comes from. search: found on the GPU, follows fast objects. "
            "dis: by OpenCV, quick. none: frames are averaged. auto: search if there is a GPU.",
        ),
        io.Combo.Input(
            "curve", options=["box", "trapezoid", "triangle", "cosine"], default="box",
            tooltip="The weight of each instant while the shutter is open.",
        ),
    ]  # fmt: skip


class MotionBlur(io.ComfyNode):
    """Images in, images out."""

    @classmethod
    def define_schema(cls):
        """Names, ranges and tooltips."""
        shutter, fps_out, flow, curve = shared_inputs()
        return io.Schema(
            node_id="WgmbMotionBlur",
            display_name="Motion Blur (wgmb)",
            category=CATEGORY,
            description="Blurs what moves along its motion, as a camera's shutter does. The motion "
            "is found in the frames. With fps_out, the result has another rate.",
            inputs=[
                io.Image.Input("images", tooltip="Frames in their order."),
                shutter,
                io.Float.Input(
                    "fps_in", default=24.0, min=0.001, max=1000.0, step=0.001,
                    tooltip="Frames per second of the images.",
                ),
                fps_out,
                flow,
                curve,
                io.Mask.Input("holdout", optional=True, tooltip="1 stays sharp: signs, logos."),
            ],
            outputs=[
                io.Image.Output(id="blurred", display_name="images"),
                io.Float.Output(id="fps", display_name="fps"),
            ],
        )  # fmt: skip

    @classmethod
    def execute(cls, images, shutter, fps_in, fps_out, flow, curve, holdout=None):
        """Blur the images."""
        fps = fps_out or fps_in
        mask = None if holdout is None else holdout.cpu().numpy()
        mask = mask[0] if mask is not None and mask.ndim == 3 else mask
        settings = {"shutter": shutter, "flow": flow, "curve": curve, "holdout": mask}
        return io.NodeOutput(blurred(images, fps_in, fps, settings), fps)


class MotionBlurVideo(io.ComfyNode):
    """A video in, a video out."""

    @classmethod
    def define_schema(cls):
        """Names, ranges and tooltips."""
        return io.Schema(
            node_id="WgmbMotionBlurVideo",
            display_name="Motion Blur of a Video (wgmb)",
            category=CATEGORY,
            description="Blurs what moves in a video along its motion; sound is kept. A video of a "
            "file goes through frame by frame, without filling the memory, in its own colours.",
            inputs=[io.Video.Input("video"), *shared_inputs()],
            outputs=[io.Video.Output(id="blurred", display_name="video")],
        )

    @classmethod
    def execute(cls, video, shutter, fps_out, flow, curve):
        """Blur the video: a file's from file to file, another's frames in memory."""
        settings = {"shutter": shutter, "flow": flow, "curve": curve}
        if isinstance(video, InputImpl.VideoFromFile):
            return io.NodeOutput(blurred_file(video, fps_out, settings))
        parts = video.get_components()
        fps = Fraction(fps_out).limit_denominator(1001) if fps_out else parts.frame_rate
        images = blurred(parts.images, parts.frame_rate, fps, settings)
        made = replace(parts, images=images, frame_rate=fps)
        return io.NodeOutput(InputImpl.VideoFromComponents(made))


def blurred(images, fps_in, fps, settings):
    """The images (frames, height, width, channels), blurred."""

    def work():
        read = (image.cpu() for image in images)
        run = wgmb.blur_pictures(read, fps_in=fps_in, fps=fps, device=device(), **settings)
        logging.info("wgmb: motion by %s", run.how)
        try:
            yield run.count(len(images))
            yield from run
        finally:
            run.close()

    items = ahead(work(), 2, THREAD, patience=0, check=throw_exception_if_processing_interrupted)
    count = next(items)
    bar = ProgressBar(count)
    made = images.new_empty((count, *images.shape[1:]), device="cpu")
    for number, image in enumerate(items):
        made[number] = image
        bar.update(1)
    return made


def blurred_file(video, fps, settings):
    """A video of a file, blurred into a file of ComfyUI's folder for such."""
    source = video.get_stream_source()
    begin, lasts = getattr(video, "get_active_trim_window", lambda: (0.0, 0.0))()
    settings = settings | ({"fps": fps} if fps else {})
    settings |= ({"begin": begin} if begin else {}) | ({"end": begin + lasts} if lasts else {})
    folder = folder_paths.get_temp_directory()
    os.makedirs(folder, exist_ok=True)
    output = os.path.join(tempfile.mkdtemp(prefix="wgmb_", dir=folder), "blurred.mp4")
    if not isinstance(source, str):
        path = f"{output}.in"
        with open(path, "wb") as file:
            file.write(source.getbuffer())
        source = path

    rate = fps or float(getattr(video, "get_frame_rate", lambda: 24)())
    bar, stop, done = ProgressBar(max(1, round(video.get_duration() * rate))), Stop(), []

    def progress(number, state):
        if stop.is_set():
            raise StoppedError
        done.append(number)

    def check():  # a bar belongs to the thread that executes a node
        throw_exception_if_processing_interrupted()
        while done:
            done.pop()
            bar.update(1)

    def work():
        yield wgmb.blur_video(source, output, device=device(), progress=progress, **settings)

    try:
        (made,) = ahead(work(), 1, THREAD, patience=0, check=check)
    finally:
        stop.set()
    for text in [*made.notes, *made.left_out, *filter(None, [made.loss])]:
        logging.info("wgmb: %s", text)
    return InputImpl.VideoFromFile(output)


class StoppedError(Exception):
    """Ends the blur of a video that nobody wants any more."""
