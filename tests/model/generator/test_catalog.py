import json

from model.generator import catalog as shipped
from model.networks.checkpoint import load_model
from model.volume_files import read_volume
from model.volume_files.shipped import DEFAULT_VOLUME, shipped_volumes


def test_every_shipped_model_belongs_to_a_shipped_volume():
    by_fingerprint = {read_volume(path).fingerprint for path in shipped_volumes()}
    assert DEFAULT_VOLUME in shipped_volumes() and shipped.shipped_models()
    for folder in shipped.shipped_models():
        card, _ = load_model(folder)
        assert card.scene.volume_fingerprint in by_fingerprint
        chosen = shipped.model_for(card.scene.volume_fingerprint)
        assert chosen is not None
        assert chosen <= folder
        assert load_model(chosen)[0].scene.volume_fingerprint == card.scene.volume_fingerprint
        volume = shipped.volume_for(folder)
        assert volume is not None
        assert read_volume(volume).fingerprint == card.scene.volume_fingerprint


def test_damaged_models_are_passed_over(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "RESOURCES", tmp_path)
    contents = ("{", "[]", '{"scene": 3}', json.dumps({"scene": {"volume_fingerprint": "abc"}}))
    for name, content in zip("abcd", contents, strict=True):
        folder = tmp_path / "models" / name
        folder.mkdir(parents=True)
        (folder / "model.json").write_text(content)
    assert shipped.model_for("abc") == tmp_path / "models" / "d"
    assert shipped.model_for("xyz") is None
    assert shipped.volume_for(tmp_path / "models" / "a") is None
    assert shipped.volume_for(tmp_path / "models" / "d") is None
