import json
import shutil

import pytest
from fake_models import WEIGHTS, make_model
from ramp import make_volume

from app.state.library import Library
from app.state.preferences import Preferences
from model.errors import CheckpointError
from model.generator.catalog import shipped_models
from model.networks.card import MODEL_FILE, load_card
from model.scene.scene import FORMAT_VERSION


@pytest.fixture
def preferences():
    return Preferences()


@pytest.fixture
def library(preferences):
    return Library(preferences)


def fingerprint(name="ramp", top=200.0):
    return make_volume(name, top).fingerprint


BROKEN_CARDS = [
    *("", "no JSON", "[" * 100_000, [], 7, {}, {"tfscope_model": None}, {"tfscope_model": 1.0}),
    *({"tfscope_model": 999}, {"tfscope_model": FORMAT_VERSION}),
    {"tfscope_model": FORMAT_VERSION, "scene": 3, "size": []},
]
WRONG_PARTS = [
    *({"scene": []}, {"size": {"width": "wide"}}, {"metrics": 3}, {"training": None}),
    *({"weights": ["a", "b"]}, {"sha256": None}),
]


def test_damaged_cards_and_weights_are_told(library, tmp_path):
    folder = make_model(tmp_path / "model")
    assert library.check_model(folder).volume_fingerprint == fingerprint()
    for number, part in enumerate(WRONG_PARTS):
        wrong = make_model(tmp_path / str(number), **part)
        assert_said(library, wrong, str(wrong))
    for content in BROKEN_CARDS:
        text = content if isinstance(content, str) else json.dumps(content)
        (folder / MODEL_FILE).write_text(text)
        assert_said(library, folder, MODEL_FILE)


def test_weights_that_are_truncated_or_altered(library, tmp_path):
    folder = make_model(tmp_path / "model")
    for content in (WEIGHTS[:-1], b"", b"x" + WEIGHTS[1:]):
        (folder / "generator-1.safetensors").write_bytes(content)
        assert_said(library, folder, "generator-1.safetensors", "truncated or altered")


def test_missing_files_are_named(library, tmp_path):
    folder = make_model(tmp_path / "model")
    (folder / "generator-1.safetensors").unlink()
    assert_said(library, folder, "generator-1.safetensors", "missing")
    # Its volume is known all the same.
    scene = library.scene_of(folder)
    assert scene is not None and scene.volume_name == "ramp"
    (folder / MODEL_FILE).unlink()
    assert_said(library, folder, MODEL_FILE, "missing")


def test_what_is_no_folder_of_a_model(library, tmp_path):
    assert_said(library, tmp_path, MODEL_FILE)
    assert_said(library, tmp_path / "gone", "no such folder")
    folder = make_model(tmp_path / "runs" / "mine")
    assert_said(library, folder / MODEL_FILE, "a file")
    assert_said(library, tmp_path / "runs", "'mine'")


def assert_said(library, folder, *parts):
    with pytest.raises(CheckpointError) as raised:
        library.check_model(folder)
    said = str(raised.value)
    assert all(part in said for part in (str(folder), *parts))
    assert "Unexpected" not in said
    assert said.endswith(".") and ";" in said and "\n" not in said


def models_of(library, preferences, fingerprint):
    return library.models_of(fingerprint, preferences.volume(fingerprint).models)


def test_models_of_a_volume_are_the_newest_first(library, preferences, tmp_path):
    ours = fingerprint()
    for name in ("old", "new", "gone", "other"):
        folder = make_model(tmp_path / name)
        preferences.note_model(folder, ours)
    shutil.rmtree(tmp_path / "gone")
    shutil.rmtree(tmp_path / "other")
    make_model(tmp_path / "other", top=300.0)
    models = models_of(library, preferences, ours)
    assert [model.folder for model in models] == [tmp_path / "new", tmp_path / "old"]
    assert (models[0].name, models[0].errors) == ("new", "RMSE 0.050.")
    assert models_of(library, preferences, fingerprint(top=300.0)) == []


def test_shipped_models_come_last_and_once_but_for_the_one_opened_last(
    library, preferences, tmp_path
):
    scene = library.scene_of(shipped_models()[0])
    same = [f for f in shipped_models() if same_volume(library, f, scene)]
    cards = {folder: load_card(folder) for folder in same}
    same.sort(key=lambda folder: cards[folder].scene.lighting != "direct")
    assert [m.folder for m in models_of(library, preferences, scene.volume_fingerprint)] == same
    copy = tmp_path / "copy"
    shutil.copytree(same[0], copy)
    for folder in (same[-1], copy):
        preferences.note_model(folder, scene.volume_fingerprint)
    models = models_of(library, preferences, scene.volume_fingerprint)
    assert [m.folder for m in models] == [copy, *same]
    # Who closes the window with a shipped one finds that again.
    preferences.note_model(same[-1], scene.volume_fingerprint)
    models = models_of(library, preferences, scene.volume_fingerprint)
    assert [m.folder for m in models] == [same[-1], copy, *same[:-1]]


def same_volume(library, folder, scene):
    other = library.scene_of(folder)
    return other is not None and other.volume_fingerprint == scene.volume_fingerprint


def test_the_volume_of_a_model(library, preferences, tmp_path):
    folder = make_model(tmp_path / "runs" / "model")
    assert library.volume_of(folder) is None
    assert library.volume_of(tmp_path / "gone") is None
    parent = folder.parent / "ramp_4x5x6_float32.raw"
    parent.write_bytes(b"1")
    (folder.parent / "ramp.txt").write_text("")
    (folder.parent / "ramps.nrrd").write_text("")
    assert library.volume_of(folder) == parent
    inside = folder / "ramp.nii.gz"
    inside.write_bytes(b"1")
    assert library.volume_of(folder) == inside
    remembered = tmp_path / "renamed.nrrd"
    preferences.note_opened(fingerprint(), remembered)
    # It is gone: somewhere else then.
    assert library.volume_of(folder) == inside
    remembered.write_bytes(b"1")
    assert library.volume_of(folder) == remembered
