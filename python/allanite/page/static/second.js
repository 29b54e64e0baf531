// A second view beside the first one. It shows the whole range of another figure of the same step.
import { $, S, fill, speak, theme } from "./core.js";
import { fit, paint, shown } from "./draw.js";

const NAMES = { allan: "Allan curve", psd: "Spectrum", map: "Time × band", samples: "Samples", compare: "Compare", error: "Error growth", nis: "NIS", thermal: "Thermal", average: "Average" };
export const second = { name: null, view: null };
let drawn = "";
const others = () => Object.entries(NAMES).filter(([name]) => name !== S.view && !document.querySelector(`[data-tab=${name}]`).hidden);

// The other view takes the place of one that the first figure now shows.
export function trade(before) {
  if (second.name === S.view) second.name = before in NAMES && before !== S.view ? before : others()[0][0];
}
function open(name) {
  second.name = name;
  $("two").setAttribute("aria-pressed", Boolean(name));
  S.hooks.redraw();
}
export async function drawSecond() {
  const there = Boolean(second.name && S.state.recording && S.state.ladder.length && S.view in NAMES);
  const was = $("figure").classList.contains("two");
  $("second").hidden = !there;
  if ($("figure").classList.toggle("two", there) !== was) fit();
  if (!there) { second.view = null; drawn = ""; if ($("plot2").data) Plotly.purge($("plot2")); return; }
  fill($("second-view"), others(), second.name);
  const want = `${S.state.version} ${second.name} ${theme()}`;
  if (want === drawn) return;
  drawn = want;
  try {
    const got = await speak(`tabs/${S.tab}/view/${second.name}?theme=${theme()}`);
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
  $("two").onclick = () => open(second.name ? null : shown.view?.name === "psd" ? "allan" : "psd");
  $("second-view").onchange = event => open(event.target.value);
  new ResizeObserver(() => { if (second.view && $("plot2").data) Plotly.Plots.resize($("plot2")); }).observe($("second"));
}
