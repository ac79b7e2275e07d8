/** Home: the next task, the datasets and the tasks, with import and "add tasks" for administrators. */

import { byId } from "../shared/dom.js";
import { count, percent } from "../shared/format.js";
import { messageArea } from "../shared/message.js";
import { openPage } from "../shared/page.js";
import { setUpAddTasks } from "./add-tasks.js";
import { showDatasets } from "./datasets.js";
import { setUpImport } from "./import.js";
import { showNextTask } from "./next-task.js";
import { keptPlace } from "./place.js";
import { setUpRisk } from "./risk.js";
import { setUpTasks } from "./tasks.js";
import { setUpWarnings } from "./warnings.js";

const message = messageArea(byId("message"));

const place = keptPlace();
const shownTasks = await openPage(message, showHome);
if (place) await shownTasks?.goBackTo(place).catch(message.problem);

async function showHome(me) {
  const isAdmin = me.role === "admin";
  for (const node of document.querySelectorAll(".admin-only")) node.hidden = !isAdmin;

  const openAddTasks = () => addTasks.open(tasks.filter);
  const tasks = setUpTasks({ me, openAddTasks: isAdmin ? openAddTasks : null, onProblem: message.problem });
  const importDialog = setUpImport((dataset) => {
    message.show(importedSentence(dataset), "good");
    return showAll(dataset.id);
  });
  const addTasks = setUpAddTasks((added) => {
    message.show(`${count(added, "task")} added.`, "good");
    return showAll(tasks.filter.dataset_id);
  });
  const riskDialog = setUpRisk(({ name, risk }) => {
    message.show(`Risk of ${name}: ${percent(risk)}. Snaps go by it from now on.`, "good");
    return showAll(tasks.filter.dataset_id);
  });
  const warningsDialog = setUpWarnings(({ name }) => {
    message.show(`What looked odd in ${name} is accepted.`, "good");
    return showAll(tasks.filter.dataset_id);
  });
  byId("open-import").addEventListener("click", importDialog.open);
  byId("open-add-tasks").addEventListener("click", openAddTasks);

  async function showAll(datasetId) {
    const chooseDataset = (id) =>
      Promise.all([showNextTask(datasets, id), tasks.chooseDataset(id)]).catch(message.problem);
    const openImport = isAdmin ? importDialog.open : null;
    const openRisk = me.role === "operator" ? null : riskDialog.open;
    const openWarnings = me.role === "operator" ? null : warningsDialog.open;
    const datasets = await showDatasets({
      selected: datasetId,
      choose: chooseDataset,
      openImport,
      openRisk,
      openWarnings,
    });
    tasks.setDatasets(datasets);
    byId("open-add-tasks").hidden = !isAdmin || datasets.length === 0;
    await Promise.all([showNextTask(datasets, datasetId), tasks.chooseDataset(datasetId)]);
  }

  await showAll(tasks.filter.dataset_id);
  return tasks;
}

function importedSentence({ name, scenes, objects, tasks, warnings }) {
  const next = tasks > 0 ? "" : " It has no ground truth to make tasks from: add tasks yourself.";
  const numbers = [count(scenes, "scene"), count(objects, "object"), count(tasks, "task")];
  const odd = warnings.length > 0 ? " Some things looked odd: look at them beside the dataset." : "";
  return `Imported ${name}: ${numbers.join(", ")}.${next}${odd}`;
}
