// Stands in for the Python extension, as far as Potto uses it: an environment can be selected, which is told.
let selected;
const listening = new Set();
const environments = {
  getActiveEnvironmentPath: () => ({ path: selected ?? "" }),
  resolveEnvironment: async ({ path }) => (path ? { executable: { uri: { fsPath: path } } } : undefined),
  onDidChangeActiveEnvironmentPath(listener) {
    listening.add(listener);
    return { dispose: () => listening.delete(listener) };
  },
};

exports.activate = () => ({
  environments,
  /** Select an interpreter, or none. */
  select(path) {
    selected = path;
    for (const listener of listening) listener({ path });
  },
});
