"""The ends of the names of files that hold pictures."""

STILLS = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
DEEP = (".png", ".tif", ".tiff")
"""Those of them that hold 16 bits."""
VIDEOS = (".mp4", ".mov", ".mkv", ".webm", ".gif")
"""Those that are written; any video that FFmpeg knows is read."""
KNOWN_VIDEOS = (
    *VIDEOS, ".m4v", ".avi", ".ts", ".mts", ".m2ts", ".mpg", ".mpeg", ".vob", ".wmv", ".flv",
    ".ogv", ".3gp", ".mxf",
)  # fmt: skip
"""Those that a name alone tells."""
