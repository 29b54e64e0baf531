// The axes of the log: a strip of small curves, and a table of what each is.
import { $, S, act, busy, el, refill, speak, svg } from "./core.js";

const WORDS = { new: "Not looked at", fitted: "Fitted", fails: "Fails", adequate: "Adequate" };
const SIGNS = { new: "○", fitted: "◔", fails: "✗", adequate: "✓" };
let curves = { digest: null, paths: [] };

export async function strip() {
  const { recording, axes } = S.state;
  $("strip").hidden = !recording || axes.length < 2;
  $("improve-all").hidden = $("strip").hidden;
  if ($("strip").hidden) return;
  draw();
  if (curves.digest === recording.digest) return;
  curves = { digest: recording.digest, paths: [] };
  try {
    const found = await speak(`tabs/${S.tab}/part/strip`);
    if (S.state.recording && found.digest === S.state.recording.digest) { curves = found; draw(); }
  } catch { curves.digest = null; }
}
function draw() {
  const { recording, axes } = S.state;
  refill($("strip"), ...axes.map((a, i) => el("button", { class: `axis ${a.state}`, "aria-current": i === recording.column ? "true" : null, "data-axis": i,
    "aria-label": `${a.name}: ${WORDS[a.state]}`, title: `${a.name} (${a.unit}): ${WORDS[a.state]}${a.model ? `, ${a.model}` : ""}${a.missing ? `; missing: ${a.missing}` : ""}`, onclick: () => act({ do: "column", column: i }) },
    svg("0 0 100 40", curves.paths[i] ? [{ d: curves.paths[i] }] : [], { preserveAspectRatio: "none" }),
    el("span", { class: "label" }, a.name), el("span", { class: "state" }, SIGNS[a.state], el("span", {}, WORDS[a.state])))));
  const here = $("strip").querySelector("[aria-current]");
  if (here) $("strip").scrollTo({ left: Math.max(0, here.offsetLeft - $("strip").offsetLeft - 60) });
}
export function axesTable() {
  const { axes, recording } = S.state;
  const symbols = ["N", "B", "K"];
  const cell = (kind, text) => el(kind, {}, text ?? "–");
  return el("div", {},
    el("table", {}, el("caption", {}, "Axes of ", S.state.log),
      el("thead", {}, el("tr", {}, ...["Axis", "State", "Model", ...symbols, "Error, rms", "Missing"].map(t => cell("th", t)))),
      el("tbody", {}, ...axes.map((a, i) => el("tr", { "aria-current": i === recording.column ? "true" : null },
        el("th", { scope: "row" }, el("button", { class: "link", onclick: () => act({ do: "column", column: i }) }, a.name)),
        el("td", { class: a.state }, `${SIGNS[a.state]} ${WORDS[a.state]}`), cell("td", a.model), ...symbols.map(s => cell("td", a.values[s])), cell("td", a.error), cell("td", a.state === "adequate" ? "nothing" : a.missing))))),
    el("div", { id: "common" }, axes.filter(a => a.state !== "new").length > 1 ? el("button", { onclick: common }, "Compare the axes") : null),
    axes.some(a => a.state !== "adequate") && !busy() ? el("button", { class: "main", onclick: () => act({ do: "improve", all: true }) }, axes.length > 1 ? "Improve all axes" : "Improve") : null);
}
// Agreement, shared noise, lines that several axes see: by request, for it fits them together.
async function common() {
  $("common").textContent = "Comparing the axes …";
  try {
    const found = await speak(`tabs/${S.tab}/part/common`);
    const capital = t => t[0].toUpperCase() + t.slice(1);
    $("common").replaceChildren(...found.sensors.map(s => el("section", {}, el("h3", {}, `${capital(s.name)}: ${s.columns.join(", ")}`), el("ul", {}, ...(s.sentences.length ? s.sentences : ["one axis alone"]).map(t => el("li", {}, capital(t)))))),
      found.lines.length ? el("section", {}, el("h3", {}, "Lines of several axes"), el("ul", {}, ...found.lines.map(t => el("li", {}, capital(t))))) : "");
  } catch (error) { if ($("common")) $("common").textContent = error.message; }
}
export const step = by => {
  const { axes, recording } = S.state;
  if (recording && axes.length > 1) act({ do: "column", column: (recording.column + by + axes.length) % axes.length });
};
