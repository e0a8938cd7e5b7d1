"""Quality and time of sharp frames with a blur against the path tracer's own blur.

PYTHONPATH=.:blender:tests/blender python tools/blender/blender_worth.py FOLDER [--shaded]

Runs in the environment of tests/blender (`./run test all` makes it). The scene is
the tests' crossing, 480 x 270, with a centred shutter of 180 degrees: emission only, or `--shaded`:
rough surfaces, a lamp of some size, soft shadows that move, two bounces. Truth is Cycles' blur with
512 samples a pixel.
Printed are PSNR of sRGB values against it and CPU seconds of all threads, of the render and of the
blur (on lavapipe, so that both are of the same processor), first-use compilation left out.
"""

import sys
import time
from pathlib import Path

import bpy

import conftest  # noqa: F401  (the paths of what is needed)
import scenes
import wgmb
from wgmb_blender import picture, sharp
from wgmb_blender.rendering import at_once
from wgmb_blender.wgmb_worker.recipe import SharpFrames

SIZE, NUMBER, TRUTH = (480, 270), 5, 512


def shaded():
    """The crossing with light that falls on it."""
    scene = scenes.crossing(size=SIZE)
    for material in bpy.data.materials:
        nodes, link = material.node_tree.nodes, material.node_tree.links.new
        light = next(n for n in nodes if n.type == "EMISSION")
        out = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        surface = nodes.new("ShaderNodeBsdfPrincipled")
        surface.inputs["Roughness"].default_value = 0.4
        surface.inputs["Base Color"].default_value = light.inputs[0].default_value
        if light.inputs[0].is_linked:
            link(light.inputs[0].links[0].from_socket, surface.inputs["Base Color"])
        link(surface.outputs[0], out.inputs[0])
    bpy.ops.object.light_add(type="AREA", location=(3, -5, 5), rotation=(0.8, 0.3, 0.3))
    bpy.context.object.data.energy, bpy.context.object.data.size = 900, 2
    scene.cycles.max_bounces = 2
    return scene


def sharp_frames(scene, folder: Path, samples: int) -> float:
    """Render frame 5 and its neighbours; returns the seconds of one."""
    files = SharpFrames(str(folder / f"sharp{samples}_"))
    scene.cycles.samples = samples
    seconds = []
    for n in (NUMBER - 1, NUMBER, NUMBER + 1):
        began = time.process_time()
        seen = picture.picture_of(scene)
        for _ in sharp.render_frame(scene, n, files, seen, False, False, at_once):
            pass
        seconds.append(time.process_time() - began)
    return sum(seconds) / 3


def main() -> None:
    """Print a table."""
    folder = Path(sys.argv[1])
    is_shaded = "--shaded" in sys.argv
    scene = shaded() if is_shaded else scenes.crossing(size=SIZE)
    scene.cycles.seed = 1
    want = scenes.truth(scene, NUMBER, folder / "truth", samples=TRUTH)
    scene.cycles.seed = 7
    for samples in (16, 64, 128, 256):
        began = time.process_time()
        got = scenes.truth(scene, NUMBER, folder / f"cycles{samples}", samples=samples)
        took = time.process_time() - began
        print(f"Cycles' blur, {samples:4d} samples: {scenes.psnr(got, want):.1f} dB, {took:.2f} s")
    for samples in (16, 64) if is_shaded else (16,):
        took = sharp_frames(scene, folder, samples)
        clip = wgmb.Clip(folder / f"sharp{samples}_####.exr")
        frame = clip.with_neighbours(clip.source(NUMBER))
        sharp_db = scenes.psnr(scenes.pixels(folder / f"sharp{samples}_0005.exr"), want)
        for method in ("gather", "tap"):
            blur = wgmb.Blur(method)
            blur(frame)
            began = time.process_time()
            got = blur(frame)
            more = time.process_time() - began
            print(
                f"sharp, {samples:4d} samples, and {method}: {scenes.psnr(got, want):.1f} dB, "
                f"{took:.2f} s + {more:.2f} s (sharp {sharp_db:.1f} dB)"
            )


if __name__ == "__main__":
    main()
