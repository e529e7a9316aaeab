// Plots of streams over time, one below the other, with a common cursor.
import {kFont} from "./chart.js";
import {element, shortNumber} from "./dom.js";
import {valueAt, visiblePoints} from "./series.js";

/**
 * @typedef {import("./flight.js").Panel} Panel
 * @typedef {import("./flight.js").Line} Line
 */

const kLeft_px = 52, kBuckets = 700;

/** One plot: the lines of the watched flight, and dashed those of a second flight. */
class Plot {
  /**
   * @param {Panel} panel
   * @param {Panel | null} beside
   * @param {(t_s: number) => void} seek
   * @param {(factor: number, t_s: number) => void} zoom
   */
  constructor(panel, beside, seek, zoom) {
    this.lines = panel.lines.map((line) => ({line, dashed: false}));
    if (beside) this.lines.push(...beside.lines.map((line) => ({line, dashed: true})));
    this.left_out = panel.left_out ?? [];
    this.values = this.lines.map(() => element("span", {class: "value"}));
    const names = this.lines.map(({line, dashed}, k) => {
      const swatch = element("span", {class: dashed ? "swatch dashed" : "swatch", style: `--colour: ${line.colour}`});
      return element("span", {class: dashed ? "key beside" : "key"}, swatch, dashed ? "" : `${line.name} `, this.values[k]);
    });
    this.canvas = /** @type {HTMLCanvasElement} */ (element("canvas", {role: "img", "aria-label": `${panel.title} over time`}));
    this.cursor = element("div", {class: "cursor"});
    this.area = element("div", {class: "area"}, this.canvas, this.cursor);
    this.element = element("section", {class: "plot", "data-panel": panel.id},
      element("h4", {}, panel.title, element("span", {class: "unit"}, ` (${panel.unit})`), ...names), this.area);
    this.chart = null;
    const time = (/** @type {MouseEvent} */ event) => this.chart.scales.x.getValueForPixel(event.clientX - this.canvas.getBoundingClientRect().left);
    this.area.addEventListener("pointerdown", (event) => {
      this.area.setPointerCapture(event.pointerId);
      seek(time(event));
    });
    this.area.addEventListener("pointermove", (event) => { if (event.buttons === 1) seek(time(event)); });
    this.area.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;  // otherwise the wheel scrolls the page
      event.preventDefault();
      zoom(Math.exp(0.002 * (event.deltaY || event.deltaX)), time(event));
    }, {passive: false});
  }

  /** @param {number} begin_s @param {number} end_s */
  window(begin_s, end_s) {
    const datasets = this.lines.map(({line, dashed}) => ({
      data: visiblePoints(line.times, line.values, begin_s, end_s, kBuckets), borderColor: dashed ? `${line.colour}99` : line.colour,
      borderWidth: dashed ? 1.5 : 1.8, borderDash: dashed ? [5, 4] : []}));
    if (!this.chart) this.chart = this.drawn();
    Object.assign(this.chart.options.scales.x, {min: begin_s, max: end_s});
    this.chart.data.datasets = datasets;
    this.chart.update("none");
  }

  drawn() {
    const font = {family: kFont, size: 11};
    return new Chart(this.canvas, {
      type: "scatter", data: {datasets: []}, plugins: [{id: "leftOut", beforeDatasetsDraw: (/** @type {any} */ chart) => this.shade(chart)}],
      options: {
        animation: false, responsive: true, maintainAspectRatio: false, parsing: false, normalized: true, events: [],
        datasets: {scatter: {showLine: true, pointRadius: 0}},
        plugins: {legend: {display: false}, tooltip: {enabled: false}},
        scales: {
          x: {type: "linear", ticks: {font, color: "#57606a", maxRotation: 0, maxTicksLimit: 9, includeBounds: false,
            callback: (/** @type {number} */ t) => `${Number(t.toPrecision(6))}`}, grid: {color: "#eaeef2", borderColor: "#8c959f"}},
          y: {ticks: {font, color: "#57606a", maxTicksLimit: 5}, grid: {color: "#eaeef2", borderColor: "#8c959f"},
            afterFit: (/** @type {any} */ axis) => { axis.width = kLeft_px; }},
        },
      },
    });
  }

  /**
   * Shades the stretches without poses.
   * @param {any} chart
   */
  shade(chart) {
    const {ctx, scales: {x}, chartArea: {left, right, top, bottom}} = chart;
    ctx.save();
    ctx.fillStyle = "#afb8c1";
    for (const [from, to] of this.left_out) {
      if (to < x.min || from > x.max) continue;
      const begin = Math.max(left, x.getPixelForValue(from) - 1), end = Math.min(right, x.getPixelForValue(to) + 1);
      ctx.fillRect(begin, top, end - begin, bottom - top);
    }
    ctx.restore();
  }

  /** @param {number} t_s */
  mark(t_s) {
    this.lines.forEach(({line}, k) => { this.values[k].textContent = shortNumber(valueAt(line.times, line.values, t_s)); });
    if (!this.chart) return;
    const {x} = this.chart.scales, inside = t_s >= x.min && t_s <= x.max;
    this.cursor.hidden = !inside;
    this.cursor.style.transform = `translateX(${x.getPixelForValue(t_s)}px)`;
  }
}

