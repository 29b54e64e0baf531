// The page: shows the state of the server and sends the actions of the user.
import { $, S, act, busy, el, fillSelect, icon, hasUserJob, replaceContent, showMessage, request, theme, unbroken } from "./core.js";
import { updateExportVerdict } from "./accept.js";
import { allAxesDone, drawStrip, stepAxis, updateStrip } from "./axes.js";
import * as Draw from "./draw.js";
import { listenDrag } from "./drag.js";
import { reopenExpired, listenLeaving, offerSavedStudy, openTab, saveStudy } from "./keep.js";
import { updateCards, updateTolerance, updateSteps, updateVerdict } from "./ladder.js";
import { updateChips, listenModel, mainValue, openCatalogue, openModelField } from "./model.js";
import { openReadingForm, hasDoubts, listenReading } from "./reading.js";
import { listenTour } from "./tour.js";
import { updateControls, updateFigure, downloadFile, openView, listenViews, updateProgress, redraw, showRange } from "./views.js";

const KEYS = [["I", "Improve this axis"], ["A", "Improve all axes"], ["E", "Add an effect"], ["M", "Enter a model"], ["[  ]", "Previous axis, next axis"], ["1 … 9", "Views"], ["N", "Values of the figure"], ["V", "Two views"], ["F", "Full screen"],
  ["T", "Light or dark"], ["Ctrl Z, Ctrl Shift Z", "Undo, redo"], ["Esc", "Close, reset the view"], ["?", "Show these keys"]];

