"""A small part of tools/soak.py, which fails where its table would say so; and the harness itself.

What is random follows from today's date, which a failure tells, with the command that tries
the same again.
"""

import contextlib
import mmap
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import soak

from soaking import (
    CRASHERS,
    damage,
    hostile,
    kinds,
    numbers,
    parts,
    resuming,
    stated,
    stopping,
    strangers,
    table,
    viewing,
)
from soaking.forked import forked
from soaking.processes import Ended, apart, growth, limits, run, use, wgmb
from soaking.table import Line, Tally, Trial
from wgmb import InputError
from wgmb.io import exr

SEED = int(time.strftime("%Y%m%d"))


def check(rows, count: int, folder: Path) -> None:
    """Every line of a row says that all is right."""
    trial = Trial(count, SEED, folder, folder / "crashers")
    again = f"python tools/soak.py --rows {rows.__name__.replace('_', '-')} --seed {SEED} -v"
    for line in rows(trial):
        assert line.ok, "\n".join([line.what, *(line.wrong or [line.worst]), "", again])


# ---- what CI has time for -------------------------------------------------------------------


@pytest.mark.full
def test_damaged_files_are_read_or_refused_by_name_and_nothing_else(tmp_path):
    check(damage.mutations, 40, tmp_path)


@pytest.mark.full
def test_strange_words_in_any_text_are_read_or_refused_by_name(tmp_path):
    check(damage.exchanges, 40, tmp_path)


@pytest.mark.full
def test_the_viewer_bears_whatever_is_done_to_it(tmp_path):
    ended = apart(viewing.used, 20, SEED, str(tmp_path), seconds=300)
    assert ended.value is not None, ended.wrong(0)
    assert ended.value[1] >= 10


