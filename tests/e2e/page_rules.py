"""What holds of every page."""

import re

BROKEN_WORDS = """() => {
  const broken = [];
  for (const cell of document.querySelectorAll("td, th")) {
    const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
      for (const word of texts.currentNode.data.matchAll(/\\S+/g)) {
        const range = document.createRange();
        range.setStart(texts.currentNode, word.index);
        range.setEnd(texts.currentNode, word.index + word[0].length);
        const lines = new Set([...range.getClientRects()].map(({ top }) => top));
        if (lines.size > 1 && word[0].length <= 12) broken.push(word[0]);
      }
    }
  }
  return broken;
}"""
"""Of tables: those that go on in a second line, but for names too long for a column."""


NAMELESS = re.compile(
    r"^\s*- (button|link|textbox|searchbox|slider|meter|progressbar|combobox|checkbox)(:|$| \[)"
)
