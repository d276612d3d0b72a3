// The bytes of the drawing, and which ink was made from which of them.

/** Bytes shown before and after the place. */
const AROUND = 700;

export class Source {
  /**
   * @param {any} meta @param {Map<string, Float64Array>} numbers @param {Map<string, Uint8Array>} texts
   */
  constructor(meta, numbers, texts) {
    this.files = meta.files;
    this.text = texts.get("source") ?? null;
    const none = new Float64Array(0);
    this.rows = numbers.get("piece_row") ?? none;
    this.starts = numbers.get("piece_start") ?? none;
    this.lengths = numbers.get("piece_length") ?? none;
  }

  get isKnown() {
    return this.rows.length > 0;
  }

  /** The piece that holds at a row: the last that starts at or before it; -1 if none. @param {number} row */
  pieceAt(row) {
    let low = 0;
    let high = this.rows.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.rows[middle] <= row) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** The piece whose bytes hold a byte, or else the one that starts nearest to it; -1 if none. @param {number} byte */
  pieceOf(byte) {
    let best = -1;
    let least = Infinity;
    for (let k = 0; k < this.starts.length; k++) {
      const [start, end] = [this.starts[k], this.starts[k] + this.lengths[k]];
      const inside = byte >= start && byte < end;
      // Of pieces that hold the byte, the shortest: it names the ink most exactly.
      const distance = inside ? this.lengths[k] * 1e-9 : byte < start ? start - byte : byte - end + 1;
      if (distance < least) {
        least = distance;
        best = k;
      }
    }
    return best;
  }

  /** The file of a byte and the byte's number there. @param {number} byte @returns {{file: any, offset: number} | null} */
  locate(byte) {
    let offset = 0;
    for (const file of this.files) {
      if (byte < offset + file.bytes || file === this.files[this.files.length - 1]) return { file, offset };
      offset += file.bytes;
    }
    return null;
  }

  /** Shows bytes `start` to `end` marked, with what stands around them. @param {HTMLElement} box @param {number} start @param {number} end */
  show(box, start, end) {
    const place = this.locate(start);
    if (!this.text || !place) return;
    const { file, offset } = place;
    const limit = offset + file.bytes;
    let from = Math.max(start - AROUND, offset);
    let to = Math.min(end + AROUND, limit);
    if (file.is_utf8) {
      while (from > offset && (this.text[from] & 0xc0) === 0x80) from--;
      while (to < limit && (this.text[to] & 0xc0) === 0x80) to++;
    }
    const cut = (/** @type {number} */ a, /** @type {number} */ b) => this.decode(this.text?.subarray(a, b) ?? new Uint8Array(), file.is_utf8);
    const mark = document.createElement("mark");
    mark.textContent = cut(start, Math.max(end, start));
    const [before, after] = [cut(from, start), cut(end, to)];
    box.replaceChildren(from > offset ? `\u2026${before}` : before, mark, to < limit ? `${after}\u2026` : after);
    this.shown = { from, cutBefore: from > offset, isUtf8: file.is_utf8, box, mark };
    this.reveal();
  }

  /** Scrolls the box to the mark, once it is visible: the page itself must not jump. */
  reveal() {
    if (!this.shown) return;
    const { box, mark } = this.shown;
    const above = mark.getBoundingClientRect().top - box.getBoundingClientRect().top;
    box.scrollTop = Math.max(box.scrollTop + above - 60, 0);
  }

  /** The byte of the text that was clicked in the box; null outside. @param {HTMLElement} box @param {MouseEvent} event */
  byteOfClick(box, event) {
    const caret = /** @type {any} */ (document).caretPositionFromPoint
      ? /** @type {any} */ (document).caretPositionFromPoint(event.clientX, event.clientY)
      : null;
    const range = caret ? null : document.caretRangeFromPoint?.(event.clientX, event.clientY);
    const node = caret?.offsetNode ?? range?.startContainer;
    if (!node || !box.contains(node) || !this.shown) return null;
    const before = document.createRange();
    before.setStart(box, 0);
    before.setEnd(node, caret?.offset ?? range?.startOffset ?? 0);
    let text = before.toString();
    if (this.shown.cutBefore) text = text.slice(1);
    const bytes = this.shown.isUtf8 ? new TextEncoder().encode(text).length : text.length;
    return this.shown.from + bytes;
  }

  /** Bytes as text; control characters get their pictures. @param {Uint8Array} bytes @param {boolean} isUtf8 */
  decode(bytes, isUtf8) {
    let text = "";
    if (isUtf8) text = new TextDecoder().decode(bytes);
    else for (const byte of bytes) text += String.fromCharCode(byte);
    return text.replace(/[\u0000-\u0008\u000b-\u001f]/g, (char) => (isUtf8 ? "\ufffd" : String.fromCharCode(0x2400 + char.charCodeAt(0))));
  }

  /** Line and column of a byte, from 1. @param {number} byte @param {number} offset where its file begins */
  lineColumn(byte, offset) {
    if (!this.text) return null;
    let line = 1;
    let start = offset;
    for (let k = offset; k < byte; k++) {
      if (this.text[k] === 10) {
        line++;
        start = k + 1;
      }
    }
    return { line, column: byte - start + 1, lines: line };
  }
}