export class Timeline {
  /**
   * @param {Panel[]} panels
   * @param {Panel[] | null} beside
   * @param {number} duration_s
   * @param {(t_s: number) => void} seek
   */
  constructor(panels, beside, duration_s, seek) {
    this.duration_s = duration_s;
    this.begin_s = 0;
    this.end_s = duration_s;
    this.now_s = 0;
    this.plots = panels.map((panel) => new Plot(panel, beside?.find((other) => other.id === panel.id) ?? null, seek,
      (factor, t_s) => this.zoom(factor, t_s)));
    const choice = element("fieldset", {class: "choice"}, element("legend", {}, "Plots"));
    this.element = element("div", {class: "timeline"}, choice, ...this.plots.map((plot) => plot.element),
      element("p", {class: "note axis"}, "time (s) – click a plot to go there, Ctrl + wheel to zoom"));
    panels.forEach((panel, k) => {
      const box = /** @type {HTMLInputElement} */ (element("input", {type: "checkbox"}));
      box.checked = panel.shown;
      this.plots[k].element.hidden = !panel.shown;
      box.addEventListener("change", () => {
        this.plots[k].element.hidden = !box.checked;
        this.refresh();
      });
      choice.append(element("label", {}, box, panel.title));
    });
  }

  /** @param {number} length_s length of the visible window around the cursor */
  show(length_s) {
    this.length_s = Math.min(length_s, this.duration_s);
    this.place(this.now_s - this.length_s / 2);
  }

  /** @param {number} factor @param {number} t_s time that keeps its place on the screen */
  zoom(factor, t_s) {
    const length = Math.min(this.duration_s, Math.max(5e-3, (this.end_s - this.begin_s) * factor));
    const share = (t_s - this.begin_s) / (this.end_s - this.begin_s);
    this.length_s = length;
    this.place(t_s - share * length);
  }

  /** @param {number} begin_s */
  place(begin_s) {
    const length = this.length_s ?? this.duration_s;
    this.begin_s = Math.min(Math.max(0, begin_s), this.duration_s - length);
    this.end_s = this.begin_s + length;
    this.refresh();
  }

  refresh() {
    for (const plot of this.plots) {
      if (plot.element.hidden) continue;
      plot.window(this.begin_s, this.end_s);
      plot.mark(this.now_s);
    }
  }

  /** @param {number} t_s */
  mark(t_s) {
    this.now_s = t_s;
    const length = this.end_s - this.begin_s;
    if (length < this.duration_s && (t_s < this.begin_s || t_s > this.end_s - 0.05 * length)) {
      this.place(t_s - 0.2 * length);
      return;
    }
    for (const plot of this.plots) if (!plot.element.hidden) plot.mark(t_s);
  }
}
