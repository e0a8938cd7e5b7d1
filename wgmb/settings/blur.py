"""Settings of the blur: the method, and the options of all methods."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, Literal, Self, TypeVar

import wgpu

from ..errors import InputError
from ..methods import METHODS, default_method
from ..methods.options import Option, options_of
from ..pipeline.arguments import checked, method_of
from ..pipeline.blur import Blur
from ..scene.scene import Scene
from ..shutter import Shutter
from .record import plain


def _method_options() -> dict[str, tuple[object, object, str]]:
    """Type, default and help of every option that a method has, by name."""
    merged: dict[str, list[tuple[str, Option]]] = {}
    for method in METHODS.values():
        for name, option in options_of(method.Options).items():
            merged.setdefault(name, []).append((method.name, option))
    return {name: _merged(options) for name, options in merged.items()}


def _merged(options: list[tuple[str, Option]]) -> tuple[object, object, str]:
    """Return one option for all methods that share its name, with the union of their choices."""
    kind: object = options[0][1].kind
    if choices := dict.fromkeys(choice for _, option in options for choice in option.choices):
        kind = Literal[tuple(choices)]
    help_ = "; ".join(f"{method}: {option.help}" for method, option in options)
    help_ = _SHARED_HELP.get(options[0][1].name, help_)
    return (bool, False, help_) if kind is bool else (kind | None, None, help_)  # pyright: ignore


_SHARED_HELP = {
    "variant": "Published form of a method instead of ours; see the method's page",
    "show": "Show the method's own data instead of the picture: tiles (tiles), confidence (gather) "
    "or count (reproject)",
}
"""Help of options that several methods have, each with its own meaning."""

METHOD_OPTIONS = _method_options()
"""(type, default, help) of the options that only some methods have, by name."""
_OF_OTHERS = METHOD_OPTIONS.keys() - {
    option
    for name, method in METHODS.items()
    if name not in METHODS.packages
    for option in options_of(method.Options)
}
"""Options that no method of wgmb has."""

_Class = TypeVar("_Class", bound=type)


def _with_method_options(settings: _Class) -> _Class:
    """Add METHOD_OPTIONS to the fields of a class that is to be a dataclass."""
    for name, (kind, default, _) in METHOD_OPTIONS.items():
        settings.__annotations__[name] = kind
        setattr(settings, name, default)
    return settings


@dataclass(frozen=True, kw_only=True)
@_with_method_options
class BlurSettings:
    """Blur method and options; the fields of METHOD_OPTIONS are added."""

    method: str | None = None
    "Blur method; by default gather with depth or searched motion, else tiles."
    samples: int | Literal["auto"] | None = None
    """Samples per pixel: 16 by default (fusion: 8). auto, the default for videos: by the length of
    the blur, at most 64.
    """
    jitter: float = 0.0
    "Jitter of the sample times, 0 to 1: trades banding for noise."
    holdout: tuple[str, ...] = ()
    "Pixels that stay sharp: LAYER (grey), LAYER=VALUE (object index, Cryptomatte) or image file."
    scale: tuple[str, ...] = ()
    "Motion scale: a LAYER or image file that multiplies it, or LAYER=VALUE:AMOUNT for an object."
    max_blur: float | None = None
    "Maximum blur length in pixels."

    def resolved(self, scene: Scene | None = None, has: Collection[str] | None = None) -> Self:
        """Return a copy; an unset method is chosen by the scene, or by the layers of the frames."""
        suited = "gather" if has is None else default_method(has)
        if scene is not None and scene.has_volumes:
            suited = "volume"
        return replace(self, method=self.method or suited)

    def for_pictures(self) -> Self:
        """Return a copy for motion found in pictures, after `resolved`: unset samples are auto, and
        unset shading is off, as areas that seem static there may move.
        """
        method = METHODS.get(self.method or "")
        unset: dict[str, Any] = {}
        if getattr(method, "adaptive", False) and self.samples is None:
            unset["samples"] = "auto"
        if method and "shading" in set(options_of(method.Options)) - set(self._method_options()):
            unset["shading"] = "off"
        return replace(self, **unset)

    def for_edges(self) -> Self:
        """Return a copy for pictures with edges of motion, `for_pictures`: gather there."""
        own = getattr(self, "where", None) or "edges"  # a method's option
        return replace(self, method="gather", where=own).for_pictures()

    def at_edges(self, shutter_: Shutter, device: wgpu.GPUDevice) -> Blur | None:
        """The Blur of pictures with edges of motion; None for options of another method."""
        try:
            return self.for_edges().make(shutter_, device)
        except InputError:
            return None

    def make(self, shutter_: Shutter, device: wgpu.GPUDevice | str | None = None) -> Blur:
        """Return the Blur these settings describe; an option of another method is an error."""
        return Blur(
            method_of(self.method or default_method({"motion", "depth"})),
            shutter=shutter_,
            samples=self.samples,
            jitter=self.jitter,
            max_blur=self.max_blur,
            device=device,
            **self._method_options(),
        )

    def _method_options(self) -> dict[str, Any]:
        """The method's own options that are set."""
        own = {name: getattr(self, name) for name in METHOD_OPTIONS}
        return {k: v for k, v in own.items() if v is not None and v is not False}

    @property
    def looks(self) -> dict[str, Any]:
        """The settings on which a result depends, for its record.

        Options that only methods of other packages have are in it where they are set, so that it
        does not depend on installed packages; with such a method, its package and version too.
        """
        unset = {name for name in _OF_OTHERS if getattr(self, name) == METHOD_OPTIONS[name][1]}
        found = {name: value for name, value in plain(self).items() if name not in unset}
        if package := METHODS.packages.get(self.method or ""):
            found["package"] = package
        return found

    def settled_samples(self) -> int | str:
        """The samples of the Blur, for a record: a number, or "auto".

        InputError as from `make`, except for limits of the device; none is opened.
        """
        method, options = method_of(self.method or ""), self._method_options()
        samples, auto = checked(method, self.samples, self.jitter, self.max_blur, options=options)
        method.Options(**options)
        return "auto" if auto else samples
