/** The import dialog: a zip is uploaded with progress, then checked and stored by the server. */

import { goToSignIn, problemSentence, UNREACHABLE } from "../shared/api.js";
import { byId, setText } from "../shared/dom.js";
import { fileSize } from "../shared/format.js";
import { messageArea } from "../shared/message.js";

/**
 * `onImported(dataset)` is called after a successful import.
 *
 * @param {(dataset: Rest["DatasetOut"]) => unknown} onImported
 */
export function setUpImport(onImported) {
  const dialog = byId("import");
  const input = byId("import-file");
  const message = messageArea(byId("import-message"));
  let upload = null;

  input.addEventListener("change", showChosen);
  byId("import-form").addEventListener("submit", (event) => {
    event.preventDefault();
    start({});
  });
  dialog.addEventListener("close", () => upload?.abort());
  setUpDrop(byId("drop"), (files) => {
    input.files = files;
    showChosen();
  });

  function showChosen() {
    const [file] = input.files ?? [];
    const name = file ? `${file.name} · ${fileSize(file.size)}` : "Choose a zip file, or drop it here";
    setText(byId("import-name"), name);
    byId("import-start").disabled = !file;
    message.clear();
  }

  /** `fields` go with the file, in the place of what the dataset says. */
  function start(fields) {
    const [file] = input.files ?? [];
    message.clear();
    setBusy(true);
    upload = sendZip(file, fields, showProgress, (outcome) => {
      upload = null;
      setBusy(false);
      if (outcome.dataset) finish(outcome.dataset);
      else if (outcome.problem) message.show(outcome.problem, "problem", suggestion(outcome));
    });
  }

  /** The one click that imports with what the server suggests. */
  function suggestion({ suggested }) {
    if (!suggested?.depth_scale) return null;
    return { label: `Import with depth scale ${suggested.depth_scale}`, run: () => start(suggested) };
  }

  function finish(dataset) {
    input.value = "";
    showChosen();
    dialog.close();
    onImported(dataset);
  }

  function setBusy(busy) {
    byId("import-progress-area").hidden = !busy;
    byId("import-start").disabled = busy;
    input.disabled = busy;
  }

  return { open: () => dialog.showModal() };
}

/** `sent` is the share of the file that the server has, 0 to 1. */
function showProgress(sent) {
  const bar = byId("import-progress");
  if (sent < 1) {
    bar.value = sent;
    setText(byId("import-status"), "Uploading…");
  } else {
    bar.removeAttribute("value");
    setText(byId("import-status"), "Uploaded. Checking and storing…");
  }
}

/** Uploads with XMLHttpRequest, as fetch tells nothing of an upload's progress. */
function sendZip(file, fields, onProgress, onEnd) {
  const body = new FormData();
  body.append("file", file);
  for (const [name, value] of Object.entries(fields)) body.append(name, value);
  const call = new XMLHttpRequest();
  call.upload.addEventListener("progress", (event) => onProgress(event.loaded / event.total));
  call.addEventListener("load", () => onEnd(uploadOutcome(call)));
  call.addEventListener("error", () => onEnd({ problem: UNREACHABLE }));
  call.addEventListener("abort", () => onEnd({}));
  call.open("POST", "/api/datasets");
  call.send(body);
  onProgress(0);
  return call;
}

function uploadOutcome({ status, responseText }) {
  if (status === 401) {
    goToSignIn();
    return {};
  }
  if (status >= 200 && status < 300) return { dataset: JSON.parse(responseText) };
  return { problem: problemSentence(status, responseText), suggested: suggestedFields(responseText) };
}

function suggestedFields(responseText) {
  try {
    return JSON.parse(responseText).suggested;
  } catch {
    return null; // the sentence above says what answered instead
  }
}

function setUpDrop(area, onFiles) {
  for (const kind of ["dragenter", "dragover", "dragleave", "drop"]) {
    area.addEventListener(kind, (event) => {
      event.preventDefault();
      area.classList.toggle("over", kind === "dragenter" || kind === "dragover");
      if (kind === "drop" && event.dataTransfer.files.length) onFiles(event.dataTransfer.files);
    });
  }
}
