// The description of REST, to read and to try out, as Swagger UI shows it.

const script = document.createElement("script"); // no module: it leaves a global behind
script.src = "/static/swagger/swagger-ui-bundle.js";
script.addEventListener("load", () =>
  globalThis.SwaggerUIBundle({
    url: "/api/openapi.json",
    domNode: document.getElementById("rest"),
    deepLinking: true,
    filter: true,
    validatorUrl: null, // or it asks another host
  }),
);
document.head.append(script);
