"""Blurs and motions of small scenes are those that are stored: stages that were tuned, together."""

import pytest

import stored_scenes


@pytest.mark.parametrize("name", stored_scenes.SCENES)
def test_it_is_what_is_stored(name):
    """Run tests/made/stored_scenes.py for a change on purpose; its commit says by how much."""
    scene = stored_scenes.SCENES[name]
    assert stored_scenes.differing(name, scene.make()) < scene.share


def test_every_file_has_its_scene():
    stored = {path.stem for path in stored_scenes.FOLDER.glob("*")}
    assert stored == set(stored_scenes.SCENES)
