"""A farm: parts of a job on workers that are processes."""

import contextlib
import os
import signal
import socket
import ssl
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import farm_stubs
import psutil
import pytest
from make_job import job_of

import make_frames as make
from wgmb import DeviceError, gpu
from wgmb.extras import install_command
from wgmb.farm import farm as farming
from wgmb.farm.farm import Farm, as_farm_job
from wgmb.farm.local import local_client
from wgmb.farm.workers import hardware_adapters

COUNT = 12


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return make.write_sequence(tmp_path_factory.mktemp("shot"), range(1, COUNT + 1))


def contents(folder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in Path(folder).iterdir()}


DASK_LEAVES_SOCKETS = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


def words(pattern, out, *more) -> list[str]:
    line = ("blur", pattern, "-o", out / "o.####.exr", "--method", "tap", "--samples", 4, *more)
    return list(map(str, line))


@pytest.fixture(scope="module")
def whole(shot, tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    assert make.command(*words(shot, out)).returncode == 0
    return contents(out)


@DASK_LEAVES_SOCKETS
def test_two_workers_make_the_same_bytes_and_a_frame_that_cannot_be_read_fails_alone(
    tmp_path, capsys
):
    pattern = make.write_sequence(tmp_path, range(1, 10))
    damaged = tmp_path / "shot.0003.exr"
    damaged.write_bytes(damaged.read_bytes()[:-300])
    code, _, err = make.inside(capsys, *words(pattern, tmp_path / "whole"))
    assert code == 1
    more = ("--workers", 2, "--verbose")
    code, out, err = make.inside(capsys, *words(pattern, tmp_path / "out", *more))
    assert (code, out) == (1, "")
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")
    assert err.count("frame 3 failed") == 1
    assert "1 of 9 frames failed" in err
    assert "8 frames in" in err
    assert "worker 0: frames" in err


@DASK_LEAVES_SOCKETS
@pytest.mark.full
def test_workers_that_die_leave_nothing_but_whole_files(shot, whole, tmp_path):
    out, said = tmp_path / "out", []
    job = as_farm_job(job_of(shot, out))
    ticks = []
    farm = Farm(workers=2, details=said.append, plugin=farm_stubs.Killing)
    report = farm.blur(job, lambda n, state: ticks.append(n))
    assert report.failed == {5: "its worker died twice"}
    assert report.stopped == ""
    assert sorted(ticks) == list(range(1, COUNT + 1))
    names = {name: data for name, data in whole.items() if name != "o.0005.exr"}
    assert contents(out) == names
    assert sum("died" in text for text in said) == 5


@DASK_LEAVES_SOCKETS
def test_a_real_worker_without_a_gpu_is_named_once(shot, whole, tmp_path):
    notes = []
    farm = Farm(workers=2, note=notes.append, plugin=farm_stubs.WithoutGpu)
    report = farm.blur(as_farm_job(job_of(shot, tmp_path)))
    assert (report.failed, report.absent) == ({}, [])
    assert contents(tmp_path) == whole
    assert len(notes) == 1
    assert "does nothing: no GPU adapter" in notes[0]


def test_workers_take_the_adapter_that_the_environment_names(monkeypatch):
    """On a machine with two GPUs, of which the environment names one."""
    monkeypatch.delenv("WGMB_ADAPTER", raising=False)
    info = {"adapter_type": "DiscreteGPU", "backend_type": "Vulkan"}
    monkeypatch.setattr(gpu, "adapters", lambda: [SimpleNamespace(info=info)] * 2)
    assert hardware_adapters() == ["0", "1"]
    monkeypatch.setenv("WGMB_ADAPTER", "1")
    assert hardware_adapters() == []


@DASK_LEAVES_SOCKETS
def test_workers_have_the_environment_of_today(shot, whole, tmp_path, monkeypatch):
    """Though the process that they are forked from may have begun with another one."""
    job = as_farm_job(job_of(shot, tmp_path / "out"))
    monkeypatch.setenv("WGMB_ADAPTER", "nonsense")
    with pytest.raises(DeviceError, match="no adapter matches 'nonsense'; found"):
        Farm(workers=1).blur(job)
    monkeypatch.setenv("WGMB_ADAPTER", "")
    assert not Farm(workers=1).blur(job).failed
    assert contents(tmp_path / "out") == whole


@DASK_LEAVES_SOCKETS
def test_nobody_else_gives_local_workers_something_to_do():
    """Whoever reaches a scheduler can run code in it, and ports are reached by all users."""
    from distributed import Client

    with local_client(1) as client:
        address = client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        assert client.submit(int, "7").result(timeout=60) == 7
        for other in (address, address.replace("tls", "tcp")):
            with pytest.raises((OSError, TypeError)):
                Client(other, timeout=2, set_as_default=False)


def listening(process: int) -> dict[int, set[str]]:
    """Ports at which a process and its descendants listen, and by which addresses."""
    found: dict[int, set[str]] = {}
    first = psutil.Process(process)
    for one in (first, *first.children(recursive=True)):
        for connection in one.net_connections("inet"):
            if connection.status == psutil.CONN_LISTEN:
                found.setdefault(connection.laddr.port, set()).add(connection.laddr.ip)
    return found


@DASK_LEAVES_SOCKETS
def test_no_port_of_a_run_answers_whoever_does_not_have_its_keys():
    """Every port of its processes is asked, in the ways of HTTP, of TLS, and of dask."""
    before = listening(os.getpid())
    with local_client(2) as client:
        assert client.submit(int, "7").result(timeout=60) == 7
        ports = {p: a for p, a in listening(os.getpid()).items() if p not in before}
        assert len(ports) == 5  # the scheduler, and each worker with its nanny
        assert set().union(*ports.values()) == {"127.0.0.1"}
        for port in ports:
            for path in ("/", "/health", "/json/identity.json", "/info/main/workers.html"):
                said = answer(port, f"GET {path} HTTP/1.1\r\nHost: a\r\n\r\n".encode())
                assert said == b"" or is_alert(said)
            said = answer(port, bytes(64))
            assert said == b"" or is_alert(said)
            with pytest.raises((OSError, ssl.SSLError)):
                stranger(port)


def answer(port: int, data: bytes) -> bytes:
    """The answer of a port to these bytes, in a second."""
    with socket.create_connection(("127.0.0.1", port), timeout=5) as connection:
        connection.settimeout(1)
        with contextlib.suppress(OSError):
            connection.sendall(data)
            return connection.recv(4096)
    return b""


def is_alert(data: bytes) -> bool:
    """Return True for what TLS says to what is no TLS: an alert, which tells nothing else."""
    return len(data) == 7 and data[0] == 21


def stranger(port: int) -> None:
    """Ask by TLS, without a key of the run; OSError if there is no answer."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with (
        socket.create_connection(("127.0.0.1", port), timeout=5) as plain,
        context.wrap_socket(plain) as connection,
    ):
        connection.sendall(b"GET / HTTP/1.1\r\n\r\n")
        if not connection.recv(4096):
            raise OSError("closed")


@DASK_LEAVES_SOCKETS
def test_for_a_worker_that_is_lost_at_its_start_another_one_comes(monkeypatch):
    """Seen where a worker lost its first connection: it ends, and no other takes its place."""
    from distributed import Client

    from wgmb.farm import local

    wait = local._wait_for

    def lost(cluster, client, count):
        client.wait_for_workers(1, timeout=60)
        while not cluster.workers:  # the cluster lists a worker a moment after it has answered
            time.sleep(0.01)
        cluster.sync(cluster.workers[0].close)
        wait(cluster, client, count)

    monkeypatch.setattr(local, "_wait_for", lost)
    with local.local_client(1) as client:
        assert client.submit(int, "7").result(timeout=60) == 7
    monkeypatch.setattr(local, "_wait_for", wait)

    def nobody(*_, **__):
        raise TimeoutError

    monkeypatch.setattr(Client, "wait_for_workers", nobody)
    monkeypatch.setattr(local, "_STARTING", 0.5)
    with pytest.raises(DeviceError, match="1 workers should answer"), local.local_client(1):
        pytest.fail("nobody answered")


def test_a_worker_that_is_named_is_so_in_the_words_of_the_command_line(
    shot, tmp_path, capsys, monkeypatch
):
    for driver in ("VK_ICD_FILENAMES", "VK_DRIVER_FILES", "__EGL_VENDOR_LIBRARY_FILENAMES"):
        monkeypatch.setenv(driver, os.devnull)
    code, _, err = make.inside(capsys, *words(shot, tmp_path / "out", "--workers", 1))
    assert code == 3
    assert "worker 0 on" in err
    assert "`device=" not in err


@pytest.fixture(scope="module")
def long_shot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("long")
    for n in range(1, 4):
        make.write_exr(folder / f"of.{n}.exr", make.frame(n))
    for n in range(1, 401):
        (folder / f"shot.{n:04d}.exr").hardlink_to(folder / f"of.{(n - 1) % 3 + 1}.exr")
    return str(folder / "shot.####.exr")


def long_words(pattern, out, *more):
    return words(pattern, out, "--vectors", "blender", "--resume", *more)


def made(out) -> int:
    return len(list(out.glob("o.*.exr")))


def test_an_interrupted_farm_ends_its_frames_and_goes_on_later(long_shot, tmp_path, capsys):
    out = tmp_path / "out"
    line = long_words(long_shot, out, "--workers", 2)
    process = make.begun(line, lambda: made(out) >= 8)
    process.send_signal(signal.SIGINT)
    said, err = process.communicate(timeout=60)
    assert (process.returncode, said, err) == (130, "", "wgmb: interrupted\n")
    count = made(out)
    assert 8 <= count < 400
    assert len(contents(out)) == count  # nothing half written
    time.sleep(1)
    assert made(out) == count  # nobody goes on
    some = ("--frames", f"1-{count + 4}")
    code, _, err = make.inside(capsys, *long_words(long_shot, out, *some))
    assert code == 0
    assert "already done" in err


@contextlib.contextmanager
def scheduler_and_worker(folder):
    """Processes of dask.distributed as a farm has them; the address."""
    folder.mkdir()
    file = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    env = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, sys.path))}
    line = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, *line, "--scheduler-file", file], env=env, **quiet)
    line = ["worker", "--no-dashboard", "--nthreads", "1", "--no-nanny", "--death-timeout", "20"]
    worker = subprocess.Popen([*dask, *line, "--scheduler-file", file], env=env, **quiet)
    try:
        ends = time.monotonic() + 60
        while not (file.exists() and file.read_text().endswith("}")):
            assert time.monotonic() < ends
            time.sleep(0.05)
        yield scheduler, file.read_text().split('"address": "')[1].split('"')[0]
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.wait()


@pytest.mark.full
def test_a_scheduler_that_is_lost_is_one_line_and_resume_goes_on(long_shot, tmp_path):
    out = tmp_path / "out"
    with scheduler_and_worker(tmp_path / "first") as (scheduler, address):
        process = make.begun(
            long_words(long_shot, out, "--cluster", address), lambda: made(out) >= 8
        )
        scheduler.kill()
        said, err = process.communicate(timeout=60)
    assert (process.returncode, said) == (1, "")
    lines = err.splitlines()
    assert lines[0].startswith("wgmb: stopped: the scheduler is gone")
    assert "--resume" in lines[0]
    assert not [name for name in contents(out) if not name.startswith("o.")]
    last = f"1-{made(out) + 6}"
    with scheduler_and_worker(tmp_path / "second") as (_, address):
        done = make.command(*long_words(long_shot, out, "--cluster", address, "--frames", last))
    assert done.returncode == 0, done.stderr
    assert "already done" in done.stderr


@DASK_LEAVES_SOCKETS
@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("--workers 0", "--workers must be 1 to 256 or auto"),
        ("--workers 2 --cluster tcp://a:1", "choose either --workers, on this machine, or"),
        ("--workers 2 -o o.mp4", "a video is written by one process; write frames"),
        ("--cluster tcp://127.0.0.1:1", "no scheduler at tcp://127.0.0.1:1"),
        ("--cluster nonsense://x", "no scheduler at nonsense://x"),
    ],
)
def test_senseless_words_are_one_line(shot, tmp_path, capsys, monkeypatch, more, says):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(farming, "_CONNECT", 1)
    line = [*([] if "-o" in more else ["-o", "o.####.exr"]), *more.split()]
    code, out, err = make.inside(capsys, "blur", shot, *line)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert says in err


def test_without_distributed_one_line_says_what_to_install(shot, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, _, err = make.inside(capsys, *words(shot, tmp_path / "out", "--workers", 2))
    assert code == 2
    assert err == (
        "wgmb: --workers and --cluster: dask.distributed is not installed: "
        f"{install_command('cluster')}\n"
    )
    assert not (tmp_path / "out").exists()
