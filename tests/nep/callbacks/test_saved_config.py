"""Runs that share the folder of a logger have a config each."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from lightning.pytorch.loggers import CSVLogger

from nep.callbacks.saved_config import SavedConfig, has_own_folder


class SharedLogger:
    """As those of services: one folder for all runs, each with an id."""

    def __init__(self, save_dir, version):
        self.save_dir, self.name, self.version = str(save_dir), "mine", version


class Parser:
    """Writes what it is given."""

    def save(self, config, path, overwrite, **_):
        assert overwrite or not Path(path).exists()
        Path(path).write_text(config)


def start(logger, config):
    trainer = SimpleNamespace(
        logger=logger,
        log_dir=getattr(logger, "log_dir", logger.save_dir),
        default_root_dir="unused",
        is_global_zero=True,
        strategy=SimpleNamespace(broadcast=lambda value: value),
    )
    SavedConfig(Parser(), config).setup(trainer, None, "fit")
    return has_own_folder(trainer)


def test_two_runs_of_a_shared_folder_have_a_config_each(tmp_path):
    for number in ("a1", "b2"):
        assert not start(SharedLogger(tmp_path, number), number)
    found = {path.relative_to(tmp_path): path.read_text() for path in tmp_path.rglob("*.yaml")}
    assert found == {Path("mine", own, "config.yaml"): own for own in ("a1", "b2")}


def test_a_logger_with_folders_has_it_there_and_never_twice(tmp_path):
    assert start(CSVLogger(tmp_path, "mine", version=0), "first")
    (path,) = tmp_path.rglob("config.yaml")
    assert path.parent == tmp_path / "mine" / "version_0"
    with pytest.raises(RuntimeError, match="to NOT exist"):
        start(CSVLogger(tmp_path, "mine", version=0), "second")
    assert path.read_text() == "first"
