"""Small stereo frames, written without wgmb: of each eye the square moves its own way."""

import numpy as np

import make_frames as make

RIGHT, LEFT = (6.0, 0.0), (0.0, 6.0)  # [px] of each view's square
STEREO, NUKE = ["right", "left"], ["left", "right"]  # the default view first


def one_view(number: int, velocity) -> dict[str, np.ndarray]:
    """Channels of one eye, without its name; `forward` is what Nuke writes."""
    channels = make.frame(number, "nuke", velocity)
    return {name: plane for name, plane in channels.items() if "backward" not in name}


def disparity() -> dict[str, np.ndarray]:
    return {"disparityL.x": np.full((make.HEIGHT, make.WIDTH), 3, "f4")}


def single_part(number: int) -> list:
    """One part, as the documentation names channels: right is the default view."""
    channels = one_view(number, RIGHT) | disparity()
    for name, plane in one_view(number, LEFT).items():
        layer, _, component = name.rpartition(".")
        channels[f"{layer}.left.{component}".lstrip(".")] = plane
    channels["forward.right.u"] = channels.pop("forward.u")
    channels["forward.right.v"] = channels.pop("forward.v")
    return [make.part(channels, {"multiView": STEREO, "owner": "me"})]


def many_parts(number: int) -> list:
    """A part for each layer and view, in an order that means nothing."""
    right, left = one_view(number, RIGHT), one_view(number, LEFT)

    def taken(channels, *names):
        return {name: channels[name] for name in names}

    return [
        make.part(taken(right, *"RGBA"), {"view": "right", "owner": "me"}, name="rgba_right"),
        make.part(taken(left, "Z"), {"view": "left"}, name="depth_left"),
        make.part(taken(left, "forward.u", "forward.v"), {"view": "left"}, name="forward_left"),
        make.part(disparity(), name="disparityL"),
        make.part(taken(left, *"RGBA"), {"view": "left"}, name="rgba_left"),
        make.part(taken(right, "forward.u", "forward.v"), {"view": "right"}, name="three"),
        make.part(taken(right, "Z"), {"view": "right"}, name="two"),
    ]


def nukes(number: int) -> list:
    """One part, the view before the layer."""
    left, right = one_view(number, LEFT), one_view(number, RIGHT)
    channels = {name.replace("Z", "depth.Z"): plane for name, plane in left.items()}
    channels |= {f"right.{name.replace('Z', 'depth.Z')}": plane for name, plane in right.items()}
    return [make.part(channels | disparity(), {"multiView": NUKE})]


def blenders(number: int) -> list:
    """Both views are named, between layer and component."""
    channels = disparity()
    for view, velocity in (("left", LEFT), ("right", RIGHT)):
        for name, plane in make.frame(number, "blender", velocity).items():
            layer, _, component = name.rpartition(".")
            channels[f"{layer}.{view}.{component}"] = plane
    return [make.part(channels, {"multiView": NUKE})]


def with_stereo(folder, form, numbers=(1, 2, 3)) -> str:
    for n in numbers:
        make.write_parts(folder / f"s.{n:04d}.exr", form(n))
    return str(folder / "s.####.exr")
