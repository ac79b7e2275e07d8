"""The colours of the style sheet: text can be read on what it stands on, in light and dark."""

import re

import pytest

from app.pages import STATIC

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
]
SHAPES = [
    (shape, ground) for shape in ("line-strong", "machine", "human") for ground in ("surface", "ground")
]


def variables() -> dict[str, dict[str, str]]:
    """Colours by scheme and name; what dark does not say is as in light."""
    sheet = (STATIC / "style.css").read_text()
    blocks = re.findall(r":root\s*{(.*?)}", sheet, re.DOTALL)
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
