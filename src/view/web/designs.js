// The robots of a design study: in 3D beside the published one, each wing over the published one's, and what each is worth.
import {drawn, element} from "./dom.js";
import {spanOf} from "./geometry.js";
import {Robot, Stage, label, turnByMouse, turningKeys} from "./scene.js";

/**
 * @typedef {import("./geometry.js").Vehicle} Vehicle
 * @typedef {import("./geometry.js").Side} Side
 * @typedef {[string, string]} Named what, and how much of it
 * @typedef {{name: string, shape: Vehicle, limits: string[], worth: Named[], built: Named[]}} Design the first is the published robot
 */

const kDesigned = "#0072b2", kPublished = "#d55e00";
const kOutlinePx = 300, kMarkPx = 16, kBar_m = 0.01;
const kNarrow_deg = 4;  // vertical field of the camera: it sees all robots from the same side
const kNamePx = 104;  // width of a label, which is four times as wide as high
const kBetween_m = 0.03;  // between the wing tips of neighbours
const kHigh_m = 0.16;  // of a robot with its name
const kWide = 640;  // px; a narrower view shows two robots at first

/**
 * Places of robots side by side, about 0.
 * @param {number} count
 * @param {number} apart_m
 * @returns {number[]}
 */
export function placesOf(count, apart_m) {
  return Array.from({length: count}, (_, k) => (k - (count - 1) / 2) * apart_m);
}

/**
 * The distance from which a camera sees a width and a height.
 * @param {number} wide_m
 * @param {number} high_m
 * @param {number} aspect width of the picture over its height
 * @param {number} field_deg from the lower to the upper edge
 * @returns {number}
 */
export function distanceTo(wide_m, high_m, aspect, field_deg) {
  return Math.max(high_m, wide_m / aspect) / 2 / Math.tan(field_deg * Math.PI / 360);
}

/**
 * The outline of a wing as an SVG path: outward to the right, the leading edge above.
 * @param {Side} side
 * @param {number} px_per_m
 * @returns {string}
 */
export function outlinePath(side, px_per_m) {
  const first = side.outline_m[0], points = [[first[0], 0], [spanOf(side), 0], ...[...side.outline_m].reverse()];
  return `M${points.map((p) => p.map((v) => (v * px_per_m).toFixed(1)).join(" ")).join("L")}Z`;
}

/**
 * The wing of a design, and the published one's dashed.
 * @param {Design} design
 * @param {Design} published
 * @param {number[]} most_m span and chord of the largest wing of all, for a common scale
 * @returns {SVGElement}
 */
function outlineElement(design, published, most_m) {
  const scale = (kOutlinePx - 2) / most_m[0], high = most_m[1] * scale, bar = kBar_m * scale;
  const path = (/** @type {Design} */ one, /** @type {Record<string, string>} */ ink) =>
    drawn("path", {d: outlinePath(/** @type {Side} */ (one.shape.left), scale), ...ink});
  const is = design === published ? [] : [path(design, {fill: "#dfe9f2", stroke: kDesigned, "stroke-width": "2"})];
  return drawn("svg", {viewBox: `-1 -2 ${kOutlinePx} ${(high + kMarkPx + 12).toFixed(1)}`, role: "img",
    "aria-label": `wing of ${design.name}, the published one's dashed`}, ...is,
  path(published, {fill: "none", stroke: kPublished, "stroke-width": "1.6", "stroke-dasharray": "6 4"}),
  drawn("path", {d: `M0 0H${(/** @type {Side} */ (design.shape.left).outline_m[0][0] * scale).toFixed(1)}`, stroke: "#24292f", "stroke-width": "3"}),
  drawn("path", {d: `M${kOutlinePx - 4 - bar} ${high + kMarkPx}h${bar}`, stroke: "#24292f", "stroke-width": "2"}),
  drawn("text", {x: kOutlinePx - 10 - bar, y: high + kMarkPx + 4, "text-anchor": "end"}, "10 mm"));
}

/**
 * What a design is worth and how it is built; strong is what differs from the published robot.
 * @param {Design} design
 * @param {Design} published
 * @returns {HTMLElement}
 */
function comparison(design, published) {
  const names = [design.name, ...(design === published ? [] : [published.name])];
  const part = (/** @type {string} */ title, /** @type {"worth" | "built"} */ what) => element("tbody", {},
    element("tr", {class: "head"}, ...[title, ...names].map((name) => element("th", {scope: "col"}, name))),
    ...design[what].map(([name, text], k) => {
      const was = published[what][k][1], cells = design === published ? [text] : [text, was];
      return element("tr", {}, element("th", {scope: "row"}, name),
        ...cells.map((cell, at) => element("td", {class: at === 0 && text !== was ? "strong" : "number"}, cell)));
    }));
  return element("table", {}, part("verified", "worth"), part("built with", "built"));
}

