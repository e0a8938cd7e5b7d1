"""Meaning of a sequence's vectors and depth, decided once for all of its frames."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import InputError
from ..data_windows import Window, laid, near_enough, union
from ..frame_cache import FrameCache
from ..frame_file import FrameFile
from . import depth_order, light, names, vector_test, vectors

Look = Callable[[FrameFile], np.ndarray | None]
"""Image of a frame on which vectors are tested, (height, width, 3 or 4); None if it has none."""


def _picture(source: FrameFile) -> np.ndarray:
    return source.rgba


class ConventionFinder:
    """The vector convention, and the kind of depth, of the frames in `stored`. `known` and
    `known_depth`: those found before, if any.
    """

    def __init__(
        self,
        stored: FrameCache,
        known: vector_test.ConventionFinding | None,
        known_depth: str | None = None,
    ):
        self._stored, self.known, self.known_depth = stored, known, known_depth
        self._wanted = stored.passes.vectors

    @property
    def finding(self) -> vector_test.ConventionFinding:
        """The vector convention, determined once for all frames.

        By name, then tested on the first frame on disk; unless that shows what the name says, on
        the middle and the last one together with it. So the result does not depend on the
        requested frames.
        """
        if self.known is None:
            self.known = self._find_out()
        return self.known

    def mask_of(self, source: FrameFile) -> str | None:
        """The channel of a frame that is 1 where its vectors are valid, if there is one."""
        convention = self.finding.vectors
        with contextlib.suppress(InputError):  # its turn to fail comes
            return (
                vectors.mask_of(source.channels, convention, source.reference_channel)
                if convention
                else None
            )
        return None

    def _find_out(self) -> vector_test.ConventionFinding:
        if self._wanted.convention == "none":
            return vector_test.ConventionFinding(None, False, "none requested")
        first = self._test(_picture, 0)
        if first is None:
            return self._none_found(self._stored.files.on_disk[0])
        if self._wanted.convention != "auto":
            return self._as_told(first)
        found = self._best([first, self._test(_picture, 1)])
        if found.is_failed:  # the light may have changed everywhere
            of_surfaces = [self._test(self._surfaces, which) for which in (0, 1)]
            found = self._best([found, *of_surfaces])
        return found

    def _as_told(self, tested: vector_test.ConventionFinding) -> vector_test.ConventionFinding:
        """The finding about vectors of a convention that was told: only their unit is found."""
        told, own = self._wanted, tested.vectors
        if told.is_told or (own and replace(own, scale=told.scale) == told):
            return tested
        text = f"{told}, whose unit is unknown: `vector_scale` must be twice the longest motion"
        return vector_test.ConventionFinding(told, False, text, notable=True)

    @staticmethod
    def _best(
        findings: list[vector_test.ConventionFinding | None],
    ) -> vector_test.ConventionFinding:
        """The finding that leaves the least difference, or the first one if all are in doubt."""
        return min(filter(None, findings), key=lambda one: one.left if one.sure else 1.0)

    def _test(self, look: Look, which: int) -> vector_test.ConventionFinding | None:
        """The finding from the `look` of a frame and of its neighbours.

        `which` of the readings of the vectors is tested; None if there are not so many.
        """
        there, finding = self._stored.files.on_disk, None
        evidence: list[vector_test.Evidence] = []
        for number in dict.fromkeys(there[i] for i in (0, len(there) // 2, -1)):
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                source, named = self._named(number)
                if not named:
                    continue
                if len(named) <= which:
                    return finding
                own = named[which]
                if self._wanted.is_told:
                    return self._untested(source, own)
                evidence.append(self._evidence(source, own, look))
                has_both = self._has_both(source, own)
                is_named = vectors.is_direction_named(
                    self._stored.own(source), own, source.reference_channel
                )
                finding = vector_test.decide(own, evidence, has_both=has_both, is_named=is_named)
                seen = {side for e in evidence for side in e.sides}
                if finding.sure and finding.vectors == own and (len(seen) == 2 or not has_both):
                    break
        return finding

    def _untested(self, source: FrameFile, own: vectors.Vectors) -> vector_test.ConventionFinding:
        """The finding about vectors of which everything was told, except perhaps their unit."""
        motion = vectors.read(self._stored.own(source), own, source.reference_channel)
        lacking = vector_test.gathered(motion, motion, None, None, source.whole).unit_lacking(own)
        text = f"{own}; {lacking}" if lacking else str(own)
        return vector_test.ConventionFinding(own, False, text, notable=bool(lacking))

    def _surfaces(self, source: FrameFile) -> np.ndarray | None:
        """(height, width, 3) colour of surfaces, whatever light falls on them, if it is there."""
        own = self._stored.own(source)
        for one in light.find(own, source.reference_channel).lights:
            return np.stack([own[name] for name in one.color], axis=2)
        return None

    def _none_found(self, number: int) -> vector_test.ConventionFinding:
        """The finding where no name speaks for vectors; a layer that may hold some is named."""
        none = vector_test.ConventionFinding(None, False, "no vector layer found")
        with contextlib.suppress(InputError, OSError):  # its turn to fail comes
            source = self._stored.leader(number)
            color = source.color if source.reference_channel else ()
            own = {k: v for k, v in self._stored.own(source).items() if k not in color}
            if perhaps := vectors.candidates(own, source.reference_channel):
                may = " and ".join(f"{layer} {reason}" for layer, reason in perhaps.items())
                first = next(iter(perhaps))
                text = f"none found by name, but {may}; `vector_layer='{first}'` takes {first}"
                return vector_test.ConventionFinding(None, False, text, notable=True)
        return none

    def _named(self, number: int) -> tuple[FrameFile, list[vectors.Vectors]]:
        """The vectors that the layers' names speak for, in the first view that has any, as they may
        be read.
        """
        first = self._stored.leader(number)
        for source in dict.fromkeys((first, *self._stored.all(number))):
            own, near = self._stored.own(source), source.reference_channel
            if named := vectors.named(own, self._wanted, near, source.units):
                if self._wanted.is_told:
                    return source, [vectors.in_pixels(named, source.whole)]
                return source, vectors.readings(own, named, source.whole, near)
        return first, []

    def _has_both(self, source: FrameFile, named: vectors.Vectors) -> bool:
        """True if the vectors to either frame are layers of their own."""
        form, near = vectors.CONVENTIONS[named.convention], source.reference_channel
        sides = vectors.channels_of(self._stored.own(source), named, near)
        return len(sides) == 2 and form.prev == form.next

    def _evidence(
        self, source: FrameFile, named: vectors.Vectors, look: Look
    ) -> vector_test.Evidence:
        seen = look(source) if source.reference_channel is not None else None
        if seen is None:
            return vector_test.Evidence(doubt="no picture to test it on")
        motion = vectors.read(self._stored.own(source), named, source.reference_channel)
        seen, motion, prev, next_ = self._aligned(source, (seen, motion), look)
        rate = float(source.rate) if source.rate else None
        return vector_test.gathered(seen, motion, prev, next_, source.whole, rate)

    def _aligned(self, source: FrameFile, arrays: Sequence[np.ndarray], look: Look) -> list[Any]:
        """Arrays of a frame, and the images before and after it (or None), in one window."""
        near = [self._probe(source, side, look) for side in (-1, 1)]
        near = [one if one and near_enough(source.data_window, one[1]) else None for one in near]
        onto = union([source.data_window, *(window for _, window in filter(None, near))])
        own = [laid(a, source.data_window, onto) for a in arrays]
        return own + [one and laid(*one, onto) for one in near]

    @property
    def depth_kind(self) -> str:
        """The kind of depth: as requested, or found by occlusion."""
        asked = self._stored.passes.depth_kind
        if asked != "auto":
            return asked
        if self.known_depth is None:
            self.known_depth = self._find_depth_kind()
        return self.known_depth

    def _find_depth_kind(self) -> str:
        finding, there = self.finding, self._stored.files.on_disk
        if finding.vectors is None or not finding.sure or self._stored.passes.camera is not None:
            return "planar"
        total = depth_order.Votes()
        for number in dict.fromkeys(there[i] for i in (0, len(there) // 2, -1)):
            with contextlib.suppress(InputError, OSError):  # its turn to fail comes
                votes = self._depth_votes(self._named(number)[0], finding.vectors)
                total += votes or depth_order.Votes()
                if votes is None or total.is_enough:
                    break
        if not total.is_reversed:
            return "planar"
        text = (
            f"larger depth is taken as nearer, as surfaces of larger depth cover others in "
            f"{total.farther} of {total.count} places; `depth_kind=planar` takes it as farther"
        )
        self._stored.notes[text] = list(self._stored.numbers)
        return "white-near"

    def _depth_votes(self, source: FrameFile, named: vectors.Vectors) -> depth_order.Votes | None:
        """The votes of a frame about its depth; None if it has none."""
        own, near = self._stored.own(source), source.reference_channel
        name = names.find_depth(own, self._stored.passes.depth, near)
        if name is None or near is None:
            return None
        motion, depth = vectors.read(own, named, near), own[name].astype(np.float32)
        color, motion, depth, prev, next_ = self._aligned(
            source, (source.rgba, motion, depth), _picture
        )
        sides = (motion[..., :2], prev), (motion[..., 2:], next_)
        found = [depth_order.votes(color, m, depth, c) for m, c in sides if c is not None]
        return sum(found, depth_order.Votes())

    def _probe(self, source: FrameFile, side: int, look: Look) -> tuple[np.ndarray, Window] | None:
        """The image of a neighbour, by `look`, and its data window, to test vectors on."""
        number = source.number + side
        if not self._stored.has_neighbour(source.number, side):
            return None
        try:
            other = self._stored.find(number, source.view)
            same = other.display_window == source.display_window
            seen = look(other) if same else None
            return None if seen is None else (seen, other.data_window)
        except (InputError, OSError):
            return None
        finally:
            if number not in self._stored.numbers:
                self._stored.forget(number)
