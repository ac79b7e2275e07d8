"""The style sheets: short, of one set of sizes and colours, whose text can be read in light and dark."""

import re

import pytest

from app.resources import STATIC

TOKENS = STATIC / "style" / "tokens.css"
SHEETS = sorted(STATIC.rglob("*.css"))
LONGEST_SHEET = 300
COLOR = r"#[0-9a-fA-F]{3,8}\b(?=[^{]*;)|\b(?:rgb|hsl)a?\("
SIZE = r"font-size: *[\d.]+\w+|font: *[\d.]+\w+|radius: *[^;]*\d(?:px|rem)"
"""A size of text or of a corner that is no token; shares of what stands around it may be."""

LEAST_FOR_TEXT = 4.5
LEAST_FOR_SHAPES = 3.0
"""Contrasts of WCAG 2.2, level AA."""

TEXT = [
    *((text, ground) for text in ("ink", "muted", "machine", "human") for ground in ("surface", "ground")),
    ("ink", "sunken"),
    ("muted", "sunken"),
    *(("on-fill", f"{who}-fill{hover}") for who in ("machine", "human") for hover in ("", "-hover")),
    ("ink", "problem-soft"),
    ("problem", "problem-soft"),
    *((text, "view-ground") for text in ("view-ink", "view-soft", "view-muted")),
    ("view-ink", "view-sunken"),
    ("view-ground", "view-ink"),
]
SHAPES = [
    (shape, ground) for shape in ("line-strong", "machine", "human") for ground in ("surface", "ground")
]


def variables() -> dict[str, dict[str, str]]:
    """Colours by scheme and name; what dark does not say is as in light."""
    blocks = re.findall(r":root\s*{(.*?)}", TOKENS.read_text(), re.DOTALL)
    light, dark = (dict(re.findall(r"--([\w-]+):\s*(#[0-9a-f]{6});", block)) for block in blocks)
    return {"light": light, "dark": light | dark}


def luminance(color: str) -> float:
    """Relative luminance as WCAG defines it."""
    channels = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    darker, lighter = sorted((luminance(one), luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)


def test_contrast_is_measured_as_wcag_does():
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_and_shapes_can_be_seen(scheme):
    colors = variables()[scheme]
    for pairs, least in ((TEXT, LEAST_FOR_TEXT), (SHAPES, LEAST_FOR_SHAPES)):
        found = {pair: contrast(*(colors[name] for name in pair)) for pair in pairs}
        assert {pair: value for pair, value in found.items() if value < least} == {}


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: str(sheet.relative_to(STATIC)))
def test_a_sheet_is_short_and_names_no_colour_or_size_of_its_own(sheet):
    content = sheet.read_text()
    assert len(content.splitlines()) < LONGEST_SHEET
    if sheet != TOKENS:
        assert re.findall(f"{COLOR}|{SIZE}", content) == []


def test_every_token_is_used_and_every_variable_is_there():
    content = "".join(path.read_text() for path in [*SHEETS, *STATIC.rglob("*.js")])
    said = set(re.findall(r"(--[\w-]+):", content))
    tokens = set(re.findall(r"(--[\w-]+):", TOKENS.read_text()))
    asked = set(re.findall(r"var\((--[\w-]+)", content))
    set_by_scripts = set(re.findall(r"""setProperty\(["'](--[\w-]+)""", content))
    read_by_scripts = set(re.findall(r"""["'](--[\w-]+)["']""", content)) - set_by_scripts
    assert asked <= said | set_by_scripts
    assert tokens <= asked | read_by_scripts
