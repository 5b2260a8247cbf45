import { type CSSVariablesResolver, createTheme } from "@mantine/core";

export const theme = createTheme({
  primaryColor: "sage",
  primaryShade: 8,
  colors: {
    sage: [
      "#eff5f0",
      "#dfe9e1",
      "#c6dacb",
      "#a5c4ad",
      "#88b093",
      "#6f9d7c",
      "#5a8a69",
      "#487a58",
      "#3b6f4b",
      "#2c5f3e",
    ],
  },
  fontFamily: "'Figtree Variable', system-ui, sans-serif",
  headings: { fontFamily: "'Fraunces Variable', Georgia, serif", fontWeight: "560" },
  defaultRadius: "md",
  cursorType: "pointer",
  respectReducedMotion: true,
});

/** Mantine's own greys give way to the house's warm ones (see tokens.css). */
export const cssVariables: CSSVariablesResolver = () => {
  const warm = {
    "--mantine-color-body": "var(--paper)",
    "--mantine-color-text": "var(--ink)",
    "--mantine-color-dimmed": "var(--ink-soft)",
    "--mantine-color-default": "var(--card)",
    "--mantine-color-default-hover": "var(--card-hover)",
    "--mantine-color-default-color": "var(--ink)",
    "--mantine-color-default-border": "var(--edge)",
    "--mantine-color-anchor": "var(--accent)",
  };
  return { variables: {}, light: warm, dark: warm };
};
