"""The interactive viewer: `wgmb view`, `python app.py`.

state      what the viewer is set to; as TOML (saved) and as a command line (command_line)
fitting    options that do not fit what is shown; video_time: the output frames of a video
controls   mouse and keys: an event and a State make a State
source     a scene or frames on disk, drawn into textures; capabilities: what can be chosen
footage_subject: a video, drawn likewise; exposed: which pictures make an output frame
finder     motion, cuts and repeats of a video; motion_maker: in a thread of its own
renderer   a State becomes one or two images (report), in small steps; blurs: compiled methods
adaptive   resolution and samples while something moves
perception the last frames as perceived; quality: difference from the reference
video_light light of videos as a display shows it: wide gamut, HLG
screen     images side by side or compared, with a key to their colours
panel      the sliders: sections of widgets, video_section; overlay: text on the image; theme
window     events in, images out, on a desktop or offscreen; actions: files, videos, exports
"""

from .state.state import State
from .state.video_time import at_rate
from .window import Viewer, offscreen, view

__all__ = ["State", "Viewer", "at_rate", "offscreen", "view"]
