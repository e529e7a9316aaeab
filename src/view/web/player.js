// The player of a page's flights: the robots in 3D, their streams next to them, and the controls of both.
import {element, shortNumber} from "./dom.js";
import {Flight, kBlue, kGreen, kPurple, kVermillion} from "./flight.js";
import {Scene, turnByMouse, turningKeys} from "./scene.js";
import {Timeline} from "./timeline.js";

/**
 * @typedef {import("./flight.js").FlightJson} FlightJson
 * @typedef {import("./scene.js").View} View
 */

const kColours = [kBlue, kVermillion, kGreen, kPurple];
const kMoments = 8;
const kTrailPoints = 1500;
const kSpeeds = [["real time", 1], ["1/4", 0.25], ["1/10", 0.1], ["1/50", 0.02], ["1/200", 0.005]];
const kViews = [["chase", "chase"], ["free", "free"], ["front", "front"], ["side", "side"], ["top", "top"]];

/** @param {string} step @returns {string} */
function keysOf(step) {
  return `space plays, arrows step by a twentieth of ${step} (with Shift by ${step}), W A S D turn the camera, + and \u2212 zoom, C changes it`;
}

/**
 * @param {[string, string | number][]} options
 * @param {string} label
 * @param {(value: string) => void} change
 * @returns {HTMLElement}
 */
function choice(options, label, change) {
  const box = /** @type {HTMLSelectElement} */ (element("select", {}, ...options.map(([name, value]) => element("option", {value: String(value)}, name))));
  box.addEventListener("change", () => change(box.value));
  return element("label", {}, `${label} `, box);
}

/**
 * @param {string} name
 * @param {boolean} on
 * @param {(on: boolean) => void} change
 * @returns {HTMLElement}
 */
function toggle(name, on, change) {
  const box = /** @type {HTMLInputElement} */ (element("input", {type: "checkbox"}));
  box.checked = on;
  box.addEventListener("change", () => change(box.checked));
  return element("label", {}, box, name);
}

export class Player {
  /**
   * @param {{goal_m: number[] | null, flights: FlightJson[]}} block
   * @param {Uint8Array} bytes
   */
  constructor(block, bytes) {
    this.flights = block.flights.map((json) => new Flight(json, bytes));
    this.goal_m = block.goal_m;
    this.duration_s = Math.max(...this.flights.map((flight) => flight.duration_s));
    this.beats = this.flights[0].json.flapping_Hz > 0;
    this.beat_s = this.flights[0].beat_s;
    this.keys = keysOf(this.beats ? "a beat" : `${this.beat_s} s`);
    this.now_s = 0;
    this.speed = 1;
    this.playing = false;
    this.shown = {trail: true, arrows: true};
    this.flying = this.flights.map(() => true);
    /** @type {Scene | null} */
    this.scene = null;
    this.view = element("div", {class: "view", tabindex: "0", role: "application", "aria-label": `The flight in 3D; ${this.keys}`});
    this.readout = element("p", {class: "readout"});
    this.slider = /** @type {HTMLInputElement} */ (element("input", {type: "range", min: "0", max: String(this.duration_s), step: "any", value: "0",
      "aria-label": "time, s"}));
    this.button = element("button", {type: "button", class: "play"}, "▶ Play");
    this.views = choice(/** @type {[string, string][]} */ (kViews), "Camera", (name) => this.look(/** @type {View} */ (name)));
    const panels = this.flights.map((flight) => flight.panels());
    this.timeline = new Timeline(panels[0], panels[1] ?? null, this.duration_s, (t_s) => this.seek(t_s));
    this.element = this.build();
  }

