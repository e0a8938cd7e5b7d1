"""What can go wrong, as exceptions.

Error
├── InputError    your arrays, files or options do not fit (also a ValueError)
├── ShaderError   a WGSL file could not be read, compiled or bound; says file:line
├── DeviceError   no adapter, one that lacks a feature or a limit, or a device that was lost
└── GpuMemoryError  too little memory on the GPU for one frame; the next one may do
"""


class Error(Exception):
    """Everything wgmb raises on purpose; the text says what was expected and what came."""


class InputError(Error, ValueError):
    """The caller's arrays, files or options do not fit."""


class ShaderError(Error):
    """A shader could not be read, compiled or bound; the text names file and line."""


class DeviceError(Error):
    """No usable GPU adapter, or one that lacks a feature or a limit; or its device was lost."""


class GpuMemoryError(Error):
    """Too little memory on the GPU for one frame; smaller ones, and later ones, may do."""
