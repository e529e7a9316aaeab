// Draws the robot with its residuals: one arrow, arc or part for each channel, stronger the more its residual exceeds noise.
import {drawn, element} from "./dom.js";
import {kHummingbird, wingPoint} from "./geometry.js";

/**
 * @typedef {import("./geometry.js").Side} Side
 * @typedef {{channel: string, name: string, short: string, ratio: number, text: string}} Part
 */

const kWidth = 480, kHeight = 350, kScale = 2400, kLetter = 7.5, kBelow = 24;  // px

/**
 * Projects a point to the picture, seen from the front and slightly from above: the robot's left is on the right.
 * @param {number[]} p in B, m
 * @returns {number[]} px
 */
function projected(p) {
  const [x, y, z] = p;
  return [kWidth / 2 + kScale * (-0.5 * x + 0.92 * y), kHeight / 2 + 22 + kScale * (0.42 * x + 0.12 * y - 0.95 * z)];
}

/** @param {number[][]} points @returns {string} */
function pathOf(points) {
  return points.map((p, k) => `${k === 0 ? "M" : "L"}${projected(p).map((v) => v.toFixed(1)).join(" ")}`).join(" ");
}

/**
 * The strength with which a residual is drawn: 0 at noise, 1 at ten times noise, logarithmic in between.
 * @param {number} ratio
 * @returns {number}
 */
export function strengthOf(ratio) {
  return Math.min(1, Math.max(0, Math.log10(Math.max(1, ratio))));
}

/** @param {number} strength @returns {{stroke: string, "stroke-width": number}} */
function inkOf(strength) {
  const mixed = [[175, 184, 193], [213, 94, 0]].reduce((from, to) => from.map((v, k) => Math.round(v + (to[k] - v) * Math.min(1, 1.6 * strength))));
  return {stroke: strength > 0.02 ? `rgb(${mixed.join(" ")})` : "#c8d0d8", "stroke-width": 2 + 6 * strength};
}

/** Directions of the axes of B. */
const kAxes = {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1]};

/** @param {"x" | "y" | "z"} axis @param {number} radius_m @param {number} along_m @returns {number[][]} */
function arcAbout(axis, radius_m, along_m) {
  return Array.from({length: 29}, (_, k) => {
    const angle = -0.6 + 4.4 * k / 28, c = radius_m * Math.cos(angle), s = radius_m * Math.sin(angle);
    return axis === "x" ? [along_m, c, s] : axis === "y" ? [s, along_m, c] : [c, s, along_m];
  });
}

/** @param {number} sign 1: left, -1: right @returns {Side} */
function sideOf(sign) {
  return /** @type {Side} */ (sign > 0 ? kHummingbird.left : kHummingbird.right);
}

/** @param {string} channel @returns {{points: number[][], label: number[]} | null} */
function shapeOf(channel) {
  const at = channel.lastIndexOf("_"), kind = at < 0 ? channel : channel.slice(0, at), which = channel.slice(at + 1);
  const axis = /** @type {"x" | "y" | "z"} */ (which), way = kAxes[axis];
  if (kind === "specific_force") return {points: [0.016, 0.066].map((length) => way.map((v) => v * length)), label: way.map((v) => v * 0.076)};
  if (kind === "angular_acceleration") {
    const along = axis === "z" ? 0.05 : 0.042, aside = {x: [0, -0.016, 0.012], y: [0, 0.004, -0.026], z: [0, 0.04, 0]}[axis];
    return {points: arcAbout(axis, 0.013, along), label: way.map((v, k) => v * along + aside[k])};
  }
  const sign = which === "left" ? 1 : -1;
  if (kind === "stroke") {
    const arc = Array.from({length: 15}, (_, k) => wingPoint(sideOf(sign), sign, -0.5 + k / 14, 0, 0.08, 0));
    return {points: arc, label: wingPoint(sideOf(sign), sign, -0.6, 0, 0.083, 0)};
  }
  if (kind === "current") return {points: [[0, sign * 0.014, 0.018], [0, sign * 0.014, 0.006]], label: [0, sign * 0.03, -0.004]};
  if (kind === "battery") return {points: [[0, 0, -0.026], [0, 0, -0.036]], label: [0, 0.012, -0.046]};
  return null;
}

