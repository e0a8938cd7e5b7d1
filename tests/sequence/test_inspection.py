"""Clip.inspect: here the first file of a sequence is opened, and no question opens one later."""

import traceback

import numpy as np
import pytest
from PIL import Image

import make_frames as make
from make_stereo import single_part
from wgmb.io import exr, stills
from wgmb.run.job import settle
from wgmb.run.request import BlurRequest
from wgmb.run.vectors import VectorsRequest
from wgmb.sequence.clip import Clip
from wgmb.settings import InputSettings, OutputSettings

WINDOW = {"data": (8, 6, 8 + make.WIDTH - 1, 6 + make.HEIGHT - 1), "display": (0, 0, 95, 71)}
KINDS = ("vectors", "no vectors", "stereo", "cropped", "panorama", "stills")


def written(folder, kind: str) -> str:
    """Frames 1 to 5 of a kind; their pattern."""
    if kind in ("vectors", "no vectors"):
        convention = "blender" if kind == "vectors" else None
        return make.write_sequence(folder, range(1, 6), convention)
    for n in range(1, 6):
        path = folder / f"shot.{n:04d}.exr"
        if kind == "stereo":
            make.write_parts(path, single_part(n))
        elif kind == "cropped":
            make.write_exr(path, make.frame(n), **WINDOW)
        elif kind == "panorama":
            channels = make.frame(n)
            wide = {k: np.tile(v, (1, 2))[:, : 2 * make.HEIGHT] for k, v in channels.items()}
            make.write_exr(path, wide)
        else:
            coded = (make.picture(n)[..., :3] ** (1 / 2.2) * 255).astype(np.uint8)
            Image.fromarray(coded).save(path.with_suffix(".png"))
    return str(folder / f"shot.####.{'png' if kind == 'stills' else 'exr'}")


@pytest.fixture
def opened(monkeypatch) -> list[list[str]]:
    """For each frame's file that is opened, the names of the functions that led there."""
    stacks: list[list[str]] = []
    for module in (exr, stills):

        def read(*words, read=module.read, **options):
            stacks.append([call.name for call in traceback.extract_stack()])
            return read(*words, **options)

        monkeypatch.setattr(module, "read", read)
    return stacks


@pytest.mark.parametrize("kind", KINDS)
def test_no_property_of_a_clip_opens_a_file_once_it_was_inspected(tmp_path, opened, kind):
    clip = Clip(written(tmp_path, kind))
    assert not opened
    findings = clip.inspect()
    assert opened
    opened.clear()
    questions = [name for name, one in vars(Clip).items() if isinstance(one, property)]
    assert {"has", "finding", "views", "chosen"} <= set(questions)
    for name in questions:
        getattr(clip, name)
    assert clip.inspect() is clip.settle() is clip.part([2, 3]).inspect() is findings
    clip.made_of(3, 1), repr(clip), len(clip), clip.dependencies.of(2)
    assert not opened


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_opens_its_first_file_by_inspecting_the_clip(tmp_path, opened, kind):
    pattern, output = written(tmp_path, kind), str(tmp_path / "o.####.exr")
    job = settle(BlurRequest(pattern=pattern, output=OutputSettings(output=output)))
    first = opened[0]
    assert first[first.index("settle") + 1] == "inspect"
    assert job.findings is job.clip.inspect()
    assert ("motion" in job.findings.has) == (kind not in ("no vectors", "stills"))


def test_vectors_are_written_of_a_clip_that_was_inspected_first(tmp_path, opened):
    pattern, output = written(tmp_path, "vectors"), str(tmp_path / "v.####.exr")
    VectorsRequest(pattern=pattern, output=output, form="nuke", input=InputSettings()).open()
    assert opened[0][opened[0].index("open") + 1] == "inspect"


@pytest.mark.parametrize("kind", ["vectors", "no vectors", "stills"])
def test_whole_frames_of_another_shape_are_not_read_for_their_edges(tmp_path, opened, kind):
    """The first frame tells that they have none; the middle and the last one are not read."""
    Clip(written(tmp_path, kind)).inspect()
    for_edges = [stack for stack in opened if "_some_leaders" in stack]
    assert len(for_edges) <= 1
