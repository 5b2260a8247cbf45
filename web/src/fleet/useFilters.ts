import { useMemo } from "react";
import { useLocation, useSearch } from "wouter";
import { type Filters, readFilters, searchOf } from "./filters";
import { withSearch } from "./paths";

/** The filters in the address, and a way to put others there. */
export function useFilters() {
  const search = useSearch();
  const [path, go] = useLocation();
  const filters = useMemo(() => readFilters(new URLSearchParams(search)), [search]);
  const change = (changed: Partial<Filters>) => go(withSearch(path, searchOf({ ...filters, ...changed })));
  return { filters, search: searchOf(filters), change };
}
