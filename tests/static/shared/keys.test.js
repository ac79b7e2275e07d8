import assert from "node:assert/strict";
import { test } from "node:test";
import { chord } from "../../../static/shared/keys.js";

const pressed = (key, more = {}) => chord({ key, code: "", ...more });

test("letters are capitals, and Space has a name", () => {
  assert.equal(pressed("z"), "Z");
  assert.equal(pressed(" "), "Space");
  assert.equal(pressed("Enter"), "Enter");
});

test("Ctrl and Cmd are one", () => {
  assert.equal(pressed("z", { ctrlKey: true }), "Mod+Z");
  assert.equal(pressed("Z", { metaKey: true, shiftKey: true }), "Mod+Shift+Z");
});

test("Shift is named only where it does not change the character already", () => {
  assert.equal(pressed("?", { shiftKey: true }), "?");
  assert.equal(pressed("R", { shiftKey: true }), "Shift+R");
  assert.equal(pressed("Enter", { shiftKey: true }), "Shift+Enter");
});

test("with Alt the key's own letter counts, whatever it types", () => {
  assert.equal(pressed("∆", { code: "KeyJ", altKey: true }), "Alt+J");
  assert.equal(pressed("j", { code: "KeyJ", altKey: true }), "Alt+J");
  assert.equal(pressed("z", { code: "KeyY", altKey: true }), "Alt+Z"); // a German keyboard
});
