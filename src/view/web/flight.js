// One recorded flight: its streams by the instants of their samples, and the robot's state at any time.
import {unpackedColumn} from "./packing.js";
import {anglesOf, betweenAttitudes, rotated} from "./geometry.js";
import {meanBetween, placeOf, runningSums, unwrapped, valueAt} from "./series.js";

/**
 * @typedef {import("./packing.js").Packed} Packed
 * @typedef {import("./geometry.js").Vehicle} Vehicle
 * @typedef {{ground_z_m: number, ceiling_z_m: number, walls: number[][], spheres?: number[][], boxes?: number[][], cylinders?: number[][]}} Ambient
 * @typedef {{name: string, declared: string, flapping_Hz: number, gravity_m_s2: number, vehicle: Vehicle, ambient: Ambient,
 *   wings: string, latency_s: Record<string, number>, streams: Record<string, Record<string, Packed>>,
 *   swapped: {begin_s: Packed, end_s: Packed} | null, notes: string[]}} FlightJson
 * @typedef {{name: string, colour: string, times: Float64Array, values: Float64Array}} Line
 * @typedef {{id: string, title: string, unit: string, shown: boolean, lines: Line[], left_out?: number[][]}} Panel left_out: from when to when
 */

const kDegrees = 180 / Math.PI;
const kVelocityOver_s = 0.02, kStep_s = 0.1;
const kInputsOfAPlot = 6;
export const kBlue = "#0072b2", kVermillion = "#d55e00", kGreen = "#009e73", kPurple = "#cc79a7";

export class Flight {
  /**
   * @param {FlightJson} json
   * @param {Uint8Array} bytes
   */
  constructor(json, bytes) {
    this.json = json;
    /** @type {Record<string, Record<string, Float64Array>>} */
    this.streams = {};
    for (const [stream, columns] of Object.entries(json.streams)) {
      /** @type {Record<string, Float64Array>} */
      const own = {};
      for (const [name, packed] of Object.entries(columns)) own[name] = unpackedColumn(bytes, packed);
      this.streams[stream] = own;
    }
    // the page's time starts at the first pose; it is the time of the instant, not of the arrival
    const begin = this.streams.mocap.t_s[0] - (json.latency_s.mocap ?? 0);
    for (const [stream, columns] of Object.entries(this.streams)) {
      const shift = begin + (json.latency_s[stream] ?? 0);
      columns.t_s = columns.t_s.map((t) => t - shift);
    }
    const arrival = begin + (json.latency_s.mocap ?? 0);
    const [from, to] = json.swapped ? [json.swapped.begin_s, json.swapped.end_s].map((packed) => unpackedColumn(bytes, packed)) : [[], []];
    /** Stretches of time without poses, because their markers were swapped. */
    this.swapped = Array.from(from, (t, k) => [t - arrival, to[k] - arrival]);
    const m = this.streams.mocap;
    this.duration_s = m.t_s[m.t_s.length - 1];
    /** The force of the path where there is one, because such a flight has no beat to average over. */
    this.forces = this.streams.path ?? this.streams.imu;
    this.sums = !this.forces ? [] : ["x", "y", "z"].map((axis) => runningSums(this.forces[`accel_${axis}_m_s2`]));
  }

  /** @param {number} t_s @returns {number[]} in W, m */
  positionAt(t_s) {
    const m = this.streams.mocap;
    return [m.x_m, m.y_m, m.z_m].map((values) => valueAt(m.t_s, values, t_s));
  }

  /** @param {number} t_s @returns {number[]} w, x, y, z */
  attitudeAt(t_s) {
    const m = this.streams.mocap, i = placeOf(m.t_s, t_s), k = Math.min(i + 1, m.t_s.length - 1);
    const share = k === i ? 0 : Math.min(1, Math.max(0, (t_s - m.t_s[i]) / (m.t_s[k] - m.t_s[i])));
    const of = (/** @type {number} */ at) => [m.qw[at], m.qx[at], m.qy[at], m.qz[at]];
    return betweenAttitudes(of(i), of(k), share);
  }

  /** @param {number} t_s @returns {number[]} in W, m/s: the path's mean over 40 ms */
  velocityAt(t_s) {
    const begin = Math.max(0, t_s - kVelocityOver_s), end = Math.min(this.duration_s, t_s + kVelocityOver_s);
    const a = this.positionAt(begin), b = this.positionAt(end);
    return a.map((value, k) => (b[k] - value) / Math.max(1e-9, end - begin));
  }

  /** @returns {number} the length of a beat, or of a step through a flight without beats */
  get beat_s() {
    return this.json.flapping_Hz > 0 ? 1 / this.json.flapping_Hz : kStep_s;
  }

  /** @param {number} t_s @returns {number[] | null} in W, N: mass times specific force, averaged over one beat; null: no stream has it */
  forceAt(t_s) {
    if (!this.forces) return null;
    const half = this.streams.path ? 0 : 0.5 * this.beat_s, times = this.forces.t_s;
    const mean = this.sums.map((sums) => meanBetween(times, sums, t_s - half, t_s + half) * this.json.vehicle.mass_kg);
    return rotated(this.attitudeAt(t_s), mean);
  }