  build() {
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.button.addEventListener("click", () => this.play(!this.playing));
    const step = (/** @type {string} */ text, /** @type {string} */ label, /** @type {number} */ beats) => {
      const made = element("button", {type: "button", "aria-label": label}, text);
      made.addEventListener("click", () => this.seek(this.now_s + beats * this.beat_s));
      return made;
    };
    const [short, long] = this.beats ? ["beat", "one beat"] : [`${this.beat_s} s`, `${this.beat_s} s`];
    const of_beats = this.beats ? [["5 beats", 5 * this.beat_s], ["1 beat", this.beat_s]] : [];
    const windows = /** @type {[string, number][]} */ ([["whole flight", this.duration_s], ["10 s", 10], ["1 s", 1], ...of_beats]
      .filter(([, length], k) => k === 0 || Number(length) < this.duration_s));
    const ghosts = this.flights.length < 2 ? [] : this.flights.map((flight, k) => {
      const made = toggle(flight.json.name, true, (on) => { this.flying[k] = on; this.draw(); });
      made.prepend(element("span", {class: "swatch", style: `--colour: ${kColours[k % kColours.length]}`}));
      return made;
    });
    const controls = element("div", {class: "controls"},
      element("div", {}, this.button, step(`◂ ${short}`, `${long} back`, -1), step(`${short} ▸`, `${long} on`, 1),
        choice(/** @type {[string, number][]} */ (kSpeeds), "Speed", (value) => { this.speed = Number(value); }),
        choice(windows, "Show", (length) => this.timeline.show(Number(length)))),
      this.slider,
      element("div", {}, this.views, toggle("trail", true, (on) => { this.shown.trail = on; this.draw(); }),
        toggle("arrows", true, (on) => { this.shown.arrows = on; this.draw(); }),
        toggle("moments", false, (on) => this.showMoments(on)), ...ghosts));
    this.steer(this.view);
    const notes = this.notes().map((note) => element("p", {class: "note"}, note));
    return element("div", {class: "player"}, element("div", {class: "stage"}, this.view, this.readout, controls, ...notes,
      element("p", {class: "note"}, `In the view: ${this.keys}.`)), this.timeline.element);
  }

  /**
   * Shows the watched robot at equally spaced times of the visible window, all at once.
   * @param {boolean} on
   * @param {number} count
   */
  showMoments(on, count = kMoments) {
    const {begin_s, end_s} = this.timeline, flight = this.flights[0];
    const times = on ? Array.from({length: count}, (_, k) => begin_s + (end_s - begin_s) * k / (count - 1)) : [];
    this.scene?.showMoments(times.map((t_s) => ({position: flight.positionAt(t_s), attitude: flight.attitudeAt(t_s), wings: flight.wingsAt(t_s),
      velocity: [0, 0, 0], force: [0, 0, 0]})));
    this.draw();
  }

  notes() {
    const list = [];
    const json = this.flights[0].json;
    if (json.wings === "derived")
      list.push("No wings were recorded: strokes and rotations are what the recorded voltages make of the vehicle's wings.");
    if (json.wings === "still") list.push("Neither wings nor voltages were recorded: the wings are drawn still.");
    if (json.wings === "none")
      list.push("The vehicle's file has no modelled wings, and none are drawn: the body is the ellipsoid of its mass and inertia, its nose forward, "
        + "and the force is that of the path that motion capture saw, up to the file's bandwidth.");
    if (this.flights.length > 1) list.push(`Solid lines: ${json.name}. Dashed lines: ${this.flights[1].json.name}. Each begins at its own first pose.`);
    list.push(...this.flights.flatMap((flight) => flight.json.notes.map((note) => `${flight.json.name}: ${note}.`)));
    return list;
  }

  /** Call it once the element is in the page. */
  start() {
    const place = this.flights[0].json.ambient;
    const robots = this.flights.map((flight, k) => ({vehicle: flight.json.vehicle, colour: kColours[k % kColours.length], path: this.pathOf(flight)}));
    try {
      this.scene = new Scene(this.view, robots, place, this.goal_m);
    } catch {
      this.view.append(element("p", {class: "note"}, "This browser draws no WebGL: the flight is shown by its plots alone."));
    }
    this.timeline.show(this.duration_s);
    this.seek(0);
    new ResizeObserver(() => {
      this.scene?.resize();
      this.draw();
    }).observe(this.view);
  }

