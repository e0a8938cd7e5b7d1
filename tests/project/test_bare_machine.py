"""tools/bare_machine.sh, with programs in place of those that make a root and enter it."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.fast
ROOT = Path(__file__).parents[2]
STUBS = {
    "id": "echo 0",
    # It leaves mounts if it is killed, so it needs a namespace of its own.
    "debootstrap": '[ "$NAMESPACE" = own ] && mkdir -p "$5/root"',
    "chroot": ":",
    "git": ":",
    "chown": ":",
    # A command to run in the root is its last word.
    "unshare": """
        while [ $# -gt 1 ] && [ "$1" != debootstrap ]; do shift; done
        [ $# -gt 1 ] || exec sh -c "$1"
        NAMESPACE=own exec "$@"
    """,
}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_all_that_it_started_and_keeps_the_rows(tmp_path, number):
    for name, text in STUBS.items():
        path = tmp_path / "bin" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)
    tools = tmp_path / "clone" / "tools"
    tools.mkdir(parents=True)
    script = tools / "bare_machine.sh"
    script.write_text((ROOT / "tools" / "bare_machine.sh").read_text())
    under_way = tmp_path / "under way"
    line = ["bash", script, "debian:12", "--", "true", f"echo $$ >'{under_way}'; sleep 60; :"]
    env = os.environ | {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
    process = subprocess.Popen(
        list(map(str, line)), env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    ends = time.monotonic() + 30
    while not (under_way.exists() and under_way.read_text()):
        assert time.monotonic() < ends and process.poll() is None, process.communicate()
        time.sleep(0.02)
    process.send_signal(number)
    out, _ = process.communicate(timeout=10)
    assert process.returncode == 128 + number
    assert "| debian:12 | `true " in out
    assert out.count("debian:12") == 1
    pid = under_way.read_text().strip()
    time.sleep(0.2)
    stat = Path(f"/proc/{pid}/stat")
    assert not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] == "Z"
