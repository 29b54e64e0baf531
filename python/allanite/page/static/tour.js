// A one-minute tour: a sentence about each part of the page, shown next to the part and never over it.
import { $, S, act, busy, showMessage } from "./core.js";

// Each step describes the first of its elements that is visible.
const STEPS = [
  ["Allan curve", ["#plot [data-subplot=xy].nsewdrag", "#plot .xy .nsewdrag", "#plot"], "Dots are the measured Allan deviation with 95 % intervals, the thick line is the model, and each thin line is one of its effects."],
  ["Residual", ["#plot [data-subplot=x2y2].nsewdrag", "#plot .x2y2 .nsewdrag", "#plot"], "The residual is the distance of the measured curve from the model in σ, and points beyond the dotted lines exceed the expected scatter."],
  ["Missing effects", ["#cards .card", "#missing-title"], "Each card names an effect that would explain a misfit, with its evidence and size, and “Add” puts the effect into the model."],
  ["Your own effects", ["#add-effect"], "“+ Effect” opens the catalog, for effects that you know of but that no card suggests."],
  ["Steps", ["#ladder li", "footer"], "Each step is a model of the same record, and a click on a step returns to it."],
  ["Axes", ["#strip:not([hidden])", "[data-tab=axes]"], "A log with several axes has a model and steps for each axis, and here you see all axes side by side."],
  ["Export", [".menu summary"], "“File” exports the parameters of all axes for your filter, a report, and each figure with its values."],
];
const ROOM = 10;
let at = 0, opener = null, timer = 0;

const describedElement = () => STEPS[at][1].map(s => document.querySelector(s)).find(n => n && n.getClientRects().length);

// Without a log the example is opened first.
export async function startTour(from) {
  if (timer) return;
  opener = from;
  if (!S.state.log && !await act({ do: "example" })) return;
  while (busy() || S.state.log && S.state.ladder.length && !document.body.dataset.drawn) await new Promise(done => setTimeout(done, 100));
  if (!S.state.ladder.length) { showMessage("The tour needs a log that can be read: set its rate and units first, or open another log"); return; }
  if (timer) return;
  S.hooks.openView("allan");
  $("tour").show(); $("tour-frame").hidden = false;
  // The frame follows its element, which may move or be redrawn.
  timer = setInterval(placeFrame, 200);
  showStep(0);
  $("tour-next").focus();
}
function endTour() {
  if (!timer) return;
  clearInterval(timer); timer = 0;
  const inside = $("tour").contains(document.activeElement);
  $("tour").close(); $("tour-frame").hidden = true;
  if (inside || document.activeElement === document.body) (opener && opener.isConnected && opener.getClientRects().length ? opener : $("keys")).focus();
}
function showStep(to) {
  if (to >= STEPS.length) { endTour(); return; }
  at = Math.max(0, to);
  const last = at === STEPS.length - 1;
  $("tour-title").textContent = STEPS[at][0];
  $("tour-count").textContent = `${at + 1} of ${STEPS.length}`;
  $("tour-text").textContent = STEPS[at][2];
  $("tour-next").textContent = last ? "Done" : "Next";
  // `disabled` would remove the focus.
  $("tour-back").setAttribute("aria-disabled", at === 0);
  const target = describedElement();
  if (target && !target.closest("header")) {
    target.scrollIntoView({ block: "nearest", inline: "nearest" });
    // On a narrow page the header stays on top: scroll the part below it, with the text below the part.
    if (document.body.scrollHeight > innerHeight + 1) scrollBy(0, target.getBoundingClientRect().top - document.querySelector("header").offsetHeight - ROOM);
  }
  placeFrame();
}
function placeFrame() {
  const target = describedElement();
  if (!target) return;
  const r = target.getBoundingClientRect(), frame = $("tour-frame").style, box = $("tour").getBoundingClientRect();
  Object.assign(frame, { left: `${r.left - 4}px`, top: `${r.top - 4}px`, width: `${r.width + 8}px`, height: `${r.height + 8}px` });
  const between = (low, x, high) => Math.max(low, Math.min(x, high));
  const x = between(8, r.left, innerWidth - box.width - 8), y = between(8, r.top, innerHeight - box.height - 8);
  const fits = [[x, r.bottom + ROOM], [x, r.top - ROOM - box.height], [r.right + ROOM, y], [r.left - ROOM - box.width, y]]
    .find(([left, top]) => left >= 0 && top >= 0 && left + box.width <= innerWidth && top + box.height <= innerHeight);
  const [left, top] = fits || [x, innerHeight - box.height - 8];
  Object.assign($("tour").style, { left: `${left}px`, top: `${top}px` });
}
export function listenTour() {
  $("tour-next").onclick = () => showStep(at + 1);
  $("tour-back").onclick = () => showStep(at - 1);
  $("tour-end").onclick = endTour;
  $("help-tour").onclick = () => { $("help").close(); startTour($("keys")); };
  $("tour").addEventListener("keydown", event => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by) { showStep(at + by); event.preventDefault(); }
  });
  document.addEventListener("keydown", event => {
    if (event.key !== "Escape" || !timer || event.target.matches("input, select") || document.querySelector("dialog:modal")) return;
    event.stopPropagation(); endTour();
  }, true);
  for (const name of ["resize", "scroll"]) addEventListener(name, () => timer && placeFrame(), true);
}
