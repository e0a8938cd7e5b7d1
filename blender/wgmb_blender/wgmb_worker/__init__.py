# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that blurs: it runs beside Blender, and knows files and no Blender.

wgmb, its OpenEXR and its way to the GPU share no memory with Blender, which brings an OpenEXR of
its own and draws its window with OpenGL: a fault of a driver ends this process, not Blender.
Blender's side is `process.py`; it imports from here only what needs no wgmb.
"""
