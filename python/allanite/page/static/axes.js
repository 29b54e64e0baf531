// The axes of the log: a strip of small curves, and a table of their results.
import { $, S, act, busy, el, replaceContent, request, svg } from "./core.js";

const WORDS = { new: "Not yet checked", fitted: "Fitted", fails: "Fails", within: "Within tolerance", adequate: "Adequate" };
const SIGNS = { new: "○", fitted: "◔", fails: "✗", within: "≈", adequate: "✓" };
const DONE = ["within", "adequate"];
// Paths of the small curves, one per axis, by the digest of the log.
let curves = {}, requestedDigests = "";
// True if every axis of the open log is adequate or within the tolerance.
export const allAxesDone = () => S.state.axes.every(a => DONE.includes(a.state));

// Shows the strip of axes, and requests small curves that are missing.
export async function updateStrip() {
  const { recording, axes, elsewhere } = S.state;
  $("strip").hidden = !recording || axes.length + elsewhere.length < 2;
  $("improve-all").hidden = !recording || axes.length < 2;
  if ($("strip").hidden) return;
  drawStrip();
  const want = [recording.digest, ...elsewhere.map(e => e.digest)];
  if (want.every(d => curves[d]) || requestedDigests === want.join()) return;
  requestedDigests = want.join();
  try { curves = await request(`tabs/${S.tab}/part/strip`); if (S.state.recording) drawStrip(); }
  catch { requestedDigests = ""; }
}
// Text of the work on an axis of the open log; null if there is none.
export function jobText(i) {
  const job = busy() ? S.state.job : null;
  return !job || !job.columns.includes(i) ? null : job.column === i ? "Improving …" : "Waiting";
}
// Button of an axis: small curve, name and state.
function axisButton(a, path, more, onclick) {
  const doing = "data-axis" in more ? jobText(more["data-axis"]) : null;
  const told = `${a.name}${a.unit ? ` (${a.unit})` : ""}: ${WORDS[a.state]}${a.model ? `, ${a.model}` : ""}${a.missing ? `; missing: ${a.missing}` : ""}`;
  return el("button", { class: `axis ${a.state}`, "aria-label": `${a.name}: ${WORDS[a.state]}`, title: told, ...more, onclick },
    svg("0 0 100 40", path ? [{ d: path }] : [], { preserveAspectRatio: "none" }),
    el("span", { class: "label" }, a.name), el("span", { class: "state" }, doing ? "…" : SIGNS[a.state], el("span", {}, doing || WORDS[a.state])));
}
// All opened logs, each under its name, in the order of the list. A click on an axis of another log opens that axis.
export function drawStrip() {
  const { recording, axes, elsewhere, log, log_number } = S.state;
  const paths = digest => curves[digest] || [];
  const own = axes.map((a, i) => axisButton(a, paths(recording.digest)[i], { "aria-current": i === recording.column ? "true" : null, "data-axis": i }, () => act({ do: "column", column: i })));
  const others = elsewhere.map(e => [e.log, group(e.name, e.axes.map((a, i) => axisButton(a, paths(e.digest)[i], { "aria-label": `${a.name} of ${e.name}: ${WORDS[a.state]}`, "data-other": `${e.log}-${i}`, "data-work": true }, () => act({ do: "open", log: e.log, column: i }))))]);
  replaceContent($("strip"), ...(others.length ? [[log_number, group(log, own)], ...others].sort((a, b) => a[0] - b[0]).map(g => g[1]) : own));
  S.hooks.updateJob();
  const here = $("strip").querySelector("[aria-current]");
  if (here) $("strip").scrollTo({ left: Math.max(0, here.offsetLeft - $("strip").offsetLeft - 60) });
}
const group = (name, axes) => el("div", { class: "group", role: "group", "aria-label": name }, el("span", { class: "log", title: name }, name), el("div", {}, ...axes));
export function axesTable() {
  const { axes, recording } = S.state;
  const symbols = ["N", "B", "K"];
  const cell = (kind, text) => el(kind, {}, text ?? "–");
  return el("div", {},
    el("table", {}, el("caption", {}, "Axes of ", S.state.log),
      el("thead", {}, el("tr", {}, ...["Axis", "State", "Model", ...symbols, "Allan error (expected)", "Missing effect"].map(t => cell("th", t)))),
      el("tbody", {}, ...axes.map((a, i) => el("tr", { "aria-current": i === recording.column ? "true" : null },
        el("th", { scope: "row" }, el("button", { class: "link", onclick: () => act({ do: "column", column: i }) }, a.name)),
        el("td", { class: a.state }, `${SIGNS[a.state]} ${WORDS[a.state]}`), el("td", { class: "model" }, ...(a.model ?? "–").split(/(?<=\+)/).flatMap(t => [t, el("wbr")])), ...symbols.map(s => cell("td", a.values[s])), cell("td", a.error), cell("td", a.state === "adequate" ? "None" : a.missing))))),
    el("div", { id: "common" }, axes.filter(a => a.state !== "new").length > 1 ? el("button", { onclick: compareAxes }, "Compare the axes") : null),
    !allAxesDone() && !busy() ? el("button", { class: "main", onclick: () => act({ do: "improve", all: true }) }, axes.length > 1 ? "Improve all axes" : "Improve") : null);
}
// Common model, shared noise, and lines found on several axes. Computed on request, because it fits all axes together.
async function compareAxes() {
  $("common").textContent = "Comparing the axes …";
  try {
    const found = await request(`tabs/${S.tab}/part/common`);
    const capital = t => t[0].toUpperCase() + t.slice(1);
    $("common").replaceChildren(...found.sensors.map(s => el("section", {}, el("h3", {}, `${capital(s.name)}: ${s.columns.join(", ")}`), el("ul", {}, ...(s.sentences.length ? s.sentences : ["only one axis"]).map(t => el("li", {}, capital(t)))))),
      found.lines.length ? el("section", {}, el("h3", {}, "Found on several axes"), el("ul", {}, ...found.lines.map(t => el("li", {}, capital(t))))) : "");
  } catch (error) { if ($("common")) $("common").textContent = error.message; }
}
// Opens the next (by = 1) or previous (by = -1) axis.
export const stepAxis = by => {
  const { axes, recording } = S.state;
  if (recording && axes.length > 1) act({ do: "column", column: (recording.column + by + axes.length) % axes.length });
};
