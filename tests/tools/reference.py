"""Writes the reference: of `registration_core` from its docstrings, and of REST from its OpenAPI document."""

import argparse
import json
import shutil
import warnings
from pathlib import Path
from typing import Any, cast

import pdoc

import registration_core
from app.main import create_app
from app.pages import SWAGGER
from app.services import Services

REST_PAGE = """<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>REST · Snap6D</title><link rel="stylesheet" href="swagger-ui.css"></head>
<body>
<div id="rest"></div>
<script src="swagger-ui-bundle.js"></script>
<script>
SwaggerUIBundle({
  spec: %s,
  domNode: document.getElementById("rest"),
  supportedSubmitMethods: [], // there is no server behind this page
  validatorUrl: null,
});
</script>
</body>
</html>
"""
FIRST_PAGE = """<!doctype html>
<html lang="en">
<head><meta charset="utf-8"><title>Snap6D %s</title></head>
<body>
<h1>Snap6D %s</h1>
<ul>
<li><a href="core/registration_core.html">registration_core</a>: poses of known objects in depth images</li>
<li><a href="rest/index.html">REST</a>: everything that a page does</li>
</ul>
</body>
</html>
"""


def main() -> None:
    """Write all pages; a warning is an error."""
    parser = argparse.ArgumentParser(description="Write the reference of registration_core and of REST.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("site"), help="is made anew")
    folder: Path = parser.parse_args().folder
    write_reference(folder)
    print(f"The reference begins at {folder / 'index.html'}.")


def write_reference(folder: Path) -> None:
    """Make the folder anew, with a page that leads to both parts.

    Raises:
        Warning: what pdoc warns of.
        ValueError: naming what is part of an interface and has no docstring.
    """
    document: dict[str, Any] = create_app(cast(Services, None)).openapi()  # routes alone need no services
    if silent := [*silent_names(), *silent_operations(document)]:
        raise ValueError(f"these have no docstring: {', '.join(silent)}")
    shutil.rmtree(folder, ignore_errors=True)
    write_core(folder / "core")
    write_rest(folder / "rest", document)
    version = document["info"]["version"]
    (folder / "index.html").write_text(FIRST_PAGE % (version, version), encoding="utf-8")


def write_core(folder: Path) -> None:
    """Pages of all modules of `registration_core`, with a search."""
    pdoc.render.configure(docformat="google")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pdoc.pdoc("registration_core", output_directory=folder)


def write_rest(folder: Path, document: dict[str, Any]) -> None:
    """A page that shows the OpenAPI document, also where no server is."""
    folder.mkdir(parents=True)
    for name in ("swagger-ui.css", "swagger-ui-bundle.js"):
        shutil.copy(SWAGGER / name, folder)
    spec = json.dumps(document).replace("</", "<\\/")  # which would end the script
    (folder / "index.html").write_text(REST_PAGE % spec, encoding="utf-8")
    (folder / "openapi.json").write_text(json.dumps(document, indent=1), encoding="utf-8")


def silent_names() -> list[str]:
    """Names that `registration_core` offers without a docstring; constants cannot have one that is seen."""
    offered = {name: getattr(registration_core, name) for name in registration_core.__all__}
    return [name for name, what in offered.items() if callable(what) and not what.__doc__]


def silent_operations(document: dict[str, Any]) -> list[str]:
    """Operations of REST without a description."""
    return [
        f"{method.upper()} {path}"
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
        if not operation.get("description")
    ]


if __name__ == "__main__":
    main()
