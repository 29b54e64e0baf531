// The views: selection, controls, values, and files.
import { $, S, act, busy, capitalized, el, fillSelect, replaceContent, showMessage, request, theme, unbroken } from "./core.js";
import { acceptancePanel } from "./accept.js";
import { axesTable } from "./axes.js";
import { removeCursors, moveCursor } from "./cursor.js";
import * as Draw from "./draw.js";
import { drawSecond, listenSecond, avoidSameView } from "./second.js";
import { startTour } from "./tour.js";

let drawn = "";
// Views that are tables instead of figures.
const TABLES = { axes: axesTable, accept: acceptancePanel };
export const query = () => new URLSearchParams({ theme: theme(), ...S.options }).toString();

let drawing = null;
// Draws the current view, then the second one.
export function updateFigure() {
  const mine = Promise.all([drawing, drawView().then(drawSecond)]).finally(() => { if (drawing === mine) drawing = null; });
  drawing = mine;
}
// Requests and draws the current view, unless it is already shown.
async function drawView() {
  const state = S.state, want = `${state.version} ${S.view} ${query()}`;
  if (want === drawn) return;
  removeCursors();
  if (!S.view.startsWith(Draw.shown.view?.name || " ")) headline("");
  $("numbers").hidden = S.view in TABLES;
  if (S.view in TABLES) { drawn = want; Draw.clearFigure(); updateLegend(); $("empty").textContent = ""; replaceContent($("table"), state.recording ? TABLES[S.view]() : ""); $("table").hidden = false; document.body.dataset.drawn = want; return; }
  $("table").hidden = $("numbers").getAttribute("aria-pressed") !== "true";
  // The measured curve and the samples are available before the first fit.
  if (!state.recording || (!state.ladder.length && !["allan", "samples"].includes(S.view))) {
    Draw.clearFigure(); drawn = ""; $("key").replaceChildren(); $("readout").replaceChildren();
    if (state.log) showWaiting();
    else showWelcome();
    return;
  }
  const anew = !drawn;
  drawn = want;
  // The canvas is never empty: a quick view replaces the shown one, and any other view is announced.
  const slow = ["nis", "error", "compare", "thermal", "average"].includes(S.view);
  if (S.view !== Draw.shown.view?.name) $("empty").textContent = slow || !Draw.shown.view ? "Computing …" : "";
  try {
    const got = await request(`tabs/${S.tab}/view/${S.view}?${query()}`);
    if (want !== drawn) return;
    $("empty").textContent = "";
    headline(got.headline);
    updateLegend(got);
    // Many changes of the state, such as a finished audit, leave the figure as it is.
    if (anew || JSON.stringify(got) !== JSON.stringify(Draw.shown.view)) await Draw.show(got);
    $("plot").setAttribute("aria-label", [got.title, got.headline, got.subtitle].filter(Boolean).join(": "));
    if (!$("table").hidden) updateNumbers();
    document.body.dataset.drawn = want;
  } catch (error) {
    if (want !== drawn) return;
    Draw.clearFigure(); $("empty").textContent = error.message;
  }
}
// Until there is a figure: the log, the finished stages, and the progress of the current one, which `updateProgress` fills in.
function showWaiting() {
  const { log, problem, recording } = S.state;
  replaceContent($("empty"), problem ? "" : el("div", { class: "waiting" }, el("h2", {}, log),
    recording ? el("p", {}, `✓ Read: ${recording.text}`) : null, el("p", { id: "stage" }), el("progress", { id: "stage-bar", "aria-label": "Progress" })));
  updateProgress();
}
// Name, count, time and progress bar of the job, in the side panel and instead of a figure.
export function updateProgress() {
  const job = busy() ? S.state.job : null, count = job?.total > 1 ? ` ${job.done} of ${job.total}` : "";
  const text = job ? `${job.name} …${count} · ${job.seconds.toFixed(job.seconds < 10 ? 1 : 0)} s` : "Nothing is fitted yet";
  for (const node of [$("work-name"), $("stage")]) if (node) node.textContent = node.title = unbroken(text);
  for (const bar of [$("bar"), $("stage-bar")]) if (bar) { bar.hidden = !job; if (job?.total) { bar.max = job.total; bar.value = job.done; } else bar.removeAttribute("value"); }
}
function showWelcome() {
  replaceContent($("empty"), el("div", { class: "welcome" }, el("h2", {}, "Which noise does your sensor have?"),
    el("p", {}, "Drop a log of a sensor at rest here: CSV, NPZ, NPY, MATLAB, ROS bag, ULog, HDF5, Parquet."),
    el("div", {}, el("button", { class: "main", onclick: () => S.hooks.chooseFile("log") }, "Open a log …"), el("button", { onclick: () => act({ do: "example" }) }, "Try an example"), el("button", { onclick: event => startTour(event.currentTarget) }, "Take a one-minute tour")),
    el("ol", {}, ...["The Allan deviation is computed and a first model is fitted.", "Failing regions are shaded; missing effects are listed on the right, with their evidence.", "Add one effect, or let all missing effects be added. Every step is kept.", "Export the parameters of all axes for your filter."].map(t => el("li", {}, t)))));
}
// The main result of the figure, as a sentence.
function headline(text) {
  $("headline").hidden = !text;
  $("headline").textContent = text ? unbroken(`${capitalized(text)}.`) : "";
}
// Shows the legend and the text below the figure.
function updateLegend(got) {
  const state = S.state, item = (style, text, kind = "", title = null) => el("span", { title }, el("i", { class: kind, style }), text);
  const allan = [item("", "Measured ± 95 %", "dot"), item("border-color:var(--c-model)", state.preview ? "Trial" : "Model"),
    item("background:var(--c-model)", "Expected scatter (95 %)", "box", "Where the measured curve lies if the model is true: dark for each τ separately, pale for all τ together")];
  const other = got && got.kind === "deviation", psd = [];
  if (state.chips.some(c => c.values.some(v => v.role === "coefficient" && !v.detected))) allan.push(item("border-top-style:dashed", "Not detected: 95 % limit"));
  if (got && got.fails) allan.push(item("background:var(--fail);opacity:.6", "Fails", "box"));
  if (got && got.singles) psd.push(item("border-color:var(--raw)", "Single frequencies"));
  const samples = [item("border-color:var(--c1)", "Mean"), item("background:var(--c1)", "Minimum–maximum", "box"), ...(got && got.drift ? [item("border-color:var(--c-model)", capitalized(got.drift))] : [])];
  $("key").replaceChildren(...(other ? [] : { allan, psd: [...allan, ...psd], samples }[S.view] || []));
  $("readout").textContent = other ? (state.ladder.length ? "The model is always fitted to the spectrum, whatever deviation is shown" : "") : got && !["allan", "psd"].includes(S.view) ? unbroken(capitalized(got.subtitle)) : S.view === "allan" || S.view === "psd" ? "Drag a thin line to try a value" : "";
}
// Opens a view at a range of its axis, in s, Hz, or s of the record.
export async function showRange(name, place) {
  if (S.view !== name) openView(name);
  // In the spectrum, request all single frequencies around the range.
  if (name === "psd" && place) { const [from, to] = Draw.rangeWithMargin(place).map(String); S.options = { from, to }; redraw(); }
  await settled();
  if (place && Draw.shown.view?.name === name) Draw.zoomTo(place);
}
const settled = async () => { while (drawing) await drawing; };
export function redraw() { drawn = ""; updateFigure(); }
// Opens a view by name; its options are reset.
export function openView(name) {
  if (name !== S.view || (name === "psd" && S.options.from)) S.options = {};
  const before = S.view;
  S.view = name;
  avoidSameView(before);
  for (const button of document.querySelectorAll("[role=tab]")) {
    const on = button.dataset.tab === name;
    button.setAttribute("aria-selected", on); button.tabIndex = on ? 0 : -1;
    if (on) button.parentElement.scrollTo({ left: button.offsetLeft - button.parentElement.offsetLeft - 40 });
  }
  updateControls(); updateFigure();
}