@pytest.mark.parametrize(("growth", "ok"), [(0.0, True), (0.5, True), (3.0, False)])
def test_growth_is_told_from_what_comes_and_goes(growth, ok):
    seconds = np.arange(0, 3600, 5.0)
    compiled = 300 * (1 - np.exp(-seconds / 150)) + 250 * (seconds > 540)  # and a block of wgpu's
    opened = 60 * (seconds // 45 % 3)
    looks = np.stack([seconds, 500 + opened + compiled + growth * seconds / 60], axis=1)
    rate, error, *_ = viewing._slope(looks)
    assert (rate - 2 * error <= viewing._MOST_USED) == ok
    assert abs(rate - growth) <= max(3 * error, 0.2)
    for shorter in (100, 720, 1300):  # while all is still being compiled, nothing can be told
        assert viewing._slope(looks[seconds < shorter])[1] == np.inf


@pytest.mark.full
def test_files_that_were_cut_off_are_refused(tmp_path):
    check(damage.truncations, 15, tmp_path)


@pytest.mark.full
@pytest.mark.parametrize(
    ("rows", "count"),
    [
        (strangers.lists, 3),
        (strangers.jumps, 3),
        (strangers.joined, 4),
        (strangers.outdated_videos, 1),
    ],
)
def test_strangers_videos_do_no_harm(rows, count, tmp_path):
    check(rows, count, tmp_path)


@pytest.fixture(scope="module")
def outcomes() -> dict[str, dict]:
    """The result of every file in tests/crashers."""
    return damage.replayed(CRASHERS)


@pytest.mark.parametrize("name", sorted(path.name for path in CRASHERS.iterdir()))
def test_what_once_did_what_no_file_may_is_read_or_refused_by_name(name, outcomes):
    assert outcomes[name]["why"] == ""


@pytest.mark.full
def test_killed_runs_leave_whole_files_and_are_resumed_to_the_same_bytes(tmp_path):
    check(stopping.kills, 4, tmp_path)


@pytest.mark.full
def test_interrupted_runs_end_with_one_line_at_any_time_also_while_they_start(tmp_path):
    check(stopping.stops, 4, tmp_path)


@pytest.mark.full
def test_several_processes_may_blur_into_one_folder(tmp_path):
    check(resuming.processes, 1, tmp_path)


# ---- what would be noticed ------------------------------------------------------------------


def behave(how: str) -> str:
    """A case of `forked`: it crashes, hangs, ends the process, or is well."""
    if how == "crashes":
        os.kill(os.getpid(), signal.SIGSEGV)
    elif how == "hangs":
        time.sleep(60)
    elif how == "exits":
        os._exit(7)
    return how


def tried(cases: list[str]) -> list:
    return forked(cases, behave, seconds=0.5)


def test_a_case_that_crashes_or_hangs_costs_only_itself():
    cases = ["well", "crashes", "well", "hangs", "exits", "crashes", "well"]
    found = apart(tried, cases).value
    assert [f if isinstance(f, str) else (f["what"], f["why"]) for f in found] == [
        "well", ("died", "SIGSEGV"), "well", ("hung", "0.5 s"), ("died", "exit 7"),
        ("died", "SIGSEGV"), "well",
    ]  # fmt: skip


def leaking(kib: int) -> float:
    """KiB a step that is found where so many are left behind."""
    kept = []

    def step(number: int) -> None:
        block = mmap.mmap(-1, max(1, kib) << 10)
        block.write(bytes(kib << 10))
        kept.append(block)

    return growth(step, 10, 60)


@pytest.mark.covers(0)
@pytest.mark.parametrize(("kib", "least", "most"), [(0, -5, 12), (100, 90, 112)])
def test_growth_is_what_a_step_leaves_behind(kib, least, most):
    assert least <= apart(leaking, kib).value <= most


def eating(mib: int) -> int:
    return len(b"x" * (mib << 20)) >> 20


@pytest.mark.full
def test_limits_hold_and_the_peak_is_told():
    ballast = b"x" * (1 << 30)  # of this process, which is none of that one's
    ended = apart(eating, 300)
    assert ended.value == 300
    assert 300 < ended.peak < 500 < len(ballast) >> 20
    ended = apart(eating, 9000, prepare=limits(memory=3000))
    assert ended.value is None
    assert "MemoryError" in ended.wrong(0)


def test_a_command_that_never_ends_is_ended():
    ended = run(["sleep", "60"], seconds=0.2)
    assert ended.late
    assert "still running" in ended.wrong(0)


def test_a_machine_that_is_busy_makes_no_command_late():
    """Only a command's own processor time counts, or many times as long by the clock."""
    assert not run(["sleep", "1"], seconds=0.4).late
    busy = run([sys.executable, "-c", "while True: pass"], seconds=0.4)
    assert busy.late and busy.seconds < 60


@pytest.mark.parametrize(
    ("code", "err", "wanted", "wrong"),
    [
        (0, "", (0,), ""),
        (2, "wgmb: a.exr: no such file\n", (0, 2), ""),
        (2, "wgmb: a.exr: no such file\n", (0,), "exit 2"),
        (2, "wgmb: no such file\n", (2,), "does not name a.exr"),
        (2, "wgmb: a.exr\nand more\n", (2,), "2 lines"),
        (1, "Traceback (most recent call last):\nKeyError: 3\n", (1,), "traceback, exit 1: Key"),
        (0, "\x1b[31m", (0,), "control characters"),
        (-11, "", (0, 2), "exit -11"),
    ],
)
def test_how_a_command_ended_is_judged(code, err, wanted, wrong):
    found = Ended(code, "", err, 1.0, 1.0, False).wrong(*wanted, name="a.exr")
    assert found.startswith(wrong)
    assert bool(found) == bool(wrong)


def behaved(how: str) -> list:
    """The measurement of a command that behaves well or badly."""
    from wgmb.cli import app

    def main(words):
        if how == "large":
            kept = b"x" * (400 << 20)
            time.sleep(len(kept))
        while how == "long" or how == "deaf":
            with contextlib.suppress(KeyboardInterrupt if how == "deaf" else ()):
                sum(range(1000))
        sys.stderr.write("wgmb: a.png: cut off\n")
        return 2

    stated.MOST_SECONDS, stated.DEAF_SECONDS, stated.MOST_MB = 0.5, 0.2, 300
    app.main = main
    return list(stated.measure([how], interrupt=0.1 if how == "deaf" else None))


@pytest.mark.parametrize(
    ("how", "wrong"),
    [("well", ""), ("large", "over 300 MiB"), ("long", "over 0.5 s"), ("deaf", "deaf: 0.2 s")],
)
def test_a_command_that_takes_too_much_is_stopped(how, wrong):
    measured = stated.Measured(*apart(behaved, how).value)
    assert measured.ended.startswith(wrong)
    assert stated.fault(measured, Path("a.png")).startswith(wrong)
    assert (measured.exit, measured.line) == ((-9, "") if wrong else (2, "wgmb: a.png: cut off"))


@pytest.mark.full
def test_files_that_state_too_much_are_refused_or_read_rightly(tmp_path):
    check(stated.stated, 4, tmp_path)


def test_every_sound_file_is_read_and_seen_to_differ_from_others(tmp_path):
    ended = apart(damage.batch, "mutated", [], 0, 1, str(tmp_path), str(tmp_path / "kept"))
    assert ended.value == {}, ended.err
    assert len(kinds.KINDS) >= 25
    for name, kind in kinds.KINDS.items():
        holds = kinds.read(name, tmp_path / f"{name}{kind.suffix}")
        assert holds == kinds.read(name, tmp_path / f"{name}{kind.suffix}")
    pictures = {kinds.read(n, tmp_path / f"{n}.exr") for n in ("exr-none", "exr-zip", "exr-piz")}
    assert len(pictures) == 1
    assert kinds.read("exr-b44", tmp_path / "exr-b44.exr") not in pictures


def test_damage_is_the_same_again_and_differs_by_seed_kind_and_number(tmp_path):
    data = bytes(range(256)) * 8
    for how in damage.SPOIL:
        one = damage.spoiled(how, "png-8", data, 1, 0)
        assert one == damage.spoiled(how, "png-8", data, 1, 0)
        others = [damage.spoiled(how, *rest) for rest in
                  (("png-8", data, 2, 0), ("jpeg", data, 1, 0), ("png-8", data, 1, 1))]  # fmt: skip
        assert one not in others
    assert len(damage.spoiled("cut", "png-8", data, 1, 0)) <= len(data) - 13
    text = b'{"a": [1, 2.5], "b": "two"}'
    assert {damage.spoiled("exchanged", "camera", text, 1, n) for n in range(9)}.isdisjoint({text})


@pytest.mark.parametrize(
    ("error", "what"),
    [
        (InputError("somewhere: bad"), "unnamed"),
        (InputError("{path}: bad\nand more"), "lines"),
        (KeyError("x"), "KeyError"),
        (InputError("{path}: bad"), "refused"),
        (None, "another picture"),
    ],
)
def test_what_comes_of_a_file_is_judged(tmp_path, monkeypatch, error, what):
    path = tmp_path / "a.png"

    def read(kind, at):
        if error is not None:
            raise type(error)(str(error.args[0]).format(path=at))
        return "a digest"

    monkeypatch.setattr(kinds, "read", read)
    outcome = damage.judge("png-8", path, "another digest")
    assert outcome["what"] == what
    assert bool(outcome["why"]) == (what not in ("refused", "another picture"))


def test_inputs_that_went_wrong_are_kept_once_a_kind_and_outcome(tmp_path):
    def keep(what, data):
        damage._keep(tmp_path / "new", "png-8", {"what": what, "why": "SIGSEGV"}, data)

    keep("KeyError", b"first")
    keep("KeyError", b"second")
    keep("died", b"third")
    keep("hung", bytes(1 << 20))
    kept = {p.name: p.read_bytes() for p in (tmp_path / "new").iterdir()}
    assert kept == {"png-8.KeyError.png": b"first", "png-8.SIGSEGV.png": b"third"}


def test_hostile_headers_are_those_of_a_sound_file_but_for_what_they_say(tmp_path):
    path = tmp_path / "sound.exr"
    path.write_bytes(hostile.exr())
    assert {n: p.shape for n, p in exr.read(path).channels().items()} == dict.fromkeys(
        "BGR", (4, 8)
    )
    packed = hostile._zeros_exr(32, 32, hostile.RGB)
    path.write_bytes(packed)
    (part,) = exr.read(path).parts
    assert part.size == (32, 32)
    assert not any(plane.any() for plane in part.channels.values())
    assert len({build() for name, build in hostile.HEADERS.items() if "MiB" not in name}) == (
        len(hostile.HEADERS) - 1
    )


def test_values_that_come_out_are_looked_at():
    made = np.ones((4, 6, 4), np.float32)
    assert numbers._bad(made, (6, 4)) == ""
    assert "shape" in numbers._bad(made, (4, 6))
    made[0, 0] = np.nan, np.inf, 0, 1
    assert numbers._bad(made, (6, 4)) == "1 NaN, 1 infinite"


def test_use_counts_descriptors_and_threads():
    before = use()
    reads, writes = os.pipe()
    assert use().files == before.files + 2
    os.close(reads)
    os.close(writes)
    assert before.threads >= 1
    assert before.memory > 10_000  # NumPy alone


# ---- the table ------------------------------------------------------------------------------


@pytest.fixture
def rows(monkeypatch):
    """Two rows of their own: one is right, one cannot be tried."""
    monkeypatch.setattr(table, "ROWS", {})

    @table.row(quick=2, full=20)
    def right(trial):
        """Counts."""
        tally = Tally("counting", "numbers")
        for number in range(trial.count):
            tally.note(number)
        (trial.folder / "file").write_text("")
        yield tally.line(f"seed {trial.seed}")

    @table.row(full=1)
    def broken(trial):
        """Breaks."""
        yield Line("begun", "1", "yes", "-", True)
        raise OSError("no | disk\x1b[31m")

    monkeypatch.setattr(soak, "ROWS", table.ROWS)
    monkeypatch.setattr(soak, "_about", lambda given: f"seed {given.seed}")
    monkeypatch.setattr(soak, "LISTED", list(table.ROWS.values()))
    return table.ROWS


def test_rows_are_printed_as_they_are_done_and_written_whole(rows, tmp_path, capsys):
    out = tmp_path / "table.md"
    assert soak.main(["--rows", "right", "--seed", "3", "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "| counting | 20 numbers | yes | seed 3 |" in printed
    assert out.read_text() == printed
    assert [p.name for p in tmp_path.iterdir()] == ["table.md"]
    assert soak.main(["--quick", "--scale", "3"]) == 0
    assert "| 6 numbers |" in capsys.readouterr().out


def test_a_row_that_is_not_right_is_the_exit_code_and_does_not_end_the_others(rows, capsys):
    assert soak.main(["--rows", "broken,right"]) == 1
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert lines[-3] == "| begun | 1 | yes | - |"
    assert lines[-2] == "| **broken** | - | **not tried** | OSError: no \\| disk\\x1b[31m |"
    assert lines[-1].startswith("| counting")
    assert "Traceback" in said.err


def test_an_interrupted_table_is_not_written(rows, tmp_path, monkeypatch):
    def interrupted(trial):
        raise KeyboardInterrupt
        yield

    monkeypatch.setitem(rows, "right", table.Row("right", 1, 1, interrupted))
    with pytest.raises(KeyboardInterrupt):
        soak.main(["--rows", "right", "-o", str(tmp_path / "table.md")])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [["--rows", "nonsense"], ["--scale", "0"], ["--scale", "nan"]])
def test_words_that_make_no_sense_are_usage(words, capsys):
    with pytest.raises(SystemExit) as ended:
        soak.main(words)
    assert ended.value.code == 2


def test_every_row_says_what_it_does(capsys):
    assert soak.main(["--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == len(table.ROWS) == len({line.split()[0] for line in listed})
    assert all(row.about.endswith(".") and row.full > 0 for row in table.ROWS.values())


def test_a_tally_says_what_was_wrong_and_what_was_tried_never():
    tally = Tally("this", "files")
    assert not tally.line().ok
    for number in range(5):
        tally.note(number, "bad" if number else "")
    line = tally.line("worst")
    assert (line.right, line.ok) == ("1 of 5", False)
    assert line.worst == "1: bad; 2: bad; 3: bad; 1 more; worst"
    assert len(line.wrong) == 4


def test_cases_are_taken_evenly(tmp_path):
    assert Trial(3, 0, tmp_path, tmp_path).some("abcdefghi") == ["a", "d", "g"]
    assert Trial(99, 0, tmp_path, tmp_path).some("abc") == ["a", "b", "c"]


def test_every_method_is_among_the_parts():
    from wgmb import METHODS

    assert {name.split(",")[0].split()[-1] for name in parts.PARTS} >= METHODS.keys()


def test_wgmb_is_the_one_that_lies_beside_the_harness():
    where = "import wgmb; print(wgmb.__file__)"
    from soaking import ROOT

    assert run([*wgmb_python(), "-c", where]).out.strip() == str(ROOT / "wgmb" / "__init__.py")
    assert wgmb("--version").code == 0


def wgmb_python() -> list[str]:
    from soaking.processes import WGMB

    return WGMB[:1]
