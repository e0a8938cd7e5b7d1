"""The real window, on a display of its own: xdotool's mouse and keys in, pictures out."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import ImageGrab

import make_clips as clips
from wgmb.viewer import State, offscreen
from wgmb.viewer.window import frame

ROOT = Path(__file__).parents[2]
SIZE = 800, 720  # of the window; its picture is 480 wide
PATIENCE = 90  # seconds: a busy machine without a GPU is slow
WATCHED = """
import os, weakref, glfw
from wgpu.backends.wgpu_native import GPUCanvasContext as Surface
from wgmb.viewer import State, view, window
surfaces, make, destroy = weakref.WeakSet(), Surface.__init__, glfw.destroy_window
def made(self, *arguments):
    make(self, *arguments)
    surfaces.add(self)
def destroyed(its):
    if surfaces:
        os.write(2, b"the window goes before its surface")
        os._exit(9)
    destroy(its)
Surface.__init__, glfw.destroy_window = made, destroyed
"""
BROKEN = """
from wgmb.viewer.draw.composer import Composer
def compose(*_): raise ZeroDivisionError("broken")
Composer.compose = compose
view(State().with_settings(method="tap"))
"""
QUITTING = """
draw = window.Viewer._draw
def quitting(self):
    draw(self)
    self.do("quit")
window.Viewer._draw = quitting
view(State().with_settings(method="tap"))
"""
DYING = """
import os, subprocess
ours, theirs = os.pipe()
command = ["Xvfb", "-displayfd", str(theirs), "-screen", "0", "640x480x24", "-nolisten", "tcp"]
server = subprocess.Popen(command, pass_fds=[theirs], stderr=subprocess.DEVNULL)
os.environ["DISPLAY"] = ":" + os.read(ours, 20).decode().strip()
from wgmb.viewer import State, view, window
drawn, draw = [], window.Viewer._draw
def dying(self):
    drawn.append(self)
    if len(drawn) == 8:
        server.kill()
        server.wait()
    draw(self)
window.Viewer._draw = dying
view(State(playing=True).with_settings(method="tap"), size=(320, 240))
"""
CLOSE = """
import ctypes, sys
x = ctypes.CDLL("libX11.so.6")
x.XOpenDisplay.restype = x.XInternAtom.restype = ctypes.c_void_p
display = ctypes.c_void_p(x.XOpenDisplay(None))
atom = lambda name: x.XInternAtom(display, name, 0)
class Message(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("sent", ctypes.c_int),
                ("display", ctypes.c_void_p), ("window", ctypes.c_ulong),
                ("message", ctypes.c_ulong), ("format", ctypes.c_int),
                ("data", ctypes.c_long * 5), ("rest", ctypes.c_long * 16)]
window = int(sys.argv[1])
event = Message(33, 0, 1, display, window, atom(b"WM_PROTOCOLS"), 32)
event.data[0] = atom(b"WM_DELETE_WINDOW")
x.XSendEvent(display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(event))
x.XSync(display, 0)
"""
DROP = """
import ctypes, sys
x = ctypes.CDLL("libX11.so.6")
long = ctypes.c_ulong
x.XOpenDisplay.restype = ctypes.c_void_p
x.XInternAtom.restype = x.XDefaultRootWindow.restype = x.XCreateSimpleWindow.restype = long
display = ctypes.c_void_p(x.XOpenDisplay(None))
atom = lambda name: x.XInternAtom(display, name, 0)
root, window = x.XDefaultRootWindow(display), int(sys.argv[1])
own = x.XCreateSimpleWindow(display, long(root), 0, 0, 9, 9, 0, long(0), long(0))
files = "".join(f"{name}\\r\\n" for name in sys.argv[2:]).encode()
def send(to, *values):
    event = (ctypes.c_long * 24)(*values)
    x.XSendEvent(display, long(to), 0, ctypes.c_long(0), ctypes.byref(event))
    x.XFlush(display)
def tell(name, *data):
    send(window, 33, 0, 1, 0, window, atom(name), 32, own, *data)
