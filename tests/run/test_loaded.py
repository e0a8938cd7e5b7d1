"""Neither flow nor PyAV is loaded by `wgmb blur`, unless a run needs them."""

import subprocess
import sys

import pytest

import make_frames as make

CODE = """
import sys
from wgmb.cli import app
code = app.main(sys.argv[1:])
print(code, sorted(m for m in ("av", "cv2", "wgmb.flow") if m in sys.modules), file=sys.stderr)
"""


@pytest.mark.parametrize("which", ["help", "frame"])
def test_flow_and_pyav_are_loaded_only_where_they_are_needed(tmp_path, which):
    words = ["blur", "--help"]
    if which == "frame":
        pattern = make.write_sequence(tmp_path, range(1, 4))
        words = ["blur", pattern, "-o", str(tmp_path / "b.####.exr")]
        words += ["--frames", "2", "--method", "tap", "-q"]
    ran = subprocess.run([sys.executable, "-c", CODE, *words], capture_output=True, text=True)
    assert ran.stderr.strip() == "0 []"
