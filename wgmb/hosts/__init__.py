"""wgmb inside other programs: notebooks, pygfx, VapourSynth. Nothing else in wgmb imports it."""
