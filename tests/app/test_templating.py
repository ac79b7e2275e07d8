"""Templates: what people wrote cannot become markup, and nothing is left out in silence."""

from pathlib import Path

import pytest
from jinja2 import UndefinedError

from app.templating import templates_in


def test_what_is_put_in_is_escaped(tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("<p>{{ name }}</p>")
    assert templates_in(tmp_path).get_template("page.html").render(name="<b>") == "<p>&lt;b&gt;</p>"


def test_what_is_missing_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("{{ name }}")
    with pytest.raises(UndefinedError, match="name"):
        templates_in(tmp_path).get_template("page.html").render()
