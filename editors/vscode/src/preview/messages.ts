// What a preview and the extension say to each other, and what the language server answers. Types alone.

export interface SceneParameter {
  readonly name: string;
  readonly kind: "number" | "tuple" | "function";
  readonly type: string;
  /** How many numbers it has; 0 for a function. */
  readonly size: number;
  /** The numbers to begin with; empty if none are known. */
  readonly value: readonly number[];
  /** Functions that it could be, as texts: definitions, or at least a constant one; empty if nothing fits. */
  readonly fits: readonly string[];
  /** The least and the largest number that live expressions give it, if they give it several. */
  readonly reach?: readonly [number, number] | null;
}

export interface Scene {
  readonly name: string;
  readonly range: { readonly start: { readonly line: number; readonly character: number } };
  readonly parameters: readonly SceneParameter[];
  readonly components: number;
  readonly axes: readonly string[];
}

export interface Axis {
  readonly name: string;
  readonly from: number;
  readonly to: number;
  readonly count: number;
}

export type Given = number | readonly number[] | string;

export interface SampleRequest {
  readonly name: string;
  readonly axes: readonly Axis[];
  readonly values: Readonly<Record<string, Given>>;
  readonly wrt: string | null;
  readonly rtol: number;
}

/** Components are base64 of little-endian floats: 64 bits a value, 32 bits a bound of an error. */
export interface Samples {
  readonly shape: readonly number[];
  readonly value: readonly string[];
  readonly valueError: readonly string[];
  readonly tangent?: readonly string[];
  readonly tangentError?: readonly string[];
  readonly evals: number;
  readonly seconds: number;
  readonly compileSeconds: number;
  readonly converged: boolean;
  readonly reasons: readonly string[];
  readonly method: string;
}

/** A place of a picture: the values of all parameters there, and the sides of a pixel by its axes. */
export interface PixelRequest {
  readonly name: string;
  readonly values: Readonly<Record<string, Given>>;
  readonly cell: Readonly<Record<string, number>>;
}

export interface Range {
  readonly start: { readonly line: number; readonly character: number };
  readonly end: { readonly line: number; readonly character: number };
}

/** Where a pixel comes from: the definition, and its conditions, the nearest first; `pixels` is how far off one is. */
export interface Pixel {
  readonly range: Range;
  readonly conditions: readonly {
    readonly equation: string;
    readonly uri: string;
    readonly range: Range;
    readonly side: number;
    readonly pixels: number;
  }[];
}

export type ToPreview =
  | { readonly type: "scenes"; readonly scenes: readonly Scene[]; readonly show: string | null; readonly finest: number }
  | { readonly type: "samples"; readonly id: number; readonly samples: Samples }
  | { readonly type: "pixel"; readonly text: string }
  | { readonly type: "failed"; readonly id: number; readonly message: string; readonly outdated: boolean };

export type FromPreview =
  | { readonly type: "ready" }
  | { readonly type: "sample"; readonly id: number; readonly request: SampleRequest }
  | { readonly type: "cancel"; readonly id: number }
  | { readonly type: "pixel"; readonly request: PixelRequest }
  | { readonly type: "show"; readonly name: string }
  | { readonly type: "save"; readonly name: string; readonly png: string };
