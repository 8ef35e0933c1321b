/** Files that were dropped, those in dropped folders among them. */

/**
 * @param {DataTransfer} dropped
 * @returns {Promise<{path: string, file: File}[]>} by path
 */
export async function droppedFiles(dropped) {
  // All at once: what was dropped cannot be asked for any more after the first wait.
  const entries = [...dropped.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.length) return [...dropped.files].map((file) => ({ path: file.name, file }));
  const found = (await Promise.all(entries.map((entry) => within(entry, "")))).flat();
  return found.sort((a, b) => (a.path < b.path ? -1 : 1));
}

async function within(entry, folder) {
  const path = folder + entry.name;
  if (entry.isFile) return [{ path, file: await new Promise((done, failed) => entry.file(done, failed)) }];
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    // A hundred at a time, until there are none.
    const some = await new Promise((done, failed) => reader.readEntries(done, failed));
    if (!some.length) return found.flat();
    found.push(...(await Promise.all(some.map((inner) => within(inner, `${path}/`)))));
  }
}

/** Files of an input, with the path in the folder that was chosen. */
export const chosenFiles = (input) =>
  [...input.files].map((file) => ({ path: file.webkitRelativePath || file.name, file }));
