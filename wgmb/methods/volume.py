"""Analytic motion blur of turning spheres and tori, by volume ray casting."""

from __future__ import annotations

import math

import numpy as np
import wgpu

from .. import gpu
from ..errors import InputError
from ..gpu import wgsl
from ..scene.density import TURN, Rotation, overrides, tables
from ..scene.figure import RATE, Figure
from ..scene.gbuffer import SceneOnGpu
from ..scene.volumes import Backdrop, OrbitingSphere, Torus
from ..shutter import Shutter
from .contract import Inputs, View
from .options import MethodOptions

CLOUD, SHADOW = 1, 2  # what can be in a tile


class Volume:
    """Motion-blurred density, integrated in closed form, as a cloud (Cusa 2022).

    A scene's volumes (`OrbitingSphere`, `Torus`) before their backdrop; `samples` do not matter.
    The share of the exposure that a volume spends at a place is a difference of the shutter's
    antiderivative. Scenes choose the `density`: "exact" counts every revolution, at any speed, as
    a periodic sum in closed form (box, cosine) or in a table; "published" counts each crossing
    once.

    Strong: trails of any length and speed without noise or copies, at one price. Artefacts:
    surfaces look soft, normals are blended guesses, shadows are of the cloud.
    """

    name = "volume"
    needs = frozenset({"scene"})
    uses: frozenset[str] = frozenset()

    Options = MethodOptions

    def __init__(
        self, device: wgpu.GPUDevice, options: MethodOptions, *, output: str = "rgba32float"
    ):
        self._device, self._output = device, output

    def encode(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        """Record a pass for every kind of tile."""
        on_gpu, shutter = inputs.scene, inputs.shutter
        scene = on_gpu.original
        if not scene.has_volumes:
            raise InputError(f"method 'volume' needs volumes, scene {scene.name!r} has none")
        if scene.bodies:
            raise InputError("method 'volume' cannot draw the rigid bodies of this scene")
        if scene.figure is not None:
            if shutter.rolling:
                raise InputError("a figure is exposed at once: it cannot roll the shutter")
            self._figure(encoder, inputs, scene.figure, output)
        else:
            self._volumes(encoder, inputs, output)

    def _volumes(self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, output: View) -> None:
        on_gpu, shutter = inputs.scene, inputs.shutter
        # The shader loops over the orbiting spheres, then over the tori.
        volumes, backdrop = on_gpu.original.instant(on_gpu.time)
        volumes = [v for v in volumes if v.opacity or v.facing]
        volumes.sort(key=lambda v: isinstance(v, Torus))
        exact = on_gpu.original.density == "exact"
        rotations = [rotation_of(v, shutter, on_gpu.fps, exact) for v in volumes]
        constants = {
            **overrides(shutter, rotations),
            "EXACT": exact,
            "ORBITS": sum(isinstance(v, OrbitingSphere) for v in volumes),
            "TORI": sum(isinstance(v, Torus) for v in volumes),
            "ROLLING": shutter.rolling is not None,
            "BLENDED": all(v.facing is not None for v in volumes),
        }
        source = wgsl.load("methods/volume.wgsl")
        if len(volumes) > (most := source.constant("MOST_VOLUMES")):
            raise InputError(f"a scene has at most {most} volumes, got {len(volumes)}")
        data = _uniforms(on_gpu, shutter, backdrop, volumes, rotations)
        tabled, usage = tables(shutter, rotations), wgpu.BufferUsage.STORAGE
        shared = {
            "scene": data,
            "tables": gpu.constant(self._device, "tables", tabled, usage),
            "output": output,
        }
        # Most tiles show only the backdrop: those with a cloud or a shadow have their own kernels.
        edges = source.integer("WG_X"), source.integer("WG_Y")
        kinds = tile_kinds(data, len(rotations), on_gpu.size, edges)
        row = source.integer("TILES_A_ROW")
        for kind in np.unique(kinds):
            cloud, shadow = bool(kind & CLOUD), bool(kind & SHADOW)
            kernel = gpu.kernel(
                self._device,
                "methods/volume.wgsl",
                {"Output": self._output},
                CLOUD=cloud,
                SHADOW=shadow,
                **(constants if cloud or shadow else {"ORBITS": 0, "TORI": 0}),
            )
            at = np.argwhere(kinds == kind)[:, ::-1].astype(np.uint32)
            groups = min(len(at), row), -(-len(at) // row)
            kernel.run(
                encoder,
                "main",
                inputs.bindings,
                (groups[0] * edges[0], groups[1] * edges[1]),
                tiles=np.ascontiguousarray(at),
                **shared,
            )

    def _figure(
        self, encoder: wgpu.GPUCommandEncoder, inputs: Inputs, figure: Figure, output: View
    ) -> None:
        source = wgsl.load("scene/figure.wgsl")
        shutter, fps = inputs.shutter, inputs.scene.fps
        if figure.shutter is not None:
            shutter, fps = figure.shutter, RATE
        opens, closes = shutter.span
        symmetry = 2 if figure.kind == "SPIRIC" else 1  # a torus looks alike after half a turn
        rotation = Rotation(figure.speed * (closes - opens) / fps, symmetry)
        data = np.zeros((), source.dtype("Figure"))
        figure.fill(data, inputs.scene.time + (opens + closes) / 2 / fps)
        rotation.fill(data["turning"], 0)
        kernel = gpu.kernel(
            self._device,
            "scene/figure.wgsl",
            {"Output": self._output},
            **overrides(shutter, [rotation]),
            KIND=source.constant(figure.kind),
            SHARP=closes == opens,
        )
        kernel.run(
            encoder,
            "main",
            inputs.bindings,
            figure=data,
            tables=tables(shutter, [rotation]),
            output=output,
        )


def volume_row(
    row: np.ndarray,
    v: OrbitingSphere | Torus,
    rotation: Rotation,
    middle_of: float,
    delay: tuple[float, float],
) -> None:
    """Fill a `Volume` of the shader, all but `turning`.

    `middle_of` the exposure, `delay` of a rolling shutter across width and height [s].
    """
    angle, swept = math.fmod(v.phase + v.speed * middle_of, TURN), rotation.angle
    c, s = math.cos(angle), math.sin(angle)
    side = -1 if v.speed < 0 else 1
    speed = 30 * swept  # at the exposure that the pseudo distances were made for
    row["centre"], row["color"], row["opacity"] = v.centre, v.color, v.opacity
    row["normal_weight"] = 1 if v.facing is None else v.facing
    row["drift"] = drift = [abs(v.speed) * d for d in delay]
    half = min((swept + sum(map(abs, drift))) / 2, math.pi / 2)
    middle, reach = np.array(v.centre), v.reach
    if isinstance(v, OrbitingSphere):
        row["turn"] = c, -s, -side * s, -side * c
        row["small"], row["large"] = v.radius, v.orbit
        quick = 2 * speed * _smoothstep(30, 40, speed)
        row["lead"] = math.cos(min(0.004 * (quick + (0.037 * quick) ** 3), math.pi))
        middle = middle + v.orbit * math.cos(half) * np.array([c, 0, -s])
        reach = v.orbit * math.sin(half) + v.radius
        slab = (0, 1, 0, v.radius)
    else:
        row["turn"] = c, s, -side * s, side * c
        row["small"], row["large"] = v.minor_radius, v.major_radius
        row["lead"], row["swell"] = 0.001 * speed, v.swell
        slab = (-s, c, 0, v.minor_radius + v.major_radius * math.sin(half))
    margin = 1e-5 * v.reach
    row["bound"] = (*middle, reach + margin if v.opacity else 0)
    row["slab"] = (*slab[:3], slab[3] + margin)


def _smoothstep(a: float, b: float, x: float) -> float:
    u = min(max((x - a) / (b - a), 0), 1)
    return u * u * (3 - 2 * u)


def rotation_of(
    volume: OrbitingSphere | Torus, shutter: Shutter, fps: float, exact: bool
) -> Rotation:
    """Its rotation within the exposure; a torus has twofold symmetry, which "published" ignores."""
    opens, closes = shutter.span
    symmetry = 2 if exact and isinstance(volume, Torus) else 1
    return Rotation(abs(volume.speed) * (closes - opens) / fps, symmetry)


def _uniforms(
    on_gpu: SceneOnGpu,
    shutter: Shutter,
    backdrop: Backdrop,
    volumes: list[OrbitingSphere | Torus],
    rotations: list[Rotation],
) -> np.ndarray:
    source = wgsl.load("methods/volume.wgsl")
    data = np.zeros((), source.dtype("Volumes"))
    width, height = on_gpu.size
    camera = on_gpu.original.camera.world_from_camera(on_gpu.time)[0]
    zoom = float(np.ravel(on_gpu.original.camera.zoom(np.array([on_gpu.time])))[0])
    bound = backdrop.bound or max(math.dist((0, 0, 0), v.centre) + v.reach for v in volumes)
    data["eye"] = (*camera[:3, 3], bound)
    data["right"][:3] = camera[:3, 0] * width / height / zoom
    data["up"][:3], data["forward"][:3] = camera[:3, 1] / zoom, -camera[:3, 2]
    data["strobe"], data["grain"] = backdrop.strobe, backdrop.grain
    backdrop.fill(data["backdrop"])
    middle_of = sum(shutter.span) / 2 / on_gpu.fps
    delay = shutter.delay[0] / on_gpu.fps, shutter.delay[1] / on_gpu.fps
    for i, (row, volume, rotation) in enumerate(
        zip(data["volumes"], volumes, rotations, strict=False)
    ):
        volume_row(row, volume, rotation, middle_of, delay)
        rotation.fill(row["turning"], i)
    return data


def tile_kinds(
    data: np.ndarray, count: int, size: tuple[int, int], edges: tuple[int, int]
) -> np.ndarray:
    """(rows, columns) of CLOUD and SHADOW: where the view, or light to the ground, meets a bound.

    `data`: the shader's `Volumes`; `count` of them; `edges` of a tile [px]. Every ray of a tile is
    within a cone around that through its middle, or starts in a circle on the ground.
    """
    rows, columns = (-(-n // edge) for n, edge in zip(size[::-1], edges[::-1], strict=True))
    x = np.arange(columns + 1) * edges[0] / size[0] * 2 - 1
    y = 1 - np.arange(rows + 1) * edges[1] / size[1] * 2
    eye, right, up, forward = (data[n][:3].astype(float) for n in ("eye", "right", "up", "forward"))
    corner = x[:, None] * right + y[:, None, None] * up + forward  # (rows + 1, columns + 1, 3)
    middle = (corner[:-1, :-1] + corner[1:, 1:]) / 2
    length = np.sqrt(_dot(middle, middle))
    spread = np.linalg.norm(corner[0, 0] - corner[1, 1]) / 2 / length
    bounds, slabs = (data["volumes"][n][:count].astype(float) for n in ("bound", "slab"))
    seen = _meets(eye, middle / length[..., None], bounds, slabs, spread)
    light, height = data["backdrop"]["light"][:3].astype(float), float(data["backdrop"]["tint"][3])
    drop = height - eye[1]
    down = corner[..., 1] * drop > 0
    along = drop / np.where(down, corner[..., 1], 1)
    ground = np.stack([eye[0] + along * corner[..., 0], eye[2] + along * corner[..., 2]], axis=-1)
    four = np.stack([ground[:-1, :-1], ground[1:, :-1], ground[:-1, 1:], ground[1:, 1:]])
    any_down, all_down = (
        f([down[:-1, :-1], down[1:, :-1], down[:-1, 1:], down[1:, 1:]], axis=0)
        for f in (np.any, np.all)
    )
    centre = four.mean(axis=0)
    circle = np.hypot(*np.moveaxis(four - centre, -1, 0)).max(axis=0)
    start = np.insert(centre, 1, height, axis=-1)
    shaded = _meets(start, light, bounds, slabs, 0.0, circle) | ~all_down
    return CLOUD * seen + SHADOW * (shaded & any_down)


def _meets(
    origin: np.ndarray,
    direction: np.ndarray,
    bounds: np.ndarray,
    slabs: np.ndarray,
    spread: np.ndarray | float,
    wide: np.ndarray | float = 0.0,
) -> np.ndarray:
    """True where lines of unit direction, thickened, are in a bound's sphere and slab at once.

    They are `wide` at their origin and spread by the tangent `spread`.
    """
    hits = False
    for bound, slab in zip(bounds, slabs, strict=True):
        if not bound[3]:
            continue
        to = bound[:3] - origin
        distance2, along = _dot(to, to), _dot(to, direction)
        thick = wide + spread * (np.sqrt(distance2) + bound[3])
        root = (bound[3] + thick) ** 2 - (distance2 - along**2)
        half = np.sqrt(np.maximum(root, 0))
        rise, height = direction @ slab[:3], to @ slab[:3]
        rise = np.where(np.abs(rise) < 1e-9, 1e-9, rise)
        edges = [(height + k * (slab[3] + thick)) / rise for k in (-1, 1)]
        first = np.maximum(along - half, np.minimum(*edges))
        last = np.minimum(along + half, np.maximum(*edges))
        hits = hits | ((root > 0) & (first <= last) & (last > 0))
    return np.broadcast_to(hits, np.broadcast_shapes(np.shape(origin), np.shape(direction))[:-1])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i", a, b)
