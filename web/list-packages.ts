import type { Plugin } from "vite";

/** The folder of an npm package, up to its name. Packages may be in the folders of others. */
const FOLDER = /node_modules\/(?:.*\/node_modules\/)?(?:@[^/]+\/)?[^/]+/;

/**
 * Writes `packages.json`: the folders of all npm packages with code, styles or files in the bundle.
 * `hatch_build.py` collects their licences. Vite's own `build.license` leaves out files such as fonts.
 */
export function listPackages(): Plugin {
  return {
    name: "list-packages",
    generateBundle(_, bundle) {
      const files = Object.values(bundle).flatMap((output) =>
        output.type === "chunk" ? output.moduleIds : output.originalFileNames,
      );
      const folders = new Set(files.flatMap((file) => FOLDER.exec(file)?.[0] ?? []));
      this.emitFile({
        type: "asset",
        fileName: "packages.json",
        source: JSON.stringify([...folders].sort()),
      });
    },
  };
}
