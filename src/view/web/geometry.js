// The robot's shape and turns. World W: z up. Body B: x forward, y left, z up. Quaternions w, x, y, z, body to world.

/**
 * @typedef {{shoulder_m: number[], wing_length_m: number, mean_chord_m: number, moments: number[]}} Side
 * @typedef {{name: string, mass_kg: number, left?: Side, right?: Side, body_m?: number[]}} Vehicle body_m: of one without modelled wings, the
 *   semi-axes of its ellipsoid
 */

/**
 * Chord over its mean at a share of the span, the quadratic function that has the planform's moments of order 0, 1 and 2
 * (about the root, over span and mean chord): none other is known of a vehicle's file. Of a straight taper it is exact.
 * @param {number[]} moments
 * @returns {(share: number) => number}
 */
export function chordOf(moments) {
  const [m0, m1, m2] = moments;
  // inverse of the Hilbert matrix of order 3
  const a = 9 * m0 - 36 * m1 + 30 * m2, b = -36 * m0 + 192 * m1 - 180 * m2, c = 30 * m0 - 180 * m1 + 180 * m2;
  return (share) => Math.max(0, a + b * share + c * share * share);
}

/**
 * Outline of a wing at stroke and rotation 0: pairs of span and chord in m, down the trailing edge from the root. Its tip is
 * rounded over the last part of the span.
 * @param {Side} side
 * @param {number} stations
 * @returns {number[][]}
 */
export function wingOutline(side, stations = 16) {
  const chord = chordOf(side.moments), kRoot = 0.05, kTip = 0.94;
  return Array.from({length: stations + 1}, (_, k) => {
    const share = kRoot + (1 - kRoot) * k / stations;
    const beyond = Math.max(0, (share - kTip) / (1 - kTip));
    return [share * side.wing_length_m, chord(share) * side.mean_chord_m * Math.sqrt(1 - beyond * beyond)];
  });
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
 * Between two attitudes, the short way.
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
