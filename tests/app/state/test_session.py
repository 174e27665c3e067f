import json
import random
import shutil
from contextlib import suppress
from dataclasses import asdict, fields, replace

import pytest
from fake_models import WEIGHTS, make_model
from kept_values import MEMORY, SETTINGS
from ramp import make_volume

from app.state.latent_session import LatentChoices
from app.state.library import Library
from app.state.preferences import Preferences
from app.state.sensitivity_state import Choices
from app.state.session import Session, SessionContent, SessionError
from app.state.settings import SessionSettings, VolumeMemory, part_of
from model.errors import CheckpointError
from model.generator.catalog import shipped_models
from model.networks.card import MODEL_FILE, load_card
from model.scene.scene import FORMAT_VERSION
from tests.fuzz.mutations import mutated_json

CONTENT = SessionContent(
    replace(MEMORY, path="", models=()),
    part_of(SETTINGS, SessionSettings),
    Choices(False, False, True, False, "change", "exact", 9.0, 0.1, True, True),
    (120.0, 140.0),
    LatentChoices(True, True, "model", (90.0, 120.0)),
    0.3,
    ((0.1, 0.2, 0.3), (1.0, 0.0, 0.5)),
    True,
)
"""None of them the usual value."""


def make_session(folder):
    volume = folder / "data" / "ball.nrrd"
    volume.parent.mkdir(exist_ok=True)
    volume.touch()
    return Session(volume, "0f" * 32, CONTENT, folder / "data")


def test_every_field_comes_back(tmp_path):
    usual = SessionContent()
    for part, kind in ((CONTENT, usual), *((getattr(CONTENT, n), getattr(usual, n))
                       for n in ("memory", "settings", "sensitivity", "latent"))):  # fmt: skip
        same = {f.name for f in fields(part) if getattr(part, f.name) == getattr(kind, f.name)}
        # These are of the machine that it was saved on.
        assert same == ({"path", "models"} if isinstance(part, VolumeMemory) else set())
    session = make_session(tmp_path)
    session.save(tmp_path / "a.tfscope")
    assert Session.load(tmp_path / "a.tfscope") == session


def test_a_volume_that_moved_with_the_session_is_found(tmp_path):
    before, after = tmp_path / "before", tmp_path / "after"
    before.mkdir()
    make_session(before).save(before / "a.tfscope")
    before.rename(after)
    found = Session.load(after / "a.tfscope")
    assert found.volume == after / "data" / "ball.nrrd" and found.model == after / "data"
    # Beside the session, too; else it stays where it was.
    (after / "data" / "ball.nrrd").rename(after / "ball.nrrd")
    assert Session.load(after / "a.tfscope").volume == after / "ball.nrrd"
    data = json.loads((after / "a.tfscope").read_text())
    data["volume"] = {"path": r"C:\data\ball.nrrd", "beside": "", "fingerprint": "0f"}
    (after / "b.tfscope").write_text(json.dumps(data))
    assert Session.load(after / "b.tfscope").volume == after / "ball.nrrd"
    (after / "ball.nrrd").unlink()
    assert Session.load(after / "a.tfscope").volume == before / "data" / "ball.nrrd"


@pytest.mark.parametrize(("change", "words"), [
    ({"tfscope_session": 3}, "newer tfscope"),
    ({"tfscope_session": "1"}, "is not a tfscope session"),
    ({"volume": "ball.nrrd"}, "Expected object"), ({"volume": {"path": 3}}, "'path'"),
    ({"model": []}, "Expected object"),
])  # fmt: skip
def test_what_is_no_session_is_refused(tmp_path, change, words):
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(SessionError, match=words) as caught:
        Session.load(path)
    assert str(path) in str(caught.value) and "nothing was changed" in str(caught.value)


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        ("memory", "tf", {}), ("memory", "view", {"distance": -1}),
        ("memory", "crop", {"low": [0, 0, 0], "high": [1, 1, 7]}),
        ("memory", "clip", {"normal": [0, 0, 0], "offset": 0.5}), ("settings", "cube", 1),
        ("sensitivity", "width", 1e9), ("", "memory", []), ("", "band", [3.0]),
        ("latent", "shown", "yes"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_and_costs_no_more(tmp_path, part, name, value):
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    data = json.loads(path.read_text())
    (data[part] if part else data)[name] = value
    path.write_text(json.dumps(data))
    found = Session.load(path)
    assert found.wrong == (name,)
    usual, expected = asdict(SessionContent()), asdict(CONTENT)
    (expected[part] if part else expected)[name] = (usual[part] if part else usual)[name]
    assert asdict(found.content) == expected


def test_other_files_are_no_sessions(tmp_path):
    path = tmp_path / "a.tfscope"
    with pytest.raises(SessionError, match="cannot be read"):
        Session.load(path)
    for content in (b"", b"[]", b"NRRD0004", b"\xff\xfe", b"{" * 9999, b'{"a": 1}'):
        path.write_bytes(content)
        with pytest.raises(SessionError, match="nothing was changed"):
            Session.load(path)
    with pytest.raises(SessionError, match="another place"):
        make_session(tmp_path).save(path / "b.tfscope")


def test_damaged_files_are_opened_or_refused(tmp_path):
    path = tmp_path / "a.tfscope"
    make_session(tmp_path).save(path)
    whole, rng = path.read_bytes(), random.Random(0)
    for _ in range(300):
        path.write_bytes(mutated_json(whole, rng))
        with suppress(SessionError):
            Session.load(path)


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


def test_what_is_damaged_missing_or_no_model_is_said(library, tmp_path):
    folder = make_model(tmp_path / "model")
    assert library.check_model(folder).volume_fingerprint == fingerprint()
    for number, part in enumerate(WRONG_PARTS):
        wrong = make_model(tmp_path / str(number), **part)
        assert_said(library, wrong, str(wrong))
    for content in BROKEN_CARDS:
        text = content if isinstance(content, str) else json.dumps(content)
        (folder / MODEL_FILE).write_text(text)
        assert_said(library, folder, MODEL_FILE)
    folder = make_model(tmp_path / "runs" / "mine")
    weights = folder / "generator-1.safetensors"
    for content in (WEIGHTS[:-1], b"", b"x" + WEIGHTS[1:]):
        weights.write_bytes(content)
        assert_said(library, folder, weights.name, "truncated or altered")
    assert_said(library, folder / MODEL_FILE, "a file")
    assert_said(library, folder.parent, "'mine'")
    weights.unlink()
    assert_said(library, folder, weights.name, "missing")
    # Its volume is known all the same.
    assert library.scene_of(folder).volume_name == "ramp"
    (folder / MODEL_FILE).unlink()
    assert_said(library, folder, MODEL_FILE, "missing")
    assert_said(library, tmp_path / "gone", "no such folder")


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
    cards = {folder: load_card(folder) for folder in shipped_models()}
    same = [f for f in cards if cards[f].scene.volume_fingerprint == scene.volume_fingerprint]
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
