import { describe, expect, it } from "vitest";
import { daysBetween, during, every, queryOf, readFilters, searchOf, spanOf, step } from "./filters";

const NOW = new Date("2026-11-22T23:30:00Z");
const read = (search: string) => readFilters(new URLSearchParams(search));

describe("the filters in an address", () => {
  it("are the last 30 days of all missions where it says nothing", () => {
    expect(queryOf(read(""), NOW)).toEqual({
      from: "2026-10-24",
      to: "2026-11-22",
      firmware: [],
      model: [],
      algorithm: [],
      size: [],
    });
  });

  it.each([
    "",
    "days=7",
    "from=2026-11-01&to=2026-11-03",
    "to=2026-11-03",
    "days=90&firmware=5.1&firmware=&model=S9&algorithm=0.1.0&size=10%2B&size=1-3",
  ])("come back as they were written: %s", (search) => {
    expect(searchOf(read(search))).toBe(search);
  });

  it.each(["days=30", "days=12", "from=yesterday", "from=2026-02-31", "size=huge"])("forget nonsense: %s", (search) => {
    expect(searchOf(read(search))).toBe("");
  });

  it("let the days that were picked win over a span", () => {
    expect(searchOf(during(read("days=7&model=S9"), "2026-11-16", "2026-11-16"))).toBe(
      "from=2026-11-16&to=2026-11-16&model=S9",
    );
  });

  it("put two days that were said the wrong way round in order", () => {
    expect(spanOf(read("from=2026-11-09&to=2026-11-02"), NOW)).toEqual({ from: "2026-11-02", to: "2026-11-09" });
  });
});

describe("the days that are drawn", () => {
  it("are weeks from Monday on where there are many", () => {
    expect(step(read("days=90"), NOW)).toBe("day");
    expect(step(read("days=365"), NOW)).toBe("week");
    expect(every("week", "2026-11-08", "2026-11-16")).toEqual(["2026-11-02", "2026-11-09", "2026-11-16"]);
  });

  it("are all of the span, over the end of summer time too", () => {
    const days = every("day", "2026-10-20", "2026-11-22");
    expect(days).toHaveLength(daysBetween("2026-10-20", "2026-11-22") + 1);
    expect(new Set(days).size).toBe(days.length);
    expect(days.at(-1)).toBe("2026-11-22");
  });
});
