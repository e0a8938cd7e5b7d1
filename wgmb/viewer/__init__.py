"""The interactive viewer: `wgmb view`, `python app.py`.

state      what the viewer is set to; as TOML (saved) and as a command line
controls   mouse and keys: an event and a State make a State
source     a scene or frames on disk, drawn into textures; capabilities: what can be chosen
renderer   a State becomes one or two images, in small steps
adaptive   resolution and samples while something moves
perception the last frames as perceived; quality: difference from the reference
video_light light of videos as a display shows it: wide gamut, HLG
screen     images side by side or compared, with a key to their colours
panel      the sliders: sections of widgets; overlay: text on the image; theme: colours, font
window     events in, images out, on a desktop or offscreen; actions: files, videos, exports
"""

from .state import State
from .window import Viewer, offscreen, view

__all__ = ["State", "Viewer", "offscreen", "view"]
