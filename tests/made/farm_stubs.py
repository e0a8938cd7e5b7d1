"""Workers of a farm that misbehave on purpose; workers import this module."""

import os
import signal
from pathlib import Path

from wgmb import DeviceError
from wgmb.farm.plugin import BlurPlugin
from wgmb.io import atomic


class WithoutGpu(BlurPlugin):
    """Worker 1 has no GPU."""

    def prepare(self, adapter):
        if str(self._worker.name) == "1":
            raise DeviceError("no GPU adapter; found none at all")
        super().prepare(adapter)


class Killing(BlurPlugin):
    """Frame 5 kills its worker, always; frame 9 does so once. Both leave an unfinished file."""

    def blur(self, chosen, tell, stop):
        folder = Path(self._job.request.output.output).parent
        sources = self._job.clip.__class__.sources

        def deadly(clip, number):
            again = folder.parent / "again"
            if number == 5 or (number == 9 and not again.exists()):
                if number == 9:
                    again.write_bytes(b"")
                left = atomic.temporary_name(folder / f"o.{number:04d}.exr")
                os.close(atomic.create(left))
                os.kill(os.getpid(), signal.SIGKILL)
            return sources(clip, number)

        self._job.clip.__class__.sources = deadly
        return super().blur(chosen, tell, stop)
