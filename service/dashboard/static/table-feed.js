// Rows of the table, live: the first of them by server-sent events, those after them on demand.

import { follow, getJson } from "meshcone/api";
import { isBatch } from "meshcone/batch-row";
import { hasEnded } from "meshcone/job-words";

const TRIES = 3;  // to read the older rows while the first change

const isOver = (row) => (isBatch(row) ? row.state === "finished" : hasEnded(row));

const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

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
    this.cursor = null;  // of what comes after all of the rows
    this.end = null;  // of what comes after the first
    this.hasOlder = false;  // whether more than the first were asked for
    this.isStale = false;  // whether the older rows may be others by now
    this.asking = null;  // for older rows, the last time
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
    const before = this.rows;
    const known = new Map([...this.older, ...this.first, ...changed].map((row) => [row.id, row]));
    this.first = order.map((id) => known.get(id));
    this.older = this.after(order, before);
    if (more === null) Object.assign(this, { older: [], isStale: false });
    if (!this.hasOlder || more === null) this.cursor = more;
    this.end = more;
    this.hasCome = true;
    this.onChange(counts);
  }

  /** Of the rows before a change those that come after the first now: what new ones pushed off their end is among them. */
  after(order, before) {
    if (!this.hasOlder) return [];
    const shown = new Set(order);
    const places = new Map(before.map(({ id }, index) => [id, index]));
    const last = places.get(order.findLast((id) => places.has(id))) ?? -1;
    const after = before.slice(last + 1).filter(({ id }) => !shown.has(id));
    if (!same(after.map(({ id }) => id), this.older.map(({ id }) => id))) this.isStale = true;
    return after;
  }

  page(cursor) {
    return getJson(`/dashboard/rows?${new URLSearchParams([...this.query, ["cursor", cursor]])}`);
  }

  /** Fetch the rows after those that are there. */
  async showMore() {
    const asking = this.ask();  // ends what is being read again: these come after it
    this.hasOlder = true;
    try {
      const page = await this.page(this.cursor);
      if (asking.feed !== this.following) return;
      const shown = new Set(this.rows.map(({ id }) => id));
      this.older.push(...page.rows.filter(({ id }) => !shown.has(id)));
      this.cursor = page.more;
    } finally {
      asking.isOver = true;
    }
  }

  ask(isForMore = true) {
    this.asking = { feed: this.following, isForMore, isOver: false };
    return this.asking;
  }

  /** Whether older rows, which nobody tells of, may have changed. */
  get isBehind() {
    return this.hasOlder && (this.isStale || this.older.some((row) => !isOver(row)));
  }

  /** Read the older rows again; those that are gone by then, or no longer like what is asked for, leave. */
  async lookAgain() {
    if (!this.hasOlder || this.end === null) return;
    this.isStale = true;
    for (let tries = TRIES; tries > 0; tries -= 1) {
      if (this.asking.isForMore && !this.asking.isOver) return;
      const asking = this.ask(false);
      const { end } = this;
      const read = await this.readOlder(this.older.length);
      // Meanwhile others may be wanted, or more: these would be those of before.
      if (asking !== this.asking || asking.feed !== this.following) return;
      if (this.put(read, end)) return;
    }
  }

  /** Take older rows as they were read after the first; whether these ended there still, so that none is missing. */
  put({ rows, cursor }, end) {
    const known = new Map(this.older.map((row) => [row.id, row]));
    const read = rows.map((row) => (same(row, known.get(row.id)) ? known.get(row.id) : row));
    if (end === this.end) {
      const first = new Set(this.first.map(({ id }) => id));
      Object.assign(this, { older: read.filter(({ id }) => !first.has(id)), cursor, isStale: false });
      return true;
    }
    const byIds = new Map(read.map((row) => [row.id, row]));
    this.older = this.older.map((row) => byIds.get(row.id) ?? row);
    return false;
  }

  /** At least as many rows after the first, as far as there are any. */
  async readOlder(count) {
    const rows = [];
    let cursor = this.end;
    while (cursor !== null && rows.length < count) {
      const page = await this.page(cursor);
      rows.push(...page.rows);
      cursor = page.more;
    }
    return { rows, cursor };
  }
}
