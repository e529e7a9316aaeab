// Draws the watched flapper and its recent path in 3D: the shipped hummingbird, as telemetry does not tell the vehicle.
import {kHummingbird} from "./geometry.js";
import {Scene} from "./scene.js";

/**
 * @typedef {{source: string, t_s: number, position_m: number[], q_WB: number[], v_WB_W_m_s: number[]}} State
 */

const kPlace = {ground_z_m: -1e3, ceiling_z_m: 1e3, walls: []};
const kColour = "#0072b2", kPoints = 400, kRoom_m = 0.4;

export class LiveView {
  /** @param {HTMLElement} frame */
  constructor(frame) {
    this.frame = frame;
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {number[][]} */
    this.path = [];
    this.source = "";
    new ResizeObserver(() => this.scene?.resize()).observe(frame);
  }

  /** @param {State} state */
  show(state) {
    const at = state.position_m, left = this.scene && this.scene.low.some((low, k) => at[k] < low - kRoom_m || at[k] > this.scene.high[k] + kRoom_m);
    if (state.source !== this.source || left) this.begin(state);
    if (!this.scene) return;
    this.path.push(at);
    if (this.path.length > kPoints) this.path.shift();
    if (this.path.length > 1) this.scene.retrace(0, this.path, kColour);
    this.scene.draw([{position: at, attitude: state.q_WB, wings: [0, 0, 0, 0], velocity: state.v_WB_W_m_s, force: [0, 0, 0]}], [1],
      {trail: true, arrows: true});
  }

  /**
   * Makes a new scene around the flapper, because the source changed or the flapper left the grid.
   * @param {State} state
   */
  begin(state) {
    if (state.source !== this.source) this.path = [];
    this.source = state.source;
    const corners = [-kRoom_m, kRoom_m].map((reach) => state.position_m.map((value, k) => value + (k < 2 ? reach : 0)));
    this.frame.replaceChildren();
    this.scene?.renderer.dispose();
    try {
      this.scene = new Scene(this.frame, [{vehicle: kHummingbird, colour: kColour, path: corners}], kPlace, null);
    } catch {
      this.scene = null;  // no WebGL: only the numbers are shown
    }
  }
}
