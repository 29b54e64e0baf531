"use strict";
// The figure: drawing, lighting up a component, shading where an effect acts, dragging a component's line.
const Draw = (() => {
  const plot = () => document.getElementById("plot");
  let shown = null, base = [], grip = null, later = null;
  const options = { displaylogo: false, displayModeBar: false, doubleClick: "reset" };

  async function show(view) {
    if (grip) { later = view; return; }  // a line is in the hand
    shown = view;
    const layout = structuredClone(view.layout);
    base = layout.shapes || [];
    await Plotly.react(plot(), view.data, layout, options);
    // What stands above may have become taller: the observer of sizes would put that right, but only a moment later.
    const { width, height } = plot()._fullLayout;
    if (width !== plot().clientWidth || height !== plot().clientHeight) await Plotly.relayout(plot(), { autosize: true });
  }

  function light(place) {
    if (!shown || !plot().data) return;
    const meta = place === null ? null : `effect-${place}`;
    const indices = [], widths = [], opacity = [];
    shown.data.forEach((trace, i) => {
      if (!String(trace.meta || "").startsWith("effect-")) return;
      const own = trace.meta === meta;
      indices.push(i);
      widths.push(own ? 3.6 : (trace.line && trace.line.width) || 1.2);
      opacity.push(meta === null || own ? 1 : 0.25);
    });
    if (indices.length) Plotly.restyle(plot(), { "line.width": widths, opacity }, indices);
  }

  // Where an effect acts: a range of the view's own axis; on the map the frequencies, the times or both.
  function shade(acts, color) {
    if (!shown || !plot().layout) return;
    const { name, layout } = shown, more = [];
    if (acts) {
      const scale = /\((d|h|min)\)/.exec((layout.xaxis.title || {}).text || ""), unit = { d: 86400, h: 3600, min: 60 }[scale && scale[1]] || 1;
      const time = acts.time && acts.time.map(t => t / unit);
      const x = { allan: acts.tau, compare: acts.tau, psd: acts.frequency, map: time, samples: time }[name], y = name === "map" ? acts.frequency : null;
      if (x || y) for (const s of ["", "2"]) if (layout["xaxis" + s]) more.push({
        type: "rect", xref: x ? "x" + s : `x${s} domain`, yref: y ? "y" + s : `y${s} domain`, x0: x ? x[0] : 0, x1: x ? x[1] : 1, y0: y ? y[0] : 0, y1: y ? y[1] : 1,
        fillcolor: color, opacity: name === "map" ? 0.3 : 0.16, line: { width: 1, color }, layer: name === "map" ? "above" : "below", name: "acts" });
    }
    Plotly.relayout(plot(), { shapes: [...base, ...more] });
  }

  // A line of the Allan curve or the spectrum is grabbed near the pointer and moved up or down.
  function drag(onDone) {
    const place = event => {
      const box = plot().getBoundingClientRect(), axes = plot()._fullLayout;
      return { x: event.clientX - box.left - axes.xaxis._offset, y: event.clientY - box.top - axes.yaxis._offset, axes };
    };
    // Distance in pixels from a point to a stretch of a line.
    const away = (x, y, [ax, ay], [bx, by]) => {
      const length = (bx - ax) ** 2 + (by - ay) ** 2, t = length ? Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length)) : 0;
      return Math.hypot(ax + t * (bx - ax) - x, ay + t * (by - ay) - y);
    };
    const nearest = event => {
      if (!shown || !["allan", "psd"].includes(shown.name) || !plot()._fullLayout) return null;
      const { x, y, axes } = place(event);
      if (x < 0 || y < 0 || x > axes.xaxis._length || y > axes.yaxis._length) return null;
      let best = null;
      shown.data.forEach((trace, i) => {
        if (!String(trace.meta || "").startsWith("effect-")) return;
        let last = null;
        for (let k = 0; k < trace.x.length; k++) {
          const here = trace.y[k] > 0 ? [axes.xaxis.d2p(trace.x[k]), axes.yaxis.d2p(trace.y[k])] : null;
          const far = last && here ? away(x, y, last, here) : Infinity;
          if (far < 7 && (!best || far < best.far)) best = { far, i };
          last = here;
        }
      });
      return best && best.i;
    };
    plot().addEventListener("pointermove", event => {
      if (!grip) { plot().classList.toggle("grip", nearest(event) !== null); return; }
      const decades = (grip.y - event.clientY) / plot()._fullLayout.yaxis._length * (plot()._fullLayout.yaxis.range[1] - plot()._fullLayout.yaxis.range[0]);
      grip.factor = 10 ** decades;
      Plotly.restyle(plot(), { y: [shown.data[grip.i].y.map(v => v === null ? null : v * grip.factor)] }, [grip.i]);
      event.preventDefault(); event.stopPropagation();
    }, true);
    plot().addEventListener("mousedown", event => {
      const i = nearest(event);
      if (i === null) return;
      grip = { i, y: event.clientY, factor: 1 };
      event.preventDefault(); event.stopPropagation();
    }, true);
    window.addEventListener("pointerup", () => {
      if (!grip) return;
      const { i, factor } = grip, waiting = later;
      grip = later = null;
      if (waiting) show(waiting);
      // The density goes with the square of a coefficient.
      if (Math.abs(factor - 1) > 1e-3) onDone(Number(shown.data[i].meta.slice(7)), shown.name === "psd" ? Math.sqrt(factor) : factor);
    });
  }

  return { show, light, shade, drag, fit: () => { if (shown && plot().data) Plotly.Plots.resize(plot()); }, clear: () => { shown = null; if (plot().data) Plotly.purge(plot()); } };
})();
