"""A canvas whose interface has another size: its logical pixels are larger than the system's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

SIZES = 0.5, 4.0  # the smallest and the largest, as a factor


class ScaledCanvas:
    """Stands for a rendercanvas: positions, sizes and the pixel ratio are those of `scale`."""

    def __init__(self, canvas: Any, scale: float = 1.0):
        self._canvas, self.scale = canvas, scale
        self._contexts: list[_Context] = []

    def __getattr__(self, name: str):
        return getattr(self._canvas, name)

    def get_logical_size(self) -> tuple[float, float]:
        """Width and height in pixels of the interface."""
        width, height = self._canvas.get_logical_size()
        return width / self.scale, height / self.scale

    def get_pixel_ratio(self) -> float:
        """Pixels of the screen for one of the interface."""
        return self._canvas.get_pixel_ratio() * self.scale

    def get_wgpu_context(self) -> Any:
        """The canvas's context, with the same sizes."""
        self._contexts.append(_Context(self._canvas.get_wgpu_context(), self))
        return self._contexts[-1]

    def release_surface(self) -> None:
        """Let go of the surface while its window exists. Nothing can be drawn afterwards.

        Mesa frees a surface's images by the connection of its window: after the window, that was
        an X error, and after the connection, a heap that is damaged.
        """
        for context in self._contexts:
            context.release()

    def add_event_handler(
        self, handler: Callable[[dict[str, Any]], None], *types: str, **options: Any
    ) -> None:
        """As of the canvas; `handler` gets positions in pixels of the interface."""

        def scaled(event: dict[str, Any]) -> None:
            own = dict(event)
            for name in ("x", "y", "width", "height"):
                if name in own:
                    own[name] = own[name] / self.scale
            if "pixel_ratio" in own:
                own["pixel_ratio"] = own["pixel_ratio"] * self.scale
            handler(own)
            if own.get("stop_propagation"):
                event["stop_propagation"] = True

        self._canvas.add_event_handler(scaled, *types, **options)


class _Context:
    def __init__(self, context: Any, canvas: ScaledCanvas):
        self._context, self._scaled = context, canvas

    def release(self) -> None:
        self._context = None

    def __getattr__(self, name: str):
        return getattr(self._context, name)

    @property
    def logical_size(self) -> tuple[float, float]:
        return self._scaled.get_logical_size()

    @property
    def pixel_ratio(self) -> float:
        return self._scaled.get_pixel_ratio()
