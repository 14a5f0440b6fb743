/** A refusal, as the page shows it. */
export class Refused extends Error {
  readonly more: object;

  constructor(why: string, more: object = {}) {
    super(why);
    this.more = more;
  }
}
