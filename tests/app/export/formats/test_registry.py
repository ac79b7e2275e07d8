"""The formats of exports are the files of their folder."""

from pathlib import Path

from app.export.formats import registry
from app.export.formats.registry import formats


def test_every_file_of_the_folder_is_a_format():
    files = {path.stem for path in Path(registry.__file__).parent.glob("*.py")} - {"__init__", "registry"}
    assert set(formats()) == files
    assert next(iter(formats())) == "bop", "the whole dataset is what people mostly want"


def test_each_makes_the_folder_it_is_asked_for(tmp_path):
    for one in formats().values():
        checked, target = tmp_path / f"checked {one.name}", tmp_path / one.name
        checked.mkdir()
        one.write(checked, target)
        assert target.is_dir() and one.title
