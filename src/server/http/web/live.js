// The watched flapper in 3D, where it was and is. Telemetry says nothing of the vehicle: it is drawn as the shipped one.
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
   * A new scene about where the flapper is: another one, or it has left the grid.
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
      this.scene = null;  // no WebGL here: the numbers stay
    }
  }
}
