// The API's description in Swagger UI, which comes with the service and loads nothing else.

import { authorization } from "meshcone/api";
import { byId, embedded, h } from "meshcone/dom";

const urls = embedded("libraries");

function load(element) {
  return new Promise((resolve, reject) => {
    element.onload = resolve;
    element.onerror = () => reject(new Error("Swagger UI could not be loaded"));
    document.head.append(element);
  });
}

try {
  await Promise.all([
    load(h("link", { rel: "stylesheet", href: urls["swagger-ui.css"] })),
    load(h("script", { src: urls["swagger-ui.js"] })),
  ]);
  globalThis.SwaggerUIBundle({
    url: "/openapi.json",
    domNode: byId("swagger"),
    deepLinking: true,
    validatorUrl: null,
    requestInterceptor: (request) => {
      Object.assign(request.headers, authorization());
      return request;
    },
  });
} catch (error) {
  byId("swagger").replaceChildren(h("p", { role: "alert" }, `${error.message}. The description itself is at `, h("a", { href: "/openapi.json" }, "/openapi.json"), "."));
}
