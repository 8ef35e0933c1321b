/** numpy's npz files: a ZIP archive of npy arrays (ZIP application note 6.3.9, numpy NEP 1). */

const DTYPES = {
  "<f8": Float64Array, "<f4": Float32Array, "<i8": BigInt64Array, "<i4": Int32Array, "<i2": Int16Array,
  "|i1": Int8Array, "|u1": Uint8Array, "|b1": Uint8Array, "<u4": Uint32Array,
};

/**
 * The arrays of an npz file.
 * @param {ArrayBuffer} buffer
 * @returns {Promise<Object<string, {shape: number[], values: ArrayLike}>>} row-major; text as an array of strings
 * @throws {Error} when it is no npz file, or holds something this does not read
 */
export async function readNpz(buffer) {
  const found = await Promise.all(
    entries(new DataView(buffer)).map(async ({ name, method, start, size }) => {
      const packed = new Uint8Array(buffer, start, size);
      return [name.replace(/\.npy$/, ""), npy(method === 0 ? packed.slice().buffer : await inflated(packed))];
    }),
  );
  return Object.fromEntries(found);
}

async function inflated(packed) {
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).arrayBuffer();
}

/** Of the central directory at the end, since sizes may stand only there. */
function entries(view) {
  let at = view.byteLength - 22;
  while (at >= 0 && view.getUint32(at, true) !== 0x06054b50) at -= 1;
  if (at < 0) throw new Error("not an npz file");
  const count = view.getUint16(at + 10, true);
  let place = view.getUint32(at + 16, true);
  const out = [];
  for (let i = 0; i < count; i += 1) {
    const [nameLength, extra, comment] = [28, 30, 32].map((offset) => view.getUint16(place + offset, true));
    const local = view.getUint32(place + 42, true);
    const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    out.push({
      name: new TextDecoder().decode(new Uint8Array(view.buffer, place + 46, nameLength)),
      method: view.getUint16(place + 10, true),
      size: view.getUint32(place + 20, true),
      start,
    });
    place += 46 + nameLength + extra + comment;
  }
  return out;
}

function npy(buffer) {
  const bytes = new Uint8Array(buffer);
  if (bytes[0] !== 0x93 || bytes[1] !== 0x4e) throw new Error("not an npy array");
  const wide = bytes[6] >= 2;
  const view = new DataView(buffer);
  const length = wide ? view.getUint32(8, true) : view.getUint16(8, true);
  const begin = (wide ? 12 : 10) + length;
  const header = new TextDecoder("latin1").decode(bytes.subarray(wide ? 12 : 10, begin));
  const dtype = /'descr': '([^']+)'/.exec(header)[1];
  const shape = /'shape': \(([^)]*)\)/.exec(header)[1].split(",").filter((n) => n.trim()).map(Number);
  if (/'fortran_order': True/.test(header) && shape.length > 1) throw new Error("a Fortran-ordered array");
  if (dtype.startsWith("<U")) return { shape, values: texts(buffer.slice(begin), Number(dtype.slice(2)), shape) };
  const kind = DTYPES[dtype];
  if (!kind) throw new Error(`an array of type ${dtype}`);
  return { shape, values: new kind(buffer.slice(begin)) };
}

/** UCS-4, padded with zeros. Neighbours are mostly the same word, which is then made once. */
function texts(buffer, width, shape) {
  const codes = new Uint32Array(buffer);
  const out = new Array(shape.reduce((a, b) => a * b, 1));
  for (let i = 0; i < out.length; i += 1) {
    const at = i * width;
    let same = i > 0;
    for (let j = 0; same && j < width; j += 1) same = codes[at + j] === codes[at - width + j];
    if (same) {
      out[i] = out[i - 1];
      continue;
    }
    let text = "";
    for (let j = 0; j < width && codes[at + j]; j += 1) text += String.fromCodePoint(codes[at + j]);
    out[i] = text;
  }
  return out;
}

/** An array of rows from a row-major one, each a view on it. */
export const rows = ({ shape: [count, width], values }) =>
  Array.from({ length: count }, (_, i) => values.subarray(i * width, (i + 1) * width));
