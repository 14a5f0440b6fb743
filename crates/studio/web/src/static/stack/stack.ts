// The stack that serves the page, if one does: the file `rayfold.json` beside the page says so. On other hosts it is empty.

export interface SignIn {
  readonly region: string;
  readonly identityPoolId: string;
  readonly userPoolId: string;
  readonly clientId: string;
  readonly loginUrl: string;
}

export interface Stack {
  readonly bucket: string;
  readonly region: string;
  /** The bucket's address, without a slash at its end. */
  readonly endpoint: string;
  /** Where the page asks for credentials; only of `rayfold dev`. */
  readonly credentials?: string;
  /** How people sign in; only of a stack on AWS. */
  readonly signIn?: SignIn;
}

async function read(): Promise<Stack | null> {
  try {
    const answer = await fetch("rayfold.json");
    const stack = (await answer.json()) as Partial<Stack>;
    return stack.bucket && stack.region && stack.endpoint && (stack.credentials || stack.signIn) ? (stack as Stack) : null;
  } catch {
    return null;
  }
}

let known: Promise<Stack | null> | null = null;

/** Returns the stack to which the page can submit, or nothing. */
export const stack = (): Promise<Stack | null> => (known ??= read());