// -- controls of a view
export function updateControls() {
  const there = Boolean(S.state.recording), of = { allan: allanControls, compare: compareControls, samples: samplesControls, error: errorControls, thermal: thermalControls }[S.view];
  const parts = there && of ? of() : [];
  $("beside").hidden = !parts.length;
  replaceContent($("beside"), ...parts);
  updateSheet();
}
// Other deviations and averaging times for the measured curve; the fit does not change.
const GRIDS = [["", "As fitted"], ["octave", "1, 2, 4, 8 …"], ["decade", "1, 2, 4, 10 …"], ["fine", "20 per decade"]];
function allanControls() {
  const choice = (name, label, items) => {
    const node = el("select", { "data-option": name, "aria-label": label, onchange: event => { const v = event.target.value; if (v) S.options[name] = v; else delete S.options[name]; redraw(); } });
    fillSelect(node, items, S.options[name] || "");
    return el("label", {}, label, node);
  };
  const [[, first], ...others] = S.state.recording.deviations;
  return [choice("kind", "Deviation", [["", first], ...others]), choice("grid", "Averaging times", GRIDS)];
}
function compareControls() {
  const state = S.state;
  if (state.beside) {
    const end = () => act({ do: "beside", rung: null });
    return [el("span", {}, "Two models:"), el("span", { class: "beside" }, state.beside.heads[0]),
      el("span", { class: "beside" }, state.beside.heads[1], el("button", { class: "icon", "aria-label": `Stop comparing with ${state.beside.heads[1].toLowerCase()}`, onclick: end }, "×"))];
  }
  const logs = state.logs.map((name, i) => ({ name, i })).filter(({ name, i }) => i !== state.log_number && !state.others.some(o => o.startsWith(`${name} `)));
  const gone = (name, order) => el("span", { class: "beside" }, name, el("button", { class: "icon", "aria-label": `Stop comparing with ${name}`, onclick: () => act({ do: "alone", ...order }) }, "×"));
  return [el("span", {}, "Compared with:"), ...state.others.map(name => gone(name, { name })), state.sheet ? gone(state.sheet.name, {}) : null,
    ...logs.map(({ name, i }) => el("button", { onclick: () => act({ do: "compare", log: i }) }, `+ ${name}`)),
    el("button", { onclick: () => S.hooks.chooseFile("compare") }, "+ A log …"), el("button", { onclick: () => S.hooks.chooseFile("sheet") }, "+ A data sheet …")];
}
function samplesControls() {
  const out = [], { span, duration, left_out } = S.state.recording;
  if (S.options.from !== undefined) {
    const from = Number(S.options.from), to = Number(S.options.to);
    const text = `${Number(Math.max(0, from).toPrecision(6))}–${Number(Math.min(duration, to).toPrecision(6))} s`;
    out.push(el("span", {}, text), el("button", { class: "main", onclick: () => act({ do: "take", from, to }).then(done => { if (done) { S.options = {}; redraw(); } }) }, "Analyze only this"),
      el("button", { onclick: () => act({ do: "leave-out", from, to }).then(done => { if (done) { S.options = {}; redraw(); } }) }, "Exclude this"),
      el("button", { onclick: () => { S.options = {}; updateControls(); redraw(); } }, "Show all"));
  } else out.push(el("span", {}, left_out.length ? "Excluded:" : "Drag over the samples to zoom in. You can then analyze only this segment or exclude it. Double-click to show all."));
  const begin = span ? span[0] : 0, seconds = t => Number((t - begin).toPrecision(6));
  if (S.options.from === undefined) left_out.forEach(([a, b], i) => {
    const text = `${seconds(a)}–${seconds(b)} s`;
    out.push(el("span", { class: "beside" }, text, el("button", { class: "icon", "aria-label": `Include ${text} again`, onclick: () => act({ do: "put-back", number: i }) }, "×")));
  });
  if (span || left_out.length) out.push(el("button", { onclick: () => act({ do: "take" }) }, "Use the whole record"));
  return out;
}
function errorControls() {
  const field = (name, text) => el("label", {}, text, el("input", { inputmode: "decimal", size: 7, value: S.options[name] || "", placeholder: "auto", onchange: event => { const v = event.target.value.trim(); if (v) S.options[name] = v; else delete S.options[name]; redraw(); } }), "s");
  return [field("aided", "Aided for"), field("until", "Then without a fix for")];
}
const LAWS = { params: "PX4", parm: "ArduPilot", h: "C header", csv: "CSV", json: "JSON" };
function thermalControls() {
  return [el("span", {}, "Save the law of all axes for:"), ...Object.entries(LAWS).map(([suffix, text]) => el("button", { onclick: () => downloadFile(`temperature-law.${suffix}`) }, text))];
}
// Below the compared curves: differences between two models, or the comparison with a data sheet.
function updateSheet() {
  const { beside, sheet: found, recording } = S.state;
  $("sheet").hidden = S.view !== "compare" || !recording || !(beside || found);
  if ($("sheet").hidden) return;
  $("sheet").className = beside ? "two" : "";
  $("sheet").replaceChildren(...(beside ? twoModelsTable(beside) : [
    el("table", {}, el("caption", {}, `Model compared with data sheet ${found.name}`),
      el("tr", {}, ...["Figure", "Data sheet", "Measured", "Measured / sheet (95 %)", "Remark"].map(t => el("th", {}, t))),
      ...found.rows.map(r => el("tr", {}, el("th", {}, r.figure), el("td", {}, r.sheet), el("td", {}, r.measured), el("td", {}, r.ratio), el("td", { class: "remark" }, r.remark)))),
    ...found.remarks.map(r => el("p", {}, capitalized(r)))]));
}
function twoModelsTable({ heads, models, rows }) {
  return [el("table", {}, el("caption", {}, "Differences"),
    el("tr", {}, el("th", {}, ""), ...heads.map((h, i) => el("th", {}, `${h}: ${models[i]}`)), el("th", {}, "Difference")),
    ...rows.map(r => el("tr", { class: r.differs ? "differs" : "same" }, el("th", { scope: "row" }, r.what), ...r.texts.map(t => el("td", {}, t)), el("td", {}, r.remark || (r.differs ? "" : "Same")))))];
}

