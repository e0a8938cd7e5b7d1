"""The viewer offscreen, and somebody at its mouse and keys: events in, pictures out.

A test file that names this module in `pytest_plugins` has its fixtures.
"""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from wgmb import Blur, Render, observer
from wgmb.color.srgb import srgb
from wgmb.scene import builtin
from wgmb.viewer import State, offscreen
from wgmb.viewer.state.groups import GROUP_OF
from wgmb.viewer.state.state import LOOKS
from wgmb.viewer.window import frame

SIZE = 512, 1010  # tall enough for the whole panel; the picture is 256 x 144
BESIDE = 256, 144
BARE, SMALL = (320, 180), (160, 90)  # of the picture alone, for what needs no panel


def put(state, **changes):
    """The state with other fields of its own, or options of its groups, by their names.

    `look` and `speed`, which are both, are its own.
    """
    own = {f.name for f in fields(state)} - GROUP_OF.keys() | {"look", "speed"}
    settings = {name: value for name, value in changes.items() if name not in own}
    view = {name: value for name, value in changes.items() if name in own}
    return replace(state.with_settings(**settings), **view)


PLAIN = State().with_settings(method="tap", antialias=1, samples=4)
ALONE = replace(PLAIN, panel=False)
SAMPLE = str(Path(__file__).parents[2] / "sample" / "crossing.####.exr")


class Hand:
    """A viewer and somebody at its mouse and keys; the clock is theirs."""

    def __init__(self, state=PLAIN, size=SIZE, ratio=1.0):
        self.now = 100.0
        self.viewer = offscreen(state, size, ratio, clock=lambda: self.now)
        self.look()

    @property
    def state(self):
        return self.viewer.state

    def submit(self, kind, **event):
        self.viewer.canvas.submit_event({"event_type": kind, "modifiers": (), **event})

    def look(self, seconds=0.02):
        """The window's next frame; of frames being opened, after the test of their vectors."""
        self.now += seconds
        image = frame(self.viewer)
        while self.viewer.stage.report.waiting == "sharp: testing the vectors":
            image = frame(self.viewer)
        return image[..., :3].astype(np.int16)

    def look_until(self, done):
        for _ in range(400):
            self.look(0.4)
            if done():
                return
        raise AssertionError("never done")

    def picture(self):
        """The picture when all is done, without the panel."""
        self.look_until(lambda: not self.viewer.stage.report.busy)
        return self.viewer.screen.picture()

    def drag(self, start, end, button=1, modifiers=()):
        press = {"button": button, "modifiers": modifiers}
        self.submit("pointer_move", x=start[0], y=start[1], button=0, buttons=())
        self.submit("pointer_down", x=start[0], y=start[1], buttons=(button,), **press)
        self.look()
        for share in (0.5, 1.0):
            x, y = (a + (b - a) * share for a, b in zip(start, end, strict=True))
            self.submit("pointer_move", x=x, y=y, button=0, buttons=(button,))
            self.look()
        self.submit("pointer_up", x=end[0], y=end[1], buttons=(), **press)
        self.look()

    def click(self, at):
        self.drag(at, at)

    def touch(self, name, share=0.5):
        """Put a finger on a widget, without having come over it before."""
        x, y, width, height = self.viewer.panel.places[name]
        at = x + share * width, y + height / 2
        for kind in ("pointer_down", "pointer_up"):
            self.submit("pointer_move", x=at[0], y=at[1], button=0, buttons=())
            self.submit(kind, x=at[0], y=at[1], button=1, buttons=(1,))
            self.look()
        self.look()

    def choose(self, name, item):
        self.touch(name)
        self.look()
        self.touch(f"{name}: {item}")
        self.look()

    def press(self, key):
        self.submit("key_down", key=key)
        self.submit("key_up", key=key)
        self.look()


@pytest.fixture(scope="module")
def shared():
    """One hand for the tests that begin by putting everything back."""
    return Hand()


@pytest.fixture
def hand(shared):
    shared.viewer.state = PLAIN
    shared.viewer.canvas.set_logical_size(*SIZE)
    shared.look()
    return shared


@pytest.fixture(scope="module")
def shared_bare():
    return Hand(ALONE, BARE)


@pytest.fixture
def bare(shared_bare):
    """As `hand`, without the panel: drawn in a tenth of the time."""
    shared_bare.viewer.state = ALONE
    shared_bare.viewer.canvas.set_logical_size(*BARE)
    shared_bare.look()
    return shared_bare


@pytest.fixture
def small(bare):
    """As `bare`, with a quarter of the pixels."""
    bare.viewer.canvas.set_logical_size(*SMALL)
    bare.look()
    return bare


def library(state, size=SMALL):
    """A Render of what the state is set to, and when."""
    shows = {} if state.look in LOOKS else {"show": state.look}
    blur = Blur(state.method, samples=state.blur.samples, shutter=state.shutter.make(), **shows)
    scene = builtin.make(state.source, **state.scene.parameters())
    render = Render(scene, blur, size=size, antialias=state.scene.antialias, fps=state.fps)
    return render, (state.frame / state.fps, int(state.frame))


def seen(frames, fps, after=0.0):
    """The frames as wgmb/observer.py perceives them; the first was always there."""
    eye = observer.Observer(fps)
    for picture in frames:
        eye.present(picture)
    return srgb(np.clip(eye.perceived(after)[..., :3], 0, 1))
