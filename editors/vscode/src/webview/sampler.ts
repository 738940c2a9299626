// When to ask for what: coarsely while something changes, then finer and finer. At most one request is on its way.
import type { SampleRequest, Samples } from "../preview/messages";

/** What is to be seen; how finely is the sampler's business. */
export interface Wish {
  readonly key: string;
  request(count: number, rtol: number): SampleRequest;
  /** Places for a count: its square for a picture. */
  places(count: number): number;
  /** Counts along an axis, the coarsest first. */
  readonly levels: readonly number[];
}

export interface Outcome {
  readonly wish: Wish;
  readonly samples: Samples;
  readonly count: number;
  readonly final: boolean;
  readonly milliseconds: number;
}

interface Pass {
  readonly id: number;
  readonly wish: Wish;
  readonly level: number;
  readonly since: number;
}

const FRAME = 60; // ms that a pass may take while something changes
const RTOL = [1e-3, 1e-4, 1e-6];

export class Sampler {
  private last = 0;
  private wish: Wish | undefined;
  private under: Pass | undefined;
  private reached = -1;
  private perPlace = 0; // ms
  private held = false;

  constructor(
    private readonly send: (id: number, request: SampleRequest) => void,
    private readonly cancel: (id: number) => void,
    private readonly arrived: (outcome: Outcome) => void,
    private readonly failed: (message: string) => void,
  ) {}

  /** Whether the finest pass for what is wanted is done. */
  get settled(): boolean {
    return this.wish !== undefined && this.under === undefined && this.reached >= this.wish.levels.length - 1;
  }

  /** Show this from now on. A fine pass for something else is ended; a coarse one is soon over and shows the way. */
  want(wish: Wish, again = false): void {
    if (!again && wish.key === this.wish?.key) return;
    this.wish = wish;
    this.reached = -1;
    this.held = false;
    if (!this.under) this.next();
    else if (this.expected(this.under) > FRAME) this.drop();
  }

  samples(id: number, samples: Samples): void {
    const pass = this.under;
    if (pass?.id !== id) return;
    this.under = undefined;
    const count = pass.wish.levels[pass.level] ?? 0;
    const milliseconds = performance.now() - pass.since;
    this.perPlace = Math.max(milliseconds - 1000 * samples.compileSeconds, 0.1) / pass.wish.places(count);
    const final = pass.level === pass.wish.levels.length - 1 && pass.wish === this.wish;
    if (pass.wish === this.wish) this.reached = pass.level;
    this.arrived({ wish: pass.wish, samples, count, final, milliseconds });
    this.next();
  }

  failure(id: number, message: string, outdated: boolean): void {
    const pass = this.under;
    if (pass?.id !== id) return;
    this.under = undefined;
    if (pass.wish === this.wish && !outdated) {
      this.held = true; // until something changes
      this.failed(message);
    }
    if (pass.wish === this.wish && outdated) this.held = true; // a change of the text, which will ask again
    this.next();
  }

  private drop(): void {
    if (!this.under) return;
    this.cancel(this.under.id);
    this.under = undefined;
    this.next();
  }

  private expected(pass: Pass): number {
    return this.perPlace * pass.wish.places(pass.wish.levels[pass.level] ?? 0) || (pass.level ? Infinity : 0);
  }

  private next(): void {
    const { wish } = this;
    if (!wish || this.under || this.held || this.reached >= wish.levels.length - 1) return;
    const level = this.reached < 0 ? this.first(wish) : this.reached + 1;
    const count = wish.levels[level] ?? 1;
    this.under = { id: ++this.last, wish, level, since: performance.now() };
    this.send(this.last, wish.request(count, RTOL[Math.min(level, RTOL.length - 1)] ?? 1e-6));
  }

  /** The finest level that takes no longer than a frame, as far as is known. */
  private first(wish: Wish): number {
    if (!this.perPlace) return 0;
    const quick = wish.levels.filter((count) => this.perPlace * wish.places(count) <= FRAME);
    return Math.max(0, quick.length - 1);
  }
}
