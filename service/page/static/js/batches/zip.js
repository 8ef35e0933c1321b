/** A ZIP archive of files as they are, not packed (ZIP application note 6.3.9). */

const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});

function crc32(bytes) {
  let c = 0xffffffff;
  for (const byte of bytes) c = CRC[(c ^ byte) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

/**
 * @param {{name: string, bytes: Uint8Array}[]} files
 * @returns {Blob}
 */
export function zipOf(files) {
  const parts = [];
  const directory = [];
  let at = 0;
  for (const { name, bytes } of files) {
    const text = new TextEncoder().encode(name);
    // Version 2.0, names in UTF-8 (bit 11), stored; every file is as old as the format, so that archives agree.
    const about = [u16(20), u16(0x0800), u16(0), u16(0), u16(0x21), u32(crc32(bytes)), u32(bytes.length), u32(bytes.length), u16(text.length), u16(0)];
    parts.push(u32(0x04034b50), ...about, text, bytes);
    directory.push(u32(0x02014b50), u16(20), ...about, u16(0), u16(0), u16(0), u32(0), u32(at), text);
    at += 30 + text.length + bytes.length;
  }
  const size = directory.reduce((sum, part) => sum + part.length, 0);
  const end = [u32(0x06054b50), u16(0), u16(0), u16(files.length), u16(files.length), u32(size), u32(at), u16(0)];
  return new Blob([...parts, ...directory, ...end], { type: "application/zip" });
}

const u16 = (n) => Uint8Array.of(n & 255, (n >>> 8) & 255);
const u32 = (n) => Uint8Array.of(n & 255, (n >>> 8) & 255, (n >>> 16) & 255, (n >>> 24) & 255);

/** More files than the end of a plain archive can count. */
export const MOST_FILES = 65_535;
