/**
 * Stands in for parts of OpenLayers that are left out of the build (vite.config.ts): the default controls and interactions,
 * since HomeMap names its own, and the JSON style language, since shapes.ts makes style objects.
 */

function leftOut(): never {
  throw new Error("This part of OpenLayers is left out of the build: see vite.config.ts.");
}

export { leftOut as defaults, leftOut as flatStyleLikeToStyleFunction };
