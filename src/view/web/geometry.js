// The robot's form and rotations. World W: z up. Body B: x forward, y left, z up. Quaternions are w, x, y, z, body to world.

/**
 * @typedef {{shoulder_m: number[], outline_m: number[][]}} Side outline_m: pairs of span and chord, down the trailing edge from the root
 * @typedef {{name: string, mass_kg: number, profile_m?: number[][], left?: Side, right?: Side, body_m?: number[]}} Vehicle profile_m: pairs of
 *   height and radius; body_m: semi-axes of the ellipsoid of a beat-averaged vehicle (src/view/shape.hpp)
 */

/**
 * The form of the shipped hummingbird, made by src/view/shape.cpp; drawn where the vehicle is unknown.
 * @type {Vehicle}
 */
export const kHummingbird = {"name": "hummingbird_nominal", "mass_kg": 0.0124481,
  "profile_m": [[-0.04, 0], [-0.03, 0.004], [-0.016, 0.009], [0, 0.0105], [0.012, 0.0085], [0.022, 0.0045], [0.026, 0.0062], [0.031, 0.0068],
    [0.036, 0.0048], [0.0375, 0]],
  "left": {"shoulder_m": [0, 0.01395, 0.0189913], "outline_m": [
    [0.0035, 0.026776], [0.007656, 0.026047], [0.011813, 0.025316], [0.015969, 0.024584], [0.020125, 0.023851], [0.024281, 0.023116],
    [0.028437, 0.02238], [0.032594, 0.021643], [0.03675, 0.020904], [0.040906, 0.020164], [0.045063, 0.019423], [0.049219, 0.01868],
    [0.053375, 0.017936], [0.057531, 0.017191], [0.061688, 0.016444], [0.065844, 0.015695], [0.07, 0]]},
  "right": {"shoulder_m": [0, -0.01395, 0.0189913], "outline_m": [
    [0.0035, 0.026776], [0.007656, 0.026047], [0.011813, 0.025316], [0.015969, 0.024584], [0.020125, 0.023851], [0.024281, 0.023116],
    [0.028437, 0.02238], [0.032594, 0.021643], [0.03675, 0.020904], [0.040906, 0.020164], [0.045063, 0.019423], [0.049219, 0.01868],
    [0.053375, 0.017936], [0.057531, 0.017191], [0.061688, 0.016444], [0.065844, 0.015695], [0.07, 0]]}};

/** @param {Side} side @returns {number} span, m */
export function spanOf(side) {
  return side.outline_m[side.outline_m.length - 1][0];
}

/**
 * A point of a wing in B. Stroke > 0 moves both wings backward, rotation > 0 turns the trailing edge backward.
 * @param {Side} side
 * @param {number} sign 1: left, -1: right
 * @param {number} stroke_rad
 * @param {number} rotation_rad
 * @param {number} span_m
 * @param {number} chord_m from the leading edge
 * @returns {number[]}
 */
export function wingPoint(side, sign, stroke_rad, rotation_rad, span_m, chord_m) {
  const x = -chord_m * Math.sin(rotation_rad), y = sign * span_m, z = -chord_m * Math.cos(rotation_rad);
  const c = Math.cos(sign * stroke_rad), s = Math.sin(sign * stroke_rad);
  const [sx, sy, sz] = side.shoulder_m;
  return [c * x - s * y + sx, s * x + c * y + sy, z + sz];
}

/**
 * @param {number[]} q
 * @param {number[]} v in B
 * @returns {number[]} in W
 */
export function rotated(q, v) {
  const [w, x, y, z] = q;
  const [a, b, c] = v;
  const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

/**
 * Roll, pitch and yaw in rad of R = Rz Ry Rx.
 * @param {number[]} q
 * @returns {number[]}
 */
export function anglesOf(q) {
  const [w, x, y, z] = q;
  return [Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(Math.min(1, Math.max(-1, 2 * (w * y - z * x)))),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))];
}

/**
 * Interpolates between two attitudes, the short way.
 * @param {number[]} a
 * @param {number[]} b
 * @param {number} share
 * @returns {number[]} of length 1
 */
export function betweenAttitudes(a, b, share) {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const q = a.map((value, k) => value + share * (sign * b[k] - value));
  const length = Math.hypot(...q);
  return q.map((value) => value / length);
}
