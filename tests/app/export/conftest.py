"""Fixtures: a small dataset, and an export of it."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.app.export.site import ExportedSite, Site, make_site


@pytest.fixture(scope="session")
def made_site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    """A dataset in which nothing is submitted, to be copied."""
    site = make_site(tmp_path_factory.mktemp("site"))
    site.database.close()
    return site


@pytest.fixture
def site(made_site: Site, tmp_path: Path) -> Iterator[Site]:
    """A dataset in which nothing is submitted."""
    site = made_site.copied(tmp_path)
    yield site
    site.database.close()


@pytest.fixture(scope="package")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ExportedSite]:
    """An export to read from, not to change."""
    exported = ExportedSite(tmp_path_factory.mktemp("exported"))
    yield exported
    exported.site.database.close()


@pytest.fixture
def export_copy(exported: ExportedSite, tmp_path: Path) -> Path:
    """A copy of the export, to be damaged."""
    return Path(shutil.copytree(exported.root, tmp_path / "copy"))