export class Designs {
  /** @param {{robots: Design[], note: string}} block */
  constructor(block) {
    this.robots = block.robots;
    this.yaw = 0.45;
    this.zoom = 1;
    /** @type {number | null} the one beside the published; null: all */
    this.chosen = null;
    /** @type {Stage | null} */
    this.stage = null;
    const [published] = this.robots;
    this.view = element("div", {class: "view", tabindex: "0", role: "application",
      "aria-label": `The robots in 3D: ${this.robots.map((one) => one.name).join(", ")}; W A S D turn them, + and \u2212 zoom`});
    this.buttons = [null, ...this.robots.keys()].filter((k) => k !== 0).map((k) => {
      const made = element("button", {type: "button"}, k === null ? "all" : this.robots[k].name);
      made.addEventListener("click", () => this.choose(k));
      return {k, made};
    });
    const winged = this.robots.filter((one) => one.shape.left);
    const most_m = [0, 1].map((k) => Math.max(...winged.flatMap((one) => /** @type {Side} */ (one.shape.left).outline_m.map((p) => p[k]))));
    this.cards = this.robots.map((design) => element("section", {},
      element("h4", {}, design.name),
      ...(design.shape.left && published.shape.left ? [outlineElement(design, published, most_m)] : []),
      element("p", {}, element("b", {}, "Limited by: "), design.limits.length > 0 ? design.limits.join("; ") : "no range and no limit", "."),
      comparison(design, published)));
    this.element = element("figure", {class: "designs wide"},
      ...this.robots.length < 2 ? [] : [element("div", {class: "controls"}, element("div", {role: "group", "aria-label": "robots shown"}, "Show beside the published robot: ",
        ...this.buttons.map(({made}) => made)))],
      this.view, element("figcaption", {}, block.note), element("div", {class: "cards"}, ...this.cards));
    const turn = this.turn.bind(this), keys = turningKeys(turn);
    turnByMouse(this.view, turn);
    this.view.addEventListener("keydown", (event) => {
      const key = keys[event.key.toLowerCase()];
      if (!key || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      key();
    });
  }

  /** Call it once the element is in the page. */
  start() {
    try {
      this.stage = new Stage(this.view);
      this.stage.elevation = 0.3;
      this.stage.camera.fov = kNarrow_deg;
    } catch {
      this.view.replaceChildren(element("p", {class: "note"}, "This browser draws no WebGL: the robots are shown by their wings' outlines alone."));
    }
    const {stage} = this;
    if (stage) {
      this.drawn = this.robots.map(({name, shape}, k) => {
        const colour = k === 0 ? kPublished : kDesigned, robot = new Robot(shape, colour), text = label(name, "#24292f");
        stage.scene.add(robot.group, text);
        return {robot, text};
      });
    }
    this.choose(this.robots.length === 2 || this.view.clientWidth < kWide && this.robots.length > 1 ? 1 : null);
    new ResizeObserver(() => this.draw()).observe(this.view);
  }

  /** @param {number | null} k a design, shown beside the published one; null: all */
  choose(k) {
    this.chosen = k;
    this.zoom = 1;
    for (const one of this.buttons) one.made.setAttribute("aria-pressed", String(one.k === k));
    this.cards.forEach((card, at) => card.classList.toggle("chosen", at === k));
    this.draw();
  }

  /**
   * Turns each robot where it is.
   * @param {number} azimuth_rad of the camera
   * @param {number} elevation_rad of the camera
   * @param {number} zoom factor of the distance
   */
  turn(azimuth_rad, elevation_rad, zoom = 1) {
    this.yaw -= azimuth_rad;
    this.zoom = Math.min(4, Math.max(0.2, this.zoom * zoom));
    this.stage?.turn(0, elevation_rad);
    this.draw();
  }

  draw() {
    const {stage} = this;
    if (!stage) return;
    stage.resize();
    const shown = this.chosen === null ? [...this.robots.keys()] : [0, this.chosen];
    const reach_m = Math.max(...this.robots.map(({shape}) => shape.left ? spanOf(shape.left) + Math.abs(shape.left.shoulder_m[1]) : Math.max(...shape.body_m ?? [])));
    const apart_m = 2 * reach_m + kBetween_m, places = placesOf(shown.length, apart_m), size = reach_m / 0.084;
    stage.distance = this.zoom * (distanceTo(apart_m * shown.length, kHigh_m * size, stage.camera.aspect, kNarrow_deg) + reach_m);
    stage.target = [0, 0, -0.018 * size];
    const px_per_m = this.view.clientHeight / 2 / Math.tan(kNarrow_deg * Math.PI / 360) / stage.distance;
    const wide = Math.min(kNamePx, apart_m * px_per_m) / px_per_m / stage.distance;  // labels are so wide at a distance of 1
    this.drawn?.forEach(({robot, text}, k) => {
      const at = shown.indexOf(k);
      robot.group.visible = text.visible = at >= 0;
      if (at < 0) return;
      const still = [0, 0, 0];
      robot.show({position: [0, places[at], 0], attitude: [Math.cos(this.yaw / 2), 0, 0, Math.sin(this.yaw / 2)], wings: [0, 0, 0, 0], velocity: still, force: still});
      text.position.set(0, places[at], -0.066 * size);
      text.scale.set(wide, wide / 4, 1);
    });
    stage.render();
  }
}
