/** When the extension began to load. Imported first, so that what the others take to load counts. */
export const began = performance.now();
