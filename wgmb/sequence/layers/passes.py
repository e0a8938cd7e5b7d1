"""Layers of a sequence's files, and their conventions."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ...errors import InputError, check_choice
from . import vectors
from .alpha import ALPHAS

DEPTHS = ("auto", "planar", "inverse", "clip", "white-near")


@dataclass(frozen=True)
class Passes:
    """Layers to read from the files, and their conventions.

    `color`, `depth`: names of layers that cannot be found automatically. `depth_kind`: "planar"
    (distance along the view axis), "inverse" (its reciprocal, Nuke), "clip" (z after projection),
    "white-near" (larger is nearer, and nothing else is known of it; not with a camera), or "auto":
    planar, or white-near where occlusion shows it. `camera`: JSON file (see CameraFile) for
    motion where vectors are missing. `object_layer`: index layer that identifies the camera file's
    objects. `object_motion`: vectors exclude the camera's motion. `holdout`, `scale`: masks, each a
    layer, `LAYER=VALUE`, or an image file or pattern; VALUE is an index, or a name (with wildcards)
    or id of a Cryptomatte. The holdout is the union of all masks. The scales multiply;
    `MASK:AMOUNT` stands for 1 + (AMOUNT - 1) * mask. `also`: patterns of files with more layers of
    the same frames. In the names of files, %V stands for the view (see Clip.views). `far`: depth
    from which a pixel counts as empty. `outside`: the picture beyond a data window that ends within
    the display window: "nothing", "edge" (unknown: the pixels at its edge are repeated) or "auto"
    (unknown if the window cuts through the picture). `wrap`: the left and the right edge are one
    meridian of an equirectangular panorama: "on", "off" or "auto" (by the attribute `envmap`, or
    where a picture is 2:1 and its edges join or vectors are longer than half its width). `twos`:
    poses that are held, as in animation on twos, are shown without the jumps between them where the
    vectors of a neighbour tell ("auto"), or with them ("off"). `alpha`: the colours of the files
    are "premultiplied" or "straight".
    """

    color: str | None = None
    vectors: vectors.Vectors = field(default_factory=vectors.Vectors)
    depth: str | None = None
    depth_kind: str = "auto"
    far: float = 1e9
    camera: Path | None = None
    object_layer: str | None = None
    object_motion: bool = False
    holdout: str | tuple[str, ...] = ()
    scale: str | tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    outside: str = "auto"
    wrap: str = "auto"
    twos: str = "auto"
    alpha: str = "premultiplied"

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the requested layers, other than the picture's."""
        masks = (mask.partition("=")[0] for mask in (*self.holdout, *self.scale))
        named = self.vectors.layer, self.depth, self.object_layer, *masks
        return tuple(name for name in named if name)

    def __post_init__(self) -> None:
        if not isinstance(self.vectors, vectors.Vectors):
            given = f"got {self.vectors!r}"
            raise InputError(f"`vectors` must be Vectors, such as Vectors('none'), {given}")
        for name in ("holdout", "scale"):
            given = getattr(self, name)
            object.__setattr__(self, name, (given,) if isinstance(given, str) else tuple(given))
        check_choice("`depth_kind`", self.depth_kind, DEPTHS)
        check_choice("`alpha`", self.alpha, ALPHAS)
        if self.camera is not None and self.depth_kind == "white-near":
            raise InputError(
                "motion from `camera` needs distances: `depth_kind` planar, inverse or clip"
            )
        for name in ("object_motion", "object_layer"):
            if getattr(self, name) and self.camera is None:
                raise InputError(f"`{name}` needs `camera`, a file with the cameras of the frames")
        if not self.far > 0:
            raise InputError(f"`far` must be over 0, got {self.far}")
