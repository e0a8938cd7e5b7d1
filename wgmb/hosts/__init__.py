"""wgmb inside other programs: notebooks and pygfx scenes. Nothing else in wgmb imports it."""
