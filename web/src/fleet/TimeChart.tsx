/** A chart over days, drawn by uPlot: sized by its place, in the colours of the page, with the day that is pointed at. */

import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef } from "react";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { shortDay } from "./figures";
import { dayOf } from "./filters";

const DAY_S = 86_400;
const HEIGHT = 300;
const LOW_HEIGHT = 230;
const NARROW = 560;

export type Ink = (name: string) => string;

export interface Drawing {
  readonly series: uPlot.Series[];
  readonly bands?: uPlot.Band[];
  readonly end: number;
  readonly say: (value: number) => string;
  readonly overlay?: (chart: uPlot) => void;
}

interface Props {
  readonly label: string;
  readonly days: readonly string[];
  /** A row for each series: one value, or none, for each day. */
  readonly values: readonly (readonly (number | null)[])[];
  /** Must not change while what it draws is the same. */
  readonly draw: (ink: Ink) => Drawing;
  readonly low?: boolean;
  readonly onPoint: (index: number | null) => void;
  readonly onPick: (index: number) => void;
  readonly onSpan: (from: number, to: number) => void;
}

export function TimeChart({ label, days, values, draw, low = false, onPoint, onPick, onSpan }: Props) {
  const place = useRef<HTMLDivElement>(null);
  const scheme = useComputedColorScheme("light");
  const handlers = useRef({ onPoint, onPick, onSpan });
  handlers.current = { onPoint, onPick, onSpan };

  useEffect(() => {
    const div = place.current;
    if (!div) return;
    const style = getComputedStyle(div);
    const drawing = draw((name) => style.getPropertyValue(name).trim());
    const height = () => (low || div.clientWidth < NARROW ? LOW_HEIGHT : HEIGHT);
    const seconds = days.map((one) => Date.parse(one) / 1000);
    const chart = new uPlot(
      { ...options(drawing, style, seconds, handlers), width: div.clientWidth, height: height() },
      [seconds, ...values] as uPlot.AlignedData,
      div,
    );
    const resized = new ResizeObserver(() => chart.setSize({ width: div.clientWidth, height: height() }));
    resized.observe(div);
    return () => {
      resized.disconnect();
      chart.destroy();
    };
  }, [days, values, draw, scheme, low]);

  return <div ref={place} role="img" aria-label={label} data-points={days.length} />;
}

type Handlers = React.RefObject<Pick<Props, "onPoint" | "onPick" | "onSpan">>;

function options(
  drawing: Drawing,
  style: CSSStyleDeclaration,
  seconds: readonly number[],
  handlers: Handlers,
): Omit<uPlot.Options, "width" | "height"> {
  const ink = style.getPropertyValue("--ink-soft").trim();
  const grid = { stroke: style.getPropertyValue("--edge").trim(), width: 1 };
  const font = "13px 'Figtree Variable', system-ui, sans-serif";
  const step = (seconds[1] ?? 0) - (seconds[0] ?? 0) || DAY_S;
  const ends = [(seconds[0] ?? 0) - step / 2, (seconds.at(-1) ?? 0) + step / 2] as const;
  const axis = { stroke: ink, font, grid, ticks: { ...grid, size: 4 } };
  return {
    legend: { show: false },
    padding: [12, 12, 0, 0],
    tzDate: (at) => uPlot.tzDate(new Date(at * 1000), "Etc/UTC"),
    scales: { x: { range: [ends[0], ends[1]] }, y: { range: [0, drawing.end] } },
    series: [{}, ...drawing.series],
    ...(drawing.bands && { bands: drawing.bands }),
    axes: [
      {
        ...axis,
        space: 64,
        grid: { show: false },
        incrs: [1, 2, 7, 14, 28, 56, 91, 182].map((n) => n * DAY_S),
        values: (_, splits) => splits.map((at) => shortDay(dayOf(new Date(at * 1000)))),
      },
      { ...axis, size: 56, values: (_, splits) => splits.map(drawing.say) },
    ],
    cursor: {
      y: false,
      points: { show: false },
      drag: { x: true, y: false, setScale: false },
    },
    hooks: {
      init: [
        // uPlot keeps clicks that end a drag to itself.
        ({ over, posToIdx }) =>
          over.addEventListener("click", ({ offsetX }) => handlers.current.onPick(posToIdx(offsetX))),
      ],
      setCursor: [(chart) => handlers.current.onPoint(chart.cursor.idx ?? null)],
      setSelect: [
        (chart) => {
          const { left, width } = chart.select;
          if (width > 0) handlers.current.onSpan(chart.posToIdx(left), chart.posToIdx(left + width));
        },
      ],
      draw: drawing.overlay ? [drawing.overlay] : [],
    },
  };
}
