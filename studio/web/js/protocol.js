// Requests and answers as bytes: a line of JSON, then bytes (`studio/src/protocol.rs`).

/** @param {object} message @param {Uint8Array | null} bytes */
export function request(message, bytes) {
  const line = new TextEncoder().encode(`${JSON.stringify(message)}\n`);
  const packed = new Uint8Array(line.length + (bytes?.length ?? 0));
  packed.set(line);
  if (bytes) packed.set(bytes, line.length);
  return packed;
}

/** @param {Uint8Array<ArrayBuffer>} answer @returns {{json: any, bytes: Uint8Array<ArrayBuffer>}} */
export function split(answer) {
  const end = answer.indexOf(10);
  const json = JSON.parse(new TextDecoder().decode(answer.subarray(0, end)));
  // A copy, so that its buffer can be handed over.
  return { json, bytes: answer.slice(end + 1) };
}