x.XSetSelectionOwner(display, long(atom(b"XdndSelection")), long(own), long(0))
tell(b"XdndEnter", 5 << 24, atom(b"text/uri-list"))
tell(b"XdndPosition", 0, 150 << 16 | 360, 0, atom(b"XdndActionCopy"))
event = (ctypes.c_long * 24)()
while True:
    x.XNextEvent(display, ctypes.byref(event))
    kind, what = event[0] & 0xFFFFFFFF, event[5]
    if kind == 33 and what == atom(b"XdndStatus"):
        tell(b"XdndDrop", 0, 0)
    elif kind == 30:  # what is dropped is asked for
        asks, selection, target, where, time = event[5:10]
        x.XChangeProperty(
            display, long(asks), long(where), long(target), 8, 0, files, len(files)
        )
        send(asks, 31, 0, 1, 0, asks, selection, target, where, time)
    elif kind == 33 and what == atom(b"XdndFinished"):
        sys.exit(0 if event[8] else "refused")  # GLFW tells the number of bytes it took
"""


@pytest.fixture(scope="module")
def display():
    """An X server without a screen: its name."""
    if not (shutil.which("Xvfb") and shutil.which("xdotool")):
        missing = "needs Xvfb and xdotool; `./run test` installs them"
        if os.environ.get("CI"):
            pytest.fail(missing)
        pytest.skip(missing)
    ours, theirs = os.pipe()
    # A server that resets when its last client goes refuses a client that comes meanwhile.
    screen = ["-screen", "0", "960x760x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(theirs), *screen],
        pass_fds=[theirs],
        stderr=subprocess.DEVNULL,
    )
    os.close(theirs)
    with os.fdopen(ours) as number:
        yield f":{number.readline().strip()}"
    server.terminate()
    server.wait(10)


class Desk:
    """The program on a display, and somebody at its mouse and keys."""

    def __init__(self, display, *words, cwd):
        self.display = display
        own = {"DISPLAY": display, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(cwd)}
        self.env = os.environ | own
        self.program = subprocess.Popen(
            [sys.executable, *words], env=self.env, cwd=cwd, stderr=subprocess.PIPE, text=True
        )

    def do(self, *words):
        done = subprocess.run(
            ["xdotool", *map(str, words)], env=self.env, capture_output=True, text=True, timeout=60
        )
        return done.stdout.split()

    def wait_for_window(self):
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            assert self.program.poll() is None, self.program.communicate()[1]
            if found := self.do("search", "--name", "^wgmb$"):
                self.window = found[0]
                return
            time.sleep(0.2)
        raise AssertionError("no window")

    def grab(self, size=SIZE):
        picture = ImageGrab.grab(bbox=(0, 0, *size), xdisplay=self.display)
        return np.asarray(picture.convert("RGB")).astype(np.int16)

    def grabs(self, size=SIZE):
        """The window's content now, and again, for as long as one can wait."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            assert self.program.poll() is None, self.program.communicate()[1]
            yield self.grab(size)
            time.sleep(0.4)

    def settled(self, size=SIZE):
        """The window's content once its picture does not change for two seconds."""
        last, since = None, 0.0
        for now in self.grabs(size):
            left = now[:, : size[0] - 320]
            if last is None or not np.array_equal(last, left):
                last, since = left, time.monotonic()
            if time.monotonic() - since > 2.0 and left.std() > 5:
                return now
        raise AssertionError("nothing was shown")

    def plays(self):
        """Wait until the picture moves by itself."""
        first = next(shown for shown in self.grabs() if picture_of(shown).std() > 5)
        assert self.shows_other_than(first)

    def shows_other_than(self, old):
        """True if the picture becomes another one than this."""
        old = picture_of(old)
        return any(np.abs(picture_of(now) - old).max() > 30 for now in self.grabs())

    def shows_again(self, old):
        """True if the picture becomes this one again, which may be coarser in between."""
        old = picture_of(old)
        return any(np.array_equal(picture_of(now), old) for now in self.grabs())

    def drag(self, start, end):
        self.do("mousemove", *start, "mousedown", 1)
        for share in (0.3, 0.6, 1.0):
            self.do(
                "mousemove", *(round(a + (b - a) * share) for a, b in zip(start, end, strict=True))
            )
            time.sleep(0.1)
        self.do("mouseup", 1)

    def ask_to_close(self):
        """The message of a window manager when its cross is clicked."""
        words = [sys.executable, "-c", CLOSE, self.window]
        subprocess.run(words, env=self.env, check=True, timeout=PATIENCE)

    def drop(self, *files):
        """Files let go of over the window, as a file manager does it (XDND 5)."""
        words = [sys.executable, "-c", DROP, self.window, *(Path(f).as_uri() for f in files)]
        subprocess.run(words, env=self.env, check=True, timeout=PATIENCE)

    def end(self):
        said = self.program.communicate(timeout=PATIENCE)[1]
        return self.program.returncode, said


