"""The ends of the names of files that hold pictures."""

STILLS = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
VIDEOS = (".mp4", ".mov", ".mkv", ".webm", ".gif")
"""Those that are written; any video that FFmpeg knows is read."""
