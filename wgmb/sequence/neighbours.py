"""Frames among their neighbours: camera cuts left out, different data windows on one canvas."""

from __future__ import annotations

import contextlib
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

from ..errors import InputError, check_choice
from ..extent import Extent
from ..frame import Frame
from ..pipeline import panorama
from ..shots.cuts import frames_differ, is_cut, jumps, still, straightened
from ..shots.held_poses import TWOS, may_be_held, without_jumps
from . import panorama_signs
from .data_windows import (
    OUTSIDE,
    Placement,
    Sides,
    Window,
    allowed,
    canvas,
    common,
    covered,
    moved_by,
    placed,
    union,
    unknown,
)
from .frame_builder import FrameBuilder
from .frame_cache import FrameCache
from .frame_file import FrameFile

Load = Callable[[int], Frame | None]
"""Reads the frame before (-1) or after (1), of the same shot; None where there is none."""


class ClipFrame(Frame):
    """A frame of a Clip. `prev` and `next` are read when they are asked for, and not kept."""

    @classmethod
    def of(cls, frame: Frame, load: Load) -> ClipFrame:
        """The frame with neighbours that `load` reads."""
        made = object.__new__(cls)
        made.__dict__.update({k: v for k, v in vars(frame).items() if k not in ("prev", "next")})
        made.__dict__["_load"] = load
        return made

    def __repr__(self) -> str:
        alone = copy(self)
        alone.__dict__.pop("_load", None)  # nothing is read to be counted
        return Frame.__repr__(alone)


def _side(name: str, side: int) -> property:
    def read(frame: ClipFrame) -> Frame | None:
        own: dict[str, Any] = vars(frame)
        if name in own:
            return own[name]
        return own["_load"](side) if "_load" in own else None

    def put(frame: ClipFrame, other: Frame | None) -> None:
        vars(frame)[name] = other

    return property(read, put, doc=f"The frame {'before' if side < 0 else 'after'}, or None.")


for _name, _number in (("prev", -1), ("next", 1)):  # a property is found before what is stored
    setattr(ClipFrame, _name, _side(_name, _number))


HELD = (
    "has poses that are held, as in animation on twos: their jumps are not blurred; "
    "`twos='off'` blurs them"
)
_SIDES = "left", "top", "right", "bottom"


