/** The import dialog: a zip is uploaded with progress, then checked and stored by the server. */

import { goToSignIn, problemSentence, UNREACHABLE } from "../api.js";
import { byId, setText } from "../dom.js";
import { fileSize } from "../format.js";
import { messageArea } from "../message.js";

/** `onImported(dataset)` is called after a successful import. */
export function setUpImport(onImported) {
  const dialog = byId("import");
  const input = byId("import-file");
  const message = messageArea(byId("import-message"));
  let upload = null;

  input.addEventListener("change", showChosen);
  byId("import-form").addEventListener("submit", start);
  dialog.addEventListener("close", () => upload?.abort());
  setUpDrop(byId("drop"), (files) => {
    input.files = files;
    showChosen();
  });

  function showChosen() {
    const [file] = input.files;
    const name = file ? `${file.name} · ${fileSize(file.size)}` : "Choose a zip file, or drop it here";
    setText(byId("import-name"), name);
    byId("import-start").disabled = !file;
    message.clear();
  }

  function start(event) {
    event.preventDefault();
    message.clear();
    setBusy(true);
    upload = sendZip(input.files[0], showProgress, (outcome) => {
      upload = null;
      setBusy(false);
      if (outcome.dataset) finish(outcome.dataset);
      else if (outcome.problem) message.show(outcome.problem, "problem");
    });
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
function sendZip(file, onProgress, onEnd) {
  const body = new FormData();
  body.append("file", file);
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
  return { problem: problemSentence(status, responseText) };
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