// -- numbers and files
// Shows the values of the figure as tables.
async function updateNumbers() {
  try {
    const tables = await request(`tabs/${S.tab}/part/table-${S.view}?${query()}`);
    // The clipboard gets more digits than the page shows; the first column needs them to tell its rows apart.
    const text = (v, digits = 6) => v === null ? "" : typeof v === "number" ? String(Number(v.toPrecision(digits))) : v;
    const cell = (v, i) => el("td", { class: typeof v === "number" ? "value" : null }, String(text(v, i ? 4 : 6)).replace("-", "−"));
    const copy = t => navigator.clipboard.writeText([t.head, ...t.rows].map(r => r.map(v => text(v)).join("\t")).join("\n")).then(() => showMessage("The values were copied to the clipboard", 3));
    $("table").replaceChildren(...tables.map(t => el("table", {}, el("caption", {}, capitalized(t.title), el("button", { onclick: () => copy(t) }, "Copy")),
      el("thead", {}, el("tr", {}, ...t.head.map(h => el("th", {}, capitalized(h).replace("95 %", "95\u00a0%"))))), el("tbody", {}, ...t.rows.slice(0, 600).map(r => el("tr", {}, ...r.map(cell)))))));
  } catch (error) { $("table").textContent = error.message; }
}
// Downloads a generated file, and shows the server's note on it.
export async function downloadFile(name) {
  const slow = setTimeout(() => showMessage(`Making ${name} …`, 3600), 600);
  try {
    const answer = await fetch(`tabs/${S.tab}/file/${name}?${query()}`);
    if (!answer.ok) throw new Error((await answer.json()).error);
    const called = decodeURIComponent((answer.headers.get("content-disposition") || "").split("''")[1] || name);
    const note = decodeURIComponent(answer.headers.get("x-note") || "");
    const anchor = el("a", { href: URL.createObjectURL(await answer.blob()), download: called });
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
    showMessage(note ? `${called}: ${note}` : "");
  } catch (error) { showMessage(error.message); } finally { clearTimeout(slow); }
}
export function listenViews() {
  for (const button of document.querySelectorAll("[role=tab]")) {
    // Until the user chooses a view, the page opens the most informative one.
    button.onclick = () => { S.chosen = S.state.recording?.home; openView(button.dataset.tab); };
    button.onkeydown = event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const all = [...document.querySelectorAll("[role=tab]:not([hidden])")], next = all[(all.indexOf(button) + step + all.length) % all.length];
      next.focus(); next.click();
    };
  }
  $("numbers").onclick = () => {
    const on = $("numbers").getAttribute("aria-pressed") !== "true";
    $("numbers").setAttribute("aria-pressed", on);
    $("table").hidden = !on;
    if (on && S.state.recording) { $("table").textContent = "…"; updateNumbers(); }
  };
  $("full").onclick = () => document.fullscreenElement ? document.exitFullscreen() : $("left").requestFullscreen();
  listenSecond();
  for (const plot of [$("plot"), $("plot2")]) {
    plot.addEventListener("pointermove", moveCursor);
    plot.addEventListener("pointerleave", removeCursors);
  }
}