class Neighbours:
    """The frames in `stored` as a blur takes them, built by `builder`.

    `is_search`: cuts that nobody told of are looked for. `cuts`: those found so far, and those
    known.
    """

    def __init__(self, stored: FrameCache, builder: FrameBuilder, is_search: bool):
        check_choice("`outside`", stored.passes.outside, OUTSIDE)
        check_choice("`wrap`", stored.passes.wrap, panorama_signs.WRAPS)
        check_choice("`twos`", stored.passes.twos, TWOS)
        self._stored, self._builder, self._is_search = stored, builder, is_search
        self._outside = stored.passes.outside
        self.cuts: set[int] = set()
        self._alone: OrderedDict[
            tuple[int, str | None], tuple[FrameFile, frozenset[str], Frame]
        ] = OrderedDict()
        self._placed: OrderedDict[tuple[int, str | None], tuple[Frame, Window, Frame]] = (
            OrderedDict()
        )
        self.beyond_note = ""  # a line for the user about `beyond`; "" without such sides
        self._jumps: dict[int, list[int]] = {}
        self._cuts_to: dict[tuple[int, int], bool] = {}

    def forget(self, number: int) -> None:
        """Drop all data made of a frame."""
        for kept in (self._alone, self._placed):
            for key in [key for key in kept if key[0] == number]:
                del kept[key]

    def forget_all(self) -> None:
        """Drop all data made of every frame."""
        self._alone.clear()
        self._placed.clear()

    def settle(self, beyond: Sides, is_joined: bool) -> None:
        """Take what was found out about all frames as `beyond` and `is_joined`."""
        self.beyond, self.is_joined = beyond, is_joined

    # ---- frames ----------------------------------------------------------------------------

    def frame(self, source: FrameFile, wanted: frozenset[str]) -> Frame:
        """The Frame of `source` in its own window, without motion that leads across a cut."""
        frame = self._builder.build(source, wanted)
        if self._is_panorama(source, frame):
            frame = replace(panorama.shortest(frame), wrap="on")
        if all(self._stored.is_known_cut(source.number, side) for side in (-1, 1)):
            self.cuts |= {source.number, source.number + 1}
            return still(frame)
        for side in self._sides_cut(source, frame):
            self.cuts.add(source.number + (side > 0))
            frame = straightened(frame, side)
        return frame

    def alone(
        self, source: FrameFile, wanted: frozenset[str], extent: Extent | None
    ) -> tuple[Frame, Placement]:
        """The frame by itself, on a canvas with room for `extent`."""
        frame = self.frame(source, wanted)
        frames = {0: (source, frame)}
        onto = self._canvas(frames, extent)
        return self._laid(onto, source, frame), Placement(onto, self._bounds(source))

    def between(
        self, source: FrameFile, wanted: frozenset[str], extent: Extent | None, reach: int
    ) -> tuple[Frame, Placement]:
        """The frame with `reach` before and after it, on a canvas with room for `extent`.

        Their arrays cannot be written to (Frame.locked): every frame is made, and uploaded by a
        Blur, once, though it is shown in three, or five.
        """
        self._stored.reach = max(self._stored.reach, reach)
        frames = {0: (source, self._locked(source, wanted))}
        for side in (-1, 1):
            for offset in range(side, side * (reach + 1), side):
                neighbour = self._neighbour(*frames[offset - side], side, wanted)
                if neighbour is None:
                    break
                frames[offset] = neighbour
        onto = self._canvas(frames, extent)
        made = {side: self._on(onto, *one) for side, one in frames.items()}
        beside: list[Frame | None] = []
        for side in (-1, 1):
            near, beyond = made.get(side), made.get(2 * side)
            if near is not None and beyond is not None:
                near = near.between(beyond, None) if side < 0 else near.between(None, beyond)
            beside.append(near)
        frame = self._held(source, made[0].between(*beside))
        return frame, Placement(onto, self._bounds(source))

    def opened(
        self, source: FrameFile, wanted: frozenset[str], onto: Window | None = None
    ) -> ClipFrame:
        """The frame on a canvas, by default its own window; its neighbours are read when needed."""
        frame, canvas = self._locked(source, wanted), onto or source.data_window

        def load(side: int) -> Frame | None:
            neighbour = self._neighbour(source, frame, side, wanted)
            return self.opened(neighbour[0], wanted, canvas) if neighbour else None

        placed = self._on(canvas, source, frame)
        if onto is None and placed.motion is not None and may_be_held(placed.motion):
            held = self._held(source, placed.between(load(-1), load(1)))
            return ClipFrame.of(held, lambda side: held.prev if side < 0 else held.next)
        return ClipFrame.of(placed, load)

    def _held(self, source: FrameFile, frame: Frame) -> Frame:
        """`frame` without the jumps between poses that are held; says so in a note."""
        if self._stored.passes.twos == "off":
            return frame
        held = without_jumps(frame)
        if held is frame:
            return frame
        if source.number not in (on := self._stored.notes.setdefault(HELD, [])):
            on.append(source.number)
        return held.locked()

    def _neighbour(
        self, source: FrameFile, frame: Frame, side: int, wanted: frozenset[str]
    ) -> tuple[FrameFile, Frame] | None:
        """The frame before or after, and its file; None where there is none of the same shot."""
        other = self._stored.neighbour(source, side)
        if other is None or other.display_window != source.display_window:
            return None
        try:
            near = self._locked(other, wanted)
        except InputError:  # its turn to fail comes
            self._stored.unread.add(other.number)
            return None
        if self._is_cut(source, frame, near, side, wanted):
            self.cuts.add(source.number + (side > 0))
            return None
        return other, near

    def _locked(self, source: FrameFile, wanted: frozenset[str]) -> Frame:
        """`frame`, made once for the three frames, or five, that it is shown in."""
        key = source.number, source.view
        made, with_inputs, frame = self._alone.get(key, (None, None, None))
        if frame is None or made is not source or with_inputs != wanted:
            self._alone.pop(key, None)
            self._make_room(self._alone)
            frame = self.frame(source, wanted).locked()
            if frame.motion is not None:
                source.share(frame.motion)
            self._alone[key] = source, wanted, frame
        return frame

    def _on(self, onto: Window, source: FrameFile, frame: Frame) -> Frame:
        """`frame` on a canvas, made once while the canvas stays the same."""
        if source.data_window == onto:
            return frame
        key = source.number, source.view
        made, then, result = self._placed.get(key, (None, None, None))
        if result is None or made is not frame or then != onto:
            self._placed.pop(key, None)
            self._make_room(self._placed)
            result = self._laid(onto, source, frame).locked()
            self._placed[key] = frame, onto, result
        return result

    def _laid(self, onto: Window, source: FrameFile, frame: Frame) -> Frame:
        """`frame` on a canvas."""
        return placed(frame, source.data_window, onto, self._edges(source, onto))

    def _make_room(self, kept: OrderedDict[tuple[int, str | None], Any]) -> None:
        while len(kept) >= (2 * self._stored.reach + 1) * max(len(self._stored.views), 1):
            kept.popitem(last=False)

    # ---- cuts ------------------------------------------------------------------------------

    def _sides_cut(self, source: FrameFile, frame: Frame) -> list[int]:
        """Sides of a frame on which its motion leads across a cut, by that of the default view."""
        number = source.number
        if source.view is not None and source.view != self._stored.leader(number).view:
            with contextlib.suppress(InputError):  # then this view decides
                if number not in self._jumps:
                    self.frame(self._stored.leader(number), frozenset())
                return self._jumps[number]
        sides: list[int] = []
        is_search = self._is_search and not self._builder.finding.is_failed
        for side in (-1, 1):
            if self._stored.is_known_cut(number, side) or (is_search and jumps(frame, side)):
                sides.append(side)
                frame = straightened(frame, side)
        if source.view is not None:
            self._jumps[number] = sides
        return sides

    def _is_cut(
        self, source: FrameFile, frame: Frame, near: Frame, side: int, wanted: frozenset[str]
    ) -> bool:
        """True if a cut lies between `frame` and `near`, as decided on the default view."""
        if not self._is_search:  # known ones are not asked
            return False
        if source.view is None:
            return self._differ(frame, near, side)
        key = source.number, side
        if key not in self._cuts_to:
            leader = self._stored.leader(source.number)
            if leader.view != source.view:
                with contextlib.suppress(InputError, OSError):  # then this view decides
                    other = self._stored.neighbour(leader, side)
                    if other is not None and other.display_window == leader.display_window:
                        frame, near = self._locked(leader, wanted), self._locked(other, wanted)
            self._cuts_to[key] = self._differ(frame, near, side)
        return self._cuts_to[key]

    def _differ(self, frame: Frame, near: Frame, side: int) -> bool:
        """True if neither the motion nor a search finds `frame` again in its neighbour.

        Vectors that failed their test, or were not tested, cannot tell a cut.
        """
        finding = self._builder.finding
        if not is_cut(frame, near, side):
            return False
        return finding.vectors is None or finding.sure or frames_differ(frame, near)

    # ---- data windows ----------------------------------------------------------------------

    def _canvas(
        self, frames: Mapping[int, tuple[FrameFile, Frame]], extent: Extent | None
    ) -> Window:
        """The window that the frames, by their offset, are placed on for a blur of this `extent`.

        It depends on them alone, so that parts of a sequence give the same pictures as the whole.
        """
        source, _ = frames[0]
        display, windows = source.display_window, [file.data_window for file, _ in frames.values()]
        held = union(windows)
        if extent is None or held == display == source.data_window:
            return held
        limit = allowed(windows, display, self._cut_through)
        if held == limit or extent.spread == "everywhere":
            return limit
        needed: list[Window] = []
        for offset, (file, frame) in frames.items():
            if (box := extent.box(frame, offset)) is not None:
                needed += [file.data_window, moved_by(box, file.data_window[:2])]
        if not needed:
            return source.data_window
        within = common(union(needed), limit)
        try:
            return canvas(within or limit, limit, windows, display)
        except InputError as error:
            raise InputError(f"{source.path}: {error}") from None

    def _edges(self, source: FrameFile, onto: Window) -> Sides:
        """The sides of a frame beyond which its edge is repeated: the picture is unknown there."""
        if onto == source.data_window:
            return False, False, False, False
        return unknown(source.data_window, source.display_window, self._cut_through)

    def _bounds(self, source: FrameFile) -> Window:
        """The largest window of the frame's result: it does not grow into the unknown."""
        own, display = source.data_window, source.display_window
        if own == display:
            return own
        far = 1 << 31
        left, top, right, bottom = (
            end if known else (-far, -far, far, far)[i]
            for i, (end, known) in enumerate(
                zip(own, unknown(own, display, self._cut_through), strict=True)
            )
        )
        return left, top, right, bottom

    # ---- panoramas -------------------------------------------------------------------------

    def _is_panorama(self, source: FrameFile, frame: Frame) -> bool:
        """True if the left and the right edge of a frame are one meridian; says so in a note."""
        wrap = self._stored.passes.wrap
        is_whole = source.data_window == source.display_window
        if wrap == "on" and not is_whole:
            raise InputError(
                "`wrap='on'` needs the whole panorama, but the data window is only a part of it"
            )
        if wrap == "off" or not is_whole or (wrap == "auto" and frame.camera is not None):
            return False
        if wrap == "on":
            return True
        reason = self._what_joins(source)
        if not reason and panorama_signs.has_shape(source) and panorama.crosses(frame.motion):
            reason = "2:1, and vectors are longer than half its width"
        if not reason:
            return False
        text = f"is taken as a panorama of 360 degrees ({reason}); `wrap='off'` takes it as flat"
        if source.number not in (on := self._stored.notes.setdefault(text, [])):
            on.append(source.number)
        return True

    def goes_around(self, source: FrameFile) -> bool:
        """True if the edges of a picture are one meridian, as far as the picture itself tells."""
        wrap, is_whole = self._stored.passes.wrap, source.data_window == source.display_window
        return is_whole and (wrap == "on" or (wrap == "auto" and bool(self._what_joins(source))))

    def _what_joins(self, source: FrameFile) -> str:
        """The reason to join the edges of a picture, apart from its motion; '' for none."""
        if panorama_signs.is_stated(source):
            return "its attribute envmap says so"
        if panorama_signs.has_shape(source) and self.is_joined:
            return "2:1, and its left edge goes on where the right one ends"
        return ""

    @cached_property
    def is_joined(self) -> bool:
        """True if the left and the right edge of these frames seem to be one meridian.

        The first, the middle and the last frame on disk tell, if the first has the shape.
        """
        leaders = self._some_leaders()
        first = next(leaders, None)
        if first is None or not (
            panorama_signs.has_shape(first) and panorama_signs.joins(first.rgba)
        ):
            return False
        return all(
            panorama_signs.joins(one.rgba) for one in leaders if panorama_signs.has_shape(one)
        )

    def _some_leaders(self) -> Iterator[FrameFile]:
        """The first, the middle and the last frame on disk, as far as their pictures are readable.

        Findings on these alone are independent of `frames`.
        """
        there = self._stored.files.on_disk
        for number in dict.fromkeys(there[i] for i in (0, len(there) // 2, -1)):
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                source = self._stored.leader(number)
                _ = source.rgba
                yield source

    @property
    def _cut_through(self) -> Sides:
        """`beyond`, where it matters to a frame; the user is told."""
        sides = self.beyond
        if self.beyond_note:
            self._stored.notes.setdefault(self.beyond_note, list(self._stored.numbers))
        return sides

    @cached_property
    def beyond(self) -> Sides:
        """Sides of the data window beyond which the picture is unknown: left, top, right, bottom.

        The first, the middle and the last frame on disk tell, so that the result is independent
        of `frames`: such a side lies in the same place in all of them, and is covered.
        """
        if self._outside != "auto":
            edge = self._outside == "edge"
            return edge, edge, edge, edge
        places: list[set[int]] = [set(), set(), set(), set()]
        closed, within = [True] * 4, [True] * 4
        for source in self._some_leaders():
            if not source.rgba.any():
                continue
            sides = zip(
                source.data_window, source.display_window, covered(source.rgba), strict=True
            )
            for i, (end, border, full) in enumerate(sides):
                places[i].add(end)
                closed[i] &= full and end != border
                within[i] &= end > border if i < 2 else end < border
            if not any(closed):  # the other frames cannot alter that
                break
        left, top, right, bottom = (
            full and len(ends) == 1 for full, ends in zip(closed, places, strict=True)
        )
        found = left, top, right, bottom
        told = [name for name, *both in zip(_SIDES, found, within, strict=True) if all(both)]
        if told:
            where = ", ".join(told)
            self.beyond_note = (
                f"the picture goes on beyond the data window ({where}): what lies there is taken "
                "as unknown; `outside='nothing'` takes it as empty"
            )
        return found