// Requests the state of the tab again and again, and shows each change.
async function pollState() {
  for (;;) {
    await new Promise(done => setTimeout(done, busy() ? 150 : document.hidden ? 5000 : 600));
    const answered = S.answered;
    try {
      const next = await request(`tabs/${S.tab}?seen=${S.seen}`);
      // A state requested before the answer to an action may be older than that answer.
      if (answered === S.answered) applyState(next);
    }
    catch (error) {
      if (error instanceof TypeError) { showMessage("The server has stopped. Restart it; your work is kept in this browser.", 3600); return; }
      try { if (await reopenExpired(error.message)) { S.seen = -1; continue; } } catch { /* said below */ }
      showMessage(error.message); return;
    }
  }
}
// Shows a state that the server returned.
function applyState(next) {
  // If nothing has changed, the server only reports its progress.
  const fresh = "version" in next && next.version !== S.seen, before = busy(), moved = S.state && fresh && next.log_number !== S.state.log_number;
  S.state = { ...S.state, ...next };
  if (fresh) {
    S.seen = next.version;
    // The first view of another log is the measured curve.
    if (moved && !S.state.checked) openView("allan");
    updateHeader(); updateAudit(); updateStrip(); updateChips(); updateCards(); updateTolerance(); updateSteps(); updateControls(); updateFigure(); offerSavedStudy(); saveStudy();
    if (next.job && !next.job.busy && next.job.error) showMessage(next.job.error);
    if (hasDoubts() && !S.asked) { S.asked = true; openReadingForm(); }
  }
  if (fresh || before !== busy()) updateVerdict();
  if (fresh && $("files").parentElement.open) updateExportVerdict();
  if (fresh) openInformativeView();
  updateJob();
}
// Opens the most informative view of a checked step, unless the user has chosen another view for this log.
let lastFollowed = "";
function openInformativeView() {
  const { recording, checked, view, model, preview } = S.state, of = recording && `${recording.digest} ${recording.column} ${model}`;
  if (!checked || preview || of === lastFollowed) return;
  lastFollowed = of;
  if (S.chosen !== recording.home && S.view !== view) openView(view);
}
// Columns of the running job when the strip of axes was last drawn.
let lastJobColumns = "";
// Shows the running job, and disables the controls that have to wait for it.
function updateJob() {
  const inHand = busy() ? `${S.state.job.column} ${S.state.job.columns}` : "";
  if (inHand !== lastJobColumns) { lastJobColumns = inHand; if (!$("strip").hidden) drawStrip(); }
  const hands_off = hasUserJob();
  $("work").hidden = !busy();
  document.body.dataset.busy = busy();
  document.body.dataset.adequate = Boolean(S.state.adequate);
  updateProgress();
  // `disabled` would remove the focus.
  for (const button of document.querySelectorAll("[data-work]")) button.setAttribute("aria-disabled", hands_off);
  $("improve").setAttribute("aria-disabled", hands_off || S.state.within || !S.state.cards.some(c => c.significant));
  $("improve-all").setAttribute("aria-disabled", hands_off || allAxesDone());
  $("undo").disabled = !S.state.undo; $("redo").disabled = !S.state.redo;
}
// Shows the log, the export formats and the views that suit the log.
function updateHeader() {
  const { logs, log_number, recording, log, fixed } = S.state;
  fillSelect($("logs"), logs.length ? logs.map((name, i) => [i, name]) : [[0, "No log"]], log_number ?? 0);
  $("logs").disabled = logs.length < 2;
  $("recording").textContent = $("recording").title = recording ? unbroken(recording.text) : "";
  $("reading").disabled = !log || fixed;
  // Offers only the formats that suit the sensor, and keeps the choice of the user.
  const offered = recording ? recording.targets : [];
  fillSelect($("target"), offered, [S.target, "kalibr.yaml", "state-space.json"].find(name => offered.some(t => t[0] === name)));
  for (const [name, there] of [["thermal", S.state.covariates.length], ["average", S.state.others.length]]) {
    document.querySelector(`[data-tab=${name}]`).hidden = !there;
    if (!there && S.view === name) openView("allan");
  }
  document.title = log ? `${log} – allanite` : "allanite";
}
// Shows the findings of the audit, with buttons for remedies.
function updateAudit() {
  const found = S.state.recording ? S.state.recording.audit : [], warnings = found.filter(f => f.severity === "warning");
  const count = (n, word) => n ? `${n} ${word}${n > 1 ? "s" : ""}` : "", offers = f => f.offers.map(o => el("button", { onclick: () => act(o.act) }, o.text));
  $("audit").hidden = !S.state.recording || !S.state.recording.audited;
  $("audit").className = warnings.length ? "warning" : "";
  const title = [count(warnings.length, "warning"), count(found.length - warnings.length, "note")].filter(Boolean).join(", ");
  $("audit-more").replaceChildren(...(found.length ? [el("b", {}, title), el("span", {}, (warnings[0] || found[0]).message)] : [el("b", {}, "✓ Audit"), el("span", {}, "No problem found in the samples: no gaps, no clipping, no outliers")]));
  $("audit-more").disabled = !found.length;
  replaceContent($("offers"), ...warnings.flatMap(offers).slice(0, 2));
  replaceContent($("findings"), ...found.map(f => el("p", { class: f.severity }, el("b", {}, f.severity === "warning" ? "Warning" : "Note"), el("span", {}, f.message), ...offers(f))));
}
// Opens the file dialog; the chosen file is sent as a log, a log to compare, a data sheet or a study.
function chooseFile(role) {
  $("pick").onchange = () => { if ($("pick").files[0]) uploadFile($("pick").files[0], role); $("pick").value = ""; };
  $("pick").click();
}
async function uploadFile(file, role) {
  if (role === "study") {
    let study = null;
    try { study = JSON.parse(await file.text()); } catch { showMessage(`${file.name} is not a study: choose a JSON file saved from this page`); return; }
    act({ do: "study", study });
    return;
  }
  S.asked = false;
  const since = Date.now(), tick = setInterval(() => showMessage(`Sending and reading ${file.name} … ${Math.round((Date.now() - since) / 1000)} s`, 3600), 500);
  showMessage(`Sending and reading ${file.name} …`, 3600);
  try { applyState(await request(`tabs/${S.tab}/upload?name=${encodeURIComponent(file.name)}&as=${role}`, { method: "POST", body: file })); showMessage(""); if (role !== "log") openView("compare"); }
  catch (error) { showMessage(error.message); }
  finally { clearInterval(tick); }
}
// The analysis as a Python script or as a command.
function copyScript(kind) {
  const { log, recording, reading, model } = S.state;
  if (!recording || !model) return;
  const name = recording.columns[recording.column].name, quote = t => `"${String(t).replace(/["\\$`]/g, "\\$&")}"`;
  const rate = reading.said_rate, { span, left_out } = recording, begin = span ? span[0] : 0;
  // A command always reads the whole log, so only a script can describe a part of it.
  if (kind === "command" && (span || left_out.length)) { showMessage("Only a part of the log is analyzed. Copy it as Python, because a command always uses the whole log."); return; }
  const without = left_out.map(([a, b]) => `samples[round(${Math.max(0, a - begin)} * recording.rate):round(${Math.max(0, b - begin)} * recording.rate)] = np.nan`);
  const text = kind === "python"
    ? ["import allanite as al", ...(left_out.length ? ["import numpy as np"] : []), "", `recording = al.read(${JSON.stringify(log)}${rate ? `, rate=${rate}` : ""}, column=${JSON.stringify(name)})`, ...(span ? [`recording = recording.trim(${span[0]}, ${span[1]})`] : []), ...(left_out.length ? ["samples = recording.samples.astype(float)", ...without, "recording = al.Recording(samples, recording.rate, unit=recording.unit, quantity=recording.quantity, columns=recording.columns, covariates=recording.covariates)"] : []), `fit = al.parse_model(${JSON.stringify(model)}).fit(recording)`, "print(fit.check())"].join("\n")
    : `allanite check ${quote(log)} --column ${quote(name)}${rate ? ` --rate ${rate}` : ""} --model ${quote(model)}`;
  navigator.clipboard.writeText(text).then(() => showMessage(`Copied:\n${text}`, 6), () => showMessage(text, 60));
}
function setTheme(name) {
  document.documentElement.dataset.theme = name;
  if (S.state) updateFigure();
}
function handleKey(event) {
  if (event.target.matches("input, select, textarea, dialog[open] *")) return;
  const key = event.key.toLowerCase();
  if ((event.ctrlKey || event.metaKey) && key === "z") { act({ do: event.shiftKey ? "redo" : "undo" }); event.preventDefault(); return; }
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const menu = $("files").parentElement;
  const does = { t: () => $("theme").click(), i: () => $("improve").click(), a: () => !$("improve-all").hidden && $("improve-all").click(), e: openCatalogue, m: () => S.state.chips.length && openModelField(), n: () => $("numbers").click(), f: () => $("full").click(), v: () => $("two").click(),
    "[": () => stepAxis(-1), "]": () => stepAxis(1), "?": () => $("help").showModal(), escape: () => { if (menu.open || !$("message").hidden) { showMessage(""); menu.open = false; } else Draw.resetZoom(); } }[key];
  if (does) { event.preventDefault(); does(); }
  else if (/^[1-9]$/.test(key)) document.querySelectorAll("[role=tab]:not([hidden])")[Number(key) - 1]?.click();
}
// Accepts files that are dropped anywhere on the page.
function listenDrops() {
  let inside = 0;
  const files = event => [...(event.dataTransfer ? event.dataTransfer.types : [])].includes("Files");
  addEventListener("dragenter", event => { if (files(event)) { inside++; $("drop").hidden = false; } });
  addEventListener("dragleave", () => { if (--inside <= 0) { inside = 0; $("drop").hidden = true; } });
  addEventListener("dragover", event => event.preventDefault());
  addEventListener("drop", event => {
    event.preventDefault(); inside = 0; $("drop").hidden = true;
    const file = event.dataTransfer.files[0];
    if (file) uploadFile(file, { json: "study", toml: "sheet" }[file.name.split(".").pop()] || "log");
  });
}
function listen() {
  listenViews(); listenModel(); listenReading(); listenTour(); listenDrops();
  for (const [name, sign] of Object.entries({ undo: "undo", redo: "redo", theme: "theme", full: "full", two: "beside", numbers: "numbers" })) $(name).append(icon(sign));
  $("audit-more").onclick = () => {
    const open = $("findings").hidden;
    $("findings").hidden = !open;
    $("audit-more").setAttribute("aria-expanded", open);
  };
  $("undo").onclick = () => act({ do: "undo" });
  $("redo").onclick = () => act({ do: "redo" });
  $("improve").onclick = () => act({ do: "improve" });
  $("improve-all").onclick = () => act({ do: "improve", all: true });
  $("cancel").onclick = () => act({ do: "cancel" });
  $("message").onclick = () => showMessage("");
  $("logs").onchange = event => { S.asked = false; act({ do: "open", log: Number(event.target.value) }); };
  $("theme").onclick = () => setTheme(theme() === "dark" ? "light" : "dark");
  $("keys").onclick = () => $("help").showModal();
  $("help-keys").replaceChildren(...KEYS.flatMap(([k, t]) => [el("dt", {}, el("kbd", {}, k)), el("dd", {}, t)]));
  $("as-python").onclick = () => copyScript("python");
  $("as-command").onclick = () => copyScript("command");
  $("target").onchange = () => { S.target = $("target").value; updateExportVerdict(); };
  $("files").parentElement.ontoggle = () => { if ($("files").parentElement.open) updateExportVerdict(); };
  $("export").onclick = () => downloadFile($("target").value);
  $("improve-first").onclick = () => act({ do: "improve", all: true });
  for (const button of document.querySelectorAll("[data-pick]")) button.onclick = () => chooseFile(button.dataset.pick);
  for (const button of document.querySelectorAll("[data-file]")) button.onclick = () => downloadFile(button.dataset.file);
  for (const button of document.querySelectorAll("[data-view]")) button.onclick = () => downloadFile(`${S.view}.${button.dataset.view}`);
  document.addEventListener("click", event => {
    if (event.target.closest("[aria-disabled=true]")) { event.stopPropagation(); event.preventDefault(); }
  }, true);
  $("files").addEventListener("click", event => { if (event.target.closest("button")) $("files").parentElement.open = false; });
  document.addEventListener("click", event => { if (!event.target.closest(".menu")) $("files").parentElement.open = false; });
  document.addEventListener("keydown", handleKey);
  listenDrag((place, factor) => {
    const main = mainValue(S.state.chips.find(c => c.place === place));
    if (main) act({ do: "what-if", place: S.state.chips.find(c => c.place === place).place, name: main.name, value: main.number * factor });
  });
}
Object.assign(S.hooks, { applyState, updateJob, openReadingForm, chooseFile, openView, showRange, redrawAll: () => { updateControls(); redraw(); } });
setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
new ResizeObserver(Draw.fitSize).observe($("figure"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", event => setTheme(event.matches ? "dark" : "light"));
listen();
try {
  await openTab();
  applyState(await request(`tabs/${S.tab}`));
  listenLeaving();
  pollState();
} catch (error) { showMessage(error.message, 3600); }
