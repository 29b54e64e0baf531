// A second view beside the first one. It shows the whole range of another figure of the same step.
import { $, S, fillSelect, request, theme } from "./core.js";
import { fitSize, paint, shown } from "./draw.js";

const NAMES = { allan: "Allan curve", psd: "Spectrum", map: "Time × band", samples: "Samples", compare: "Compare", error: "Error growth", nis: "NIS", thermal: "Thermal", average: "Average" };
export const second = { name: null, view: null };
let drawn = "";
const otherViews = () => Object.entries(NAMES).filter(([name]) => name !== S.view && !document.querySelector(`[data-tab=${name}]`).hidden);

// The other view takes the place of one that the first figure now shows.
export function avoidSameView(before) {
  if (second.name === S.view) second.name = before in NAMES && before !== S.view ? before : otherViews()[0][0];
}
function setSecondView(name) {
  second.name = name;
  $("two").setAttribute("aria-pressed", Boolean(name));
  S.hooks.redrawAll();
}
export async function drawSecond() {
  const there = Boolean(second.name && S.state.recording && S.state.ladder.length && S.view in NAMES);
  const was = $("figure").classList.contains("two");
  $("second").hidden = !there;
  if ($("figure").classList.toggle("two", there) !== was) fitSize();
  if (!there) { second.view = null; drawn = ""; if ($("plot2").data) Plotly.purge($("plot2")); return; }
  fillSelect($("second-view"), otherViews(), second.name);
  const want = `${S.state.version} ${second.name} ${theme()}`;
  if (want === drawn) return;
  drawn = want;
  try {
    const got = await request(`tabs/${S.tab}/view/${second.name}?theme=${theme()}`);
    if (want !== drawn) return;
    second.view = got;
    $("second-said").textContent = "";
    await paint($("plot2"), got);
    $("plot2").setAttribute("aria-label", [got.title, got.headline, got.subtitle].filter(Boolean).join(": "));
    $("second").dataset.drawn = want;
  } catch (error) {
    if (want !== drawn) return;
    second.view = null;
    if ($("plot2").data) Plotly.purge($("plot2"));
    $("second-said").textContent = error.message;
  }
}
export function listenSecond() {
  $("two").onclick = () => setSecondView(second.name ? null : shown.view?.name === "psd" ? "allan" : "psd");
  $("second-view").onchange = event => setSecondView(event.target.value);
  new ResizeObserver(() => { if (second.view && $("plot2").data) Plotly.Plots.resize($("plot2")); }).observe($("second"));
}