@pytest.fixture
def desk(display, tmp_path):
    made = []

    def start(*words):
        made.append(Desk(display, *words, cwd=tmp_path))
        return made[-1]

    yield start
    for each in made:
        if each.program.poll() is None:
            each.program.kill()
            each.program.communicate()


def picture_of(whole):
    return whole[:, : SIZE[0] - 320]


def turned(desk):
    """The viewer after a drag of the mouse, and its picture before it."""
    words = [ROOT / "app.py", "--window", "{}x{}".format(*SIZE), "--samples", "4"]
    words += ["--method", "tap"]  # without a GPU, others take longer than a picture has to settle
    it = desk(*map(str, words))
    it.wait_for_window()
    it.plays()
    it.do("key", "space")
    first = it.settled()
    it.drag((150, 360), (300, 380))
    assert it.shows_other_than(first)
    return it, first


def test_the_mouse_turns_the_scene_and_escape_ends_the_program(desk):
    it, _ = turned(desk)
    it.do("key", "Escape")
    assert it.end() == (0, "")


@pytest.mark.full
def test_mouse_keys_slider_resize_and_escape(desk, tmp_path):
    it, first = turned(desk)
    it.do("key", "r")
    assert it.shows_again(first)

    it.do("mousemove", 200, 360, "click", 4, "click", 4)
    assert it.shows_other_than(first)
    it.do("key", "r")
    assert it.shows_again(first)

    twin = offscreen(State().with_settings(samples=4, method="tap"), SIZE)
    frame(twin)
    x, y, width, height = twin.panel.places["shutter"]
    it.drag((x + width * 0.25, y + height / 2), (x + width * 0.8, y + height / 2 + 100))
    assert it.shows_other_than(first)
    longer = it.settled()
    it.do("key", "r")  # there is nothing to put back: the camera never moved
    time.sleep(1)
    assert np.array_equal(picture_of(it.settled()), picture_of(longer))

    it.do("key", "h")
    assert it.shows_other_than(longer)
    it.do("key", "h")
    assert it.shows_again(longer)

    it.do("keydown", "Right")
    time.sleep(0.1)
    steps = [it.grab()]
    until = time.monotonic() + PATIENCE
    while len(steps) < 5 and time.monotonic() < until:
        if np.abs((now := it.grab())[:, :460] - steps[-1][:, :460]).max() > 60:
            steps.append(now)
    it.do("keyup", "Right")
    assert len(steps) == 5  # it goes on and on
    later = it.settled()

    it.do("key", "2")
    assert it.shows_other_than(later)
    it.do("key", "s")
    until = time.monotonic() + PATIENCE
    while not (tmp_path / "wgmb-001.exr").exists() and time.monotonic() < until:
        time.sleep(0.1)
    assert (tmp_path / "wgmb-001.png").exists()

    before = it.settled()
    it.drop(ROOT / "sample/crossing.0010.exr")
    assert it.shows_other_than(before)
    it.settled()
    recent = json.loads((tmp_path / "wgmb/recent.json").read_text())
    assert recent == [str(ROOT / "sample/crossing.####.exr")]

    it.do("windowsize", it.window, 900, 600)
    time.sleep(1)
    assert it.settled((900, 600))[:, -20:].max() < 120  # the panel has moved to the edge
    it.do("windowunmap", it.window)
    time.sleep(0.5)
    it.do("windowmap", it.window)
    it.settled((900, 600))
    it.do("key", "f")
    time.sleep(1)
    assert it.settled((960, 760)).std() > 5
    it.do("key", "f")
    time.sleep(1)
    it.settled((900, 600))
    it.do("key", "Escape")
    code, said = it.end()
    assert (code, said) == (0, "")


