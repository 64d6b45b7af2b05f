// The API's description in Swagger UI, which comes with the service and loads nothing else.

import { authorization } from "meshcone/api";
import { byId, embedded, h } from "meshcone/dom";

const urls = embedded("libraries");
const prefersDark = matchMedia("(prefers-color-scheme: dark)");

/** Swagger UI has a dark theme, under a class of its own. */
function followTheme() {
  const root = document.documentElement;
  root.classList.toggle("dark-mode", root.dataset.theme ? root.dataset.theme === "dark" : prefersDark.matches);
}

function load(element) {
  return new Promise((resolve, reject) => {
    element.onload = resolve;
    element.onerror = () => reject(new Error("Swagger UI could not be loaded"));
    document.head.append(element);
  });
}

/** Names and focus that Swagger UI's own elements lack for those who hear the page or use its keys. */
function lend() {
  for (const area of document.querySelectorAll("textarea:not([aria-label])")) area.setAttribute("aria-label", "Request body");
  for (const example of document.querySelectorAll("#swagger pre:not([tabindex])")) example.tabIndex = 0;
  for (const close of document.querySelectorAll(".close-modal:not([aria-label])")) close.setAttribute("aria-label", "Close");
}

followTheme();
addEventListener("themechange", followTheme);
prefersDark.addEventListener("change", followTheme);

try {
  await Promise.all([
    load(h("link", { rel: "stylesheet", href: urls["swagger-ui.css"] })),
    load(h("script", { src: urls["swagger-ui.js"] })),
  ]);
  new MutationObserver(lend).observe(byId("swagger"), { childList: true, subtree: true });
  globalThis.SwaggerUIBundle({
    url: "/openapi.json",
    domNode: byId("swagger"),
    deepLinking: false,
    validatorUrl: null,
    requestInterceptor: (request) => {
      Object.assign(request.headers, authorization());
      return request;
    },
  });
} catch (error) {
  byId("swagger").replaceChildren(h("p", { role: "alert" }, `${error.message}. The description itself is at `, h("a", { href: "/openapi.json" }, "/openapi.json"), "."));
}
