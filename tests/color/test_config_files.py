"""Files of a colour config are regular ones of a bounded size, or refused in one line."""

import os
import zipfile

import pytest

from make_config import film_config, light
from wgmb import ColorConfig, InputError
from wgmb.color import config_files

pytestmark = pytest.mark.fast

CLF = """<?xml version="1.0"?><ProcessList id="a" version="1.7">
<Reference inBitDepth="32f" outBitDepth="32f" path="/dev/zero"/></ProcessList>"""


def pipe(path):
    path.unlink()
    os.mkfifo(path)


def device(path):
    path.unlink()
    path.symlink_to("/dev/zero")


def large(path):
    os.truncate(path, 2 << 30)


@pytest.mark.parametrize("name", ["config.ocio", "film.cube"])
@pytest.mark.parametrize(
    ("spoil", "message"),
    [(pipe, "is a pipe or a device"), (device, "is a pipe or a device"), (large, "MiB, too large")],
)
def test_a_pipe_a_device_and_a_large_file_are_refused(tmp_path, name, spoil, message):
    film_config(tmp_path)
    spoil(tmp_path / name)
    with pytest.raises(InputError, match=rf"{name}: .*{message}") as error:
        ColorConfig(tmp_path / "config.ocio")
    assert "\n" not in str(error.value)


PLACES = {
    "a look": "looks:\n  - !<Look> {name: odd, process_space: log, transform: TABLE}\n",
    "an inverse look": "looks:\n  - !<Look> {name: odd, process_space: log, "
    "inverse_transform: TABLE}\n",
    "a view": "default_view_transform: odd\nview_transforms:\n  - !<ViewTransform>\n"
    "    name: odd\n    from_scene_reference: TABLE\n",
    "a named transform": "named_transforms:\n  - !<NamedTransform> {name: odd, transform: TABLE}\n",
    "a space of the display": "display_colorspaces:\n  - !<ColorSpace>\n    name: odd\n"
    "    from_display_reference: TABLE\n",
    "a group in a group": "named_transforms:\n  - !<NamedTransform>\n    name: odd\n"
    "    inverse_transform: !<GroupTransform>\n"
    "      {children: [!<GroupTransform> {children: [TABLE]}]}\n",
}


@pytest.mark.parametrize("place", PLACES)
def test_tables_are_found_wherever_a_config_names_one(tmp_path, place):
    config = film_config(tmp_path)
    text, added = config.read_text(), PLACES[place]
    lead = added.partition("\n")[0] + "\n"
    added = added.replace("TABLE", "!<FileTransform> {src: odd.cube}")
    if lead in text:
        text = text.replace(lead, added)
    else:
        text += added
    config.write_text(text)
    (tmp_path / "odd.cube").symlink_to("/dev/zero")
    with pytest.raises(InputError, match=r"odd\.cube: is a pipe or a device"):
        ColorConfig(config)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-be", "utf-16-le"])
def test_a_table_that_names_another_file_is_refused(tmp_path, encoding):
    config = film_config(tmp_path)
    config.write_text(config.read_text().replace("film.cube", "film.clf"))
    (tmp_path / "film.clf").write_bytes(CLF.encode(encoding))
    with pytest.raises(InputError, match=r"film\.clf: .* must not name another file"):
        ColorConfig(config)


def test_an_archive_is_opened_unless_it_unpacks_to_too_much(tmp_path, monkeypatch):
    plain, archive = ColorConfig(film_config(tmp_path)), tmp_path / "film.ocioz"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name in ("config.ocio", "film.cube"):
            file.write(tmp_path / name, name)
    opened, color = ColorConfig(archive), light()
    shown = [c.display().shown(color, c.space("lin_rec709")) for c in (plain, opened)]
    assert (shown[0] == shown[1]).all()
    monkeypatch.setattr(config_files, "_MOST_ARCHIVE", 10_000)
    with pytest.raises(InputError, match=r"film\.ocioz: unpacks to over"):
        ColorConfig(archive)


def test_a_table_that_is_not_there_is_told_where_it_is_needed(tmp_path):
    config = ColorConfig(film_config(tmp_path))
    (tmp_path / "film.cube").unlink()
    config = ColorConfig(tmp_path / "config.ocio")
    with pytest.raises(InputError, match=r"film\.cube"):
        config.display().shown(light(), config.space("lin_rec709"))
