"""The interactive viewer: `wgmb view`, `python app.py`.

state      what the viewer is set to; as TOML (saved) and as a command line
controls   mouse and keys: an event and a State make a State
subject    a scene or frames on disk, drawn into textures; choices: what they allow
stage      a State becomes one or two images, a bit at a time
pace       how finely, while something moves
perceived  the last frames as an eye has them; judge: how far from the reference
screen     images side by side or compared, with a key to their colours
panel      the sliders: sections of widgets; words: those on the picture; theme: their looks
window     events in, pictures out; a desktop window, or none; actions: files, videos, exports
"""

from .state import State
from .window import Viewer, offscreen, view

__all__ = ["State", "Viewer", "offscreen", "view"]
