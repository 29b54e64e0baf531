// Keeps the work: a reloaded page continues, and for a log that is opened again the saved study is offered.
import { $, S, act, el, hasUserJob, showMessage, request } from "./core.js";

const PREFIX = "allanite:study:", MOST = 30;
let saved = "", timer = 0, failed = false, offered = new Set();

// Continues the tab of this page after a reload, or opens a new one.
export async function openTab() {
  const was = sessionStorage.getItem("allanite:tab");
  if (was) for (const wait of [0, 200]) {
    await new Promise(done => setTimeout(done, wait));
    try { await request(`tabs/${was}/resume`, { method: "POST" }); S.tab = was; return; } catch { /* the tab was forgotten or belongs to another page */ }
  }
  S.tab = await copyOfLastTab() || (await request("tabs", { method: "POST" })).tab;
  sessionStorage.setItem("allanite:tab", S.tab);
}
// A second browser tab starts with a copy of the first tab's study.
const LAST = "allanite:last";
async function copyOfLastTab() {
  const last = localStorage.getItem(LAST);
  try { return last && (await request(`tabs/${last}/copy`, { method: "POST" })).tab; } catch { return null; }
}
// Tells the server when the page is left, and warns if work would be lost.
export function listenLeaving() {
  localStorage.setItem(LAST, S.tab);
  addEventListener("pagehide", () => navigator.sendBeacon(`tabs/${S.tab}/leave`));
  addEventListener("pageshow", event => { if (event.persisted) location.reload(); });
  addEventListener("beforeunload", event => {
    if (failed ? hasOwnWork(S.state) : hasUserJob() && S.state.job.name.startsWith("Improving")) event.preventDefault();
  });
}
// True if a log has more than the first fit, or only a part of it is analyzed.
const hasOwnWork = state => Boolean(state && state.axes && (state.axes.some(a => a.steps > 1) || (state.recording && (state.recording.span || state.recording.left_out.length))));

// Saves the study shortly after each change, under the digest of the samples.
export function saveStudy() {
  const { recording, version } = S.state, mark = recording && `${recording.digest} ${version}`;
  if (!recording || !S.state.ladder.length || !hasOwnWork(S.state) || saved === mark) return;
  clearTimeout(timer);
  timer = setTimeout(async () => {
    try {
      const document = await request(`tabs/${S.tab}/part/saved`);
      localStorage.setItem(PREFIX + document.digest, JSON.stringify({ when: Date.now(), document }));
      saved = mark; failed = false;
      const all = Object.keys(localStorage).filter(k => k.startsWith(PREFIX)).map(k => [JSON.parse(localStorage.getItem(k)).when, k]).sort((a, b) => b[0] - a[0]);
      for (const [, key] of all.slice(MOST)) localStorage.removeItem(key);
    } catch { failed = true; }
  }, 400);
}
// Offers the saved study of this log, once each time it is opened.
export function offerSavedStudy() {
  const { recording } = S.state;
  if (!recording) { $("offer").hidden = true; return; }
  if (offered.has(recording.home)) { if (hasOwnWork(S.state)) $("offer").hidden = true; return; }
  offered.add(recording.home);
  if (hasOwnWork(S.state)) return;
  let found = null;
  try { found = JSON.parse(localStorage.getItem(PREFIX + recording.home)); } catch { /* not ours */ }
  if (!found || !found.document) return;
  const axes = found.document.axes, steps = axes.reduce((n, a) => n + a.ladder.length - 1, 0);
  if (steps < 1 && !found.document.span && !(found.document.left_out || []).length) return;
  const when = new Date(found.when).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
  const close = () => { $("offer").hidden = true; };
  $("offer").replaceChildren(el("span", {}, `You worked on this log on ${when}: ${axes.length} ${axes.length > 1 ? "axes" : "axis"}, ${steps} ${steps > 1 ? "steps" : "step"}.`),
    el("button", { class: "main", onclick: () => { close(); act({ do: "study", study: found.document }); } }, "Restore it"),
    el("button", { onclick: close }, "Start over"));
  $("offer").hidden = false;
}
// If the server has forgotten this tab, opens a new one.
export async function reopenExpired(message) {
  if (!/session has ended/.test(message)) return false;
  sessionStorage.removeItem("allanite:tab");
  showMessage("The session had expired; the page continues in a new one");
  await openTab();
  return true;
}
