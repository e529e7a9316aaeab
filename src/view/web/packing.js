// Unpacks columns of numbers that src/view/packing.hpp packed.

/**
 * The place of a column among the packed bytes.
 * @typedef {{at: number, count: number, step: number}} Packed
 */

/**
 * @param {string} text base64 of deflated bytes
 * @returns {Promise<Uint8Array>}
 */
export async function inflatedBytes(text) {
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * @param {Uint8Array} bytes all columns
 * @param {Packed} packed
 * @returns {Float64Array}
 */
export function unpackedColumn(bytes, packed) {
  const column = new Float64Array(packed.count);
  let at = packed.at, now = 0;
  for (let i = 0; i < packed.count; i++) {
    let byte = bytes[at++];
    let value = byte & 0x7f;
    // multiply, because shifts are limited to 32 bits
    for (let scale = 128; byte & 0x80; scale *= 128) {
      byte = bytes[at++];
      value += (byte & 0x7f) * scale;
    }
    now += value % 2 === 0 ? value / 2 : -(value + 1) / 2;
    column[i] = now * packed.step;
  }
  return column;
}
