// The 3D library, loaded where a mesh is shown and not before.

import { embedded } from "meshcone/dom";

let loading = null;

/** three.js; it is a classic script that leaves itself in `THREE`. */
export function threeJs() {
  if (globalThis.THREE) return Promise.resolve(globalThis.THREE);
  loading ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = embedded("libraries")["three.js"];
    script.onload = () => resolve(globalThis.THREE);
    script.onerror = () => { loading = null; reject(new Error("the 3D library could not be loaded")); };
    document.head.append(script);
  });
  return loading;
}

/** Whether this browser draws in three dimensions at all. */
export function hasWebGl() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl2") ?? canvas.getContext("webgl"));
}

/** What to say where the browser takes the graphics from a page, as it does when they are reset or too many pages draw. */
export const LOST = "The browser has taken the graphics away from this page. The meshes come back once it gives them back, or when you load the page again.";
