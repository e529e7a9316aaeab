// Sampled functions of time: the sample at a time, interpolation, and thinning to what a screen can show.

/**
 * The last sample at or before `t`; 0 before the first.
 * @param {ArrayLike<number>} times ascending
 * @param {number} t
 * @returns {number}
 */
export function placeOf(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * Linear interpolation between samples; the first and last value hold beyond the ends.
 * @param {ArrayLike<number>} times
 * @param {ArrayLike<number>} values
 * @param {number} t
 * @returns {number}
 */
export function valueAt(times, values, t) {
  const i = placeOf(times, t), k = Math.min(i + 1, times.length - 1);
  if (k === i || t <= times[i]) return values[i];
  return values[i] + (values[k] - values[i]) * Math.min(1, (t - times[i]) / (times[k] - times[i]));
}

/**
 * The points between two times, at most two for each bucket: its smallest and its largest value in their order,
 * so that no peak is lost. Includes one sample beyond each end, so that lines reach the edges of the picture.
 * @param {ArrayLike<number>} times
 * @param {ArrayLike<number>} values
 * @param {number} begin
 * @param {number} end
 * @param {number} buckets
 * @returns {{x: number, y: number}[]}
 */
export function visiblePoints(times, values, begin, end, buckets) {
  const first = placeOf(times, begin), last = Math.min(times.length - 1, placeOf(times, end) + 1);
  const points = [];
  if (last - first <= 2 * buckets) {
    for (let i = first; i <= last; i++) points.push({x: times[i], y: values[i]});
    return points;
  }
  for (let b = 0; b < buckets; b++) {
    const from = first + Math.floor((last - first + 1) * b / buckets), to = first + Math.floor((last - first + 1) * (b + 1) / buckets);
    let low = from, high = from;
    for (let i = from + 1; i < to; i++) {
      if (values[i] < values[low]) low = i;
      if (values[i] > values[high]) high = i;
    }
    const [one, other] = low < high ? [low, high] : [high, low];
    points.push({x: times[one], y: values[one]});
    if (other !== one) points.push({x: times[other], y: values[other]});
  }
  return points;
}

/**
 * Cumulative sums: the sum of all values before each sample, for means over any stretch.
 * @param {ArrayLike<number>} values
 * @returns {Float64Array} one longer than `values`
 */
export function runningSums(values) {
  const sums = new Float64Array(values.length + 1);
  for (let i = 0; i < values.length; i++) sums[i + 1] = sums[i] + values[i];
  return sums;
}

/**
 * Mean of the samples between two times; the last sample before them where there is none between.
 * @param {ArrayLike<number>} times
 * @param {Float64Array} sums
 * @param {number} begin
 * @param {number} end
 * @returns {number}
 */
export function meanBetween(times, sums, begin, end) {
  const last = placeOf(times, end), first = Math.min(last, placeOf(times, begin) + (times[0] < begin ? 1 : 0));
  return (sums[last + 1] - sums[first]) / (last + 1 - first);
}

/**
 * Makes angles continuous beyond half a turn.
 * @param {Float64Array} angles
 * @returns {Float64Array}
 */
export function unwrapped(angles) {
  const on = Float64Array.from(angles);
  for (let i = 1; i < on.length; i++) on[i] -= 2 * Math.PI * Math.round((on[i] - on[i - 1]) / (2 * Math.PI));
  return on;
}
