/** How each measure and each outcome looks: colour, dash and mark, or colour and hatching, so that colour never stands alone. */

import type { Measure } from "./queries";

export const ROWS = ["transfer", "meta_occupancy", "meta_dividers"] as const satisfies readonly Measure[];
export type Row = (typeof ROWS)[number];
export type Shape = "circle" | "square" | "triangle";

/** Colours by Okabe and Ito (Fleet.module.css). */
export const LOOKS: Readonly<Record<Row, { colour: string; dash: number[]; shape: Shape }>> = {
  transfer: { colour: "--rate-transfer", dash: [], shape: "circle" },
  meta_occupancy: { colour: "--rate-occupancy", dash: [8, 4], shape: "square" },
  meta_dividers: { colour: "--rate-dividers", dash: [2, 3], shape: "triangle" },
};

export const OUTCOMES = ["taken", "needs_review", "reverted", "parked"] as const;
export type Outcome = (typeof OUTCOMES)[number];
export type Hatch = "plain" | "rising" | "falling" | "dots";

export const FILLS: Readonly<Record<Outcome, { colour: string; hatch: Hatch }>> = {
  taken: { colour: "--outcome-taken", hatch: "plain" },
  needs_review: { colour: "--outcome-asked", hatch: "plain" },
  reverted: { colour: "--outcome-reverted", hatch: "rising" },
  parked: { colour: "--outcome-parked", hatch: "dots" },
};

const SIZE = 8;

/** A tile of a hatching, in the colours of the page. */
export function tile(colour: string, hatch: Hatch, paper: string): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE;
  const pen = canvas.getContext("2d");
  if (!pen) return canvas;
  pen.fillStyle = colour;
  pen.fillRect(0, 0, SIZE, SIZE);
  pen.strokeStyle = pen.fillStyle = paper;
  pen.lineWidth = 2;
  if (hatch === "dots") pen.fillRect(2, 2, 3, 3);
  if (hatch === "rising" || hatch === "falling") {
    const sign = hatch === "rising" ? -1 : 1;
    for (const offset of [-SIZE, 0, SIZE]) {
      pen.beginPath();
      pen.moveTo(offset - 1, sign < 0 ? SIZE + 1 : -1);
      pen.lineTo(offset + SIZE + 1, sign < 0 ? -1 : SIZE + 1);
      pen.stroke();
    }
  }
  return canvas;
}

/** The corners of a mark around (x, y), its radius 1. */
export function outline(shape: Exclude<Shape, "circle">): readonly (readonly [number, number])[] {
  if (shape === "square")
    return [
      [-0.85, -0.85],
      [0.85, -0.85],
      [0.85, 0.85],
      [-0.85, 0.85],
    ];
  return [
    [0, -1.15],
    [1.1, 0.8],
    [-1.1, 0.8],
  ];
}

interface MarkProps {
  readonly shape: Shape;
  readonly x: number;
  readonly y: number;
  readonly r: number;
  readonly colour: string;
}

export function Mark({ shape, x, y, r, colour }: MarkProps) {
  if (shape === "circle") return <circle cx={x} cy={y} r={r} fill={`var(${colour})`} />;
  const points = outline(shape).map(([dx, dy]) => `${x + dx * r},${y + dy * r}`);
  return <polygon points={points.join(" ")} fill={`var(${colour})`} />;
}

/** A piece of the line of a measure, for legends. */
export function LineSample({ row }: { readonly row: Row }) {
  const { colour, dash, shape } = LOOKS[row];
  return (
    <svg width="34" height="14" aria-hidden="true">
      <line x1="1" x2="33" y1="7" y2="7" stroke={`var(${colour})`} strokeWidth="2" strokeDasharray={dash.join(" ")} />
      <Mark shape={shape} x={17} y={7} r={4.5} colour={colour} />
    </svg>
  );
}

export function FillSample({ outcome }: { readonly outcome: Outcome }) {
  const { colour, hatch } = FILLS[outcome];
  const id = `hatch-${outcome}`;
  return (
    <svg width="18" height="14" aria-hidden="true">
      <defs>
        <pattern id={id} width="8" height="8" patternUnits="userSpaceOnUse">
          <rect width="8" height="8" fill={`var(${colour})`} />
          {hatch === "dots" && <rect x="2" y="2" width="3" height="3" fill="var(--card)" />}
          {hatch === "rising" && <path d="M-1 9 9 -1M-1 1 1 -1M7 9 9 7" stroke="var(--card)" strokeWidth="2" />}
          {hatch === "falling" && <path d="M-1 -1 9 9" stroke="var(--card)" strokeWidth="2" />}
        </pattern>
      </defs>
      <rect width="18" height="14" rx="2" fill={`url(#${id})`} />
    </svg>
  );
}
