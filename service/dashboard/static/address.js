// What a link says of a view: names and values after the "#", which no server is told.

const read = () => new URLSearchParams(location.hash.slice(1));

/** The value of a name in this page's link; null if it is not there. */
export const inLink = (name) => read().get(name);

/** Change some names in the link, without a step in the history; null takes a name out. */
export function putInLink(changes) {
  const values = read();
  for (const [name, value] of Object.entries(changes)) {
    if (value === null) values.delete(name);
    else values.set(name, value);
  }
  // Commas and colons may stand in a fragment as they are (RFC 3986, section 3.5), and read better.
  const written = values.toString().replaceAll("%2C", ",").replaceAll("%3A", ":");
  try { history.replaceState(history.state, "", `#${written}`); } catch { /* a page in a notebook's frame has no link of its own */ }
}
