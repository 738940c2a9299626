// When to ask for what: coarsely while something changes, then finer and finer, as far as a pass is worth waiting for.
// At most one request is on its way.
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
  /** What the finest pass would take, in milliseconds, if that is too long to wait for; else 0. */
  readonly tooLong: number;
}

interface Pass {
  readonly id: number;
  readonly wish: Wish;
  readonly count: number;
  readonly since: number;
}

const FRAME = 60; // ms that a pass may take while something changes
const BUDGET = 4000; // ms of evaluation that a pass may take at all, as far as the one before it tells
const WORTH = 1.25; // a finer pass has at least so many times as many places along an axis
const RTOL = [1e-3, 1e-4, 1e-6];

export class Sampler {
  private last = 0;
  private wish: Wish | undefined;
  private under: Pass | undefined;
  private reached = 0; // places along an axis
  private perPlace = 0; // ms until it was here
  private ownPerPlace = 0; // ms of evaluation alone
  private held = false;

  constructor(
    private readonly send: (id: number, request: SampleRequest) => void,
    private readonly cancel: (id: number) => void,
    private readonly arrived: (outcome: Outcome) => void,
    private readonly failed: (message: string) => void,
  ) {}

  /** Whether the finest pass for what is wanted is done. */
  get settled(): boolean {
    return this.wish !== undefined && this.under === undefined && this.reached > 0 && !this.finer(this.wish);
  }

  /** Show this from now on; whether that is anything new. A fine pass for something else is ended; a coarse one is soon
   * over and shows the way. */
  want(wish: Wish, again = false): boolean {
    if (!again && wish.key === this.wish?.key) return false;
    this.wish = wish;
    this.reached = 0;
    this.held = false;
    if (!this.under) this.next();
    else if (this.expected(this.under) > FRAME) this.drop();
    return true;
  }

  samples(id: number, samples: Samples): void {
    const pass = this.under;
    if (pass?.id !== id) return;
    this.under = undefined;
    const { wish, count } = pass;
    const milliseconds = performance.now() - pass.since;
    const places = wish.places(count);
    const own = Math.max(1000 * (samples.seconds - samples.compileSeconds), 0.1);
    this.ownPerPlace = own / places;
    this.perPlace = Math.max(milliseconds - 1000 * samples.compileSeconds, own) / places;
    if (wish === this.wish) this.reached = count;
    const final = wish === this.wish && !this.finer(wish);
    const finest = wish.levels.at(-1) ?? 0;
    const tooLong = final && count < finest ? this.ownPerPlace * wish.places(finest) : 0;
    this.arrived({ wish, samples, count, final, milliseconds, tooLong });
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

  private expected({ wish, count }: Pass): number {
    return this.perPlace * wish.places(count) || (count > (wish.levels[0] ?? 0) ? Infinity : 0);
  }

  private next(): void {
    const { wish } = this;
    if (!wish || this.under || this.held) return;
    const count = this.reached ? this.finer(wish) : this.first(wish);
    if (!count) return;
    const rtol = RTOL[wish.levels.filter((level) => level < count).length] ?? 1e-6;
    this.under = { id: ++this.last, wish, count, since: performance.now() };
    this.send(this.last, wish.request(count, rtol));
  }

  /** The finest level that takes no longer than a frame, as far as is known. */
  private first(wish: Wish): number {
    const quick = this.perPlace ? wish.levels.filter((count) => this.perPlace * wish.places(count) <= FRAME) : [];
    return quick.at(-1) ?? wish.levels[0] ?? 1;
  }

  /** The level after the one that is reached, or as much of it as is worth waiting for; 0 if there is no more. */
  private finer(wish: Wish): number {
    const level = wish.levels.find((count) => count > this.reached) ?? 0;
    let count = level;
    while (count > this.reached && this.ownPerPlace * wish.places(count) > BUDGET) count--;
    return count === level || count >= WORTH * this.reached ? count : 0;
  }
}
