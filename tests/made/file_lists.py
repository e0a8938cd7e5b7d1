"""Texts that name other files, as FFmpeg's readers of lists know them: {name} or {path} is one.

And a film that does.
"""

import struct

LISTS = {
    "ffconcat": "ffconcat version 1.0\nfile {name}\n",
    "hls": "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:2\n#EXTINF:1.0,\n{path}\n"
    "#EXT-X-ENDLIST\n",
    "hls without an end": "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:1\n#EXTINF:1.0,\n"
    "{name}\n",
    "dash": '<?xml version="1.0"?>\n<MPD xmlns="urn:mpeg:dash:schema:mpd:2011" type="static" '
    'mediaPresentationDuration="PT1S" profiles="urn:mpeg:dash:profile:isoff-on-demand:2011">'
    '<Period><AdaptationSet mimeType="video/mp4"><Representation id="1" bandwidth="1">'
    "<BaseURL>{name}</BaseURL></Representation></AdaptationSet></Period></MPD>\n",
    "sdp": "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\n"
    "m=video 5000 RTP/AVP 96\na=rtpmap:96 H264/90000\n",
    "imf": '<?xml version="1.0"?>\n<AssetMap xmlns="http://www.smpte-ra.org/schemas/429-9/2007/AM">'
    "<AssetList><Asset><ChunkList><Chunk><Path>{name}</Path></Chunk></ChunkList></Asset>"
    "</AssetList></AssetMap>\n",
    "vobsub": "# VobSub index file, v7\nid: en, index: 0\n",
    "webm manifest": "{name}\n",
    "metadata": ";FFMETADATA1\ntitle={name}\n",
}

_PARENTS = (b"moov", b"trak", b"mdia", b"minf", b"dinf", b"dref")


def refer(movie: bytes, name: str) -> bytes:
    """A MOV whose pictures lie in another file, as QuickTime's references know it.

    The index of `movie` must come last, so that nothing else moves.
    """
    at = movie.index(b"url \0\0\0\1") - 4
    alias = bytearray(150)
    alias[130:134] = struct.pack(">HH", 1, 1)  # up to the folder of both, down to the file
    path = f"/{name}".encode()
    path += bytes(len(path) % 2)
    alias += struct.pack(">HH", 2, len(path)) + path + struct.pack(">HH", 0xFFFF, 0)
    box = struct.pack(">I4sI", 12 + len(alias), b"alis", 0) + alias
    made = bytearray(movie[:at] + box + movie[at + 12 :])
    for kind in _PARENTS:
        begin = made.rindex(kind, 0, at) - 4
        size = int.from_bytes(made[begin : begin + 4], "big") + len(box) - 12
        made[begin : begin + 4] = size.to_bytes(4, "big")
    return bytes(made)
