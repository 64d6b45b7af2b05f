// Rows of the table, live: the first of them by server-sent events, those after them on demand.

import { follow, getJson } from "meshcone/api";

export class TableFeed {
  /**
   * @param {Object} told `onChange(counts)` after each change; `onState(state)` of the connection
   */
  constructor({ onChange, onState }) {
    this.onChange = onChange;
    this.onState = onState;
    this.stop();
  }

  stop() {
    this.following?.abort();
    this.following = null;
    this.first = [];
    this.older = [];
    this.cursor = null;
    this.hasCome = false;
  }

  get rows() {
    return [...this.first, ...this.older];
  }

  /** Begin with other rows; ends, or throws, when they can be followed no more. */
  async start(query) {
    this.stop();
    this.query = query;
    this.following = new AbortController();
    const { signal } = this.following;
    await follow(`/dashboard/events?${query}`, { onEvent: (event) => this.take(event), onState: this.onState, signal });
  }

  take(event) {
    if (event.type === "unavailable") this.onState("interrupted");
    if (event.type !== "jobs") return;
    this.onState("live");
    const { order, changed, more, counts } = JSON.parse(event.data);
    const known = new Map([...this.older, ...this.first, ...changed].map((row) => [row.id, row]));
    this.first = order.map((id) => known.get(id));
    if (!this.older.length) this.cursor = more;
    const shown = new Set(order);
    this.older = this.older.filter((row) => !shown.has(row.id));
    this.hasCome = true;
    this.onChange(counts);
  }

  /** Fetch the rows after those that are there. */
  async showMore() {
    const { following } = this;
    const page = await getJson(`/dashboard/rows?${new URLSearchParams([...this.query, ["cursor", this.cursor]])}`);
    if (following !== this.following) return;
    this.older.push(...page.rows);
    this.cursor = page.more;
  }

  /** Older rows are not followed: look at those of them that something was done with. */
  async lookAgain(ids) {
    const look = (job) => getJson(`/v1/jobs/${job.id}`).catch((error) => (error.status === 404 ? null : job));
    const looked = await Promise.all(this.older.map((row) => (ids.has(row.id) ? look(row) : row)));
    this.older = looked.filter(Boolean);
  }
}
