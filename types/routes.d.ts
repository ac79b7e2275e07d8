/**
 * REST by address: `Answer<"get", "/api/tasks/3">` is what `GET /api/tasks/3` sends. An address that there is not
 * is `never`, so that a call of it does not pass.
 */
import type { components, paths } from "./rest.d.ts";

type Method = "get" | "post" | "put" | "delete";

type Segments<Path extends string> = Path extends `${infer Head}/${infer Tail}`
  ? [Head, ...Segments<Tail>]
  : [Path];

/** Whether an address is one of a described route, whose parameters are in braces. */
type Fits<Asked, Described> = [Asked, Described] extends [
  [infer One, ...infer Ones],
  [infer Other, ...infer Others],
]
  ? Other extends `{${string}}`
    ? Fits<Ones, Others>
    : One extends Other
      ? Fits<Ones, Others>
      : false
  : [Asked, Described] extends [[], []]
    ? true
    : false;

type Route<Path extends string> = Path extends keyof paths
  ? Path
  : {
      [Known in keyof paths]: Fits<Segments<Path>, Segments<Known>> extends true ? Known : never;
    }[keyof paths];

type Operation<M extends Method, Path extends string> = Exclude<paths[Route<Path>][M], undefined>;

type Content<Described> = Described extends { content: { "application/json": infer Body } } ? Body : null;

declare global {
  /** What REST sends and takes, by the names of its description. */
  type Rest = components["schemas"];

  /** The address, where there is such a route. */
  type Known<M extends Method, Path extends string> = [Operation<M, Path>] extends [never] ? never : Path;

  type Answer<M extends Method, Path extends string> =
    Operation<M, Path> extends { responses: infer Responses } ? Content<Responses[keyof Responses]> : never;

  type Sent<M extends Method, Path extends string> =
    Operation<M, Path> extends { requestBody?: infer Request } ? Content<Exclude<Request, undefined>> : null;

  /** The parameters of a query; whatever is given may be a text, as it stands in the page. */
  type Query<Path extends string> =
    Operation<"get", Path> extends { parameters: { query?: infer Params } }
      ? { [Name in keyof Params]?: Params[Name] | string | null }
      : never;
}
