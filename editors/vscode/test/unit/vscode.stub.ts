// What of the editor the code under test touches, with a record of it.

export interface Shown {
  readonly name: string;
  readonly args: readonly string[];
  /** How it was shown, each time: whether the editor kept the keyboard. */
  readonly kept: (boolean | undefined)[];
  readonly sent: string[];
  exitStatus: { code: number } | undefined;
}

export const terminals: Shown[] = [];

export const window = {
  createTerminal({ name, shellArgs }: { name: string; shellArgs: string[] }) {
    const shown: Shown = { name, args: shellArgs, kept: [], sent: [], exitStatus: undefined };
    terminals.push(shown);
    return {
      get exitStatus() {
        return shown.exitStatus;
      },
      show: (preserveFocus?: boolean) => shown.kept.push(preserveFocus),
      sendText: (text: string) => shown.sent.push(text),
    };
  },
};

export const workspace = { asRelativePath: (path: string) => path.split("/").at(-1) ?? path };

export class ThemeIcon {
  constructor(readonly id: string) {}
}
