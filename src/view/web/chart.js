// Draws figures (src/view/figure.hpp) by Chart.js. Bars and intervals are drawn here, so that paper and page have the same layout.
import {element, shortNumber} from "./dom.js";

/**
 * @typedef {{name: string, draw: string, colour: string, dashed: boolean, x: (number | null)[], y?: (number | null)[],
 *   low?: (number | null)[], high?: (number | null)[], labels?: string[]}} SeriesJson
 * @typedef {{title: string, log: boolean, low: number | null, high: number | null}} AxisJson
 * @typedef {{id: string, title: string, note: string, x: AxisJson, y: AxisJson, categories: string[], bar: number,
 *   series: SeriesJson[]}} FigureJson
 */

const kInk = "#24292f", kSoft = "#57606a", kGrid = "#e4e8ec";
const kLabelled = 0.5;  // bars at least this wide have room for their number
const kLine = 26;  // letters of a line
const kUpright = 34;  // letters of a title for which an axis upward has room
export const kFont = "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif";

/**
 * @param {AxisJson} axis
 * @returns {Record<string, any>} a scale of Chart.js
 */
function scaleOf(axis) {
  return {
    type: axis.log ? "logarithmic" : "linear", min: axis.low ?? undefined, max: axis.high ?? undefined,
    title: {display: axis.title !== "", text: axis.title, color: kInk, font: {family: kFont, size: 13}},
    ticks: {color: kSoft, font: {family: kFont, size: 12}, maxRotation: 0},
    grid: {color: kGrid, borderColor: "#8c959f", tickColor: "#8c959f"},
  };
}

/**
 * Breaks a long name into lines.
 * @param {string} text
 * @returns {string[]}
 */
export function wrapped(text) {
  const lines = [""];
  for (const word of text.split(" ")) {
    const line = lines[lines.length - 1];
    if (line !== "" && line.length + word.length > kLine) lines.push(word);
    else lines[lines.length - 1] = line === "" ? word : `${line} ${word}`;
  }
  return lines;
}

/**
 * The configuration of Chart.js: everything is a function of numbers; categories are names of whole numbers.
 * @param {FigureJson} figure
 * @returns {Record<string, any>}
 */
export function chartConfig(figure) {
  const datasets = [];
  for (const s of figure.series) {
    const common = {label: s.name, borderColor: s.colour, backgroundColor: s.colour, own: s, bar: figure.bar};
    if (s.draw === "band") {
      const edge = (/** @type {(number | null)[]} */ list) => s.x.map((x, i) => ({x, y: list[i]}));
      const band = {...common, showLine: true, pointRadius: 0, borderWidth: 0, backgroundColor: `${s.colour}2e`};
      datasets.push({...band, data: edge(s.low ?? []), label: "", fill: false});
      datasets.push({...band, data: edge(s.high ?? []), fill: "-1"});
      continue;
    }
    const line = s.draw === "line";
    const points = s.x.map((x, i) => ({x, y: (s.y ?? [])[i]}));
    datasets.push({...common, data: points.filter((p) => line || p.x !== null), showLine: line, spanGaps: false, borderWidth: 2,
      borderDash: s.dashed ? [6, 4] : [], pointRadius: line || s.draw === "bars" ? 0 : 4, pointHoverRadius: 4, pointHitRadius: 12,
      clip: line ? 0 : 6});  // do not cut off a point at the end of an axis
  }
  const y = scaleOf(figure.y);
  if (figure.categories.length > 0) {
    Object.assign(y, {min: -0.5, max: figure.categories.length - 0.5, reverse: true, type: "linear"});
    Object.assign(y.grid, {display: false});
    Object.assign(y.ticks, {stepSize: 1, autoSkip: false, color: kInk, callback: (/** @type {number} */ v) => wrapped(figure.categories[v] ?? "")});
    y.afterBuildTicks = (/** @type {any} */ axis) => { axis.ticks = figure.categories.map((_, value) => ({value})); };
  }
  if (figure.y.title.length > kUpright) y.title.text = wrapped(figure.y.title);
  const x = scaleOf(figure.x);
  // make room for intervals, which reach beyond the points
  const ends = figure.series.filter((s) => s.draw === "interval").flatMap((s) => [...s.low ?? [], ...s.high ?? []]).filter((v) => v !== null).map(Number);
  if (ends.length > 0) Object.assign(x, {suggestedMin: Math.min(...ends), suggestedMax: Math.max(...ends)});
  return {
    type: "scatter", data: {datasets}, plugins: [barsAndIntervals],
    options: {
      animation: false, responsive: true, maintainAspectRatio: false, scales: {x, y},
      plugins: {
        legend: {
          display: figure.series.some((s) => s.name !== ""), align: "start",
          labels: {color: kInk, font: {family: kFont, size: 13}, usePointStyle: true, pointStyleWidth: 24, generateLabels: legendKeys},
        },
        tooltip: {callbacks: {label: (/** @type {any} */ at) => `${at.dataset.label} (${shortNumber(at.parsed.x)}, ${shortNumber(at.parsed.y)})`}},
      },
    },
  };
}

/**
 * The keys of the legend: a line for each name, dashed like its series, and broad for a band.
 * @param {any} chart
 * @returns {Record<string, any>[]}
 */
function legendKeys(chart) {
  return chart.data.datasets.map((/** @type {any} */ dataset, /** @type {number} */ k) => ({
    text: dataset.label, datasetIndex: k, hidden: !chart.isDatasetVisible(k), fontColor: kInk, pointStyle: "line",
    strokeStyle: dataset.backgroundColor, lineWidth: dataset.own.draw === "band" ? 9 : 3, lineDash: dataset.own.dashed ? [6, 3] : [],
  })).filter((/** @type {any} */ key) => key.text !== "");
}

