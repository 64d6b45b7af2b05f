// Showing what has changed, and nothing else: what is taken out and put back loses the press that
// is on it, and the focus.

/** Whether an element stands where another was: the same control of the same row. */
const alike = (one, other) => ["type", "class", "href"].every((name) => one.getAttribute(name) === other.getAttribute(name)) && one.tagName === other.tagName;

/** Make these the children of an element. What stays is not touched, unless others came to stand before it. */
export function place(parent, wanted) {
  const stays = new Set(wanted);
  for (const child of [...parent.children]) if (!stays.has(child)) child.remove();
  wanted.forEach((child, index) => {
    let here = parent.children[index];
    // One that has gone down is taken out, rather than all that come after it moved up.
    if (here !== child && here?.nextElementSibling === child) { here.remove(); here = child; }
    if (here !== child) parent.insertBefore(child, here ?? null);
  });
}

/** Make a row of a table look like another, by those of its cells that differ. */
export function refresh(row, like) {
  if (row.className !== like.className) row.className = like.className;
  [...like.cells].forEach((cell, index) => { if (!row.cells[index].isEqualNode(cell)) row.cells[index].replaceWith(cell); });
}

/** Draw rows, and leave the focus on what had it, or on what has come in its place. */
export function keepingFocus(rows, draw) {
  const focused = rows.contains(document.activeElement) ? document.activeElement : null;
  const row = focused?.closest("tr");
  draw();
  if (!focused || document.activeElement === focused) return;
  const again = focused.isConnected ? focused : [...row.querySelectorAll("a, button, input")].find((other) => alike(focused, other));
  (again ?? row.querySelector(".pair") ?? row.previousElementSibling?.querySelector(".toggle"))?.focus();
}
