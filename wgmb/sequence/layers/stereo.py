"""Views of a stereo frame: which of them a channel belongs to, and where it is stored.

After the OpenEXR documentation, "Storing Multi-View Images in OpenEXR Files": one part whose
attribute `multiView` names the views, the default one first, or many parts with an attribute
`view` each. Nuke's order in one part (`right.depth.Z`) is understood where that rule finds no
view.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence

from ...errors import InputError
from ...io.exr import Exr, Part

Place = tuple[Part, str]
"""A part, and a channel's name in it."""
Places = dict[str, Place]
"""Places of channels by their names without view: `layer.component`."""

# What belongs to the picture in a part whatever the part is called (OpenEXR's reserved names).
_RESERVED = frozenset(("R", "G", "B", "A", "Y", "RY", "BY", "AR", "AG", "AB", "Z", "ZBack"))


def split(
    name: str, part_view: str | None, multi: Sequence[str], names: Collection[str] = ()
) -> tuple[str, str | None, str]:
    """Layer, view and component of the channel `name`; view None: in no view.

    `part_view`: attribute `view` of its part. `multi`: the attribute `multiView`. `names`: all
    channels of the part.
    """
    head, _, component = name.rpartition(".")
    if part_view is not None or not multi:
        return head, part_view, component
    if not head:
        return "", multi[0], component
    layer, _, last = head.rpartition(".")
    if last in multi:
        return layer, last, component
    if len(multi) == 1:
        return head, multi[0], component
    first, _, below = head.partition(".")
    if first in multi:
        return below, first, component
    if any(f"{view}.{name}" in names for view in multi):  # Nuke's layer of the default view
        return head, multi[0], component
    return head, None, component


def joined(layer: str, view: str, component: str, part: Part) -> str:
    """The name under which `part` stores a channel of `view`."""
    if _view(part) is not None or len(_multi(part)) < 2:
        view = ""
    return ".".join(word for word in (layer, view, component) if word)


def leave_only(part: Part, view: str) -> None:
    """Make a part, which has no channels of other views, one of a file of `view` alone."""
    multi = _multi(part)
    if _view(part) is not None or len(multi) < 2:
        return
    names = {name: split(name, None, multi, part.channels) for name in part.channels}
    part.channels = {
        f"{layer}.{component}" if layer else component: part.channels[name]
        for name, (layer, _, component) in names.items()
    }
    part.attributes["multiView"] = [view]


def names_of(file: Exr) -> tuple[str, ...]:
    """The views of a file, the default one first; none if it does not name any.

    InputError where the attributes contradict the documentation.
    """
    views: dict[str, None] = {}
    for part in file.parts:
        view = _view(part)
        for name in [view] if view is not None else _multi(part):
            views[name] = None
            if view is None and (not name or "." in name or name != "".join(name.split())):
                raise InputError(
                    f"{file.path}: the name of a view must have no periods or blanks, got {name!r}"
                )
            if not name.isprintable() or name in ("", ".", "..") or set(name) & set("/\\:"):
                raise InputError(
                    f"{file.path}: the name of a view, {name!r}, cannot be part of a file's name"
                )
    if views and _view(file.parts[0]) is None and not _multi(file.parts[0]):
        raise InputError(
            f"{file.path}: the first part, {file.parts[0].name!r}, must name its view, "
            f"as the others do: {', '.join(views)}"
        )
    return tuple(views)


def by_view(file: Exr, layers: Iterable[str] = ()) -> dict[str | None, Places]:
    """Every channel of a file by view, the default one first, and name; None: in no view.

    The name of a part leads where two parts hold the same channel of a view, where channels
    without a layer are not the picture's (`u` in the part `forward` is `forward.u`), and where
    it begins one of the `layers`. InputError where two channels are the same one.
    """
    layers = [name.lower() for name in layers]
    members: dict[str | None, list[tuple[str, str, Place]]] = {v: [] for v in names_of(file)}
    for part in file.parts:
        view, multi = _view(part), _multi(part)
        for name in part.channels:
            layer, of, component = split(name, view, multi, part.channels)
            members.setdefault(of, []).append((layer, component, (part, name)))
    return {of: _named(file, of, channels, layers) for of, channels in members.items()}


def _named(
    file: Exr, view: str | None, channels: list[tuple[str, str, Place]], layers: list[str]
) -> Places:
    """The places of a view's channels by their names."""
    count = Counter((layer, component) for layer, component, _ in channels)
    several = len(file.parts) > 1
    wanted = {
        part.name for part in file.parts if _is_wanted(_without_view(part.name, view), layers)
    }
    leads = {
        (id(part), layer)
        for layer, component, (part, _) in channels
        if several
        and (
            count[layer, component] > 1
            or not (layer or component in _RESERVED)
            or part.name in wanted
        )
    }
    places: Places = {}
    for layer, component, (part, stored) in channels:
        own = _without_view(part.name, view)
        if (id(part), layer) in leads and own and layer != own and not layer.startswith(own + "."):
            layer = f"{own}.{layer}" if layer else own
        name = f"{layer}.{component}" if layer else component
        if name in places:
            raise InputError(
                f"{file.path}: channels {places[name][1]} and {stored} are both {name}"
                + (f" of view {view}" if view else "")
            )
        places[name] = part, stored
    return places


def _is_wanted(part: str, layers: list[str]) -> bool:
    """Return True if a layer is asked for by the name of a part."""
    return any(f"{name}.".startswith(f"{part.lower()}.") for name in layers)


def _without_view(part: str, view: str | None) -> str:
    """The name of a part without the view at its end: `diffuse_left` -> `diffuse`, `left` -> ``."""
    if part == view:
        return ""
    for mark in "._-":
        if view and part.endswith(mark + view):
            return part[: -len(view) - 1]
    return part


def _view(part: Part) -> str | None:
    view = part.attributes.get("view")
    return view if isinstance(view, str) and view else None


def _multi(part: Part) -> list[str]:
    views = part.attributes.get("multiView")
    return views if isinstance(views, list) and all(isinstance(v, str) for v in views) else []