  /** @param {number} t_s @returns {number[]} left stroke and rotation, right stroke and rotation, rad */
  wingsAt(t_s) {
    const w = this.streams.wings;
    return w ? [w.left_stroke_rad, w.left_rotation_rad, w.right_stroke_rad, w.right_rotation_rad].map((v) => valueAt(w.t_s, v, t_s))
      : [0, 0, 0, 0];
  }

  /** @returns {Panel[]} the plots over time */
  panels() {
    const s = this.streams, m = s.mocap;
    const angles = [new Float64Array(m.t_s.length), new Float64Array(m.t_s.length), new Float64Array(m.t_s.length)];
    for (let i = 0; i < m.t_s.length; i++) anglesOf([m.qw[i], m.qx[i], m.qy[i], m.qz[i]]).forEach((angle, k) => { angles[k][i] = angle; });
    const colours = [kBlue, kVermillion, kGreen, kPurple, "#000000", "#767676"];
    const panel = (/** @type {string} */ id, /** @type {string} */ title, /** @type {string} */ unit, /** @type {boolean} */ shown,
      /** @type {Float64Array} */ times, /** @type {[string, Float64Array | undefined][]} */ lines) => {
      const there = /** @type {[string, Float64Array][]} */ (lines.filter((line) => line[1] !== undefined));
      return {id, title, unit, shown, lines: there.map(([name, values], k) => ({name, colour: colours[k], times, values}))};
    };
    const degrees = (/** @type {Float64Array} */ list) => list.map((angle) => angle * kDegrees);
    /** @type {Panel[]} */
    const list = [
      panel("position", "Position", "m", true, m.t_s, [["x", m.x_m], ["y", m.y_m], ["z", m.z_m]]),
      panel("attitude", "Attitude", "deg", true, m.t_s,
        [["roll", degrees(unwrapped(angles[0]))], ["pitch", degrees(angles[1])], ["yaw", degrees(unwrapped(angles[2]))]]),
    ];
    if (s.path)
      list.push(panel("path", "Specific force of the path", "m/s²", true, s.path.t_s,
        [["x", s.path.accel_x_m_s2], ["y", s.path.accel_y_m_s2], ["z", s.path.accel_z_m_s2]]));
    if (s.imu) {
      list.push(panel("rate", "Body rate", "rad/s", false, s.imu.t_s,
        [["x", s.imu.gyro_x_rad_s], ["y", s.imu.gyro_y_rad_s], ["z", s.imu.gyro_z_rad_s]]));
      list.push(panel("force", "Specific force", "m/s²", false, s.imu.t_s,
        [["x", s.imu.accel_x_m_s2], ["y", s.imu.accel_y_m_s2], ["z", s.imu.accel_z_m_s2]]));
    }
    if (s.command) {
      const c = s.command;
      list.push(panel("inputs", "Inputs", "V", true, c.t_s, [["amplitude", c.amplitude_V], ["difference", c.difference_V], ["bias", c.bias_V]]));
      list.push(panel("split", "Split cycle", "% of a beat", false, c.t_s, [["split", c.split_cycle?.map((x) => 100 * x)]]));
      list.push(panel("voltages", "Voltages", "V", true, c.t_s, [["left", c.left_voltage_V], ["right", c.right_voltage_V]]));
    }
    const declared = Object.entries(s.declared ?? {}).filter(([name]) => name !== "t_s");
    for (let k = 0; k < declared.length; k += kInputsOfAPlot)
      list.push(panel(`declared_${k}`, k === 0 ? "Inputs" : `Inputs from ${k + 1} on`, "as declared", true, s.declared.t_s,
        declared.slice(k, k + kInputsOfAPlot).map(([name, values]) => [name.replaceAll("_", " "), values])));
    if (s.wings) {
      const w = s.wings;
      list.push(panel("strokes", "Strokes", "deg", true, w.t_s, [["left", degrees(w.left_stroke_rad)], ["right", degrees(w.right_stroke_rad)]]));
      list.push(panel("rotations", "Rotations", "deg", false, w.t_s, [["left", degrees(w.left_rotation_rad)], ["right", degrees(w.right_rotation_rad)]]));
    }
    if (s.power) {
      list.push(panel("battery", "Battery", "V", false, s.power.t_s, [["battery", s.power.battery_V]]));
      list.push(panel("currents", "Currents", "A", false, s.power.t_s, [["left", s.power.left_current_A], ["right", s.power.right_current_A]]));
    }
    if (s.loads) {
      const l = s.loads;
      list.push(panel("lift", "Lift and drag of the wings", "N", true, l.t_s,
        [["left lift", l.left_lift_N], ["left drag", l.left_drag_N], ["right lift", l.right_lift_N], ["right drag", l.right_drag_N]]));
      list.push(panel("wing_power", "Mechanical power of the wings", "W", true, l.t_s,
        [["left", l.left_mechanical_power_W], ["right", l.right_mechanical_power_W]]));
    }
    list.slice(0, 2).forEach((each) => { each.left_out = this.swapped; });
    return list.filter((each) => each.lines.length > 0);
  }
}
