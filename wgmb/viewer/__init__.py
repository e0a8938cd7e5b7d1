"""The interactive viewer: `wgmb view`, `python app.py`.

state     what the viewer is set to; as TOML and as a command line
controls  mouse and keys: an event and a State make a State
subject   a scene or frames on disk, drawn into textures
stage     a State becomes a picture, a bit at a time
pace      how finely, while something moves
panel     the sliders and the words; theme: their colours and font
window    events in, pictures out; a desktop window, or none
"""

from .state import State
from .window import Viewer, offscreen, view

__all__ = ["State", "Viewer", "offscreen", "view"]
