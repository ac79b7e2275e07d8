/** What the modules of the pages hand to one another. */

/** A point or a direction. */
type Vector = number[];

/** 4x4, row-major, metres; or 3x3, a rotation alone. */
type Matrix = number[][];

type Intrinsics = Pick<Rest["Intrinsics"], "fx" | "fy" | "cx" | "cy">;

/** How a picture is shown: page pixels to one of its own, and where in its box its corner lies [page pixels]. */
interface Shown {
  scale: number;
  left: number;
  top: number;
}

interface Place {
  x: number;
  y: number;
}

interface Mesh {
  vertices: Float32Array;
  faces: Uint32Array;
}

/** What can be done about a message. */
interface MessageAction {
  label: string;
  run: () => void;
}

/** What `messageArea` makes. */
interface Message {
  show: (text: string, kind?: "info" | "good" | "problem", action?: MessageAction | null) => void;
  clear: () => void;
  problem: (error: { message: string }, action?: MessageAction | null) => void;
}

/** A key, or several that do the same. */
interface Binding {
  /** Such as "Mod+Shift+Z"; see `chord` in static/shared/keys.js. */
  keys: string[];
  /** For the help. */
  does: string;
  run: (chord: string, isHeld: boolean) => unknown;
  /** Whether it goes on while it is held down. */
  repeats?: boolean;
  /** The tool of a condition that it belongs to. */
  tool?: string;
  /** Stand in the help for many keys. */
  caps?: string[];
}

/** A binding as the help shows it. */
interface GroupedBinding extends Binding {
  group: string;
}

/** As REST sends it, but a snap that was only just asked for has no id yet. */
type Registration = Omit<Rest["RegistrationOut"], "snap"> & {
  snap: (Omit<Rest["SnapOut"], "id"> & { id: string | null }) | null;
};

/** The window of a 3-D view: the constructors of its own document stand in it, too. */
type ViewWindow = Window & typeof globalThis;

/** A part of the labelling page, as static/label/label.js says. */
interface Part {
  title?: string;
  bindings?: Binding[];
  open?: (task: Rest["TaskOut"], scene: Rest["SceneOut"], object: Rest["ObjectDetail"]) => void;
  draw?: (registration: Registration, before: Registration | null) => void;
  attach?: (view: ViewWindow) => void;
  leave?: () => boolean;
  accept?: () => boolean;
}

type ActionPath<Action extends string> = `/api/registrations/${number}/${Action}`;

type KnownAction<M extends "put" | "post", Action extends string> =
  Known<M, ActionPath<Action>> extends never ? never : Action;

/** What the parts of the labelling page are given. */
interface LabelPage {
  message: Message;
  path: <Action extends string>(action: Action) => ActionPath<Action>;
  me: () => Rest["Me"];
  isTrial: () => boolean;
  has: (tool: string) => boolean;
  /** Null until the task is open, which only what runs before `draw` has to look after. */
  registration: () => Registration;
  isConnected: () => boolean;
  /** Changes the registration, and shows what it is then. */
  put: <Action extends string>(
    action: KnownAction<"put", Action>,
    body?: Sent<"put", ActionPath<Action>>,
  ) => Promise<Answer<"put", ActionPath<Action>>>;
  post: <Action extends string>(
    action: KnownAction<"post", Action>,
    body?: Sent<"post", ActionPath<Action>>,
  ) => Promise<Answer<"post", ActionPath<Action>>>;
  canMove: () => boolean;
  act: (name: string) => Promise<void>;
  showFrame: (frame: Rest["FrameOut"]) => Promise<unknown>;
  leaveMode: () => boolean;
}

/** The DOM makes texts of numbers and truth values by itself. */
interface Element {
  setAttribute(name: string, value: string | number | boolean): void;
}

/** What scripts look for by a selector is HTML. */
interface Element {
  closest(selectors: string): HTMLElement | null;
}

interface ParentNode {
  querySelector<Tag extends keyof HTMLElementTagNameMap>(selectors: Tag): HTMLElementTagNameMap[Tag] | null;
  querySelector(selectors: string): HTMLElement | null;
  querySelectorAll<Tag extends keyof HTMLElementTagNameMap>(
    selectors: Tag,
  ): NodeListOf<HTMLElementTagNameMap[Tag]>;
  querySelectorAll(selectors: string): NodeListOf<HTMLElement>;
}

/** An id that a page has, or one that is put together where the script runs. */
type KnownId<Id extends string> = Id extends keyof ElementsById
  ? Id
  : Record<never, never> extends Record<Id, 1>
    ? Id
    : never;

// biome-ignore lint/suspicious/noExplicitAny: an id that is put together may be that of anything
type ElementOf<Id extends string> = Id extends keyof ElementsById ? ElementsById[Id] : any;