/** Plugin of Chart.js that draws bars from the axis, and intervals. */
const barsAndIntervals = {
  id: "barsAndIntervals",
  beforeDatasetsDraw(/** @type {any} */ chart) {
    const {ctx, scales: {x, y}, chartArea} = chart;
    ctx.save();
    ctx.beginPath();
    ctx.rect(chartArea.left, chartArea.top, chartArea.right - chartArea.left, chartArea.bottom - chartArea.top);
    ctx.clip();
    chart.data.datasets.forEach((/** @type {any} */ dataset, /** @type {number} */ k) => {
      if (!chart.isDatasetVisible(k)) return;
      const s = dataset.own;
      ctx.fillStyle = ctx.strokeStyle = s.colour;
      ctx.lineWidth = 2.5;
      s.x.forEach((/** @type {number | null} */ value, /** @type {number} */ i) => {
        if (value === null) return;
        if (s.draw === "bars") {
          const base = x.type === "logarithmic" ? chartArea.left : x.getPixelForValue(0), end = x.getPixelForValue(value);
          const top = y.getPixelForValue(s.y[i] - dataset.bar / 2), bottom = y.getPixelForValue(s.y[i] + dataset.bar / 2);
          ctx.fillRect(Math.min(base, end), Math.min(top, bottom), Math.max(1.5, Math.abs(end - base)), Math.abs(bottom - top));
          if (dataset.bar < kLabelled) return;
          const way = end < base ? -1 : 1;
          const inside = way < 0 ? end < chartArea.left + 56 : end > chartArea.right - 56;
          const textAlign = (way > 0) === inside ? "right" : "left";
          Object.assign(ctx, {font: `12px ${kFont}`, textBaseline: "middle", textAlign, fillStyle: inside ? "#ffffff" : kInk});
          ctx.fillText(shortNumber(value), end + way * (inside ? -6 : 6), (top + bottom) / 2);
          ctx.fillStyle = s.colour;
        }
        if (s.draw === "interval" && s.low[i] !== null && s.high[i] !== null) {
          const at = y.getPixelForValue(s.y[i]);
          ctx.beginPath();
          ctx.moveTo(x.getPixelForValue(s.low[i]), at);
          ctx.lineTo(x.getPixelForValue(s.high[i]), at);
          ctx.stroke();
        }
      });
    });
    ctx.restore();
  },
  afterDatasetsDraw(/** @type {any} */ chart) {
    const {ctx, scales: {x, y}} = chart;
    ctx.save();
    Object.assign(ctx, {font: `12px ${kFont}`, textBaseline: "bottom", fillStyle: kInk});
    chart.data.datasets.forEach((/** @type {any} */ dataset, /** @type {number} */ k) => {
      if (!chart.isDatasetVisible(k)) return;
      dataset.own.labels?.forEach((/** @type {string} */ text, /** @type {number} */ i) => {
        const at = x.getPixelForValue(dataset.own.x[i]), inside = at > chart.chartArea.right - 8 * text.length - 6;
        ctx.textAlign = inside ? "right" : "left";
        ctx.fillText(text, at + (inside ? -6 : 6), y.getPixelForValue(dataset.own.y[i]) - 2);
      });
    });
    ctx.restore();
  },
};

/**
 * The numbers of a figure as rows of a table, for readers who do not see the picture.
 * @param {FigureJson} figure
 * @returns {{head: string[], rows: string[][]}}
 */
export function figureRows(figure) {
  const named = figure.categories.length > 0;
  const rows = figure.series.flatMap((s) => s.x.map((x, i) => {
    const y = s.y?.[i] ?? null;
    const number = (/** @type {number | null | undefined} */ v) => v === null || v === undefined ? "–" : shortNumber(v);
    return [s.name, named && y !== null ? figure.categories[Math.round(y)] : number(y), number(x), number(s.low?.[i]), number(s.high?.[i])];
  }));
  return {head: ["series", figure.y.title || "what", figure.x.title, "low", "high"], rows};
}

/**
 * @param {FigureJson} figure
 * @returns {HTMLElement}
 */
export function figureElement(figure) {
  const lines = Math.max(0, ...figure.categories.map((name) => wrapped(name).length));
  const high = figure.categories.length > 0 ? 110 + (lines > 2 ? 17 * lines : 26) * figure.categories.length : 300;
  const canvas = element("canvas", {role: "img", "aria-label": `${figure.title}. ${figure.note}`});
  const frame = element("div", {class: "chart", style: `height: ${high}px`}, canvas);
  const numbers = element("details", {}, element("summary", {}, "Numbers"));
  numbers.addEventListener("toggle", () => {
    if (numbers.childElementCount > 1) return;
    const {head, rows} = figureRows(figure);
    const row = (/** @type {string[]} */ cells, /** @type {string} */ name) => element("tr", {}, ...cells.map((cell) => element(name, {}, cell)));
    numbers.append(element("div", {class: "scroll", tabindex: "0"},
      element("table", {}, element("thead", {}, row(head, "th")), element("tbody", {}, ...rows.map((cells) => row(cells, "td"))))));
  });
  const made = element("figure", {class: "chart-figure", "data-figure": figure.id}, element("h3", {}, figure.title), frame);
  if (figure.note) made.append(element("figcaption", {}, figure.note));
  made.append(numbers);
  // a canvas has a size only once it is in the page
  requestAnimationFrame(() => new Chart(/** @type {HTMLCanvasElement} */ (canvas), chartConfig(figure)));
  return made;
}
