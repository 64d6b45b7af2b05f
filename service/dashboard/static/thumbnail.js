// The small picture of a job, loaded when its row comes into view.

import { key, request } from "meshcone/api";
import { h, svg } from "meshcone/dom";

const loaded = new Map();  // data addresses by link: a row that is drawn again asks for nothing

async function dataAddress(link) {
  const reader = new FileReader();
  const read = new Promise((resolve, reject) => { reader.onload = resolve; reader.onerror = reject; });
  reader.readAsDataURL(await (await request(link)).blob());
  await read;
  return reader.result;
}

// An image cannot send a key. So where there is one, its bytes are fetched and become its address.
const arriving = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) continue;
    arriving.unobserve(target);
    const { link } = target.dataset;
    if (!loaded.has(link)) loaded.set(link, dataAddress(link));
    loaded.get(link).then((address) => { target.src = address; }, () => { loaded.delete(link); target.replaceWith(placeholder()); });
  }
}, { rootMargin: "200px" });

const placeholder = () => h("span", { class: "thumb none", "aria-hidden": "true" },
  svg("svg", { viewBox: "0 0 24 24", width: 26, height: 26 }, svg("path", { d: "M12 3 20 7.5v9L12 21 4 16.5v-9ZM4 7.5l8 4.5 8-4.5M12 12v9", fill: "none", stroke: "currentColor", "stroke-width": "1.3", "stroke-linejoin": "round" })));

/** The picture of a job, or a sign in its place; it says nothing that the row does not. */
export function thumbnail(job) {
  const link = job.links?.thumbnail;
  if (!link) return placeholder();
  const image = h("img", { class: "thumb", alt: "", width: "52", height: "52", decoding: "async", loading: "lazy", draggable: "false" });
  if (key()) {
    image.dataset.link = link;
    arriving.observe(image);
  } else {
    image.addEventListener("error", () => image.replaceWith(placeholder()), { once: true });
    image.src = link;
  }
  return image;
}