@pytest.mark.full
def test_a_video_plays_and_is_scrubbed_to_its_ends(desk, tmp_path):
    clip = tmp_path / "a.mp4"
    x = np.mgrid[:96, :160][1]
    tones = [np.where(abs(x - 10 - 12 * n) < 9, 220, 60).astype(np.uint8) for n in range(12)]
    grey = np.full((48, 80), 128, np.uint8)
    clips.write(clip, [clips.frame([tone, grey, grey], "yuv420p") for tone in tones])
    flow = ["--flow", "none", "--speed", "0.5", "--shutter", "360"]
    it = desk("-m", "wgmb", "view", str(clip), *flow, "--window", "{}x{}".format(*SIZE))
    it.wait_for_window()
    it.plays()
    it.do("key", "End")
    last = it.settled()
    it.do("key", "Left", "key", "Left")  # half of the last picture, and half of the one before
    assert it.shows_other_than(last)
    it.do("key", "Right", "key", "Right")
    assert it.shows_again(last)
    it.do("key", "Home")
    assert it.shows_other_than(last)
    time.sleep(3)  # all pictures are read and compared by then, on a busy machine, too
    clip.unlink()
    it.do("key", "space")
    time.sleep(1.5)
    it.do("key", "Escape")
    assert it.end() == (0, "")


@pytest.mark.full
def test_closing_the_window_ends_the_program(desk):
    it = desk(str(ROOT / "app.py"), "wheel", "--window", "500x300")
    it.wait_for_window()
    time.sleep(1)
    it.ask_to_close()
    assert it.end()[0] == 0


@pytest.mark.full
def test_an_error_while_drawing_ends_the_program(desk):
    it = desk("-c", WATCHED + BROKEN)
    code, said = it.end()
    assert code == 1, said
    assert "ZeroDivisionError: broken" in said


@pytest.mark.full
def test_quitting_while_drawing_releases_the_surface_first(desk):
    assert desk("-c", WATCHED + QUITTING).end() == (0, "")


@pytest.mark.full
def test_the_end_of_the_x_server_is_told_by_xlib_alone(desk):
    """In one line, or in two where the connection is reset before it is closed."""
    code, said = desk("-c", DYING).end()
    assert code == 1 and len(said.splitlines()) <= 2 and "connection" in said.lower(), said
    assert "panicked" not in said and "Traceback" not in said


def test_without_a_display_it_says_so(tmp_path):
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, str(ROOT / "app.py")],
        env=env,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 3
    assert done.stderr.startswith("wgmb: no display") and done.stderr.count("\n") == 1


CONTEXT = """
import glfw
from wgmb import gpu
glfw.init()
glfw.window_hint(glfw.VISIBLE, 0)
window = glfw.create_window(64, 64, "host", None, None)
glfw.make_context_current(window)
assert gpu.adapters() and gpu.adapters()
gpu.open_device()
assert glfw.get_current_context()
print("alive")
"""


@pytest.mark.full
def test_a_host_that_draws_with_opengl_lives(display):
    """wgpu looks for OpenGL adapters too, and ends a process whose context is in its way."""
    env = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
    line = [sys.executable, "-c", CONTEXT]
    done = subprocess.run(line, env=env, capture_output=True, text=True, timeout=120)
    assert done.stdout == "alive\n", done.stderr[-2000:]
