"""The interactive viewer: `wgmb view`, `python app.py`.

state/     the viewer's settings: one frozen State; as TOML and as words of a command line
subjects/  a scene, frames or a video, drawn into textures; motion and cuts of a video
draw/      a State becomes one or two images, in small steps or in a thread, and these go on the
           screen
panel/     the controls beside the image, and text over it
window     events in, images out, on a desktop or offscreen; controls: an event and a State make
           a State; actions: files, videos, exports; capabilities: the available choices
"""

from .state.state import State
from .state.video_time import at_rate
from .window import Viewer, offscreen, view

__all__ = ["State", "Viewer", "at_rate", "offscreen", "view"]
