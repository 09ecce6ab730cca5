// Types that many scripts of the studio share, and of what the page provides beside them.

/** Context of a canvas. */
type Context = CanvasRenderingContext2D;
/** Texts of the page by key. */
type Words = Record<string, string>;

/** Type of a property of a component. */
type Prop<T> = import("vue").PropType<T>;
/** Event of a field of a form. */
type FieldEvent<T extends HTMLElement = HTMLInputElement> = Event & { target: T };

interface Window {
  /** Uploads in progress (send.js). */
  leafcutSending?: Promise<boolean> | null;
  /** Path of the page on a server that forwards to it (NiceGUI). */
  path_prefix?: string;
}

declare module "nicegui-codemirror" {
  export * from "codemirror";
  export * from "@codemirror/commands";
  export * from "@codemirror/language";
  export * from "@codemirror/state";
  export * from "@codemirror/theme-one-dark";
  export * from "@codemirror/view";
  export const languages: import("@codemirror/language").LanguageDescription[];
}

declare module "nicegui-scene" {
  export const THREE: typeof import("three");
}
