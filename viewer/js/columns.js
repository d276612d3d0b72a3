// The table of a plan as it stands in the page: for each column zigzag LEB128 varints of its
// differences, all columns deflated together (zlib), in base64. `viewer/src/columns.rs` writes it.

/**
 * @typedef {object} Column
 * @property {string} name
 * @property {number} count  values
 * @property {number} order  how often differences were taken
 * @property {number} bytes  length of its varints; for text its length
 */

/** The bytes of base64 text, inflated. @param {string} base64 @returns {Promise<Uint8Array>} */
export async function inflate(base64) {
  const text = atob(base64.trim());
  const packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * The values of a column, whole numbers up to 2^53.
 * @param {Uint8Array} bytes @param {number} start where its varints begin @param {Column} column
 */
export function values(bytes, start, { count, order }) {
  const result = new Float64Array(count);
  let at = start;
  for (let k = 0; k < count; k++) {
    let byte = bytes[at++];
    let value = byte & 127;
    let weight = 128;
    while (byte > 127) {
      byte = bytes[at++];
      value += (byte & 127) * weight;
      weight *= 128;
    }
    // Zigzag: 0, -1, 1, -2, 2, ...
    if (value < 2 ** 31) {
      result[k] = (value >> 1) ^ -(value & 1);
    } else {
      const half = Math.floor(value / 2);
      result[k] = value % 2 === 0 ? half : -half - 1;
    }
  }
  for (let pass = 0; pass < order; pass++) {
    for (let k = 1; k < count; k++) result[k] += result[k - 1];
  }
  return result;
}

/**
 * All columns by name.
 * @param {Uint8Array} bytes @param {Column[]} columns
 * @returns {{numbers: Map<string, Float64Array>, texts: Map<string, Uint8Array>}}
 */
export function unpack(bytes, columns) {
  const numbers = new Map();
  const texts = new Map();
  let start = 0;
  for (const column of columns) {
    if (column.count < 0) texts.set(column.name, bytes.subarray(start, start + column.bytes));
    else numbers.set(column.name, values(bytes, start, column));
    start += column.bytes;
  }
  return { numbers, texts };
}
