// A tour of one minute: a sentence about each part of the page, beside that part and never over it.
import { $, S, act, busy, say } from "./core.js";

// The first element of a step that is there is the one that it speaks of.
const STEPS = [
  ["Allan curve", ["#plot [data-subplot=xy].nsewdrag", "#plot .xy .nsewdrag", "#plot"], "Dots are the measured Allan deviation with its 95 % interval, and the thick line is the model: the sum of the thin lines, one for each effect."],
  ["Residual", ["#plot [data-subplot=x2y2].nsewdrag", "#plot .x2y2 .nsewdrag", "#plot"], "The residual is the distance of the measured curve from the model in σ: points beyond the dotted lines are more than expected scatter."],
  ["Missing effects", ["#cards .card", "#missing-title"], "Each card names an effect that would explain a misfit, with its evidence and its size, and “Add” puts it into the model."],
  ["Your own effects", ["#add-effect"], "“+ Effect” opens the catalogue, for an effect that you know of and that no card suggests."],
  ["Ladder", ["#ladder li", "footer"], "Each step of the ladder is a model of the same record, and a click goes back to it."],
  ["Axes", ["#strip:not([hidden])", "[data-tab=axes]"], "A log of several axes has a model and a ladder for each, and this is where you see them side by side."],
  ["Export", [".menu summary"], "“File” exports the parameters of all axes for your filter, a report, and each figure with its numbers."],
];
const ROOM = 10;
let at = 0, opener = null, timer = 0;

const subject = () => STEPS[at][1].map(s => document.querySelector(s)).find(n => n && n.getClientRects().length);

// Without a log there is nothing to point at: the example is opened first.
export async function tour(from) {
  if (timer) return;
  opener = from;
  if (!S.state.log && !await act({ do: "example" })) return;
  while (busy() || S.state.log && S.state.ladder.length && !document.body.dataset.drawn) await new Promise(done => setTimeout(done, 100));
  if (!S.state.ladder.length) { say("The tour is of a log that was read: set its rate and units first, or open another one"); return; }
  if (timer) return;
  S.hooks.go("allan");
  $("tour").show(); $("tour-frame").hidden = false;
  // The page goes on living: what is pointed at is drawn anew and moves.
  timer = setInterval(place, 200);
  show(0);
  $("tour-next").focus();
}
function end() {
  if (!timer) return;
  clearInterval(timer); timer = 0;
  const inside = $("tour").contains(document.activeElement);
  $("tour").close(); $("tour-frame").hidden = true;
  if (inside || document.activeElement === document.body) (opener && opener.isConnected && opener.getClientRects().length ? opener : $("keys")).focus();
}
function show(to) {
  if (to >= STEPS.length) { end(); return; }
  at = Math.max(0, to);
  const last = at === STEPS.length - 1;
  $("tour-title").textContent = STEPS[at][0];
  $("tour-count").textContent = `${at + 1} of ${STEPS.length}`;
  $("tour-text").textContent = STEPS[at][2];
  $("tour-next").textContent = last ? "Done" : "Next";
  // Not `disabled`, which would take the focus away.
  $("tour-back").setAttribute("aria-disabled", at === 0);
  const target = subject();
  if (target && !target.closest("header")) {
    target.scrollIntoView({ block: "nearest", inline: "nearest" });
    // On a narrow page the head stays on top: the part goes under it, and the words under the part.
    if (document.body.scrollHeight > innerHeight + 1) scrollBy(0, target.getBoundingClientRect().top - document.querySelector("header").offsetHeight - ROOM);
  }
  place();
}
function place() {
  const target = subject();
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
  $("tour-next").onclick = () => show(at + 1);
  $("tour-back").onclick = () => show(at - 1);
  $("tour-end").onclick = end;
  $("help-tour").onclick = () => { $("help").close(); tour($("keys")); };
  $("tour").addEventListener("keydown", event => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by) { show(at + by); event.preventDefault(); }
  });
  document.addEventListener("keydown", event => {
    if (event.key !== "Escape" || !timer || event.target.matches("input, select") || document.querySelector("dialog:modal")) return;
    event.stopPropagation(); end();
  }, true);
  for (const name of ["resize", "scroll"]) addEventListener(name, () => timer && place(), true);
}