/** @returns {SVGElement[]} */
function wingElements() {
  return [-1, 1].map((sign) => {
    const side = sideOf(sign), at = (/** @type {number} */ s, /** @type {number} */ c) => wingPoint(side, sign, 0.15, 0.5, s, c);
    const edge = [at(0, 0), ...side.outline_m.map(([s]) => at(s, 0)), ...[...side.outline_m].reverse().map(([s, c]) => at(s, c))];
    return drawn("path", {d: `${pathOf(edge)} Z`, fill: "#dfe9f2", stroke: "#8fa8bd"});
  });
}

/** @returns {SVGElement} */
function bodyElement() {
  const edge = (/** @type {number} */ sign) => /** @type {number[][]} */ (kHummingbird.profile_m).map(([z, r]) => {
    const [x, y] = projected([0, 0, z]);
    return [x + sign * kScale * r, y];
  });
  const silhouette = [...edge(1), ...edge(-1).reverse()].map((p) => p.map((v) => v.toFixed(1)).join(" "));
  return drawn("path", {d: `M${silhouette.join("L")}Z`, fill: "#e7ebef", stroke: "#8c959f"});
}

/** For a body of unknown form: a circle around the tracked point, and one in the plane of its x and y. @returns {SVGElement[]} */
function signElements() {
  const radius_m = 0.016, [x, y] = projected([0, 0, 0]);
  const level = Array.from({length: 49}, (_, k) => [radius_m * Math.cos(2 * Math.PI * k / 48), radius_m * Math.sin(2 * Math.PI * k / 48), 0]);
  return [drawn("circle", {cx: x, cy: y, r: kScale * radius_m, fill: "#e7ebef", stroke: "#8c959f"}),
    drawn("path", {d: pathOf(level), fill: "none", stroke: "#8c959f"})];
}

/**
 * @param {{parts: Part[], wings?: boolean, note: string}} block
 * @returns {HTMLElement}
 */
export function anatomyElement(block) {
  const shown = drawn("svg", {viewBox: `0 0 ${kWidth} ${kHeight}`, role: "img",
    "aria-label": block.parts.map((part) => `${part.name} ${part.text}`).join("; ")});
  if (block.wings !== false) shown.append(...wingElements(), bodyElement());
  else shown.append(...signElements());
  const marker = drawn("marker", {id: "head", viewBox: "0 0 10 10", refX: 5, refY: 5, markerWidth: 3.2, markerHeight: 3.2, orient: "auto-start-reverse"},
    drawn("path", {d: "M0 0L10 5L0 10Z", fill: "context-stroke"}));
  shown.append(drawn("defs", {}, marker));
  for (const part of [...block.parts].sort((a, b) => a.ratio - b.ratio)) {
    const shape = shapeOf(part.channel);
    if (!shape) continue;
    const strength = strengthOf(part.ratio);
    shown.append(drawn("path", {d: pathOf(shape.points), fill: "none", "stroke-linecap": "round", "marker-end": "url(#head)", ...inkOf(strength)}));
    if (strength < 0.25) continue;
    const [x, y] = projected(shape.label);
    const within = x > kWidth * 0.6 ? Math.min(x, kWidth - kLetter * part.short.length) : x;
    shown.append(drawn("text", {x: within.toFixed(0), y: (within < x ? y + kBelow : y).toFixed(0), "text-anchor": x > kWidth * 0.6 ? "start" : x < kWidth * 0.4 ? "end" : "middle"}, part.short));
  }
  const list = element("ul", {}, ...[...block.parts].sort((a, b) => b.ratio - a.ratio).slice(0, 7).map((part) =>
    element("li", {}, element("b", {}, `${part.ratio >= 10 ? Math.round(part.ratio) : part.ratio.toFixed(1)}×`), element("span", {}, element("b", {}, part.name), ` ${part.text}`))));
  const made = element("figure", {class: "anatomy wide"}, shown, list);
  made.append(element("figcaption", {class: "wide"}, block.note));
  return made;
}
