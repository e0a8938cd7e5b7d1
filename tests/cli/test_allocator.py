"""Memory that large arrays leave goes back to the system, in threads too."""

import subprocess
import sys

import pytest

LEFT = """
import sys, threading
import numpy as np
from wgmb.allocator import bound_free_memory
if not bound_free_memory():
    sys.exit(7)
def held():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * 4096 / 2**20
gate = threading.Barrier(13)
def work():
    np.ones(20 << 20, np.uint8)  # which raised the size from which arrays are mapped alone
    many = [np.ones(1 << 20, np.uint8) for _ in range(24)]
    del many
    gate.wait()
    gate.wait()
before = held()
threads = [threading.Thread(target=work) for _ in range(12)]
for thread in threads:
    thread.start()
gate.wait()
print(held() - before)
gate.wait()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="glibc is Linux's")
def test_what_threads_have_left_is_not_kept():
    done = subprocess.run([sys.executable, "-c", LEFT], capture_output=True, text=True)
    if done.returncode == 7:
        pytest.skip("the allocator is not glibc's")
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 220, done.stdout  # 290 without bounds