  /** @param {Flight} flight @returns {number[][]} positions at equal steps of time */
  pathOf(flight) {
    const count = Math.min(kTrailPoints, Math.max(16, Math.round(flight.duration_s * 150)));
    return Array.from({length: count + 1}, (_, k) => flight.positionAt(flight.duration_s * k / count));
  }

  /** @param {View} name */
  look(name) {
    /** @type {HTMLSelectElement} */ (this.views.querySelector("select")).value = name;
    this.scene?.look(name);
    this.draw();
  }

  /** @param {number} t_s */
  seek(t_s) {
    this.now_s = Math.min(this.duration_s, Math.max(0, t_s));
    this.slider.value = String(this.now_s);
    this.slider.setAttribute("aria-valuetext", `${this.now_s.toFixed(3)} s`);
    this.timeline.mark(this.now_s);
    this.draw();
  }

  draw() {
    const poses = this.flights.map((flight, k) => !this.flying[k] ? null : {
      position: flight.positionAt(this.now_s), attitude: flight.attitudeAt(this.now_s), wings: flight.wingsAt(this.now_s),
      velocity: k === 0 ? flight.velocityAt(this.now_s) : [0, 0, 0], force: (k === 0 ? flight.forceAt(this.now_s) : null) ?? [0, 0, 0]});
    this.scene?.draw(poses, this.flights.map((flight) => Math.min(1, this.now_s / flight.duration_s)), this.shown);
    const flight = this.flights[0], speed = Math.hypot(...flight.velocityAt(this.now_s)), vector = flight.forceAt(this.now_s);
    const force = vector ? Math.hypot(...vector) : NaN, weights = force / (flight.json.vehicle.mass_kg * flight.json.gravity_m_s2);
    const kind = flight.streams.path ? "of the path" : "mean of a beat";
    this.readout.replaceChildren(element("b", {}, `${this.now_s.toFixed(3)} s`), this.beats ? ` beat ${(this.now_s / this.beat_s).toFixed(2)} ` : " ",
      element("span", {class: "key"}, element("span", {class: "swatch", style: "--colour: #009e73"}), `velocity ${shortNumber(speed)} m/s`), " ",
      ...vector ? [element("span", {class: "key"}, element("span", {class: "swatch", style: "--colour: #d55e00"}),
        `force ${shortNumber(1000 * force)} mN, ${weights.toFixed(2)} weights, ${kind}`)] : []);
  }

  /** @param {boolean} on */
  play(on) {
    this.playing = on;
    this.button.textContent = on ? "❚❚ Pause" : "▶ Play";
    if (!on) return;
    if (this.now_s >= this.duration_s) this.seek(0);
    let before = performance.now();
    const frame = (/** @type {number} */ now) => {
      if (!this.playing) return;
      this.seek(this.now_s + this.speed * Math.min(0.1, (now - before) / 1000));
      before = now;
      if (this.now_s >= this.duration_s) this.play(false);
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  /** @param {HTMLElement} view element that takes keys and the mouse */
  steer(view) {
    const turn = this.turn.bind(this);
    view.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const beats = event.shiftKey ? 1 : 0.05;
      /** @type {Record<string, () => void>} */
      const keys = {
        " ": () => this.play(!this.playing), ArrowLeft: () => this.seek(this.now_s - beats * this.beat_s),
        ArrowRight: () => this.seek(this.now_s + beats * this.beat_s), Home: () => this.seek(0), End: () => this.seek(this.duration_s),
        ...turningKeys(turn),
        c: () => this.look(/** @type {View} */ (kViews[(kViews.findIndex(([, name]) => name === this.scene?.view) + 1) % kViews.length][1])),
      };
      const key = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!key) return;
      event.preventDefault();
      key();
    });
    turnByMouse(view, turn);
  }

  /** @param {number} azimuth_rad @param {number} elevation_rad @param {number} zoom */
  turn(azimuth_rad, elevation_rad, zoom = 1) {
    this.scene?.turn(azimuth_rad, elevation_rad, zoom);
    this.draw();
  }
}
