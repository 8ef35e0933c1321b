/** From a row of a ranking to the explorer: the blade as it was screened, its contact, its range. */

import { Design } from "../design/design.js";
import { ask } from "../service.js";

/** Whether the explorer knows such a contact; smooth engagement it does not. */
export const canExplore = (row) => !row.contact.engagement;

/** @param {App} app  @param {string} job  @param {Object} row of the results */
export async function explore(app, job, row) {
  const blade = await ask(`v1/screenings/${job}/blades/${row.blade_index}`);
  const weights = Object.fromEntries(blade.tip_nodes.map((node) => [node, row.contact.weights[node] ?? 0]));
  const design = new Design(blade, { label: row.blade, weights, arcs: row.contact.arcs ?? null });
  const [low_hz, high_hz] = row.speed_range_hz;
  Object.assign(app.range, { low_hz, high_hz, ke_max: row.ke_max });
  if (row.ke_liner !== null) app.range.ke_liner = row.ke_liner;
  app.show(design, { range: false });
  // Where the smallest K_e destabilises, so that the explorer begins at what the ranking is about.
  if (row.speed_hz !== null && row.smallest_unstable_ke !== null) {
    app.point = { speed_hz: row.speed_hz, ke: row.smallest_unstable_ke };
    app.changed("point");
  }
  app.go("explorer");
}
